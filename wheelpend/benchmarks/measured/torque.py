"""Judge of a driven arm: the torques that its equations need for the measured motion, behind a fixed filter."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from wheelpend.estimation.parameters import kernel_parameters
from wheelpend.identification.inverse_dynamics import equations_by_stretch, linear_parameter_values
from wheelpend.identification.measured_motion import low_passed
from wheelpend.kernels.kernel_module import KernelModule
from wheelpend.logs.log import Log

EDGE_S = 0.6  # s at either end of a stretch, three periods of the cut-off: there the filter is not settled
MOTION_CUTOFF_HZ = 5.0  # of the zero-phase filter for positions, derivatives and torques
TORQUES_OF_ROWS = np.array([[-1.0, 1.0], [0.0, 1.0]])  # the rows are V2 − V1 and V2


class JointTorques(NamedTuple):
    """Measured torques of an arm, and those that a model needs for the measured motion."""

    t: np.ndarray  # (N,) s
    measured: np.ndarray  # (N, 2) unit of the input, at the shoulder and the elbow
    needed: np.ndarray  # (N, 2) likewise


def torque_error(module: KernelModule, values: Mapping[str, float], log: Log) -> float:
    """Difference between measured and needed torques of both joints relative to the measured ones [%].

    Root of the sums of squares over all samples and both joints, behind a zero-phase filter of 5 Hz.
    """
    parts = joint_torques(module, values, log)
    left, size = (np.sum([np.sum(f(p) ** 2) for p in parts]) for f in (_difference, _measured))
    return float(100.0 * np.sqrt(left / size))


def _difference(part: JointTorques) -> np.ndarray:
    return part.measured - part.needed


def _measured(part: JointTorques) -> np.ndarray:
    return part.measured


def joint_torques(module: KernelModule, values: Mapping[str, float], log: Log) -> list[JointTorques]:
    """Torques over every stretch of a log without a gap, the ends left out at which the filter is not settled."""
    parameters, estimate = kernel_parameters(module, values, log), linear_parameter_values(module, values)
    found = []
    for stretch in equations_by_stretch(module, log, parameters, MOTION_CUTOFF_HZ):
        edge = round(EDGE_S / stretch.dt)
        rows = (stretch.left, stretch.regressor @ estimate)
        measured, needed = (low_passed(s, stretch.dt, MOTION_CUTOFF_HZ)[edge:-edge] @ TORQUES_OF_ROWS.T for s in rows)
        found.append(JointTorques(stretch.t[edge:-edge], measured, needed))
    return found


def log_halves(log: Log) -> tuple[Log, Log]:
    """The samples of a log before the middle of its time, and those after it."""
    middle = int(np.searchsorted(log.t, log.t[0] + 0.5 * log.duration))
    return log.part(0, middle), log.part(middle, len(log))
