"""Statistics over the results of many logs."""

from __future__ import annotations

from array import array
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import chdtrc

from derive.parameter_name import effect_of
from wheelpend.campaigns.one_log import Estimate, LogResult, SimulationSpec
from wheelpend.campaigns.units import is_per_log
from wheelpend.estimation.criteria import MAX_EXPLAINED_ERROR_RATIO
from wheelpend.model import model_kernels
from wheelpend.model.record import Model
from wheelpend.proportion import Proportion, proportion_of
from wheelpend.simulation.hidden import machine_values

INTERVAL_95_STANDARD_ERRORS = 1.96  # standard errors, half width of a 95 % interval
DISAGREEMENT_P_VALUE = 0.01  # probability below which logs do not agree, over all parameters together


class Range(NamedTuple):
    """One number over all logs."""

    mean: float
    smallest: float
    largest: float

    def to_json(self) -> dict[str, Any]:
        """The numbers under the keys of JSON."""
        return {"mean": self.mean, "smallest": self.smallest, "largest": self.largest}


@dataclass(frozen=True)
class ParameterRecovery:
    """A parameter of simulated logs beside the truth."""

    logs: int
    truth: float
    mean: float
    bias: float  # mean - truth
    bias_sigma: float | None  # its standard error
    spread: float | None  # standard deviation over the logs
    sigma: float | None  # mean of the standard errors
    inside: Proportion  # truth within the 95 % interval

    def to_json(self) -> dict[str, Any]:
        """The parameter under the keys of JSON."""
        return {
            "logs": self.logs,
            "truth": self.truth,
            "mean": self.mean,
            "bias": self.bias,
            "bias_sigma": self.bias_sigma,
            "spread": self.spread,
            "sigma": self.sigma,
            "inside": self.inside,
        }


class LargestDeviation(NamedTuple):
    """The log that is furthest off what the others say."""

    log: str
    sigmas: float  # its distance, in standard errors of the difference

    def to_json(self) -> dict[str, Any]:
        """The log under the keys of JSON."""
        return {"log": self.log, "sigmas": self.sigmas}


@dataclass(frozen=True)
class ParameterAgreement:
    """A parameter of measured logs, or of simulated ones without a truth of it."""

    logs: int
    mean: float  # weighted by the standard errors
    mean_sigma: float  # its standard error, if the logs agree
    spread: float | None  # standard deviation over the logs
    sigma: float  # mean of the standard errors
    chi_square: float  # of the logs about the mean
    degrees: int
    p_value: float | None  # how often chance alone spreads them as much
    furthest: LargestDeviation | None

    def to_json(self) -> dict[str, Any]:
        """The parameter under the keys of JSON."""
        return {
            "logs": self.logs,
            "mean": self.mean,
            "mean_sigma": self.mean_sigma,
            "spread": self.spread,
            "sigma": self.sigma,
            "chi_square": self.chi_square,
            "degrees": self.degrees,
            "p_value": self.p_value,
            "furthest": self.furthest,
        }


@dataclass(frozen=True)
class Summary:
    """Errors, verdicts and parameters over the results of a campaign."""

    logs: int
    failed: int
    error: Range | None
    error_after: Range | None  # with what was named
    effects: tuple[str, ...]  # of the model that most logs end with, to which the parameters belong
    parameters: dict[str, ParameterRecovery | ParameterAgreement]
    disagreeing: tuple[str, ...] = ()  # parameters that scatter more over the logs than their standard errors allow
    unexplained: tuple[str, ...] = ()  # logs whose error stays above the noise floor, the worst first
    verdicts: dict[str, int] = field(default_factory=dict)
    named: dict[str, int] = field(default_factory=dict)  # how many logs name an effect
    hidden: tuple[str, ...] = ()  # in the simulated machine and not in the model
    found: dict[str, Proportion] = field(default_factory=dict)  # by hidden effect: it is named, or declared equivalent
    first_right: Proportion | None = None  # the first that is named is hidden, or declares one that is
    false_alarms: Proportion | None = None  # nothing is hidden, and the verdict is another than nothing_missing

    def to_json(self) -> dict[str, Any]:
        """The summary under the keys of JSON."""
        return {
            "logs": self.logs,
            "failed": self.failed,
            "error": self.error,
            "error_after": self.error_after,
            "effects": self.effects,
            "parameters": self.parameters,
            "disagreeing": self.disagreeing,
            "unexplained": self.unexplained,
            "verdicts": self.verdicts,
            "named": self.named,
            "hidden": self.hidden,
            "found": self.found,
            "first_right": self.first_right,
            "false_alarms": self.false_alarms,
        }


