"""Reference trajectories of the pitch, in degrees in the paper, here in rad."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from wheelpend.failures import Failure

COMMANDS: dict[str, Callable[[np.ndarray], np.ndarray]] = {
    "simple": lambda t: 20.0 * np.sin(t),
    "aggressive": lambda t: (
        3.0 * np.sin(7 * t) + 6.0 * (np.cos(4 * t) - np.sin(t)) + 10.0 * np.cos(3 * t) * np.sin(5 * t) ** 2
    ),
    "upright": lambda t: np.zeros_like(t),
}  # degrees; simple and aggressive are the paper's, section 4


def reference(command: str, t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Commanded pitch [rad] and its rate [rad/s] at the times t [s]; raises Failure for an unknown command."""
    if command not in COMMANDS:
        raise Failure(f"No command named '{command}'. Known commands: {', '.join(sorted(COMMANDS))}")
    angle = np.radians(COMMANDS[command](t))
    return angle, np.gradient(angle, t)
