"""Rates over the outcomes, each with its 95 % confidence interval (Clopper and Pearson)."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from wheelpend.benchmarks.hidden_effects.trial import Outcome
from wheelpend.proportion import Rate, rate

KINDS = ("complete", "single", "pair", "triple", "left_out", "stick_slip")
COSTLY = 0.05  # share by which a hidden effect must raise the error to count as one that should be found
NEAR = 1.05  # times the true model's error: as good as the true model
EXPLAINS = 1.1  # times the floor: above it something is still missing
BINS = (0.0, 3.0, 10.0, 30.0, 100.0, 300.0, 1000.0, np.inf)  # of the hidden size, in standard deviations


@dataclass(frozen=True)
class Summary:
    """What the benchmark shows."""

    cases: int
    failures: tuple[str, ...]
    false_alarms: Rate  # of logs in which nothing was hidden
    singles: dict[str, Rate]  # first answer right or declared equivalent, where the effect costs enough; by source
    soft: Rate  # the same where the dry friction engages slowly, as no law of the library does
    equivalents: float  # mean number declared with a first answer
    by_effect: dict[str, Rate]
    by_size: tuple[tuple[float, float, Rate], ...]  # hidden size in standard deviations, from, to
    pairs: Rate  # both effects found, where each costs enough beside the other
    triples: Rate
    faint: Rate  # pairs in which one of the two does not cost enough beside the other: both found
    left_out: Rate  # unexplained, or an answer that reaches the floor
    overconfident: int  # left out, and a name given whose error stays above 1.1 times the floor
    near_truth: Rate  # error at the end at most 1.05 times that of the true model
    worst: float  # largest of these ratios
    coverage: Rate  # true values inside the 95 % interval
    confusion: dict[str, Counter]  # hidden: first answer
    stick_slip: Rate  # dry friction that truly sticks: first answer right
    sticking: float  # largest error of the true model there: 1 where its law of sticking is right
    spread: dict[str, float]  # of each parameter: root mean square error of the estimates in standard errors
    estimated: int  # logs behind it
    redrawn: tuple[str, ...]  # logs made with smaller effects than planned


def summarise(outcomes: Sequence[Outcome]) -> Summary:
    """Rates over all outcomes."""
    good = [o for o in outcomes if o.failure is None]
    kinds = {k: [o for o in good if o.kind == k] for k in KINDS}
    single = [o for o in kinds["single"] if not o.soft]
    costly = [o for o in single if o.cost >= COSTLY]
    right = [o for o in costly if o.first_right]
    ratios = [o.error / o.true_error for o in costly if o.true_error]
    effects = sorted({o.hidden[0] for o in costly})
    deviations = [abs(d) for o in good if not o.soft for d in o.deviations]
    out = [o for o in kinds["left_out"] if o.cost >= COSTLY and not o.soft]
    return Summary(
        cases=len(outcomes),
        failures=tuple(f"{o.key}: {o.failure}" for o in outcomes if o.failure),
        false_alarms=rate(o.verdict != "nothing_missing" for o in kinds["complete"]),
        singles={s: rate(o.first_right for o in costly if o.source == s) for s in sorted({o.source for o in costly})},
        soft=rate(o.first_right for o in kinds["single"] if o.soft and o.cost >= COSTLY),
        equivalents=float(np.mean([len(o.equivalents[0]) for o in right])) if right else float("nan"),
        by_effect={e: rate(o.first_right for o in costly if o.hidden[0] == e) for e in effects},
        by_size=tuple(
            (low, high, rate(o.first_right for o in single if low <= o.strength < high)) for low, high in pairwise(BINS)
        ),
        pairs=rate(set(o.found) == set(o.hidden) for o in kinds["pair"] if all_costly(o)),
        triples=rate(set(o.found) == set(o.hidden) for o in kinds["triple"] if all_costly(o)),
        faint=rate(set(o.found) == set(o.hidden) for o in kinds["pair"] if not all_costly(o)),
        left_out=rate(explained_or_open(o) for o in out),
        overconfident=sum(overconfident(o) for o in out),
        near_truth=rate(r <= NEAR for r in ratios),
        worst=max(ratios, default=float("nan")),
        coverage=rate(d < 1.96 for d in deviations),
        confusion=confusion(costly),
        stick_slip=rate(o.first_right for o in kinds["stick_slip"] if o.cost >= COSTLY),
        sticking=max((o.true_error for o in kinds["stick_slip"] if o.true_error), default=float("nan")),
        spread=spread(kinds["complete"]),
        estimated=sum(bool(o.estimates) for o in kinds["complete"]),
        redrawn=tuple(f"{o.key}: {o.made}" for o in good if o.made),
    )


def all_costly(outcome: Outcome) -> bool:
    """Whether each of several hidden effects raises the error enough where the others are in the model."""
    return min(outcome.costs, default=0.0) >= COSTLY


def spread(outcomes: Sequence[Outcome]) -> dict[str, float]:
    """Root mean square of each parameter's errors in standard errors: 1 where these say how far estimates are off."""
    errors: dict[str, list[float]] = {}
    for name, error in (entry for o in outcomes for entry in o.estimates):
        errors.setdefault(name, []).append(error)
    return {name: float(np.sqrt(np.mean(np.square(found)))) for name, found in errors.items()}


def explained_or_open(outcome: Outcome) -> bool:
    """Whether an explanation without the guilty effect says unexplained, or reaches the floor with a stand-in."""
    return outcome.final == "unexplained" or outcome.error <= EXPLAINS * outcome.floor


def overconfident(outcome: Outcome) -> bool:
    """Whether something was named and called complete though the error stays above 1.1 times the floor."""
    return bool(outcome.named) and not explained_or_open(outcome)


def confusion(outcomes: Sequence[Outcome]) -> dict[str, Counter]:
    """First answers per hidden effect."""
    table: dict[str, Counter] = {}
    for o in outcomes:
        answer = o.named[0] if o.named else o.verdict
        table.setdefault(o.hidden[0], Counter())[answer] += 1
    return dict(sorted(table.items()))