def summarise(model: Model, simulated: SimulationSpec | None, results: Iterable[LogResult]) -> Summary:
    """Summarise the results; parameters over those that end with the most frequent model.

    Each result is looked at once, so that they need not be in memory together.
    """
    truth, hidden = true_values(model, simulated) if simulated else ({}, ())
    seen = _Seen(hidden)
    for result in results:
        seen.take(result)
    effects = seen.models.most_common(1)[0][0] if seen.models else ()
    collected = seen.estimates.get(effects, {})
    parameters = {n: row for n, e in collected.items() if (row := summarise_parameter(e, truth.get(n))) is not None}
    summary = Summary(
        logs=seen.logs,
        failed=seen.failed,
        error=range_of(seen.errors),
        error_after=range_of(seen.errors_after),
        effects=effects,
        parameters=parameters,
        disagreeing=disagreeing_parameters(parameters),
        unexplained=tuple(log for _, log in sorted(seen.above, reverse=True)),
        verdicts=dict(seen.verdicts.most_common()),
        named=dict(seen.named.most_common()),
        hidden=hidden,
    )
    return with_detection_rates(summary, seen) if simulated and summary.verdicts else summary


class _Estimates:
    """A parameter over the logs that identify it."""

    def __init__(self) -> None:
        self.logs: list[str] = []
        self.values, self.sigmas = array("d"), array("d")  # a standard error that is not known is NaN

    def take(self, log: str, found: Estimate) -> None:
        """Take one more log's."""
        self.logs.append(log)
        self.values.append(found.value)
        self.sigmas.append(found.sigma if found.sigma is not None and found.sigma > 0.0 else float("nan"))


class _Seen:
    """What is counted and collected of results, one after the other: numbers, and the logs' names."""

    def __init__(self, hidden: Sequence[str]) -> None:
        self._hidden = set(hidden)
        self.logs = self.failed = self.alarms = self.first_right = 0
        self.errors, self.errors_after = array("d"), array("d")
        self.models: Counter[tuple[str, ...]] = Counter()  # effects of those that have parameters
        self.estimates: dict[tuple[str, ...], dict[str, _Estimates]] = {}  # by model and parameter
        self.above: list[tuple[float, str]] = []  # error, and the log that has it
        self.verdicts: Counter[str] = Counter()
        self.named: Counter[str] = Counter()
        self.found = Counter(dict.fromkeys(hidden, 0))  # logs that name a hidden effect, or one that declares it

    def take(self, result: LogResult) -> None:
        """Take one more result."""
        self.logs += 1
        if result.failure is not None:
            self.failed += 1
            return
        self._take_errors(result)
        if result.parameters:
            model = tuple(sorted(result.effects))
            self.models[model] += 1
            alike = self.estimates.setdefault(model, {})
            for name, estimate in result.parameters.items():
                alike.setdefault(name, _Estimates()).take(result.log, estimate)
        if result.verdict:
            self.verdicts[result.verdict] += 1
        self.named.update(n.effect for n in result.named)
        self.alarms += bool(result.named) or result.verdict != "nothing_missing"
        told = [{n.effect, *n.equivalent_to} for n in result.named]  # each effect with its equivalents
        self.first_right += bool(told and told[0] & self._hidden)
        self.found.update(e for e in self._hidden if any(e in one for one in told))

    def _take_errors(self, result: LogResult) -> None:
        if result.error is not None:
            self.errors.append(result.error)
        if result.error_after is not None:
            self.errors_after.append(result.error_after)
        left = result.error if result.error_after is None else result.error_after
        if left and result.noise_floor and left > MAX_EXPLAINED_ERROR_RATIO * result.noise_floor:
            self.above.append((left, result.log))


def true_values(model: Model, simulated: SimulationSpec) -> tuple[dict[str, float], tuple[str, ...]]:
    """Every parameter of the simulated machine, and the effects that are hidden from the model."""
    machine = machine_values(model, simulated.hide)
    present = tuple(e for e in dict.fromkeys(map(effect_of, machine)) if e)
    module = model_kernels.library_module_of(model, present)
    truth = {**dict(zip(module.PARAMETERS, module.ABSENT, strict=True)), **machine}
    known = {n: float(v) for n, v in truth.items() if np.isfinite(v)}
    return known, tuple(e for e in present if e not in model.effects)


