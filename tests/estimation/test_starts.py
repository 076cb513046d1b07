"""Where a fit begins, without nominal values."""

import numpy as np
import pytest

from wheelpend import Model, load_log
from wheelpend.estimation.data import prepare
from wheelpend.estimation.nonnegative import nonnegative_least_squares
from wheelpend.estimation.starts import best_start, start_candidates
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


def test_a_start_comes_from_the_first_log_that_is_long_enough_for_one():
    model, t = Model.parse('plant = "slide"\n'), np.arange(0.0, 10.0, 0.01)
    volts = 6.0 * np.sin(3.1 * t)
    place = -volts / 3.1**2
    logs = [load_log({"t": t[:n], "v_in": volts[:n], "x": place[:n]}, table=model.table) for n in (1000, 45)]
    by_order = [start_candidates(prepare(model, both, lean=True)) for both in (logs, logs[::-1])]
    assert by_order[0] and by_order[0] == by_order[1]


def fast_motor(model, interval, settles=0.0005, count=300):
    """A log of a motor with a short time constant and 20 rad/s per volt, exact under held voltages."""
    t = interval * np.arange(count)
    volts = 2.0 + np.sin(0.7 * t) + np.sin(2.3 * t)
    angle, speed, places, decay = 0.0, 20.0 * volts[0], [], np.exp(-interval / settles)
    for level in 20.0 * volts:
        places.append(angle)
        angle += level * interval + (speed - level) * settles * (1.0 - decay)
        speed = level + (speed - level) * decay
    return load_log({"t": t, "v_in": volts, "theta_m": np.array(places)}, table=model.table)


@pytest.mark.parametrize(
    ("interval", "settles", "step"),
    [(0.001, 5e-4, 1.25e-4), (0.002, 5e-4, 2e-4), (0.01, 5e-4, 5e-4), (0.2, 5e-4, 5e-4), (0.004, 2e-4, 2e-4)],
)
def test_rows_too_far_apart_to_show_an_inertia_are_not_simulated_in_steps_that_would_show_it(interval, settles, step):
    model = Model.parse('plant = "shaft"\n')
    problem, _ = best_start(prepare(model, [fast_motor(model, interval, settles)], lean=True))
    assert problem.max_step == pytest.approx(step, rel=0.05)
    assert problem.max_step < 2.5 * settles, "the integrator is stable"
