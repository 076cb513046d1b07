"""The servo's logs and model: which logs estimate, which validate, and the pairs that a study takes."""

from __future__ import annotations

from itertools import combinations, product

SERVO_FOLDER = "servo_pendulum"
TRAJECTORY_NAMES = ("sin_sin", "sin_time_square", "up_and_down")
SERVO_GAINS = (100, 200, 400, 800)
LOG_NAMES = tuple(f"{trajectory}_{gain}" for trajectory in TRAJECTORY_NAMES for gain in SERVO_GAINS)
ESTIMATION_LOGS = ("sin_sin_400", "up_and_down_400", "sin_time_square_200")
VALIDATION_LOGS = tuple(name for name in LOG_NAMES if name not in ESTIMATION_LOGS)
SERVO_MODEL = """\
plant = "pendulum"
effects = []

[assumptions]
driven = true

[sensors.step]
theta_1 = 0.001534                     # 4096 counts a turn [rad]
"""


def log_pairs() -> list[tuple[str, str]]:
    """Every pair of logs of different trajectories: 48."""
    return [
        (f"{one}_{first}", f"{other}_{second}")
        for one, other in combinations(TRAJECTORY_NAMES, 2)
        for first, second in product(SERVO_GAINS, SERVO_GAINS)
    ]
