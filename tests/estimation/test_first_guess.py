"""Where segments begin before any fit: on a parabola, or at rest."""

import numpy as np
import pytest

from wheelpend import Log, Model
from wheelpend.estimation.data import prepare
from wheelpend.estimation.first_guess import initial_states, means_at_rest
from wheelpend.estimation.prediction import prediction_error
from wheelpend.estimation.segments import Segments
from wheelpend.model.model_kernels import library_module_of

SIGMA, RATE_HZ = 0.002, 60.0
FRICTION = {"X1": 0.0244, "coulomb_drive.torque": 0.03, "encoder_zero.bias": 0.02}
MODEL = Model.parse('plant = "pendulum"\neffects = ["coulomb_drive", "encoder_zero"]\n')


def held_pendulum(place: float, seed: int) -> Log:
    """A pendulum that is let go at half a radian, then stands still aside of where it hangs, held by dry friction."""
    t = np.arange(0.0, 40.0, 1.0 / RATE_HZ)
    angle = np.where(t < 1.0, 0.5 * np.cos(6.0 * t), place)
    seen = angle + SIGMA * np.random.default_rng(seed).standard_normal(t.size)
    return Log("held", t, np.zeros(t.size), seen[:, None], ("theta_1",), rates={})


@pytest.mark.parametrize("seed", range(5))
def test_a_machine_that_dry_friction_holds_is_predicted_to_stand_still_in_every_segment(seed):
    problem = prepare(MODEL, [held_pendulum(0.012, seed)], lean=True)
    part = problem.data.validation[0].part
    _, residual = prediction_error(problem.simulator, part, FRICTION)
    errors = [float(np.sqrt(np.nanmean(residual[a:b] ** 2))) for a, b in part.bounds if part.log.t[a] > 1.0]
    assert min(errors) > 0.6 and max(errors) < 1.5, errors


def test_a_segment_at_rest_begins_at_its_mean_without_speed_and_one_that_moves_on_a_parabola():
    log = held_pendulum(0.012, seed=1)
    log.measured[2000:, 0] += 0.4 * (log.t[2000:] - log.t[2000])
    problem = prepare(MODEL, [log], lean=True, use_all=True)
    part = problem.data.estimation[0]
    states = initial_states(problem.module, part)
    late = log.t[part.bounds[:, 0]] > log.t[2000]
    still = (log.t[part.bounds[:, 0]] > 1.0) & (part.bounds[:, 1] < 2000)
    assert np.abs(states[still, 0] - 0.012).max() < 5.0 * SIGMA / np.sqrt(30.0) and not states[still, 1].any()
    assert still.sum() > 50 and np.abs(states[late, 1] - 0.4).mean() < 0.15


@pytest.mark.parametrize("start", [0.0, 0.4, 1.7, 3.3])
def test_slow_motion_in_the_steps_of_an_encoder_begins_in_its_direction_and_fast_motion_where_it_is(start):
    step, model = 2.0 * np.pi / 4096, Model.parse('plant = "slide"')
    t = np.arange(0.0, 0.5, 0.005)
    phase, slow, fast = 2.0 * np.pi * start / 4.0, 0.05, 15.0  # rad/s

    def begun(motion):
        log = Log("steps", t, np.zeros(t.size), (np.round(motion / step) * step)[:, None], ("x",), rates={})
        part = Segments(log, np.array([step / np.sqrt(12.0)]), np.array([[0, t.size]]))
        return initial_states(library_module_of(model), part)[0]

    assert begun(slow * t + start * step)[1] == pytest.approx(slow, rel=0.35)
    assert begun(np.sin(fast * t + phase))[1] == pytest.approx(fast * np.cos(phase), abs=0.1 * fast)


def test_readings_are_at_rest_where_each_scatters_by_its_noise_and_missing_ones_do_not_count():
    noise = np.random.default_rng(3).standard_normal((200, 2)) * [1.0, 0.1]
    readings = noise + np.array([3.0, -1.0])
    found = means_at_rest(readings, np.array([1.0, 0.1]))
    assert found == pytest.approx([3.0, -1.0], abs=0.3)
    readings[::3, 1] = np.nan
    assert means_at_rest(readings, np.array([1.0, 0.1])) is not None
    assert means_at_rest(readings, np.array([1.0, 0.07])) is None
    slow = readings + np.linspace(0.0, 3.0, 200)[:, None]
    assert means_at_rest(slow, np.array([1.0, 0.1])) is None
    readings[:, 1] = np.nan
    assert means_at_rest(readings, np.array([1.0, 0.1])) is None
