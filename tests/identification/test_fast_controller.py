"""A controller that is faster than the log: what the log must have of the input between its rows."""

from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest

from tests.support import simulated
from wheelpend import Log, Model, identify
from wheelpend.identification.identify import Identification

SAMPLES = 10  # of the controller to a row of the log
FRICTION_V = 0.4


@lru_cache(maxsize=1)
def as_controlled() -> Log:
    """The paper's robot with dry friction at the 1 kHz of its controller, which acts on noisy sensors."""
    return simulated(duration=10.0, coulomb_drive__torque=FRICTION_V)


def every_tenth_row(voltage: np.ndarray) -> Log:
    """Every tenth row of the log, with other voltages."""
    log = as_controlled()
    rows = slice(0, len(voltage) * SAMPLES, SAMPLES)
    return replace(log, t=log.t[rows], voltage=voltage, measured=log.measured[rows], reference=None)


def as_blocks(voltage: np.ndarray) -> np.ndarray:
    """Samples of the controller (rows, 10) by the row of the log that they follow."""
    return voltage[: len(voltage) // SAMPLES * SAMPLES].reshape(-1, SAMPLES)


def identified(voltage: np.ndarray) -> Identification:
    """Every tenth row, with these voltages, identified by the model that the robot is."""
    return identify(Model.default().with_effects(["coulomb_drive"]), every_tenth_row(voltage))


@pytest.mark.slow
def test_the_mean_of_the_input_between_rows_tells_the_friction():
    averaged = identified(as_blocks(as_controlled().voltage).mean(axis=1))
    assert averaged.parameters["coulomb_drive.torque"].value == pytest.approx(FRICTION_V, abs=0.02)
    assert averaged.remainder.strongest is None or averaged.remainder.strongest.share_of_drive < 0.05


@pytest.mark.slow
def test_one_value_of_ten_leaves_a_force_as_large_as_the_drive_and_a_warning_that_says_why():
    one_of_ten = identified(as_blocks(as_controlled().voltage)[:, 0])
    assert one_of_ten.remainder.strongest.share_of_drive > 0.5
    assert any("log the mean of the input" in w for w in one_of_ten.warnings)
