"""Probabilities of what is missing: nothing, an effect, several together, or none of these.

A structure's weight is its prior times the exponential of its evidence: the log-likelihood of the estimation logs less
what the freedom is worth by chance (Schwarz's approximation of a marginal likelihood), and that of held-out data given
the estimation logs, together that of all data. A noise model is never exact, so the evidence is drawn anew from its
blocks, and the weights averaged over the draws: a lead that a few moments decide is no certainty. That approximation
is of sizes that the logs show. An effect may also be too small for them: then they say nothing about it, and beside
every structure each further effect keeps that share of its prior.
Source: Yao, Vehtari, Simpson and Gelman, Using stacking to average Bayesian predictive distributions, Bayesian Analysis
13 (2018) 917, section 3.4 (weights with the Bayesian bootstrap); Sellke, Bayarri and Berger, Calibration of p values
for testing precise null hypotheses, The American Statistician 55 (2001) 62 (p-values of what is there as a Beta(ξ, 1)).
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Collection, Mapping, Sequence
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np

NONE_OF_THESE = "none_of_these"  # something is missing that neither an effect nor several of those tried account for
PRIOR_OF_COUNT = (0.25, 0.35, 0.1, 0.04, 0.01)  # that so many effects of the library are missing, each set alike
PRIOR_OF_NONE_OF_THESE = 0.25
PART_SHARE = 0.5  # of the effects that explain a part of something unknown: parts of it, not what resembles it
MAX_PROBABILITY_OF_NONE = 0.999  # what was tried stays possible
UNSEEN_SHARE = 0.5  # of what may be missing: too small to be seen, or passed off by an effect that resembles it
P_VALUE_EXPONENT = 0.1  # ξ: half of the p-values of the rest lie below 1e-3, a tenth above 0.35
DRAW_COUNT = 2000  # of the evidence from its blocks
MAX_EVIDENCE = 1e9  # nats of a block: what diverges is as good as impossible
MIN_LISTED_PROBABILITY = 1e-4
MIN_NOTHING_PROBABILITY = 0.1  # with which nothing may be missing, where nothing is certain to be


class Structure(NamedTuple):
    """Effects that may be missing together, and how probably just these are."""

    effects: tuple[str, ...]  # none: nothing is missing; ("none_of_these",): something that is not in the library
    probability: float
    unseen: float = 0.0  # of this probability, that with one of them too small for these logs to show

    def to_json(self) -> dict[str, Any]:
        """The structure under the keys of JSON."""
        return {"effects": self.effects, "probability": self.probability, "unseen": self.unseen}


class RoundEvidence(NamedTuple):
    """What one round of a search found."""

    tried: Mapping[str, np.ndarray]  # evidence for each possible effect over the round's model, in blocks [nats]
    added: str  # the effect that the next round has, or ''
    replaces: Mapping[str, tuple[str, ...]] = MappingProxyType({})  # effects of the model, by what replaces them


def structures(rounds: Sequence[RoundEvidence], library: Collection[str], p_rest: float) -> tuple[Structure, ...]:
    """Probabilities of every structure that a search among a library's effects met, the likeliest first.

    Each is also there with one effect more, which is too small to be seen. ``p_rest`` is the p-value of nothing more
    being there behind its last model.
    """
    evidence = _evidence(rounds)
    names, blocks = list(evidence), np.stack(list(evidence.values()))
    prior = np.log([prior_of(len(n), len(library)) * (1.0 - UNSEEN_SHARE) ** len(n) for n in names])
    draws = np.random.default_rng(0).dirichlet(np.ones(blocks.shape[1]), DRAW_COUNT) * blocks.shape[1]
    exponents = prior + draws @ blocks.T  # (draws, structures)
    weights = np.exp(exponents - exponents.max(axis=1, keepdims=True))
    found = (weights / weights.sum(axis=1, keepdims=True)).mean(axis=0)
    seen = dict(zip(names, found.tolist(), strict=True))
    unseen = _with_one_unseen(seen, library)
    other = probability_of_none(p_rest)
    scale = (1.0 - other) / (sum(seen.values()) + sum(unseen.values()))
    told = [
        Structure(n, scale * (seen.get(n, 0.0) + unseen[n]), scale * unseen[n])
        for n in sorted({*seen, *unseen}, key=len)
    ]
    told = sorted([*told, Structure((NONE_OF_THESE,), other)], key=lambda s: -s.probability)
    return tuple(s for s in told if s.probability > MIN_LISTED_PROBABILITY)


def prior_of(count: int, library: int) -> float:
    """Prior probability of one set of so many effects out of a library of so many."""
    return PRIOR_OF_COUNT[min(count, len(PRIOR_OF_COUNT) - 1)] / math.comb(library, count)


def _with_one_unseen(seen: Mapping[tuple[str, ...], float], library: Collection[str]) -> Counter[tuple[str, ...]]:
    """Weights of all structures with one effect of a library more than what was seen, which the logs do not show."""
    found: Counter[tuple[str, ...]] = Counter()
    for effects, weight in seen.items():
        rest = sorted({*library}.difference(effects))
        share = (
            UNSEEN_SHARE * prior_of(len(effects) + 1, len(library)) / prior_of(len(effects), len(library))
            if rest
            else 0.0
        )
        found.update({tuple(sorted((*effects, e))): share * weight for e in rest})
    return found


def _evidence(rounds: Sequence[RoundEvidence]) -> dict[tuple[str, ...], np.ndarray]:
    """Evidence of every structure over the model as it is, in blocks (blocks,) [nats], by its effects."""
    length = next((len(blocks) for r in rounds for blocks in r.tried.values()), 1)
    present: tuple[str, ...] = ()
    reached = np.zeros(length)
    found = {present: reached}
    for one in rounds:
        own = {effect: _of_length(blocks, length) for effect, blocks in one.tried.items()}
        larger = {e: tuple(sorted({*present}.difference(one.replaces.get(e, ())) | {e})) for e in own}
        for effect, blocks in own.items():
            known = found.get(larger[effect])
            if known is None or (reached + blocks).sum() > known.sum():  # from another round it may have gone further
                found[larger[effect]] = reached + blocks
        if one.added in own:
            reached, present = reached + own[one.added], larger[one.added]
    return found


def _of_length(blocks: np.ndarray, length: int) -> np.ndarray:
    """Evidence in so many blocks; in equal ones where it came in another number."""
    kept = np.clip(np.nan_to_num(blocks, nan=-np.inf), -MAX_EVIDENCE, MAX_EVIDENCE)
    return kept if len(kept) == length else np.full(length, kept.sum() / length)


def probability_of_none(p_value: float) -> float:
    """Probability that something is missing which no tried structure accounts for, by the p-value of what remains."""
    seen = P_VALUE_EXPONENT * max(p_value, 1e-300) ** (P_VALUE_EXPONENT - 1.0)
    ratio = UNSEEN_SHARE + (1.0 - UNSEEN_SHARE) * seen
    odds = PRIOR_OF_NONE_OF_THESE / sum(PRIOR_OF_COUNT) * ratio
    return min(odds / (1.0 + odds), MAX_PROBABILITY_OF_NONE)


def probability_of_nothing_seen(
    known: Sequence[Structure],
    named: Collection[str] = (),
    replaces: Mapping[str, Collection[str]] = MappingProxyType({}),
) -> float:
    """Probability that no more is missing than was named, or one effect more that is too small for these logs to show.

    As many effects in other places are no more. A wider law is more than the named one whose place it takes.
    """
    within = [(s, _further(s, named, replaces)) for s in known if s.effects != (NONE_OF_THESE,)]
    return sum(s.probability if more <= 0 else s.unseen for s, more in within if more <= 1)


def _further(known: Structure, named: Collection[str], replaces: Mapping[str, Collection[str]]) -> int:
    """How many effects a structure has more than were named: a wider law is there beside the one that it replaces."""
    within = {n for e in known.effects for n in replaces.get(e, ())}.intersection(named)
    return len(within.union(known.effects)) - len(named)


def is_nothing_improbable(
    known: Sequence[Structure], added: Collection[str], replaces: Mapping[str, Collection[str]]
) -> bool:
    """True where it is improbable that nothing is missing beside what was added, or nothing that these logs show."""
    tried = {effect for s in known for effect in s.effects}
    return probability_of_nothing_seen(known, tried.intersection(added), replaces) < MIN_NOTHING_PROBABILITY


def probability_outside(known: Sequence[Structure]) -> float:
    """Probability that something is missing which is not in the library."""
    return sum(s.probability for s in known if s.effects == (NONE_OF_THESE,))


def probability_of(effects: Collection[str], known: Sequence[Structure]) -> float:
    """Probability that one of some effects is missing, alone, with others, or beside what is not in the library."""
    other = probability_outside(known)
    tried = sum(s.probability for s in known if s.effects != (NONE_OF_THESE,))  # of those that are listed
    share = sum(s.probability for s in known if not {*effects}.isdisjoint(s.effects)) / tried if tried else 0.0
    return float(share * (1.0 - other + PART_SHARE * other))
