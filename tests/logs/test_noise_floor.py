"""The error that a true model has on a log."""

import numpy as np
import pytest

from tests.support import simulated
from wheelpend import Model
from wheelpend.estimation.data import noise_of, prepare
from wheelpend.logs.log import Log
from wheelpend.logs.noise import channel_noise, rounding_sigma, sensor_noise


def standing(samples=4000):
    """A robot whose wheels stand still a tenth of an encoder step beside a reading, with a voltage that shakes it."""
    rng, t = np.random.default_rng(0), np.arange(samples) * 1e-3
    measured = np.column_stack([np.full(samples, 0.0), 1e-3 * rng.normal(size=(samples, 2))])
    measured[::1000, 0] = 2 * np.pi / 60000
    return Log("standing", t, rng.normal(size=samples), measured, ("theta_w", "theta_p", "dtheta_p"))


def test_a_standing_encoder_lowers_the_error_that_is_expected_of_a_true_model():
    problem = prepare(Model.default(), [standing()], lean=True)
    assert 0.80 < problem.floor < 0.90  # √(2/3) and the little that the smoothed reading leaves
    moving = prepare(Model.default(), [simulated(duration=4.0)], lean=True)
    assert moving.floor == pytest.approx(1.0, abs=0.01)
    both = prepare(Model.default(), [standing(), simulated(duration=4.0)], lean=True)
    assert both.floor == pytest.approx((problem.floor + moving.floor) / 2)


def test_rounding_has_the_standard_deviation_of_a_uniform_error():
    rounded = np.round(np.random.default_rng(0).uniform(-50, 50, size=100_000) / 0.3) * 0.3
    exact = np.random.default_rng(0).uniform(-50, 50, size=100_000)
    assert rounding_sigma(0.3) == pytest.approx(np.std(rounded - exact), rel=0.01)


def test_stated_noise_and_steps_are_believed():
    log = simulated(duration=4.0)
    sigma, step, ratio = channel_noise(log, "theta_p", 0.02, None)
    assert (sigma, step, ratio) == (0.02, 0.0, 1.0)
    found = sensor_noise(log, {"dtheta_p": 0.5}, {"theta_w": 2 * np.pi / 60000})
    assert found.sigma[2] == 0.5
    assert found.sigma[0] == pytest.approx(2 * np.pi / 60000 / np.sqrt(12.0))
    assert found.quantum[0] == pytest.approx(2 * np.pi / 60000)


def test_the_noise_of_a_model_file_goes_before_that_of_the_log():
    sensors = "[sensors]\nencoder_counts = 60000\npitch_noise = 0.02\n[sensors.noise]\ndtheta_p = 0.3\n"
    found = noise_of(simulated(duration=4.0), Model.parse('plant = "wheel_pendulum"\n' + sensors))
    assert found.sigma[1:] == pytest.approx([0.02, 0.3])


def test_the_noise_of_the_papers_robot_is_found_within_a_tenth():
    found = noise_of(simulated(duration=20.0), Model.default())
    assert found.sigma[1:] == pytest.approx(np.radians([0.5, 0.5]), rel=0.1)
