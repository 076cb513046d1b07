"""Two effects that hide each other: neither alone is worth a step, both together are.

Where no effect is worth a step alone, the pairs whose joint score promises most are refitted; and behind the likeliest
refits with one, those with the effects that lead the scores there: a wrong model's score may promise nothing of a pair.
A pair counts only where each of the two is worth naming beside the other, and both over the model without them.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace
from itertools import combinations, islice, permutations
from typing import NamedTuple

from wheelpend.diagnosis.evidence import ValidatedFit
from wheelpend.diagnosis.likelihood.filtered_model import FilteredModel
from wheelpend.diagnosis.likelihood.judgement import Judged, JudgedModel, judge
from wheelpend.diagnosis.likelihood.meaning import without_meaning
from wheelpend.diagnosis.likelihood.refits import with_both, without_effect
from wheelpend.diagnosis.likelihood.relief import leading_refits
from wheelpend.diagnosis.likelihood.whitened_scores import (
    MIN_GAIN_PER_COEFFICIENT,
    LinearScores,
    linear_effects,
    linear_scores,
)
from wheelpend.diagnosis.refit import Progress
from wheelpend.diagnosis.score_test import EffectSize, linear_names
from wheelpend.estimation.problem import simpler_effects

MAX_FIRSTS, MAX_PAIRS = 3, 5  # likeliest refits with one effect behind which a second is looked for; likeliest of both
OF_THE_STEP = ("error_after", "fit", "blocks_agree", "held_out_gain", "in_sample_gain", "evidence")  # not of the pair


class ScoredPair(NamedTuple):
    """Two effects with the sizes from which a refit with both starts."""

    sizes: dict[str, EffectSize]  # by effect
    gain: float  # expected fall of −2 log-likelihood, in units of their mean square, less what coefficients must bring


class RefittedPair(NamedTuple):
    """A model refitted with two effects more."""

    effects: tuple[str, str]
    model: FilteredModel


class FoundPair(NamedTuple):
    """Two effects of which each is worth naming beside the other."""

    base: JudgedModel  # without either
    first: Judged  # over that model, with the size and the significance that it has beside the second
    with_first: JudgedModel
    second: Judged  # over the model with the first


def leading_pairs(model: FilteredModel) -> list[ScoredPair]:
    """The pair that promises most behind each of the filters, and more than either of the two does."""
    leading = [
        max(_promising_pairs(model, scores), key=lambda p: p.gain, default=None) for scores in linear_scores(model)
    ]
    return list({tuple(pair.sizes): pair for pair in leading if pair is not None}.values())


def _promising_pairs(model: FilteredModel, scores: LinearScores) -> Iterator[ScoredPair]:
    """The pairs whose joint score is clearly more than that of the better of the two."""
    alone = {effect: scores.together([effect])[0] for effect in linear_effects(model)}
    for pair in combinations(alone, 2):
        names = [e.name for e in pair]
        if any(e in simpler_effects(model.problem.module, other) for e, other in permutations(names)):
            continue  # one would be there twice
        gain, sizes = scores.together(pair)
        worth = {e: MIN_GAIN_PER_COEFFICIENT * len(scores.rest.layout.indices(linear_names(e))) for e in pair}
        better, other = sorted(pair, key=lambda e: -alone[e])
        if gain - alone[better] > worth[other]:
            yield ScoredPair(dict(zip(names, sizes, strict=True)), gain - sum(worth.values()))


def refitted_pairs(
    base: JudgedModel, refits: Mapping[str, FilteredModel], progress: Progress
) -> Iterator[RefittedPair]:
    """The model with the pairs that its scores promise, then with those behind its likeliest refits with one effect.

    The latter are few, and lower the error over the horizon: behind a refit that went astray two effects may take over
    what chance did, and no more.
    """
    for scored in leading_pairs(base.model):
        first, second = scored.sizes
        progress(f"refitting with {first} and {second} together")
        if both := with_both(base.model, scored.sizes):
            yield RefittedPair((first, second), both)
    behind = [pair for e in _telling_firsts(base.model, refits) for pair in _with_a_second(e, refits[e], progress)]
    likeliest: dict[frozenset[str], RefittedPair] = {}  # of two with the same effects, either of which was the first
    for pair in sorted(behind, key=lambda pair: pair.model.deviance):
        likeliest.setdefault(frozenset(pair.effects), pair)
    for pair in islice(likeliest.values(), MAX_PAIRS):
        if ValidatedFit.of(pair.model.problem, pair.model.fitted()).error < base.validated.error:
            yield pair


def _telling_firsts(model: FilteredModel, refits: Mapping[str, FilteredModel]) -> list[str]:
    """The effects with which data are likeliest, and clearly likelier than without, at a size that they may have."""
    worth = {e: MIN_GAIN_PER_COEFFICIENT * len(model.problem.effect(e).parameters) for e in refits}
    telling = [
        e
        for e, m in refits.items()
        if model.deviance - m.deviance > worth[e] and not model.problem.replaced(e) and not without_meaning(m)
    ]
    return sorted(telling, key=lambda e: refits[e].deviance)[:MAX_FIRSTS]


def _with_a_second(first: str, refit: FilteredModel, progress: Progress) -> Iterator[RefittedPair]:
    """A refit with one effect, refitted with each of those that lead behind it and take the place of none."""
    for second, both in leading_refits(refit, lambda text: progress(f"{text}, beside {first}")).items():
        if both.deviance < refit.deviance and not refit.problem.replaced(second):
            yield RefittedPair((first, second), both)


def supported_pair(base: JudgedModel, pairs: Iterable[RefittedPair], tests: int) -> FoundPair | None:
    """The likeliest pair that is supported, as one of so many tests; None where none is."""
    likeliest_first = sorted(pairs, key=lambda pair: pair.model.deviance)
    return next(filter(None, (_judged_pair(base, pair, tests) for pair in likeliest_first)), None)


def _judged_pair(base: JudgedModel, pair: RefittedPair, tests: int) -> FoundPair | None:
    """Two effects if each is supported over the model with the other, and over the model without either.

    The one with which held-out data are predicted better alone comes first.
    """
    names, both, alone = pair.effects, pair.model, {}
    for effect, other in permutations(names):
        single = without_effect(both, other)
        if single is None:
            return None
        alone[effect] = JudgedModel.of(single)
    first, second = sorted(names, key=lambda e: alone[e].validated.error)
    comparisons = [(alone[second], first), (alone[first], second), (base, first), (base, second)]
    judged = [judge(without, both, effect, tests) for without, effect in comparisons]
    if not all(j.is_supported(w.validated.error) for j, (w, _) in zip(judged, comparisons, strict=True)):
        return None
    step = judge(base, alone[first].model, first, tests)
    own = {n: getattr(step.candidate, n) for n in OF_THE_STEP}
    told = step._replace(candidate=replace(judged[0].candidate, **own))
    return FoundPair(base, told, alone[first], judged[1])
