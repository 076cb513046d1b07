"""Tables 1, 2 and 3, the condition numbers and the prediction errors of Figure 5: the paper's numbers beside ours."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from wheelpend.paper import numbers
from wheelpend.paper.numbers import Column
from wheelpend.reproduction.estimators import filtered
from wheelpend.reproduction.experiment import COMMAND_NAMES, EXPERIMENT_DURATION_S, Robot, Run, Setup, play
from wheelpend.reproduction.trials import PREDICTION_SETUP, STATE_NAMES, Trial, prediction_rmse

HOLD_NAMES = ("zoh", "foh")
DURATION_CHOICES_S = (10.0, 15.0, 20.0, 25.0, 30.0)  # of Table 3, whose duration the paper does not give
PITCH_DEVIATION_RAD = float(np.radians(0.5))  # of the initial pitch in Table 3
PRINTED_COLUMNS = {
    ("simple", "differentiation"): numbers.SIMPLE_DIFFERENTIATION,
    ("simple", "filtered_zoh"): numbers.SIMPLE_FILTERED,
    ("simple", "filtered_foh"): numbers.SIMPLE_FILTERED,
    ("simple", "filtered_rest"): numbers.SIMPLE_FILTERED,
    ("aggressive", "filtered_zoh"): numbers.AGGRESSIVE_FILTERED,
    ("aggressive", "filtered_foh"): numbers.AGGRESSIVE_FILTERED,
    ("aggressive", "filtered_rest"): numbers.AGGRESSIVE_FILTERED,
}


@dataclass(frozen=True)
class Cell:
    """One parameter by one method in Table 1 or 2: the absolute error over all seeds [% of the truth]."""

    parameter: str
    command: str
    method: str  # for cramer_rao the standard deviation takes the error's place
    median: float
    p10: float
    p90: float
    bias: float | None  # median of the signed error
    failed: int  # seeds in which the method gave no estimate
    paper: float | None  # the paper's single draw
    percentile: float | None  # share of our draws whose error is smaller than the paper's [%]

    def to_json(self) -> dict[str, Any]:
        """The cell under the keys of JSON and the columns of CSV."""
        return {
            "parameter": self.parameter,
            "command": self.command,
            "method": self.method,
            "median": self.median,
            "p10": self.p10,
            "p90": self.p90,
            "bias": self.bias,
            "failed": self.failed,
            "paper": self.paper,
            "percentile": self.percentile,
        }


@dataclass(frozen=True)
class Condition:
    """Condition number of ΦᵀΦ for one command and method, median over seeds."""

    command: str
    method: str
    plain: float
    scaled: float  # with the columns of Φ scaled to unit length

    def to_json(self) -> dict[str, Any]:
        """The row under the keys of JSON and the columns of CSV."""
        return {"command": self.command, "method": self.method, "plain": self.plain, "scaled": self.scaled}


@dataclass(frozen=True)
class Deviation:
    """One number of Table 3, errors in % of the truth."""

    case: str
    tau: float  # s, of both filters
    deviation_deg: float  # how far the filters' initial pitch is off
    hold: str  # zoh or foh
    parameter: str
    estimate: float
    error: float  # signed
    paper_estimate: float
    paper_error: float  # absolute
    ratio: float  # absolute error, ours to the paper's
    lowest: float  # of the absolute error over what the paper leaves open
    highest: float

    def to_json(self) -> dict[str, Any]:
        """The row under the keys of JSON and the columns of CSV."""
        return {
            "case": self.case,
            "tau": self.tau,
            "deviation_deg": self.deviation_deg,
            "hold": self.hold,
            "parameter": self.parameter,
            "estimate": self.estimate,
            "error": self.error,
            "paper_estimate": self.paper_estimate,
            "paper_error": self.paper_error,
            "ratio": self.ratio,
            "lowest": self.lowest,
            "highest": self.highest,
        }


@dataclass(frozen=True)
class Prediction:
    """Root mean square error of a closed-loop output prediction (Figure 5) [rad, rad/s]."""

    channel: str
    command: str  # whose data gave the parameters
    paper: float
    from_printed: float  # of the prediction with the paper's printed estimates
    median: float
    p10: float
    p90: float
    fallen: int  # number of seeds in which the predicted robot falls

    def to_json(self) -> dict[str, Any]:
        """The row under the keys of JSON and the columns of CSV."""
        return {
            "channel": self.channel,
            "command": self.command,
            "paper": self.paper,
            "from_printed": self.from_printed,
            "median": self.median,
            "p10": self.p10,
            "p90": self.p90,
            "fallen": self.fallen,
        }


# ---- Tables 1 and 2


def cells(trials: Sequence[Trial], command: str, methods: Sequence[str]) -> tuple[Cell, ...]:
    """Error statistics of one command, by method and parameter."""
    chosen = [t for t in trials if t.setup == Setup(command)]
    return tuple(
        cell
        for method in methods
        if any(method in t.errors for t in chosen) or method == "cramer_rao"
        for cell in (_bounds(chosen, command) if method == "cramer_rao" else _errors(chosen, command, method))
    )


def _errors(trials: Sequence[Trial], command: str, method: str) -> Iterator[Cell]:
    signed = np.array([t.errors[method] for t in trials])
    printed = PRINTED_COLUMNS.get((command, method))
    good = np.isfinite(signed).all(axis=1)
    for index, name in enumerate(numbers.REFERENCE_PARAMETERS):
        own, paper = signed[good, index], printed.errors[index] if printed else None
        below = None if paper is None or not own.size else float(100.0 * np.mean(np.abs(own) < paper))
        yield Cell(name, command, method, *spread(np.abs(own)), median(own), int(np.sum(~good)), paper, below)


def _bounds(trials: Sequence[Trial], command: str) -> Iterator[Cell]:
    bounds = np.array([t.bound for t in trials if t.bound is not None])
    for index, name in enumerate(numbers.REFERENCE_PARAMETERS):
        yield Cell(name, command, "cramer_rao", *spread(bounds[:, index]), None, 0, None, None)


def spread(values: np.ndarray) -> tuple[float, float, float]:
    """Median, 10 % and 90 % quantile."""
    if not values.size:
        return (float("nan"),) * 3
    middle, low, high = np.quantile(values, (0.5, 0.1, 0.9))
    return float(middle), float(low), float(high)


def median(values: np.ndarray) -> float:
    """Median, NaN of nothing."""
    return spread(values)[0]


def by_method(cells: Sequence[Cell]) -> dict[str, dict[str, Cell]]:
    """Cells by method and parameter, in their order."""
    return {
        m: {c.parameter: c for c in cells if c.method == m} for m in dict.fromkeys(c.method for c in cells)
    }  # fmt: skip


def conditions(trials: Sequence[Trial]) -> tuple[Condition, ...]:
    """Condition numbers of both commands, where the trials hold them."""
    found = []
    for command in COMMAND_NAMES:
        chosen = [t.conditions for t in trials if t.conditions and t.setup == Setup(command)]
        for method in chosen[0] if chosen else ():
            plain, scaled = np.median([c[method] for c in chosen], axis=0)
            found.append(Condition(command, method, float(plain), float(scaled)))
    return tuple(found)


# ---- Table 3


def table3(robot: Robot) -> tuple[Deviation, ...]:
    """Table 3 with both holds, each number with its range over what the paper leaves open."""
    runs = {d: play(robot, Setup(duration=d)) for d in DURATION_CHOICES_S}
    tilted = {
        (d, s): play(robot, Setup(duration=d, tilt=s * PITCH_DEVIATION_RAD))
        for d in DURATION_CHOICES_S
        for s in (1.0, -1.0)
    }
    found: list[Deviation] = []
    for case, (tau, off, column) in numbers.TABLE_3.items():
        for hold in HOLD_NAMES:
            chosen = _with_deviation(robot, runs[EXPERIMENT_DURATION_S], tau, hold, PITCH_DEVIATION_RAD * off)
            others = np.abs(
                [robot.percent_error(x) for x in _alternative_estimates(robot, runs, tilted, tau, hold, off)]
            )
            found += _deviations(robot, case, hold, chosen, others, column)
    return tuple(found)


def _alternative_estimates(
    robot: Robot, runs: dict, tilted: dict, tau: float, hold: str, off: bool
) -> Iterator[np.ndarray]:
    """Estimates over durations, signs, and over who is wrong: the filters' initial pitch or the robot's."""
    for run in runs.values():
        for sign in (1.0, -1.0) if off else (0.0,):
            yield _with_deviation(robot, run, tau, hold, sign * PITCH_DEVIATION_RAD)
    for run in tilted.values() if off else ():
        yield _with_deviation(robot, run, tau, hold, 0.0)


def _with_deviation(robot: Robot, run: Run, tau: float, hold: str, deviation: float) -> np.ndarray:
    return filtered(robot, run.log, hold=hold, start=state_with_pitch(robot, deviation), tau=(tau, tau))


def state_with_pitch(robot: Robot, deviation: float) -> np.ndarray:
    """The state at rest with the pitch off by a deviation [rad]."""
    state = np.zeros(robot.module.NX)
    state[1] = deviation
    return state


def _deviations(
    robot: Robot, case: str, hold: str, estimate: np.ndarray, others: np.ndarray, column: Column
) -> Iterator[Deviation]:
    tau, off, _ = numbers.TABLE_3[case]
    errors = robot.percent_error(estimate)
    for index, name in enumerate(numbers.REFERENCE_PARAMETERS):
        paper = printed_error(name, column.estimates[index], column.errors[index])
        yield Deviation(
            case, tau, 0.5 * off, hold, name, float(estimate[index]), errors[index], column.estimates[index], paper,
            abs(errors[index]) / paper, float(others[:, index].min()), float(others[:, index].max()),
        )  # fmt: skip


def printed_error(name: str, estimate: float, error: float) -> float:
    """The printed error, or that of the printed estimate where they differ by an order of magnitude (a misprint)."""
    implied = 100.0 * abs(estimate / numbers.REFERENCE_PARAMETERS[name] - 1.0)
    return implied if implied > 10.0 * error else error


# ---- Figure 5


def predictions(robot: Robot, trials: Sequence[Trial]) -> tuple[Prediction, ...]:
    """Prediction errors per output: printed, recomputed from the printed estimates, and over our seeds."""
    found = []
    for position, command in enumerate(COMMAND_NAMES):
        own = np.array([t.rmse for t in trials if t.rmse is not None and t.setup == Setup(command)])
        good = np.isfinite(own).all(axis=1)
        recomputed = prediction_rmse(robot, PREDICTION_SETUP, np.array(printed_estimates(command)))
        for index, channel in enumerate(STATE_NAMES):
            found.append(
                Prediction(
                    channel,
                    command,
                    numbers.PREDICTION_RMSE[channel][position],
                    recomputed[index],
                    *spread(own[good, index]),
                    int(np.sum(~good)),
                )
            )
    return tuple(found)


def printed_estimates(command: str) -> tuple[float, ...]:
    """The paper's estimates by the filtered method from a command."""
    return PRINTED_COLUMNS[command, "filtered_foh"].estimates


def prediction_errors(robot: Robot, setup: Setup) -> dict[str, np.ndarray]:
    """Prediction errors with the printed estimates in another closed loop, by the command that gave the estimates."""
    return {c: np.array(prediction_rmse(robot, setup, np.array(printed_estimates(c)))) for c in COMMAND_NAMES}


def table3_errors(
    robot: Robot, run: Run, *, hold: str = "foh", deviation: float = PITCH_DEVIATION_RAD, tau_ratio: float = 1.0
) -> dict[str, np.ndarray]:
    """Signed errors of Table 3 per case [%] from one run; ``tau_ratio`` is the second τ over the first."""
    found = {}
    for case, (tau, off, _) in numbers.TABLE_3.items():
        start = state_with_pitch(robot, deviation * off)
        found[case] = np.array(
            robot.percent_error(filtered(robot, run.log, hold=hold, start=start, tau=(tau, tau * tau_ratio)))
        )
    return found
