"""Judge of a driven arm: the torques that its equations need for the measured motion, behind a fixed filter."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
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


class JointEquations(NamedTuple):
    """Measured torques of an arm, and the regressor that gives those which a model needs for the measured motion."""

    t: np.ndarray  # (N,) s
    measured: np.ndarray  # (N, 2) unit of the input, at the shoulder and the elbow
    regressor: np.ndarray  # (N, 2, n) by the module's linear parameters


def torque_error(module: KernelModule, values: Mapping[str, float], log: Log) -> float:
    """Difference between measured and needed torques of both joints relative to the measured ones [%].

    Root of the sums of squares over all samples and both joints, behind a zero-phase filter of 5 Hz. What acts on no
    torque at the same moment, such as delays and errors of sensors, is not judged.
    """
    estimate = linear_parameter_values(module, values)
    parts = joint_equations(module, values, log)
    left = sum(float(np.sum((p.measured - p.regressor @ estimate) ** 2)) for p in parts)
    return float(100.0 * np.sqrt(left / sum(float(np.sum(p.measured**2)) for p in parts)))


def least_squares_values(
    module: KernelModule, log: Log, without: Sequence[str] = (), cutoff: float = MOTION_CUTOFF_HZ
) -> dict[str, float]:
    """Linear parameters that make the torque error on a log least, those named in ``without`` held at 0."""
    parts = joint_equations(module, {}, log, cutoff)
    kept = [k for k, name in enumerate(module.LINEAR) if name not in without]
    rows = np.concatenate([p.regressor.reshape(-1, len(module.LINEAR))[:, kept] for p in parts])
    best = np.linalg.lstsq(rows, np.concatenate([p.measured.ravel() for p in parts]), rcond=None)[0]
    return dict.fromkeys(without, 0.0) | {module.LINEAR[k]: float(v) for k, v in zip(kept, best, strict=True)}


def joint_equations(
    module: KernelModule, values: Mapping[str, float], log: Log, cutoff: float = MOTION_CUTOFF_HZ
) -> list[JointEquations]:
    """Equations up to a cut-off [Hz] over every stretch of a log, without the ends where the filter is not settled."""
    found = []
    for stretch in equations_by_stretch(module, log, kernel_parameters(module, values, log), cutoff):
        edge = round(EDGE_S / stretch.dt)
        left, regressor = (
            low_passed(side, stretch.dt, cutoff)[edge:-edge] for side in (stretch.left, stretch.regressor)
        )
        rows = np.einsum("ij,njk->nik", TORQUES_OF_ROWS, regressor)
        found.append(JointEquations(stretch.t[edge:-edge], left @ TORQUES_OF_ROWS.T, rows))
    return found


def log_halves(log: Log) -> tuple[Log, Log]:
    """The samples of a log before the middle of its time, and those after it."""
    middle = int(np.searchsorted(log.t, log.t[0] + 0.5 * log.duration))
    return log.part(0, middle), log.part(middle, len(log))
