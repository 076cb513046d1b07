"""Where a fit begins, without nominal values."""

import numpy as np
import pytest

from wheelpend import Model, load_log
from wheelpend.estimation.nonnegative import nonnegative_least_squares
from wheelpend.kernels.load import model_module


@pytest.mark.parametrize("slowing", [0.0, 0.3])
def test_a_mass_that_runs_at_constant_speed_under_an_input_gets_an_inertia_that_all_of_it_could_move(slowing):
    t = np.arange(0.0, 4.0, 0.02)
    x = 11.5 * (t - 0.05 * (1.0 - np.exp(-t / 0.05))) - slowing * t**2  # friction, which the model has not
    model = Model.parse('plant = "slide"\n')
    log = load_log({"t": t, "v_in": np.full(len(t), 9.0), "x": x}, table=model.table)
    module = model_module(model.plant, model.assumptions, ())
    found = nonnegative_least_squares(module, log, np.zeros(module.NP), (0.1, 0.13))
    assert 0.0 < found["X1"] < 1e9
