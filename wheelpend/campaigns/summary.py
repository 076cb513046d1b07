"""What the answers of many logs have in common."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np
from scipy.special import chdtrc

from wheelpend.campaigns.one_log import Answer, Played
from wheelpend.estimation.criteria import EXPLAINED
from wheelpend.model import model_kernels
from wheelpend.model.record import Model
from wheelpend.proportion import Rate, rate
from wheelpend.simulation.hidden import machine_values

INSIDE = 1.96  # standard errors: a 95 % interval
DISAGREE = 0.01  # probability below which logs do not agree, over all parameters together


class Range(NamedTuple):
    """One number over all logs."""

    mean: float
    smallest: float
    largest: float


@dataclass(frozen=True)
class Recovered:
    """A parameter of simulated logs beside the truth."""

    logs: int
    truth: float
    mean: float
    bias: float  # mean - truth
    bias_sigma: float | None  # its standard error
    spread: float | None  # standard deviation over the logs
    sigma: float | None  # mean of the standard errors
    inside: Rate  # truth within the 95 % interval


class Furthest(NamedTuple):
    """The log that is furthest off what the others say."""

    log: str
    sigmas: float  # its distance, in standard errors of the difference


@dataclass(frozen=True)
class Agreement:
    """A parameter of measured logs, or of simulated ones without a truth of it."""

    logs: int
    mean: float  # weighted by the standard errors
    mean_sigma: float  # its standard error, if the logs agree
    spread: float | None  # standard deviation over the logs
    sigma: float  # mean of the standard errors
    chi_square: float  # of the logs about the mean
    degrees: int
    p_value: float | None  # how often chance alone spreads them as much
    furthest: Furthest | None


@dataclass(frozen=True)
class Summary:
    """What the answers of a campaign have in common."""

    logs: int
    failed: int
    error: Range | None
    error_after: Range | None  # with what was named
    effects: tuple[str, ...]  # of the model that most logs end with, to which the parameters belong
    parameters: dict[str, Recovered | Agreement]
    disagreeing: tuple[str, ...] = ()  # parameters that scatter more over the logs than their standard errors allow
    unexplained: tuple[str, ...] = ()  # logs whose error stays above the noise floor, the worst first
    verdicts: dict[str, int] = field(default_factory=dict)
    named: dict[str, int] = field(default_factory=dict)  # how many logs name an effect
    hidden: tuple[str, ...] = ()  # in the simulated machine and not in the model
    found: dict[str, Rate] = field(default_factory=dict)  # by hidden effect: it is named, or declared equivalent
    first_right: Rate | None = None  # the first that is named is hidden, or declares one that is
    false_alarms: Rate | None = None  # nothing is hidden, and the verdict is another than nothing_missing


def summarise(model: Model, simulated: Played | None, answers: Sequence[Answer]) -> Summary:
    """Summarise the answers; parameters over those that end with the model that most end with."""
    good = [a for a in answers if a.failure is None]
    ends = Counter(tuple(sorted(a.effects)) for a in good if a.parameters)
    effects = ends.most_common(1)[0][0] if ends else ()
    alike = [a for a in good if tuple(sorted(a.effects)) == effects]
    truth, hidden = truth_of(model, simulated) if simulated else ({}, ())
    names = dict.fromkeys(n for a in alike for n in a.parameters)
    parameters = {n: row for n in names if (row := over_logs(n, alike, truth.get(n))) is not None}
    summary = Summary(
        logs=len(answers),
        failed=len(answers) - len(good),
        error=range_of(a.error for a in good),
        error_after=range_of(a.error_after for a in good),
        effects=effects,
        parameters=parameters,
        disagreeing=disagreeing(parameters),
        unexplained=unexplained(good),
        verdicts=counted(a.verdict for a in good if a.verdict),
        named=counted(n.effect for a in good for n in a.named),
        hidden=hidden,
    )
    return beside_hidden(summary, good) if simulated and summary.verdicts else summary


def truth_of(model: Model, simulated: Played) -> tuple[dict[str, float], tuple[str, ...]]:
    """What the simulated machine has: every parameter, and the effects that are hidden from the model."""
    machine = machine_values(model, simulated.hide)
    present = tuple(dict.fromkeys(n.partition(".")[0] for n in machine if "." in n))
    module = model_kernels.library_of(model, present)
    truth = {**dict(zip(module.PARAMETERS, module.ABSENT, strict=True)), **machine}
    known = {n: float(v) for n, v in truth.items() if np.isfinite(v)}
    return known, tuple(e for e in present if e not in model.effects)


def range_of(values: Iterable[float | None]) -> Range | None:
    """Mean, smallest and largest of what is known."""
    known = [v for v in values if v is not None]
    return Range(float(np.mean(known)), min(known), max(known)) if known else None


def unexplained(answers: Iterable[Answer]) -> tuple[str, ...]:
    """Logs whose error, with what was named, stays above the noise floor, the worst first."""
    left = ((a.error if a.error_after is None else a.error_after, a.noise_floor, a.log) for a in answers)
    above = [(error, log) for error, floor, log in left if error and floor and error > EXPLAINED * floor]
    return tuple(log for _, log in sorted(above, reverse=True))


def counted(names: Iterable[str]) -> dict[str, int]:
    """How often each comes, the most frequent first."""
    return dict(Counter(names).most_common())


def over_logs(name: str, answers: Sequence[Answer], truth: float | None) -> Recovered | Agreement | None:
    """A parameter over the logs that tell it; None where none does."""
    told = [(a.log, a.parameters[name]) for a in answers if name in a.parameters]
    sure = [(log, e.value, e.sigma) for log, e in told if e.sigma is not None and e.sigma > 0.0]
    if truth is not None:
        return recovered([e.value for _, e in told], [(value, sigma) for _, value, sigma in sure], truth)
    return agreement([log for log, *_ in sure], np.array([pair for _, *pair in sure])) if sure else None


def recovered(values: Sequence[float], sure: Sequence[tuple[float, float]], truth: float) -> Recovered:
    """Estimates, and those of them that have standard errors, beside the truth."""
    count, mean = len(values), float(np.mean(values))
    spread = float(np.std(values, ddof=1)) if count > 1 else None
    return Recovered(
        logs=count,
        truth=truth,
        mean=mean,
        bias=mean - truth,
        bias_sigma=None if spread is None else spread / count**0.5,
        spread=spread,
        sigma=float(np.mean([s for _, s in sure])) if sure else None,
        inside=rate(abs(value - truth) < INSIDE * sigma for value, sigma in sure),
    )


def agreement(logs: Sequence[str], estimates: np.ndarray) -> Agreement:
    """Whether estimates and their standard errors (N, 2), one of each log, can be of one value."""
    values, sigmas = estimates.T
    weights = sigmas**-2.0
    mean, whole, degrees = float(np.average(values, weights=weights)), float(np.sum(weights)), len(logs) - 1
    chi_square = float(np.sum(weights * (values - mean) ** 2))
    return Agreement(
        logs=len(logs),
        mean=mean,
        mean_sigma=whole**-0.5,
        spread=float(np.std(values, ddof=1)) if degrees else None,
        sigma=float(np.mean(sigmas)),
        chi_square=chi_square,
        degrees=degrees,
        p_value=float(chdtrc(degrees, chi_square)) if degrees else None,
        furthest=furthest(logs, values, weights) if degrees else None,
    )


def furthest(logs: Sequence[str], values: np.ndarray, weights: np.ndarray) -> Furthest:
    """The log whose value (N,) is furthest off the weighted mean of the others."""
    others = weights.sum() - weights
    means = ((weights * values).sum() - weights * values) / others
    distances = np.abs(values - means) / np.sqrt(1.0 / weights + 1.0 / others)
    worst = int(np.argmax(distances))
    return Furthest(logs[worst], float(distances[worst]))


def disagreeing(parameters: Mapping[str, Recovered | Agreement]) -> tuple[str, ...]:
    """Parameters on which the logs do not agree: together they are named in DISAGREE of all campaigns by chance."""
    rows = {n: row.p_value for n, row in parameters.items() if isinstance(row, Agreement)}
    judged = {n: p for n, p in rows.items() if p is not None}
    return tuple(n for n, p in judged.items() if p < DISAGREE / len(judged))


def beside_hidden(summary: Summary, good: Sequence[Answer]) -> Summary:
    """A summary with how the verdicts compare with what was hidden."""
    hidden = set(summary.hidden)
    if not hidden:
        return replace(summary, false_alarms=rate(bool(a.named) or a.verdict != "nothing_missing" for a in good))
    answers = [[{n.effect, *n.equivalent_to} for n in a.named] for a in good]
    return replace(
        summary,
        first_right=rate(bool(told and told[0] & hidden) for told in answers),
        found={e: rate(any(e in one for one in told) for told in answers) for e in summary.hidden},
    )
