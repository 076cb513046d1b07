"""Statistics over the results of many logs."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

import numpy as np
from scipy.special import chdtrc

from derive.parameter_name import effect_of
from wheelpend.campaigns.one_log import LogResult, SimulationSpec
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


def summarise(model: Model, simulated: SimulationSpec | None, results: Sequence[LogResult]) -> Summary:
    """Summarise the results; parameters over those that end with the most frequent model."""
    good = [a for a in results if a.failure is None]
    ends = Counter(tuple(sorted(a.effects)) for a in good if a.parameters)
    effects = ends.most_common(1)[0][0] if ends else ()
    alike = [a for a in good if tuple(sorted(a.effects)) == effects]
    truth, hidden = true_values(model, simulated) if simulated else ({}, ())
    names = dict.fromkeys(n for a in alike for n in a.parameters)
    parameters = {n: row for n in names if (row := summarise_parameter(n, alike, truth.get(n))) is not None}
    summary = Summary(
        logs=len(results),
        failed=len(results) - len(good),
        error=range_of(a.error for a in good),
        error_after=range_of(a.error_after for a in good),
        effects=effects,
        parameters=parameters,
        disagreeing=disagreeing_parameters(parameters),
        unexplained=logs_above_noise_floor(good),
        verdicts=counts_by_frequency(a.verdict for a in good if a.verdict),
        named=counts_by_frequency(n.effect for a in good for n in a.named),
        hidden=hidden,
    )
    return with_detection_rates(summary, good) if simulated and summary.verdicts else summary


def true_values(model: Model, simulated: SimulationSpec) -> tuple[dict[str, float], tuple[str, ...]]:
    """Every parameter of the simulated machine, and the effects that are hidden from the model."""
    machine = machine_values(model, simulated.hide)
    present = tuple(e for e in dict.fromkeys(map(effect_of, machine)) if e)
    module = model_kernels.library_module_of(model, present)
    truth = {**dict(zip(module.PARAMETERS, module.ABSENT, strict=True)), **machine}
    known = {n: float(v) for n, v in truth.items() if np.isfinite(v)}
    return known, tuple(e for e in present if e not in model.effects)


def range_of(values: Iterable[float | None]) -> Range | None:
    """Mean, smallest and largest of the values that are not None."""
    known = [v for v in values if v is not None]
    return Range(float(np.mean(known)), min(known), max(known)) if known else None


def logs_above_noise_floor(results: Iterable[LogResult]) -> tuple[str, ...]:
    """Logs whose error, with what was named, stays above the noise floor, the worst first."""
    left = ((a.error if a.error_after is None else a.error_after, a.noise_floor, a.log) for a in results)
    above = [
        (error, log) for error, floor, log in left if error and floor and error > MAX_EXPLAINED_ERROR_RATIO * floor
    ]
    return tuple(log for _, log in sorted(above, reverse=True))


def counts_by_frequency(names: Iterable[str]) -> dict[str, int]:
    """Counts of names, the most frequent first."""
    return dict(Counter(names).most_common())


def summarise_parameter(
    name: str, results: Sequence[LogResult], truth: float | None
) -> ParameterRecovery | ParameterAgreement | None:
    """A parameter over the logs that identify it; None where none does."""
    estimates = [(r.log, r.parameters[name]) for r in results if name in r.parameters]
    with_errors = [(log, e.value, e.sigma) for log, e in estimates if e.sigma is not None and e.sigma > 0.0]
    if truth is not None:
        pairs = [(value, sigma) for _, value, sigma in with_errors]
        return parameter_recovery([e.value for _, e in estimates], pairs, truth)
    if not with_errors:
        return None
    return parameter_agreement([log for log, *_ in with_errors], np.array([pair for _, *pair in with_errors]))


def parameter_recovery(
    values: Sequence[float], estimates: Sequence[tuple[float, float]], truth: float
) -> ParameterRecovery:
    """Estimates, and those of them that have standard errors, beside the truth."""
    count, mean = len(values), float(np.mean(values))
    spread = float(np.std(values, ddof=1)) if count > 1 else None
    return ParameterRecovery(
        logs=count,
        truth=truth,
        mean=mean,
        bias=mean - truth,
        bias_sigma=None if spread is None else spread / count**0.5,
        spread=spread,
        sigma=float(np.mean([s for _, s in estimates])) if estimates else None,
        inside=proportion_of(abs(value - truth) < INTERVAL_95_STANDARD_ERRORS * sigma for value, sigma in estimates),
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
    others = weights.sum() - weights
    means = ((weights * values).sum() - weights * values) / others
    distances = np.abs(values - means) / np.sqrt(1.0 / weights + 1.0 / others)
    worst = int(np.argmax(distances))
    return LargestDeviation(logs[worst], float(distances[worst]))


def disagreeing_parameters(parameters: Mapping[str, ParameterRecovery | ParameterAgreement]) -> tuple[str, ...]:
    """Parameters on which the logs do not agree; by chance any is named in DISAGREEMENT_P_VALUE of all campaigns."""
    rows = {n: row.p_value for n, row in parameters.items() if isinstance(row, ParameterAgreement)}
    judged = {n: p for n, p in rows.items() if p is not None}
    return tuple(n for n, p in judged.items() if p < DISAGREEMENT_P_VALUE / len(judged))


def with_detection_rates(summary: Summary, results: Sequence[LogResult]) -> Summary:
    """A summary with detection rates of the hidden effects, or with false alarms where nothing was hidden."""
    hidden = set(summary.hidden)
    if not hidden:
        return replace(
            summary, false_alarms=proportion_of(bool(a.named) or a.verdict != "nothing_missing" for a in results)
        )
    named = [[{n.effect, *n.equivalent_to} for n in r.named] for r in results]  # effect with its equivalents
    return replace(
        summary,
        first_right=proportion_of(bool(sets and sets[0] & hidden) for sets in named),
        found={e: proportion_of(any(e in one for one in sets) for sets in named) for e in summary.hidden},
    )
