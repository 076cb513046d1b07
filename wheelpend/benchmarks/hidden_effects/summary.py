"""Rates over the outcomes, each with its 95 % confidence interval (Clopper and Pearson)."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from wheelpend.benchmarks.hidden_effects.trial import Outcome
from wheelpend.proportion import Proportion, proportion_of

CASE_KINDS = ("complete", "single", "pair", "triple", "left_out", "stick_slip")
MIN_COSTLY_ERROR_INCREASE = 0.05  # share by which a hidden effect must raise the error to be one that should be found
MAX_TRUE_MODEL_ERROR_RATIO = 1.05  # times the true model's error: as good as the true model
MAX_EXPLAINED_ERROR_RATIO = 1.1  # times the floor: above it something is still missing
NORMAL_QUANTILE_95 = 1.96  # standard deviations, of a 95 % interval
SIZE_BIN_EDGES = (0.0, 3.0, 10.0, 30.0, 100.0, 300.0, 1000.0, np.inf)  # of the hidden size, in standard deviations


@dataclass(frozen=True)
class Summary:
    """Counts and rates over the outcomes of all cases, Proportions with their number of logs."""

    cases: int
    failures: tuple[str, ...]
    false_alarms: Proportion  # of logs in which nothing was hidden
    singles: dict[str, Proportion]  # by source: first answer right or declared equivalent, where the effect is costly
    soft: Proportion  # the same where the dry friction engages slowly, as no law of the library does
    equivalents: float  # mean number declared with a first answer
    by_effect: dict[str, Proportion]
    by_size: tuple[tuple[float, float, Proportion], ...]  # hidden size in standard deviations, from, to
    pairs: Proportion  # both effects found, where each costs enough beside the other
    triples: Proportion
    faint: Proportion  # pairs in which one of the two does not cost enough beside the other: both found
    left_out: Proportion  # unexplained, or an answer that reaches the floor
    overconfident: int  # left out, and a name given whose error stays above 1.1 times the floor
    near_truth: Proportion  # error at the end at most 1.05 times that of the true model
    worst: float  # largest of these ratios
    coverage: Proportion  # true values inside the 95 % interval
    confusion: dict[str, Counter]  # hidden: first answer
    stick_slip: Proportion  # dry friction that truly sticks: first answer right
    sticking: float  # largest error of the true model there: 1 where its law of sticking is right
    spread: dict[str, float]  # of each parameter: root mean square error of the estimates in standard errors
    estimated: int  # logs behind it
    redrawn: tuple[str, ...]  # logs made with smaller effects than planned


def summarise(outcomes: Sequence[Outcome]) -> Summary:
    """Rates over all outcomes; single effects and those left out count where they cost enough to be found."""
    usable = [o for o in outcomes if o.failure is None]
    kinds = {k: [o for o in usable if o.kind == k] for k in CASE_KINDS}
    sharp = [o for o in kinds["single"] if not o.soft]
    costly = [o for o in sharp if is_costly(o)]
    left_out = [o for o in kinds["left_out"] if is_costly(o) and not o.soft]
    error_ratios = [o.error / o.true_error for o in costly if o.true_error]
    return Summary(
        cases=len(outcomes),
        failures=tuple(f"{o.key}: {o.failure}" for o in outcomes if o.failure),
        false_alarms=proportion_of(o.verdict != "nothing_missing" for o in kinds["complete"]),
        singles={s: first_answer_rate(o for o in costly if o.source == s) for s in sorted({o.source for o in costly})},
        soft=first_answer_rate(o for o in kinds["single"] if o.soft and is_costly(o)),
        equivalents=mean_equivalents(costly),
        by_effect={
            e: first_answer_rate(o for o in costly if o.hidden[0] == e) for e in sorted({o.hidden[0] for o in costly})
        },
        by_size=rates_by_size(sharp),
        pairs=complete_answer_rate(o for o in kinds["pair"] if is_every_effect_costly(o)),
        triples=complete_answer_rate(o for o in kinds["triple"] if is_every_effect_costly(o)),
        faint=complete_answer_rate(o for o in kinds["pair"] if not is_every_effect_costly(o)),
        left_out=proportion_of(is_explained_or_declared_open(o) for o in left_out),
        overconfident=sum(is_overconfident(o) for o in left_out),
        near_truth=proportion_of(ratio <= MAX_TRUE_MODEL_ERROR_RATIO for ratio in error_ratios),
        worst=max(error_ratios, default=float("nan")),
        coverage=proportion_of(abs(d) < NORMAL_QUANTILE_95 for o in usable if not o.soft for d in o.deviations),
        confusion=confusion(costly),
        stick_slip=first_answer_rate(o for o in kinds["stick_slip"] if is_costly(o)),
        sticking=max((o.true_error for o in kinds["stick_slip"] if o.true_error), default=float("nan")),
        spread=spread(kinds["complete"]),
        estimated=sum(bool(o.estimates) for o in kinds["complete"]),
        redrawn=tuple(f"{o.key}: {o.made}" for o in usable if o.made),
    )


def is_costly(outcome: Outcome) -> bool:
    """True if leaving the hidden effects out raises the held-out error enough that they should be found."""
    return outcome.cost >= MIN_COSTLY_ERROR_INCREASE


def is_every_effect_costly(outcome: Outcome) -> bool:
    """True if each of several hidden effects raises the error enough where the others are in the model."""
    return min(outcome.costs, default=0.0) >= MIN_COSTLY_ERROR_INCREASE


def first_answer_rate(outcomes: Iterable[Outcome]) -> Proportion:
    """Share of outcomes whose first answer is a hidden effect or declares one equivalent."""
    return proportion_of(o.first_right for o in outcomes)


def complete_answer_rate(outcomes: Iterable[Outcome]) -> Proportion:
    """Share of outcomes in which every hidden effect is found."""
    return proportion_of(set(o.found) == set(o.hidden) for o in outcomes)


def rates_by_size(outcomes: Sequence[Outcome]) -> tuple[tuple[float, float, Proportion], ...]:
    """Rate of right first answers in every bin of SIZE_BIN_EDGES: lower and upper edge, rate."""
    return tuple(
        (low, high, first_answer_rate(o for o in outcomes if low <= o.strength < high))
        for low, high in pairwise(SIZE_BIN_EDGES)
    )


def mean_equivalents(outcomes: Sequence[Outcome]) -> float:
    """Mean number of effects declared equivalent to a right first answer; NaN without one."""
    right = [o for o in outcomes if o.first_right]
    return float(np.mean([len(o.equivalents[0]) for o in right])) if right else float("nan")


def spread(outcomes: Sequence[Outcome]) -> dict[str, float]:
    """Root mean square of each parameter's errors in standard errors: 1 where the standard errors are right."""
    errors: dict[str, list[float]] = {}
    for name, error in (entry for o in outcomes for entry in o.estimates):
        errors.setdefault(name, []).append(error)
    return {name: float(np.sqrt(np.mean(np.square(found)))) for name, found in errors.items()}


def is_explained_or_declared_open(outcome: Outcome) -> bool:
    """True if an explanation without the guilty effect says unexplained, or reaches the floor with a stand-in."""
    return outcome.final == "unexplained" or outcome.error <= MAX_EXPLAINED_ERROR_RATIO * outcome.floor


def is_overconfident(outcome: Outcome) -> bool:
    """True if an effect was named and called complete though the error stays above 1.1 times the floor."""
    return bool(outcome.named) and not is_explained_or_declared_open(outcome)


def confusion(outcomes: Sequence[Outcome]) -> dict[str, Counter]:
    """Counts of first answers, or of verdicts where no effect is named, per hidden effect."""
    table: dict[str, Counter] = {}
    for o in outcomes:
        answer = o.named[0] if o.named else o.verdict
        table.setdefault(o.hidden[0], Counter())[answer] += 1
    return dict(sorted(table.items()))
