"""Reliability of the probabilities, and their score beside that of always saying the base rates."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from wheelpend.benchmarks.probabilities.cases import CASE_KINDS, EFFECT_COUNT, KIND_SHARES
from wheelpend.benchmarks.probabilities.trial import Outcome
from wheelpend.proportion import Proportion, proportion_of

BIN_EDGES = (0.0, 0.02, 0.05, 0.2, 0.4, 0.6, 0.8, 0.95, 1.0)
MIDDLE_RANGE = (0.2, 0.8)  # answers between these are neither a yes nor a no
LEAST_PROBABILITY = 1e-4  # that a score counts of what was not listed


class Answer(NamedTuple):
    """A structure's probability, and whether it was the true one."""

    probability: float
    right: bool


class Bin(NamedTuple):
    """Answers of like probability."""

    mean: float  # of the probabilities
    right: Proportion

    @property
    def is_reliable(self) -> bool:
        """True where the mean probability lies in the interval of the share that was right."""
        low, high = self.right.interval
        return low <= self.mean <= high


class Score(NamedTuple):
    """Mean logarithm of the probability of the truth [nats], beside that of always saying the base rates."""

    found: float
    base_rate: float
    logs: int


def answers_of(outcomes: Sequence[Outcome]) -> list[Answer]:
    """Every listed structure of every log that was diagnosed."""
    return [
        Answer(p, tuple(sorted(effects)) == o.truth) for o in outcomes if not o.failure for effects, p in o.structures
    ]


def reliability(outcomes: Sequence[Outcome]) -> list[Bin]:
    """Answers in bins of probability, empty ones left out."""
    answers, bins = answers_of(outcomes), []
    for low, high in itertools.pairwise(BIN_EDGES):
        within = [a for a in answers if low < a.probability <= high]
        if within:
            bins.append(Bin(float(np.mean([a.probability for a in within])), proportion_of(a.right for a in within)))
    return bins


def middle_count(outcomes: Sequence[Outcome]) -> int:
    """Number of answers that are neither a yes nor a no."""
    return sum(MIDDLE_RANGE[0] < a.probability < MIDDLE_RANGE[1] for a in answers_of(outcomes))


def score(outcomes: Sequence[Outcome], of: str) -> Score | None:
    """The score of a set's outcomes; None without any."""
    used = [o for o in outcomes if not o.failure]
    if not used:
        return None
    return Score(
        float(np.mean([math.log(_probability_of_truth(o)) for o in used])),
        float(np.mean([math.log(_base_rate(o, of)) for o in used])),
        len(used),
    )


def _probability_of_truth(outcome: Outcome) -> float:
    told = {tuple(sorted(effects)): p for effects, p in outcome.structures}
    return max(told.get(outcome.truth, 0.0), LEAST_PROBABILITY)


def _base_rate(outcome: Outcome, of: str) -> float:
    """Share of the true kind in the set, over the structures of that kind."""
    share = KIND_SHARES[of][CASE_KINDS.index(outcome.kind)]
    count = EFFECT_COUNT[outcome.kind] if outcome.kind != "left_out" else 0
    return share / math.comb(max(outcome.library, 1), count)
