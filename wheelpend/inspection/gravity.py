"""Where an angle hangs, by what gravity does to it, without a model."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from wheelpend.inspection.signals import Signals

MIN_GRAVITY_GAIN = 1.3  # times less of an acceleration left by gravity, from which on it pulls the position back
MIN_SWING_RAD = 0.5  # below which a spring would do as well
MAX_ZERO_DEVIATION_RAD = 0.1  # of a zero from hanging or upright, within which it counts as that


def gravity_zero(signals: Signals | None, place: str, inputs: Sequence[str]) -> float | None:
    """Reading of an angle [rad] at which it hangs, by what gravity does to it; None where no gravity shows.

    The acceleration is fitted by input, viscous and dry friction and a constant, and then by the sine and cosine of the
    angle beside them.
    """
    if signals is None:
        return None
    rows = signals.rows
    angle, speed, bend = (signals.smooth(place, k)[rows] for k in range(3))
    plain = [np.ones(len(rows)), speed, np.tanh(speed / (0.05 * np.std(speed) + 1e-300))]
    plain += [signals.smooth(i)[rows] for i in inputs if i in signals.channels]  # a rare command is not among them
    pulled = [*plain[1:], np.sin(angle), np.cos(angle)]
    left = [residual_power(np.column_stack(columns), bend) for columns in (plain, pulled)]
    if np.ptp(angle) < MIN_SWING_RAD or left[0][0] < MIN_GRAVITY_GAIN * left[1][0]:
        return None
    sine, cosine = left[1][1][-2:]
    zero = float(math.atan2(cosine, -sine))
    upright = math.pi - abs(zero) < MAX_ZERO_DEVIATION_RAD  # ±π alike: that on whose side the log begins
    return math.copysign(zero, math.remainder(float(angle[0]), 4 * math.pi)) if upright else zero


def residual_power(matrix: np.ndarray, target: np.ndarray) -> tuple[float, np.ndarray]:
    """Power that least squares leave, and the coefficients."""
    solution = np.linalg.lstsq(matrix, target, rcond=None)[0]
    return float(np.sum((target - matrix @ solution) ** 2)), solution


def zero_offset(zero: float) -> float:
    """What is added to an angle so that it hangs at 0: nothing, π turned back, or the zero found [rad]."""
    if abs(zero) < MAX_ZERO_DEVIATION_RAD:
        return 0.0
    upright = math.pi - abs(zero) < MAX_ZERO_DEVIATION_RAD
    return -math.copysign(math.pi, zero) if upright else -zero
