"""The horizon over which predictions are judged: the usual one, or the longest that the model can be simulated over.

A robot that falls within a tenth of a second, or a model that lacks much, may follow no log over the usual horizon,
whatever its parameters. Over a shorter one it does, and what it lacks can be named.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TypeVar

from wheelpend.errors import NotSimulable, TooShort
from wheelpend.estimation.criteria import DEFAULT_HORIZON_S
from wheelpend.estimation.problem import EstimationProblem
from wheelpend.estimation.starts import best_start

MIN_HORIZON_S, MIN_HORIZON_SAMPLES = 0.1, 10  # below either a prediction shows little but the sensors

Result = TypeVar("Result")


def over_workable_horizon(
    prepared: Callable[[float], EstimationProblem],
    attempt: Callable[[EstimationProblem, dict[str, float]], Result],
    progress: Callable[[str], None],
) -> Result:
    """What an attempt makes of the problem of a horizon [s] and its start, at the longest horizon that works.

    A shorter one than usual is a warning of the problem: the logs are too short for it, or the model cannot follow
    them. Raises Failure where none works.
    """
    horizon, reasons = DEFAULT_HORIZON_S, tuple[str, ...]()
    while True:
        try:
            problem = prepared(horizon)
        except TooShort:
            horizon /= 2.0
            if horizon < MIN_HORIZON_S:
                raise
            reasons = (_judged_over(horizon),)
            progress(f"the logs are too short to be judged over {2.0 * horizon:g} s; trying {horizon:g} s")
            continue
        problem = replace(problem, warnings=(*problem.warnings, *reasons))
        progress("finding a start")
        try:
            return attempt(*best_start(problem))
        except NotSimulable:
            horizon /= 2.0
            if horizon < max(MIN_HORIZON_S, MIN_HORIZON_SAMPLES * max(log.dt for log in problem.logs)):
                raise
        progress(f"no start leads to a model that can be simulated over {problem.horizon:g} s; trying {horizon:g} s")
        reasons = (_shorter(horizon),)


def _judged_over(horizon: float) -> str:
    return (
        f"These logs, or what is held out of them, are too short to be judged over {DEFAULT_HORIZON_S:g} s: errors are "
        f"over {horizon:g} s."
    )


def _shorter(horizon: float) -> str:
    return (
        f"The model follows these logs over {DEFAULT_HORIZON_S:g} s with no parameters that were found, so that errors "
        f"are over {horizon:g} s. Either it lacks much, or the machine falls so fast."
    )
