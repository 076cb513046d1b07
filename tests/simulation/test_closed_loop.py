"""The closed loop: what the sensors add, the log that is replayed, the moment at which the machine leaves its range."""

from dataclasses import replace

import numpy as np
import pytest

from tests.support import X, simulated
from wheelpend import Model
from wheelpend.simulation.closed_loop import ClosedLoop

PARAMETERS = np.array(list(X.values()))


@pytest.fixture
def loop(lean):
    return ClosedLoop.of(Model.default(), lean, 0.001)


def stand(loop, tilt=0.0, **sensors):
    t = np.arange(501) * 1e-3
    return loop.play(t, np.zeros(501), np.zeros(501), np.array([0.0, tilt, 0.0, 0.0]), PARAMETERS, **sensors)


def test_sensors_are_ideal_unless_noise_or_steps_are_given(loop):
    run = stand(loop, 0.1)
    np.testing.assert_array_equal(run.measured, run.states @ loop.module.OUTPUT_MATRIX.T)
    rough = stand(loop, 0.1, quantum=np.array([0.0, 0.01, 0.0])).measured[:, 1] / 0.01
    np.testing.assert_allclose(rough, np.round(rough), atol=1e-9)


def test_noise_reaches_the_machine_through_its_controller(loop):
    noise = np.random.default_rng(0).normal(size=(501, 3)) * 0.01
    noisy, quiet = stand(loop, noise=noise), stand(loop)
    assert not quiet.states.any() and np.abs(noisy.input).max() > 1.0
    np.testing.assert_allclose(noisy.measured - noisy.states @ loop.module.OUTPUT_MATRIX.T, noise, atol=1e-12)


def test_a_log_of_ideal_sensors_is_replayed_as_it_was(loop):
    log = simulated(duration=1.0, noise=False)
    run = loop.replay(log, np.zeros(4), PARAMETERS)
    np.testing.assert_allclose(run.measured, log.measured, atol=1e-9)
    np.testing.assert_allclose(run.input, log.voltage, atol=1e-6)


def test_a_robot_without_its_controller_leaves_the_range_at_a_sample_that_is_named(loop):
    run = stand(replace(loop, gains=np.zeros(3)), 1.5)
    assert stand(loop, 0.1).stays_in_range and not run.stays_in_range
    pitch = np.abs(run.states[: run.first_out_of_range + 1, 1])
    assert pitch[:-1].max() <= np.pi / 2 < pitch[-1]
