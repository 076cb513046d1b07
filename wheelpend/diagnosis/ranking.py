"""Order of the refitted effects: by validation error, the simpler one first where the errors are alike."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import derive
from wheelpend.diagnosis.block_evidence import is_clear_lead
from wheelpend.diagnosis.criteria import MAX_EQUIVALENT_ERROR_DIFFERENCE, MAX_EVALUATED_COST_RATIO
from wheelpend.diagnosis.evidence import CandidateFit
from wheelpend.estimation.criteria import (
    MAX_EXPLAINED_ERROR_RATIO,
    MAX_NOISE_LEVEL_ERROR_RATIO,
    WRONG_START_ERROR_RATIO,
)
from wheelpend.estimation.fit import Fit
from wheelpend.estimation.problem import EstimationProblem, narrower_effects

MAX_SIMILAR_ERROR_RATIO = 1.1  # times the best error, up to which the simplest effect comes first where all leave much
INTERNAL_EFFECT_ERROR_PENALTY = 1.5  # times its error counts of an internal coordinate that does not reach the noise


def rank_candidates(problem: EstimationProblem, candidates: Iterable[CandidateFit]) -> list[CandidateFit]:
    """Effects by validation error, the best first; one that releases a coordinate and leaves a rest is penalised.

    Where even the best leaves much, its lead over one with fewer parameters says little: more parameters bend further
    to whatever else is missing. Then the simplest of those that are nearly as good comes first; else only one that
    these data do not tell from the best: that it contains or approaches, or that is as likely.
    """

    def rank(one: CandidateFit) -> float:
        partial = one.error_after > MAX_EXPLAINED_ERROR_RATIO * problem.floor
        penalised = partial and derive.effects.find(one.effect).releases
        return one.error_after * (INTERNAL_EFFECT_ERROR_PENALTY if penalised else 1.0)

    ordered = sorted(candidates, key=rank)
    if not ordered:
        return []
    best = next((c for c in ordered if c.physical), ordered[0])  # one of an impossible size is no rival
    far = best.error_after >= WRONG_START_ERROR_RATIO * problem.floor
    similar = MAX_SIMILAR_ERROR_RATIO if far else 1.0 + MAX_EQUIVALENT_ERROR_DIFFERENCE
    in_noise = best.error_after < MAX_NOISE_LEVEL_ERROR_RATIO * problem.floor
    nested = narrower_effects(problem.module, best.effect)

    def is_rival(one: CandidateFit) -> bool:
        alike = far or one.effect in nested or _is_as_likely(one, best, scatters=not in_noise)
        return one.physical and rank(one) < similar * rank(best) and alike

    rivals = [c for c in ordered if is_rival(c)]
    simplest = min(rivals, key=lambda c: (_complexity(c), rank(c)), default=best)
    first = simplest if _complexity(simplest) < _complexity(best) else best
    return [first, *(c for c in ordered if c is not first)]


def _complexity(one: CandidateFit) -> tuple[int, bool]:
    """Parameters of an effect, and whether it is a difference between directions: an offset is the simpler one."""
    return len(one.coefficients), bool(derive.effects.find(one.effect).varies)


def _is_as_likely(one: CandidateFit, best: CandidateFit, *, scatters: bool) -> bool:
    """True of an effect with as much evidence as the best, or not clearly less."""
    if one.evidence is None or best.evidence is None or len(one.evidence) != len(best.evidence):
        return False
    return not is_clear_lead(best.evidence - one.evidence, scatters=scatters)


def nested_effects(problem: EstimationProblem, effect: str) -> list[str]:
    """Simpler effects of the same force as one, as far as the model may be missing them."""
    testable = {e.name for e in problem.candidates()}
    return [s for s in narrower_effects(problem.module, effect) if s in testable]


def with_contained(problem: EstimationProblem, names: Sequence[str]) -> list[str]:
    """The names, and those of the effects that they contain: an effect is judged beside what it contains."""
    testable = {e.name for e in problem.candidates()}
    contained = [s for n in names for s in problem.module.CONTAINS.get(n, {}) if s in testable]
    return list(dict.fromkeys([*names, *contained]))


def is_clearly_better(best: Fit, other: Fit, floor: float) -> bool:
    """The best fit on short segments settles the matter: it reaches the noise and the other does not."""
    return best.error < MAX_EXPLAINED_ERROR_RATIO * floor and other.cost > MAX_EVALUATED_COST_RATIO * best.cost
