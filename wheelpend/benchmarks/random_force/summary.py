"""Rates and ratios over the answers, with 95 % confidence intervals."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from wheelpend.benchmarks.hidden_effects.summary import NORMAL_QUANTILE_95
from wheelpend.benchmarks.random_force.forces import FORCE_KINDS
from wheelpend.benchmarks.random_force.trial import Answer, Found
from wheelpend.proportion import Proportion, proportion_of

MAX_RMS_DEVIATION = 0.2  # relative, of a force's size
MAX_TIME_RATIO = 2.0  # of a force's correlation time to the true one, either way


@dataclass(frozen=True)
class Coverage:
    """True values inside their 95 % intervals."""

    inside: Proportion
    interval: tuple[float, float]  # 95 % confidence interval; the parameters of a log err together


@dataclass(frozen=True)
class Precision:
    """Errors of one parameter over complete logs [%]."""

    name: str
    rms_error: float
    stated: float  # rms of the standard errors given with the estimates
    bound: float  # rms of the Cramér-Rao bounds
    ratio: float  # rms of error over bound, log by log
    ratio_sigma: float  # standard error of the ratio
    lost: float  # rms of estimate - efficient estimate of the same log, over the bound: free of the logs' own luck
    inside: Proportion


@dataclass(frozen=True)
class CompleteSummary:
    """Complete logs, on which no force acts."""

    precision: tuple[Precision, ...]
    coverage: Coverage
    force_found: Proportion


@dataclass(frozen=True)
class ForceSummary:
    """Logs with a random force of one kind and place."""

    kind: str
    place: str
    rms_ratio: float  # found over played, mean over logs and rows that it acts on
    rms_right: Proportion  # of logs: within 20 % on every row that it acts on, and none on others
    time_ratio: float | None  # geometric mean of found over true correlation times; None where the force has none
    time_right: Proportion  # of logs: within a factor of two
    place_right: Proportion  # of logs: a force there and nowhere else
    coverage: Coverage


@dataclass(frozen=True)
class LawfulSummary:
    """Logs with one lawful effect beside a random force."""

    effect: str
    size: float  # true one
    ratio: float  # of estimate to truth, mean over logs
    ratio_sigma: float  # standard error of that mean
    deviation: float  # mean of (estimate - truth) / standard error
    spread: float  # standard deviation of that
    inside: Proportion
    logs: int


def usable(answers: Iterable[Answer], study: str) -> list[Answer]:
    """Answers of a study that did not fail."""
    return [a for a in answers if a.case.study == study and not a.failure]


def failures(answers: Iterable[Answer]) -> list[str]:
    """What failed and why, a sentence each."""
    return [f"{a.case.key}: {a.failure}" for a in answers if a.failure]


def is_inside(found: Found) -> bool:
    """True where the 95 % interval holds the truth."""
    return bool(abs(found.deviation) < NORMAL_QUANTILE_95)


def coverage(answers: Sequence[Answer]) -> Coverage:
    """Coverage of all parameters of the plant together; one that is lost counts neither way."""
    own = [[is_inside(f) for n, f in a.parameters.items() if "." not in n] for a in answers]
    inside = proportion_of(hit for log in own for hit in log)
    return Coverage(inside, clustered_interval(own))


def clustered_interval(logs: Sequence[Sequence[bool]]) -> tuple[float, float]:
    """95 % interval of a rate whose trials come in groups: Clopper and Pearson's of as many independent trials.

    Their number is that at which independent trials would scatter as the groups do, at least that of the groups.
    """
    groups = [g for g in logs if g]
    trials = sum(map(len, groups))
    if not trials:
        return float("nan"), float("nan")
    share = sum(map(sum, groups)) / trials
    scatter = sum((sum(g) - share * len(g)) ** 2 for g in groups) / trials**2
    effective = share * (1.0 - share) / scatter if scatter > 0.0 else 0.0
    count = round(min(max(effective, len(groups)), trials))
    return Proportion(round(share * count), count).interval


def complete_summary(answers: Sequence[Answer]) -> CompleteSummary | None:
    """Precision, coverage and false forces on complete logs; None without any."""
    mine = usable(answers, "complete")
    if not mine:
        return None
    names = dict.fromkeys(n for a in mine for n in a.parameters)
    rows = tuple(precision(n, [a.parameters[n] for a in mine if n in a.parameters]) for n in names)
    return CompleteSummary(rows, coverage(mine), proportion_of(bool(a.places) for a in mine))


def precision(name: str, found: Sequence[Found]) -> Precision:
    """Errors of a parameter over several logs."""
    percent = np.array([100.0 / abs(f.truth) for f in found])
    error = np.array([f.value - f.truth for f in found])
    bound = np.array([np.nan if f.bound is None else f.bound for f in found])
    stated = np.array([f.sigma for f in found])
    away = np.array([np.nan if f.efficient is None else f.value - f.efficient for f in found])
    squares = (error / bound) ** 2
    ratio = float(np.sqrt(squares.mean()))
    scatter = float(squares.std(ddof=1) / np.sqrt(len(squares))) if len(squares) > 1 else float("nan")
    return Precision(
        name, rms(percent * error), rms(percent * stated), rms(percent * bound), ratio, scatter / (2.0 * ratio),
        rms(away / bound), proportion_of(map(is_inside, found)),
    )  # fmt: skip


def rms(values: np.ndarray) -> float:
    """Root mean square."""
    return float(np.sqrt(np.mean(np.square(values))))


def force_summaries(answers: Sequence[Answer]) -> list[ForceSummary]:
    """A summary of every kind of force and place."""
    mine = usable(answers, "forces")
    groups = dict.fromkeys((a.case.kind, a.case.place) for a in mine)
    return [force_summary(k, p, [a for a in mine if (a.case.kind, a.case.place) == (k, p)]) for k, p in groups]


def force_summary(kind: str, place: str, answers: Sequence[Answer]) -> ForceSummary:
    """Logs with the same kind of force at the same place."""
    acting = [f for a in answers for f in a.forces.values() if f.true_rms > 0.0]
    true_time = FORCE_KINDS[kind].correlation_time
    times = [leading_force_time(a) for a in answers] if true_time else []
    ratios = [time / true_time for time in times if time and true_time]
    return ForceSummary(
        kind,
        place,
        float(np.mean([f.rms / f.true_rms for f in acting])),
        proportion_of(map(is_rms_right, answers)),
        float(np.exp(np.mean(np.log(ratios)))) if ratios else None,
        Proportion(sum(1.0 / MAX_TIME_RATIO <= r <= MAX_TIME_RATIO for r in ratios), len(times)),
        proportion_of(a.places == (place,) for a in answers),
        coverage(answers),
    )


def leading_force_time(answer: Answer) -> float | None:
    """Correlation time [s] found for the force on the row that truly has the largest; None where none was found."""
    leading = max(answer.forces.values(), key=lambda f: f.true_rms)
    return leading.correlation_time if leading.rms > 0.0 else None


def is_rms_right(answer: Answer) -> bool:
    """True where every row has a force of the right size, and none where there is none."""
    return all(
        abs(f.rms / f.true_rms - 1.0) <= MAX_RMS_DEVIATION if f.true_rms > 0.0 else f.rms == 0.0
        for f in answer.forces.values()
    )


def lawful_summaries(answers: Sequence[Answer]) -> list[LawfulSummary]:
    """A summary of every lawful effect."""
    mine = [a for a in usable(answers, "lawful") if a.size]
    effects = dict.fromkeys(a.case.effect for a in mine)
    return [lawful_summary(e, [a.size for a in mine if a.case.effect == e and a.size]) for e in effects]


def lawful_summary(effect: str, found: Sequence[Found]) -> LawfulSummary:
    """Estimates of an effect's size over several logs."""
    ratios, deviations = np.array([f.value / f.truth for f in found]), np.array([f.deviation for f in found])
    several = len(found) > 1
    return LawfulSummary(
        effect,
        found[0].truth,
        float(ratios.mean()),
        float(ratios.std(ddof=1) / np.sqrt(len(found))) if several else float("nan"),
        float(deviations.mean()),
        float(deviations.std(ddof=1)) if several else float("nan"),
        proportion_of(map(is_inside, found)),
        len(found),
    )
