"""Motion of a link or a shaft in steps of 4 µs, apart from the tool's simulator: dry friction may hold, or slide.

Symplectic Euler steps; friction is applied last, and takes the speed to zero where it could turn it round within a step
(Moreau's time stepping). A driver that lets the motor coast is switched on or off for a step: no law of it is stated.
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
    back_emf: float = 0.0  # V s/rad, that acts while the driver is on, beside what is viscous
    supply: float = 0.0  # V, of a driver that lets the motor coast in its pauses; 0 of one that gives the drive itself


def motion(bench: Bench, interval_s: float, drive: np.ndarray, begin_rad: float = 0.0) -> np.ndarray:
    """Angles (N,) [rad] of a machine let go at rest, at the begin of each interval of a drive (N,) held within it."""
    steps = round(interval_s / STEP_S)
    resistances = (bench.weight, bench.viscous, bench.dry, bench.quadratic)
    motor = (bench.back_emf, bench.supply)
    return _angles(interval_s / steps, steps, drive, begin_rad, bench.inertia, *resistances, *motor)


@njit
def _angles(step, steps, drive, begin, inertia, weight, viscous, dry, quadratic, back_emf, supply):
    angles, angle, speed, held, due = np.empty(len(drive)), begin, 0.0, step * dry / inertia, 0.0
    for k in range(len(drive)):
        angles[k] = angle
        for _ in range(steps):
            pushed = drive[k] - back_emf * speed
            if supply > 0.0:
                due += abs(drive[k]) / supply  # of a pulse that lasts a step
                on = np.floor(due)
                pushed = on * (np.sign(drive[k]) * supply - back_emf * speed)
                due -= on
            resisted = weight * np.sin(angle) + viscous * speed + quadratic * speed * abs(speed)
            speed += step * (pushed - resisted) / inertia
            speed -= min(max(speed, -held), held)
            angle += step * speed
    return angles


def counted(angles: np.ndarray, counts: int) -> np.ndarray:
    """Angles (N,) [rad] as an encoder with so many counts a turn has them."""
    return np.round(angles * counts / (2 * np.pi)) * 2 * np.pi / counts
