"""Machines on a bench, simulated apart from the tool in steps of 4 µs: dry friction that may hold, an encoder."""

import numpy as np
from numba import njit

from wheelpend import Log

STEP_S = 4e-6


@njit
def _gone_on(angle, speed, seconds, drive, inertia, weight, viscous, dry, quadratic):
    """Angle and speed some time later; dry friction holds where it can stop the motion within a step."""
    for _ in range(round(seconds / STEP_S)):
        speed += STEP_S * (drive - weight * np.sin(angle) - viscous * speed - quadratic * speed * abs(speed)) / inertia
        held = STEP_S * dry / inertia
        speed -= min(max(speed, -held), held)
        angle += STEP_S * speed
    return angle, speed


def counted(angles: np.ndarray, counts: int) -> np.ndarray:
    """Angles (N,) [rad] as an encoder with so many counts a turn has them."""
    return np.round(angles * counts / (2 * np.pi)) * 2 * np.pi / counts


def swing_log(
    rate_hz: float, span_s: float, counts: int, begin: float, inertia: float, *,
    zero: float = 0.0, viscous: float = 0.0, dry: float = 0.0, quadratic: float = 0.0,
) -> Log:  # fmt: skip
    """A pendulum let go at an angle [rad], until it stops and beyond; forces in units of its weight."""
    angle, speed, seen = begin, 0.0, []
    for _ in range(round(span_s * rate_hz)):
        seen.append(angle)
        angle, speed = _gone_on(angle, speed, 1.0 / rate_hz, 0.0, inertia, 1.0, viscous, dry, quadratic)
    t = np.arange(len(seen)) / rate_hz
    return Log("swing", t, np.zeros(t.size), counted(np.array(seen) + zero, counts)[:, None], ("theta_1",), rates={})


def shaft_log(
    rate_hz: float, volts: np.ndarray, counts: int, inertia: float, viscous: float, *,
    dry: float = 0.0, quadratic: float = 0.0, limit: float = np.inf,
) -> Log:  # fmt: skip
    """A motor's shaft under a voltage (N,), held from row to row and limited [V]; forces in V."""
    angle, speed, seen = 0.0, 0.0, []
    for applied in np.clip(volts, -limit, limit):
        seen.append(angle)
        angle, speed = _gone_on(angle, speed, 1.0 / rate_hz, applied, inertia, 0.0, viscous, dry, quadratic)
    t = np.arange(len(seen)) / rate_hz
    return Log("shaft", t, volts, counted(np.array(seen), counts)[:, None], ("theta_m",), rates={})
