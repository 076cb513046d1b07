"""Motion of a link or a shaft in steps of 4 µs, apart from the tool's simulator: dry friction may hold, or slide.

Symplectic Euler steps; friction is applied last, and takes the speed to zero where it could turn it round within a step
(Moreau's time stepping).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from wheelpend.isolation import import_configured

njit = import_configured("numba").njit
STEP_S = 4e-6


@dataclass(frozen=True)
class Bench:
    """A link or shaft: inertia θ̈ = drive − weight sin θ − its frictions, in V, or where nothing drives in weights."""

    inertia: float
    weight: float = 0.0
    viscous: float = 0.0
    dry: float = 0.0
    quadratic: float = 0.0


def motion(bench: Bench, interval_s: float, drive: np.ndarray, begin_rad: float = 0.0) -> np.ndarray:
    """Angles (N,) [rad] of a machine let go at rest, at the begin of each interval of a drive (N,) held within it."""
    steps = round(interval_s / STEP_S)
    laws = (bench.inertia, bench.weight, bench.viscous, bench.dry, bench.quadratic)
    return _angles(interval_s / steps, steps, drive, begin_rad, *laws)


@njit
def _angles(step, steps, drive, begin, inertia, weight, viscous, dry, quadratic):
    angles, angle, speed, held = np.empty(len(drive)), begin, 0.0, step * dry / inertia
    for k in range(len(drive)):
        angles[k] = angle
        for _ in range(steps):
            resisted = weight * np.sin(angle) + viscous * speed + quadratic * speed * abs(speed)
            speed += step * (drive[k] - resisted) / inertia
            speed -= min(max(speed, -held), held)
            angle += step * speed
    return angles


def counted(angles: np.ndarray, counts: int) -> np.ndarray:
    """Angles (N,) [rad] as an encoder with so many counts a turn has them."""
    return np.round(angles * counts / (2 * np.pi)) * 2 * np.pi / counts
