"""One seed of the experiment, every method on the same data."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from wheelpend.reproduction.estimators import METHOD_ESTIMATORS, condition_numbers, cramer_rao
from wheelpend.reproduction.experiment import Robot, Run, Setup, load_robot, play

STATE_NAMES = ("theta_w", "theta_p", "dtheta_w", "dtheta_p")
PREDICTION_SETUP = Setup("aggressive")  # the closed loop whose outputs Figures 4 to 6 predict


class Task(NamedTuple):
    """The work of one process at a time: one seed."""

    text: str  # of the model.toml
    seed: int
    work: tuple[tuple[Setup, tuple[str, ...]], ...]  # experiments, and the methods on each


@dataclass(frozen=True)
class Trial:
    """One seed of one experiment."""

    setup: Setup
    seed: int
    errors: dict[str, tuple[float, ...]]  # per method, signed [%]
    bound: tuple[float, ...] | None  # Cramér-Rao, standard deviation [%]
    conditions: dict[str, tuple[float, float]] | None  # of ΦᵀΦ per method, plain and column-scaled
    rmse: tuple[float, ...] | None  # of the closed-loop prediction with filtered_foh's estimate; NaN where it falls


def run_task(task: Task) -> list[Trial]:
    """All experiments of one seed."""
    robot = load_robot(task.text)
    return [run_trial(robot, setup, task.seed, wanted) for setup, wanted in task.work]


def run_trial(robot: Robot, setup: Setup, seed: int, wanted: Sequence[str]) -> Trial:
    """Run one experiment and identify its log by the wanted methods."""
    log = play(robot, setup, seed).log
    estimates = {name: METHOD_ESTIMATORS[name](robot, log) for name in wanted if name in METHOD_ESTIMATORS}
    return Trial(
        setup,
        seed,
        {name: robot.percent_error(x) for name, x in estimates.items()},
        robot.percent_error(robot.truth + cramer_rao(robot, log)) if "cramer_rao" in wanted else None,
        condition_numbers(robot, log) if "conditions" in wanted else None,
        prediction_rmse(robot, PREDICTION_SETUP, estimates["filtered_foh"]) if "rmse" in wanted else None,
    )


def prediction_rmse(robot: Robot, setup: Setup, estimate: np.ndarray) -> tuple[float, ...]:
    """Root mean square error of the closed loop predicted with estimates, per state; NaN where the prediction falls."""
    return rms_difference(predict(robot, setup, estimate), play(robot, setup))


def predict(robot: Robot, setup: Setup, estimate: np.ndarray) -> Run:
    """The closed loop with estimates in place of the truth, sensors ideal."""
    return play(robot, setup, values=dict(zip(robot.names, map(float, estimate), strict=True)))


def rms_difference(predicted: Run, exact: Run) -> tuple[float, ...]:
    """Root mean square of predicted − exact, per state."""
    if not predicted.is_upright:
        return (float("nan"),) * exact.states.shape[1]
    return tuple(map(float, np.sqrt(np.mean((predicted.states - exact.states) ** 2, axis=0))))
