"""The equations of a body on wheels with unknown parameters, and what they leave of the motor's voltage."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from derive.plants.wheel_pendulum import INPUT, PLANT_NAME
from wheelpend.inspection.signals import Signals, scan_time_shifts
from wheelpend.kernels.load import model_module

MAX_UNEXPLAINED_SHARE = 0.3  # share of the voltage's power; with more left nothing is concluded from the equations
NONNEGATIVE_COLUMNS = 6  # of VoltageRegression.constrained, the first ones


class VoltageRegression(NamedTuple):
    """The plant's equations with unknown parameters, smoothed: voltage = matrix · parameters."""

    matrix: np.ndarray  # (rows, 10) X1 ... X7, a constant in each row, dry friction
    constrained: np.ndarray  # (rows, 10) the same space, first for coefficients that a machine has positive, then free


def voltage_regression(signals: Signals, relative: bool) -> VoltageRegression:
    """The regressor at smoothed signals, with constant forces and dry friction of the drive beside it.

    Columns: X1 ... X7, a constant in each row, dry friction.
    """
    module, rows = model_module(PLANT_NAME, {}, ()), signals.rows
    pitch, ddp = signals.smooth("theta_p")[rows], signals.smooth("dtheta_p", 1)[rows]
    rate, wheel = signals.smooth("dtheta_p")[rows], signals.smooth("theta_w", 1)[rows]
    ddw = signals.smooth("theta_w", 2)[rows]
    if relative:  # the gyro is less noisy than the derivative of the pitch
        wheel, ddw = wheel + rate, ddw + ddp
    states = np.column_stack((np.zeros(len(rows)), pitch, wheel, rate))
    accelerations, parameters = np.column_stack((ddw, ddp)), np.zeros(module.NP)
    phi = np.concatenate(
        [module.regressor(0.0, x, a, 0.0, parameters)[1] for x, a in zip(states, accelerations, strict=True)]
    )
    slip = np.repeat(wheel - rate, 2)
    dry = np.tanh(slip / (0.05 * np.std(slip) + 1e-300))  # a sign, softened as much as the smoothing softens it
    first = np.arange(len(slip)) % 2 == 0
    return VoltageRegression(np.column_stack((phi, first, ~first, dry)), sign_constrained_columns(phi, first, dry))


def sign_constrained_columns(phi: np.ndarray, first: np.ndarray, dry: np.ndarray) -> np.ndarray:
    """Columns whose coefficients a machine has positive, then the free ones.

    Positive: X1 + X2, X4, X5, dry friction, X7 − X6/2 and 3 X6/2 − X7 (most damping is in the drive, which body and
    wheel share). Free: X2, X3 and the constants.
    """
    x1, x2, x3, x4, x5, x6, x7 = phi.T
    positive = (x1, x4, x5, dry, x6 + 1.5 * x7, x6 + 0.5 * x7)
    return np.column_stack((*positive, x2 - x1, x3, first, ~first))


def voltage_residual(system: VoltageRegression, signals: Signals) -> Callable[[int], tuple[np.ndarray, float]]:
    """Residual and total power of the voltage, shifted by some samples, in least squares with positive coefficients."""
    from scipy.optimize import nnls  # imported late: it is slow to load

    matrix = system.constrained / (np.linalg.norm(system.constrained, axis=0) + 1e-300)
    q, r = np.linalg.qr(matrix)
    both = np.column_stack((r, -r[:, NONNEGATIVE_COLUMNS:]))
    voltage, rows = signals.smooth(INPUT), signals.rows

    def residual(k: int) -> tuple[np.ndarray, float]:
        target = np.repeat(voltage[rows + k], 2)
        x = nnls(both, q.T @ target)[0]
        x[NONNEGATIVE_COLUMNS : matrix.shape[1]] -= x[matrix.shape[1] :]
        return target - matrix @ x[: matrix.shape[1]], float(np.sum((target - target.mean()) ** 2))

    return residual


def unexplained_voltage_share(signals: Signals, relative: bool) -> float:
    """Share of the voltage's power that the equations leave unexplained, at the best time shift."""
    return scan_time_shifts(voltage_residual(voltage_regression(signals, relative), signals)).share
