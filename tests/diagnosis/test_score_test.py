"""The score test at a fit that went astray."""

from types import SimpleNamespace

import numpy as np
import pytest

from wheelpend.diagnosis.score_test import _fall


def cost_of(cost):
    """Equations of which only the cost counts."""
    return SimpleNamespace(rest=SimpleNamespace(cost=np.array(cost)))


@pytest.mark.parametrize("costs", [(np.inf, np.inf), (np.inf, 1.0), (1.0, np.inf)])
def test_a_setting_gains_nothing_where_either_linearisation_is_not_finite(costs):
    assert _fall(*map(cost_of, costs)) == -np.inf


def test_a_setting_gains_what_the_sum_of_squares_falls_by():
    assert _fall(cost_of(5.0), cost_of(3.0)) == 2.0
