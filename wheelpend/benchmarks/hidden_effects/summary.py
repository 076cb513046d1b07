"""Rates over the outcomes, each with its 95 % confidence interval (Clopper and Pearson)."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from wheelpend.benchmarks.hidden_effects.trial import Outcome
from wheelpend.proportion import Proportion, proportion_of

CASE_KINDS = ("complete", "single", "pair", "triple", "left_out", "stick_slip")
MIN_COSTLY_ERROR_INCREASE = (
    0.05  # share by which a hidden effect must raise the error to count as one that should be found
)
MAX_TRUE_MODEL_ERROR_RATIO = 1.05  # times the true model's error: as good as the true model
MAX_EXPLAINED_ERROR_RATIO = 1.1  # times the floor: above it something is still missing
SIZE_BIN_EDGES = (0.0, 3.0, 10.0, 30.0, 100.0, 300.0, 1000.0, np.inf)  # of the hidden size, in standard deviations


@dataclass(frozen=True)
class Summary:
    """What the benchmark shows."""

    cases: int
    failures: tuple[str, ...]
    false_alarms: Proportion  # of logs in which nothing was hidden
    singles: dict[
        str, Proportion
    ]  # first answer right or declared equivalent, where the effect costs enough; by source
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
    """Rates over all outcomes."""
    good = [o for o in outcomes if o.failure is None]
    kinds = {k: [o for o in good if o.kind == k] for k in CASE_KINDS}
    single = [o for o in kinds["single"] if not o.soft]
    costly = [o for o in single if o.cost >= MIN_COSTLY_ERROR_INCREASE]
    right = [o for o in costly if o.first_right]
    ratios = [o.error / o.true_error for o in costly if o.true_error]
    effects = sorted({o.hidden[0] for o in costly})
    deviations = [abs(d) for o in good if not o.soft for d in o.deviations]
    out = [o for o in kinds["left_out"] if o.cost >= MIN_COSTLY_ERROR_INCREASE and not o.soft]
    return Summary(
        cases=len(outcomes),
        failures=tuple(f"{o.key}: {o.failure}" for o in outcomes if o.failure),
        false_alarms=proportion_of(o.verdict != "nothing_missing" for o in kinds["complete"]),
        singles={
            s: proportion_of(o.first_right for o in costly if o.source == s) for s in sorted({o.source for o in costly})
        },
        soft=proportion_of(o.first_right for o in kinds["single"] if o.soft and o.cost >= MIN_COSTLY_ERROR_INCREASE),
        equivalents=float(np.mean([len(o.equivalents[0]) for o in right])) if right else float("nan"),
        by_effect={e: proportion_of(o.first_right for o in costly if o.hidden[0] == e) for e in effects},
        by_size=tuple(
            (low, high, proportion_of(o.first_right for o in single if low <= o.strength < high))
            for low, high in pairwise(SIZE_BIN_EDGES)
        ),
        pairs=proportion_of(set(o.found) == set(o.hidden) for o in kinds["pair"] if is_every_effect_costly(o)),
        triples=proportion_of(set(o.found) == set(o.hidden) for o in kinds["triple"] if is_every_effect_costly(o)),
        faint=proportion_of(set(o.found) == set(o.hidden) for o in kinds["pair"] if not is_every_effect_costly(o)),
        left_out=proportion_of(is_explained_or_declared_open(o) for o in out),
        overconfident=sum(is_overconfident(o) for o in out),
        near_truth=proportion_of(r <= MAX_TRUE_MODEL_ERROR_RATIO for r in ratios),
        worst=max(ratios, default=float("nan")),
        coverage=proportion_of(d < 1.96 for d in deviations),
        confusion=confusion(costly),
        stick_slip=proportion_of(o.first_right for o in kinds["stick_slip"] if o.cost >= MIN_COSTLY_ERROR_INCREASE),
        sticking=max((o.true_error for o in kinds["stick_slip"] if o.true_error), default=float("nan")),
        spread=spread(kinds["complete"]),
        estimated=sum(bool(o.estimates) for o in kinds["complete"]),
        redrawn=tuple(f"{o.key}: {o.made}" for o in good if o.made),
    )


def is_every_effect_costly(outcome: Outcome) -> bool:
    """Whether each of several hidden effects raises the error enough where the others are in the model."""
    return min(outcome.costs, default=0.0) >= MIN_COSTLY_ERROR_INCREASE


def spread(outcomes: Sequence[Outcome]) -> dict[str, float]:
    """Root mean square of each parameter's errors in standard errors: 1 where these say how far estimates are off."""
    errors: dict[str, list[float]] = {}
    for name, error in (entry for o in outcomes for entry in o.estimates):
        errors.setdefault(name, []).append(error)
    return {name: float(np.sqrt(np.mean(np.square(found)))) for name, found in errors.items()}


def is_explained_or_declared_open(outcome: Outcome) -> bool:
    """Whether an explanation without the guilty effect says unexplained, or reaches the floor with a stand-in."""
    return outcome.final == "unexplained" or outcome.error <= MAX_EXPLAINED_ERROR_RATIO * outcome.floor


def is_overconfident(outcome: Outcome) -> bool:
    """Whether something was named and called complete though the error stays above 1.1 times the floor."""
    return bool(outcome.named) and not is_explained_or_declared_open(outcome)


def confusion(outcomes: Sequence[Outcome]) -> dict[str, Counter]:
    """First answers per hidden effect."""
    table: dict[str, Counter] = {}
    for o in outcomes:
        answer = o.named[0] if o.named else o.verdict
        table.setdefault(o.hidden[0], Counter())[answer] += 1
    return dict(sorted(table.items()))
