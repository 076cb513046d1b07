"""Selection among the candidates of the score tests: which are refitted, how far, and which are validated.

Refits take long, so they go on in steps, and end where they can no longer win.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import repeat

import numpy as np

import derive
from derive.effects import Effect
from wheelpend.diagnosis.criteria import MAX_ADDED_EFFECTS, MIN_RELATIVE_ERROR_DECREASE
from wheelpend.diagnosis.equation_scores import EquationScore, leading_by_equations
from wheelpend.diagnosis.evidence import CandidateFit, Comparisons, ValidatedFit, evaluate_candidate
from wheelpend.diagnosis.ranking import is_clearly_better, nested_effects, rank_candidates, with_contained
from wheelpend.diagnosis.refit import (
    PROBE_ITERATIONS,
    Progress,
    ScoredStart,
    continue_fit,
    fit_from_full_score_test,
    free_names_with,
    multistart_fit,
    significance_fit,
    starts_for,
    with_equation_start,
    with_nested_effect,
)
from wheelpend.diagnosis.score_test import ScoreTest
from wheelpend.errors import Failure
from wheelpend.estimation.continuation import fit_model
from wheelpend.estimation.criteria import MAX_EXPLAINED_ERROR_RATIO, MAX_NOISE_LEVEL_ERROR_RATIO
from wheelpend.estimation.fit import Fit
from wheelpend.estimation.problem import EstimationProblem, with_stable_step
from wheelpend.parallel import KernelPool

MAX_REFITTED_EFFECTS = 5  # best candidates of each score test that are refitted
MIN_GAIN_PER_COEFFICIENT = 10.0  # expected fall of the sum of squares per coefficient, in noise variances, for a refit
MIN_GAIN_SHARE = 0.3  # of the fall that makes an effect worth naming, which the expected one must be in the noise
LEADING_CANDIDATE_COUNT = 2  # candidates whose refit goes on first
MAX_RIVAL_ERROR_RATIO = 1.1  # times their error, up to which the others go on where one of those leaves only noise
MAX_SOLVED_ERROR_RATIO = 1.03  # error over noise floor from which on no internal coordinate is released
MAX_INTERNAL_EFFECT_ERROR_RATIO = 1.5  # times the best error on short segments, up to which a release goes on

PartialRefit = tuple[str, Fit]  # an effect, and how far its refit is


@dataclass(frozen=True)
class ScreenedModel:
    """A model as it is, fitted, validated, and its missing effects scored."""

    problem: EstimationProblem
    base: ValidatedFit
    short_base: Fit  # of short segments
    short_score_tests: list[ScoredStart]
    full_score_test: ScoreTest  # that of full segments, at the fit
    equation_scores: Mapping[str, EquationScore]  # of effects, by name; none where the fit lies in the noise


class CandidateSelection:
    """Refits of the candidates of every score test with each other: on short segments, then the best on full ones.

    An effect that releases an internal coordinate takes long to refit: it is refitted only where no other effect
    leaves only noise, and where it may be the largest of as many effects as would be added to get there.
    """

    def __init__(self, screened: ScreenedModel, progress: Progress) -> None:
        self.screened, self.problem, self.progress = screened, screened.problem, progress
        self.candidates = {c.effect.name: c for c in screened.full_score_test.candidates}
        self.leader = next(iter(self.candidates), "")  # of the score test of full segments

    def run(self) -> list[CandidateFit]:
        """Effects that were judged on validation data, the best first."""
        names = self.select_for_refit()
        slow = [n for n in names if derive.effects.find(n).releases]
        with KernelPool() as pool:
            short_fits = sorted(pool.map(self.short_fit, [n for n in names if n not in slow]), key=_cost)
            refits = self.refine_leading(short_fits, pool)
            selected = self.select_for_evaluation(refits)
            candidates = self.judged(selected, pool) if self.is_search_done([f for _, f in refits]) else []
            if not self.is_search_done([c.fit for c in candidates]):  # what is slow shows on full segments only
                lowest = short_fits[0][1].error if short_fits else np.inf
                internal = self.refine_internal([n for n in slow if self.may_lead(n)], lowest, pool)
                if internal or not candidates:
                    selected = self.select_for_evaluation([*refits, *internal])
                    candidates = self.judged(selected, pool)
        if not candidates:
            return []
        validated = len(selected)
        candidates = self.with_nested_fits(self.with_fresh_leader(candidates, validated), validated)
        return rank_candidates(self.problem, candidates)

    def judged(self, selected: Sequence[PartialRefit], pool: KernelPool) -> list[CandidateFit]:
        """Selected refits on full segments and validation data, without those that cannot be simulated there."""
        return [c for c in pool.map(self.evaluate, selected, repeat(len(selected))) if c is not None]

    def may_lead(self, name: str) -> bool:
        """Expected, by a score test, to take away a leading effect's part of what is above the noise.

        So many effects at most are added that the largest of them has at least that share. What cannot be simulated at
        the size that a score test tries is not judged by it.
        """
        screened = self.screened
        tests = ((screened.base.fit, screened.full_score_test), (screened.short_base, screened.short_score_tests[0][1]))
        for fitted, found in tests:
            excess = max(1.0 - (self.problem.floor / fitted.error) ** 2, 0.0) * fitted.count
            gain = next((c.gain for c in found.candidates if c.effect.name == name), -np.inf)
            if not np.isfinite(gain) or gain >= excess / MAX_ADDED_EFFECTS:
                return True
        return False

    def refine_leading(self, short_fits: Sequence[PartialRefit], pool: KernelPool) -> list[PartialRefit]:
        """Short fits, the best first, taken further: the leading ones, then the others that can still win."""
        refits = [*pool.map(self.refine, short_fits[:LEADING_CANDIDATE_COUNT])]
        others = short_fits[LEADING_CANDIDATE_COUNT:]
        if self.is_search_done([f for _, f in refits]):
            bound = MAX_RIVAL_ERROR_RATIO * min(f.error for _, f in refits)
            others = [p for p, f in zip(others, pool.map(self.probe, others), strict=True) if f.error < bound]
        return [*refits, *pool.map(self.refine, others)]

    def refine_internal(self, names: Sequence[str], lowest: float, pool: KernelPool) -> list[PartialRefit]:
        """Refits with effects that release a coordinate, where they come near the lowest error of the others."""
        short_fits = [*pool.map(self.short_fit, names)]
        bound = MAX_INTERNAL_EFFECT_ERROR_RATIO * lowest
        return [*pool.map(self.refine, [p for p in short_fits if p[1].error < bound or p[0] == self.leader])]

    def select_for_refit(self) -> list[str]:
        """Names of the effects that are refitted."""
        screened, base = self.screened, self.screened.base
        error = max(base.fit.error, base.error)
        tests = (*(found for _, found in screened.short_score_tests), screened.full_score_test)
        leading = (c for found in tests for c in found.candidates[:MAX_REFITTED_EFFECTS])
        promising = (c for c in leading if c.gain > min_gain(self.problem, base.fit, error, c.effect))
        names = [*(c.effect.name for c in promising), *leading_by_equations(screened.equation_scores)]
        return with_contained(self.problem, list(dict.fromkeys(names)))

    def short_fit(self, name: str) -> PartialRefit:
        """A few iterations on short segments from every start."""
        self.progress(f"refitting with {name}")
        screened = self.screened
        starts = starts_for(screened.short_score_tests, name)
        starts = with_equation_start(starts, screened.equation_scores, screened.short_base)
        return name, multistart_fit(self.problem, screened.short_base, starts)

    def probe(self, partial: PartialRefit) -> Fit:
        """A few iterations on middling segments."""
        return continue_fit(self.problem, partial[1], partial[0], rounds=PROBE_ITERATIONS)

    def refine(self, partial: PartialRefit) -> PartialRefit:
        """To the end on middling segments; what leads on full ones starts from there too: the slow shows only there."""
        name, short = partial
        fits = [continue_fit(self.problem, short, name)]
        if name == self.leader:
            fits.append(fit_from_full_score_test(self.problem, self.screened.base.fit, self.candidates[name]))
        return name, min(fits, key=lambda f: f.cost)

    def is_search_done(self, fits: Sequence[Fit]) -> bool:
        """One of some fits leaves only noise."""
        return any(f.error < MAX_SOLVED_ERROR_RATIO * self.problem.floor for f in fits)

    def select_for_evaluation(self, refits: Sequence[PartialRefit]) -> list[PartialRefit]:
        """The best refits, unless the first of them has settled the matter."""
        ordered = sorted(refits, key=_cost)
        beaten = [n > 0 and is_clearly_better(ordered[0][1], f, self.problem.floor) for n, (_, f) in enumerate(ordered)]
        return [p for p, lost in zip(ordered, beaten, strict=True) if not lost][:MAX_REFITTED_EFFECTS]

    def evaluate(self, partial: PartialRefit, validated: int) -> CandidateFit | None:
        """Fit full segments and judge on validation data, as one of so many; None where that cannot be simulated."""
        base, (name, start) = self.screened.base, partial
        self.progress(f"judging {name} on held-out data")
        free = free_names_with(self.problem, base.fit, name)
        extended = with_stable_step(self.problem.with_candidates(name), start.values)
        try:
            fitted = fit_model(extended, start.values, free, horizons=(1.0,), start_per_log=start.per_log)
        except Failure:
            return None  # so that is not what is missing
        significance = significance_fit(extended, fitted)
        comparisons = Comparisons(sum(c.trials for c in self.candidates.values()), validated)
        effect = self.candidates[name].effect
        return evaluate_candidate(extended, effect, fitted, base, comparisons, significance)

    def with_fresh_leader(self, candidates: Sequence[CandidateFit], validated: int) -> list[CandidateFit]:
        """Effects; the best refitted with the plant's own parameters from before any fit, where that leads further.

        A model that lacks an effect may bend these so far that no fit with the effect finds back.
        """
        best, origins = min(candidates, key=lambda c: c.error_after), self.problem.fallback_starts
        if not origins or best.error_after < MAX_EXPLAINED_ERROR_RATIO * self.problem.floor:
            return list(candidates)
        values = {**best.fit.values, **{n: v for n, v in origins[0].items() if n in self.problem.base}}
        start = continue_fit(self.problem, replace(best.fit, values=values, converged=False), best.effect)
        again = self.evaluate((best.effect, start), validated)
        if again is None or not again.fit.cost < best.fit.cost:
            return list(candidates)
        return [again if c is best else c for c in candidates]

    def with_nested_fits(self, candidates: Sequence[CandidateFit], validated: int) -> list[CandidateFit]:
        """Effects; each that a better one contains or approaches refitted from there, where that is its better fit."""
        found, done = {c.effect: c for c in candidates}, set()
        for larger in sorted(candidates, key=lambda c: c.error_after):
            for smaller in nested_effects(self.problem, larger.effect):
                known = found.get(smaller)
                if smaller in done or (known and known.error_after <= larger.error_after):
                    continue
                done.add(smaller)
                again = self.evaluate((smaller, nested_start(self.problem, larger, smaller)), validated)
                if again and (known is None or again.fit.cost < known.fit.cost):
                    found[smaller] = again
        return list(found.values())


def _cost(partial: PartialRefit) -> float:
    return partial[1].cost


def min_gain(problem: EstimationProblem, base: Fit, error: float, effect: Effect) -> float:
    """Expected fall of the sum of squares from which an effect is refitted, in noise variances.

    What is missing in a fit whose error lies in the noise is small, and the expectation can be trusted: there it must
    be a good part of what makes an effect worth naming.
    """
    enough = MIN_GAIN_PER_COEFFICIENT * len(effect.parameters)
    if error < MAX_NOISE_LEVEL_ERROR_RATIO * problem.floor:
        return max(enough, MIN_GAIN_SHARE * 2.0 * MIN_RELATIVE_ERROR_DECREASE * base.count)
    return enough


def nested_start(problem: EstimationProblem, larger: CandidateFit, smaller: str) -> Fit:
    """An effect at its nearest to one that contains or approaches it: its own refit may have gone astray."""

    def nested(values: Mapping[str, float]) -> dict[str, float]:
        return with_nested_effect(problem, larger.effect, smaller, values)

    return replace(larger.fit, values=nested(larger.fit.values), per_log=tuple(map(nested, larger.fit.per_log)))
