"""A prediction that is no number is an infinite error, not a value that was not measured."""

import numpy as np
import pytest

from tests.support import X, simulated
from wheelpend import Model
from wheelpend.estimation.data import prepare
from wheelpend.estimation.prediction import prediction_error, sum_of_squares


@pytest.mark.parametrize(("name", "value", "finite"), [("X1", 0.0436, True), ("X5", float("nan"), False)])
def test_a_prediction_that_is_no_number_has_an_infinite_error(name, value, finite):
    problem = prepare(Model.default(), [simulated(duration=3.0)], lean=True)
    segments = problem.data.estimation[0]
    error, residual = prediction_error(problem.simulator, segments, {**X, name: value})
    assert np.isfinite(error) == finite and np.isfinite(sum_of_squares(residual)) == finite
