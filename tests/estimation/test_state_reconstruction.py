"""States come back from readings, also where a sensor is missing."""

from types import SimpleNamespace

import numpy as np
import pytest

from wheelpend.estimation.state_reconstruction import fill_gaps, measured_states, states_from
from wheelpend.kernels import load as kernels
from wheelpend.logs.log import Log

EVERY = [
    ("slide", {}),
    ("pendulum", {}),
    ("pendulum", {"driven": True}),
    ("pendulum", {"links": 2}),
    ("pendulum", {"links": 2, "driven": True, "second_encoder": "absolute"}),
    ("cart_pole", {}),
    ("wheel_pendulum", {"encoder": "relative"}),
]


@pytest.mark.parametrize(("plant", "assumptions"), EVERY)
def test_states_come_back_from_ideal_readings(plant, assumptions):
    module = kernels.model_module(plant, assumptions, ())
    states = np.random.default_rng(3).normal(size=(8, module.NX))
    values = states @ module.OUTPUT_MATRIX.T
    slopes = states[:, module.NQ :] @ module.OUTPUT_MATRIX[:, : module.NQ].T
    np.testing.assert_allclose(states_from(module, values, slopes), states, atol=1e-12)


def test_a_gyro_that_is_missing_is_replaced_by_the_slope_of_the_pitch():
    module = kernels.model_module("wheel_pendulum", {}, ())
    found = states_from(module, np.array([[0.1, 0.2, np.nan]]), np.array([[1.0, 2.0, np.nan]]))
    np.testing.assert_allclose(found, [[0.1, 0.2, 1.0, 2.0]])


def test_rates_that_no_sensor_reads_are_differences_of_what_one_does():
    module = kernels.model_module("pendulum", {"links": 2}, ())
    t = np.arange(200) * 0.01
    measured = np.column_stack([np.sin(t), np.cos(t) - np.sin(t)])  # the second encoder reads against the first link
    states = measured_states(module, Log("x", t, np.zeros(200), measured, module.OUTPUTS))
    np.testing.assert_allclose(states[1:-1], np.column_stack([np.sin(t), np.cos(t), np.cos(t), -np.sin(t)])[1:-1],
                               atol=1e-4)  # fmt: skip


def test_a_coordinate_of_which_only_the_rate_is_read_is_its_integral():
    module = SimpleNamespace(NQ=1, NX=2, NY=1, OUTPUT_MATRIX=np.array([[0.0, 1.0]]))
    t = np.array([0.0, 0.1, 0.3, 0.4, 1.0])
    log = Log("turning", t, np.zeros(5), 2.0 * t[:, None] + 1.0, ("yaw_rate",))
    states = measured_states(module, log)
    assert np.allclose(states, np.column_stack([t**2 + t, 2.0 * t + 1.0]))


def test_missing_readings_are_filled_along_a_line():
    t = np.array([0.0, 1.0, 3.0, 4.0])
    assert fill_gaps(t, np.array([0.0, np.nan, 6.0, np.nan])).tolist() == [0.0, 2.0, 6.0, 6.0]