def range_of(values: Sequence[float]) -> Range | None:
    """Mean, smallest and largest of some values; None of none."""
    return Range(float(np.mean(values)), min(values), max(values)) if values else None


def summarise_parameter(found: _Estimates, truth: float | None) -> ParameterRecovery | ParameterAgreement | None:
    """A parameter over the logs that identify it; None where none has a standard error, and the truth is not known."""
    values, sigmas = np.array(found.values), np.array(found.sigmas)
    known = np.isfinite(sigmas)
    estimates = np.column_stack((values[known], sigmas[known]))
    if truth is not None:
        return parameter_recovery(values, estimates, truth)
    if not known.any():
        return None
    return parameter_agreement([log for log, is_known in zip(found.logs, known, strict=True) if is_known], estimates)


def parameter_recovery(values: ArrayLike, estimates: ArrayLike, truth: float) -> ParameterRecovery:
    """Values (N,), and those of them that have standard errors with these (n, 2), beside the truth."""
    values, estimates = np.asarray(values, dtype=float), np.reshape(estimates, (-1, 2))
    count, mean = len(values), float(np.mean(values))
    spread = float(np.std(values, ddof=1)) if count > 1 else None
    return ParameterRecovery(
        logs=count,
        truth=truth,
        mean=mean,
        bias=mean - truth,
        bias_sigma=None if spread is None else spread / count**0.5,
        spread=spread,
        sigma=float(np.mean(estimates[:, 1])) if len(estimates) else None,
        inside=proportion_of(np.abs(estimates[:, 0] - truth) < INTERVAL_95_STANDARD_ERRORS * estimates[:, 1]),
    )


def parameter_agreement(logs: Sequence[str], estimates: np.ndarray) -> ParameterAgreement:
    """χ² test that estimates and their standard errors (N, 2), one of each log, are of one value."""
    values, sigmas = estimates.T
    weights = sigmas**-2.0
    mean, whole, degrees = float(np.average(values, weights=weights)), float(np.sum(weights)), len(logs) - 1
    chi_square = float(np.sum(weights * (values - mean) ** 2))
    return ParameterAgreement(
        logs=len(logs),
        mean=mean,
        mean_sigma=whole**-0.5,
        spread=float(np.std(values, ddof=1)) if degrees else None,
        sigma=float(np.mean(sigmas)),
        chi_square=chi_square,
        degrees=degrees,
        p_value=float(chdtrc(degrees, chi_square)) if degrees else None,
        furthest=largest_deviation(logs, values, weights) if degrees else None,
    )


def largest_deviation(logs: Sequence[str], values: np.ndarray, weights: np.ndarray) -> LargestDeviation:
    """The log whose value (N,) is furthest off the weighted mean of the others."""
    others = sums_of_others(weights)
    means = sums_of_others(weights * values) / others
    distances = np.abs(values - means) / np.sqrt(1.0 / weights + 1.0 / others)
    worst = int(np.argmax(distances))
    return LargestDeviation(logs[worst], float(distances[worst]))


def sums_of_others(values: np.ndarray) -> np.ndarray:
    """For each of some values (N,) the sum of all the others, without rounding in one that is far larger than they."""
    before, behind = np.cumsum(values), np.cumsum(values[::-1])[::-1]
    return np.r_[0.0, before[:-1]] + np.r_[behind[1:], 0.0]


def disagreeing_parameters(parameters: Mapping[str, ParameterRecovery | ParameterAgreement]) -> tuple[str, ...]:
    """Parameters on which the logs do not agree; by chance any is named in DISAGREEMENT_P_VALUE of all campaigns.

    None that is another in every log: a slope, an encoder's zero.
    """
    shared = {n: row for n, row in parameters.items() if not is_per_log(n)}
    rows = {n: row.p_value for n, row in shared.items() if isinstance(row, ParameterAgreement)}
    judged = {n: p for n, p in rows.items() if p is not None}
    return tuple(n for n, p in judged.items() if p < DISAGREEMENT_P_VALUE / len(judged))


def with_detection_rates(summary: Summary, seen: _Seen) -> Summary:
    """A summary with detection rates of the hidden effects, or with false alarms where nothing was hidden."""
    used = seen.logs - seen.failed
    if not summary.hidden:
        return replace(summary, false_alarms=Proportion(seen.alarms, used))
    return replace(
        summary,
        first_right=Proportion(seen.first_right, used),
        found={e: Proportion(seen.found[e], used) for e in summary.hidden},
    )
