"""Which candidates of the screenings are refitted, how far, and which of them win.

Refits take long, so they go on in steps, and end where they can no longer win.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import repeat

import numpy as np

import derive
from derive.effects import Effect
from wheelpend.diagnosis.evidence import MIN_RELATIVE_ERROR_DECREASE, CandidateFit, evaluate_candidate
from wheelpend.diagnosis.refit import (
    PROBE_ITERATIONS,
    Progress,
    continue_fit,
    fit_from_full_score_test,
    free_names_with,
    multistart_fit,
    significance_fit,
    starts_for,
    with_nested_effect,
)
from wheelpend.diagnosis.score_test import ScoreTest
from wheelpend.errors import Failure
from wheelpend.estimation.continuation import fit_model
from wheelpend.estimation.criteria import (
    MAX_EXPLAINED_ERROR_RATIO,
    MAX_NOISE_LEVEL_ERROR_RATIO,
    WRONG_START_ERROR_RATIO,
)
from wheelpend.estimation.fit import Fit
from wheelpend.estimation.problem import EstimationProblem, with_stable_step
from wheelpend.parallel import KernelPool

MAX_REFITTED_EFFECTS = 5  # best candidates of each screening that are refitted
MIN_GAIN_PER_COEFFICIENT = (
    10.0  # expected fall of the sum of squares per coefficient, in noise variances, that is worth a refit
)
MIN_GAIN_SHARE = (
    0.3  # of the fall that makes an effect worth naming, which the expected one must be where it can be trusted
)
LEADING_CANDIDATE_COUNT = 2  # candidates whose refit goes on first
MAX_RIVAL_ERROR_RATIO = (
    1.1  # times their error, above which after a few rounds none goes on where one of those leaves only noise
)
MAX_SOLVED_ERROR_RATIO = (
    1.03  # error over noise floor from which on nothing is tried that frees something inside the machine
)
MAX_INTERNAL_EFFECT_ERROR_RATIO = (
    1.5  # times the best error of the others on short segments, above which such a thing does not go on
)
INTERNAL_EFFECT_ERROR_PENALTY = (
    1.5  # times its error counts where such a thing does not reach the noise: it bends to much
)
MAX_SIMILAR_ERROR_RATIO = 1.1  # times the best error, up to which the simplest effect comes first where all leave much
MAX_EQUIVALENT_ERROR_DIFFERENCE = (
    0.01  # relative difference of the held-out errors within which effects cannot be told apart
)
MAX_EVALUATED_COST_RATIO = (
    2.0  # cost on middling segments, over the best, up to which a candidate is judged on held-out data
)

PartialRefit = tuple[str, Fit]  # an effect, and how far its refit is


@dataclass(frozen=True)
class ScreenedModel:
    """A model as it is, fitted and screened."""

    problem: EstimationProblem
    base: Fit
    short_base: Fit  # of short segments
    error: float  # held out
    residuals: list[np.ndarray]  # of each held-out part [σ]
    short_score_tests: list[
        tuple[dict[str, float], ScoreTest]
    ]  # screenings of short segments, and the values that each was made at
    full_score_test: ScoreTest  # that of full segments, at the fit


class CandidateSelection:
    """Refits of the candidates of every screening with each other: those of short segments, then the best of full ones.

    What frees something inside the machine takes long to refit, and is tried unless another effect leaves only noise.
    """

    def __init__(self, scored: ScreenedModel, progress: Progress) -> None:
        self.scored, self.problem, self.progress = scored, scored.problem, progress
        self.candidates = {c.effect.name: c for c in scored.full_score_test.candidates}
        self.leader = next(iter(self.candidates), "")  # of the screening of full segments

    def run(self) -> list[CandidateFit]:
        """Effects that were judged on held-out data, the best first."""
        names = self.select_for_refit()
        slow = [n for n in names if derive.effects.find(n).frees]
        quick = [n for n in names if n not in slow]
        with KernelPool() as pool:
            looked = sorted(pool.map(self.short_fit, quick), key=lambda pair: pair[1].cost)
            least = looked[0][1].error if looked else np.inf
            begun, rest = [*pool.map(self.refine, looked[:LEADING_CANDIDATE_COUNT])], looked[LEADING_CANDIDATE_COUNT:]
            if self.is_search_done(begun):
                bound = MAX_RIVAL_ERROR_RATIO * min(f.error for _, f in begun)
                rest = [p for p, f in zip(rest, pool.map(self.probe, rest), strict=True) if f.error < bound]
            begun += pool.map(self.refine, rest)
            if not self.is_search_done(begun):
                looked = [*pool.map(self.short_fit, slow)]
                begun += pool.map(
                    self.refine,
                    [p for p in looked if p[1].error < MAX_INTERNAL_EFFECT_ERROR_RATIO * least or p[0] == self.leader],
                )
            hopeful = self.select_for_evaluation(begun)
            judged = pool.map(self.evaluate, hopeful, repeat(len(hopeful)))
            tried = [t for t in judged if t is not None]
        return rank_candidates(self.problem, self.with_nested_fits(tried, len(hopeful)) if tried else [])

    def select_for_refit(self) -> list[str]:
        """Names of the effects that are refitted."""
        scored, error = self.scored, max(self.scored.base.error, self.scored.error)
        leading = (
            c
            for s in (*(s for _, s in scored.short_score_tests), scored.full_score_test)
            for c in s.candidates[:MAX_REFITTED_EFFECTS]
        )
        promising = (c for c in leading if c.gain > min_gain(self.problem, scored.base, error, c.effect))
        return with_contained(self.problem, list(dict.fromkeys(c.effect.name for c in promising)))

    def short_fit(self, name: str) -> PartialRefit:
        """A few rounds on short segments from every start."""
        self.progress(f"refitting with {name}")
        return name, multistart_fit(
            self.problem, self.scored.short_base, starts_for(self.scored.short_score_tests, name)
        )

    def probe(self, pair: PartialRefit) -> Fit:
        """A few rounds on middling segments."""
        return continue_fit(self.problem, pair[1], pair[0], rounds=PROBE_ITERATIONS)

    def refine(self, pair: PartialRefit) -> PartialRefit:
        """To the end on middling segments; what leads on full ones starts from there too: the slow shows only there."""
        name, looked = pair
        fits = [continue_fit(self.problem, looked, name)]
        if name == self.leader:
            fits.append(fit_from_full_score_test(self.problem, self.scored.base, self.candidates[name]))
        return name, min(fits, key=lambda f: f.cost)

    def is_search_done(self, begun: Sequence[PartialRefit]) -> bool:
        """Whether one of some refits leaves only noise."""
        return any(f.error < MAX_SOLVED_ERROR_RATIO * self.problem.floor for _, f in begun)

    def select_for_evaluation(self, begun: Sequence[PartialRefit]) -> list[PartialRefit]:
        """Those refits that are judged: the best ones, unless the first has settled the matter."""
        ordered = sorted(begun, key=lambda pair: pair[1].cost)
        clear = [n > 0 and is_clearly_better(ordered[0][1], f, self.problem.floor) for n, (_, f) in enumerate(ordered)]
        return [p for p, lost in zip(ordered, clear, strict=True) if not lost][:MAX_REFITTED_EFFECTS]

    def evaluate(self, pair: PartialRefit, judged: int) -> CandidateFit | None:
        """Fit full segments and judge on held-out data, as one of so many; None where that cannot be simulated."""
        scored, (name, begun) = self.scored, pair
        self.progress(f"judging {name} on held-out data")
        free, able = (
            free_names_with(self.problem, scored.base, name),
            with_stable_step(self.problem.with_candidates(name), begun.values),
        )
        try:
            fitted = fit_model(able, begun.values, free, horizons=(1.0,), start_per_log=begun.per_log)
        except Failure:
            return None  # so that is not what is missing
        evidence, tests = significance_fit(able, fitted, begun), sum(c.trials for c in self.candidates.values())
        return evaluate_candidate(
            able, self.candidates[name], fitted, evidence, scored.error, scored.residuals, tests=tests, judged=judged
        )

    def with_nested_fits(self, tried: Sequence[CandidateFit], judged: int) -> list[CandidateFit]:
        """Effects; each that a better one contains or approaches refitted from there, where that is its better fit."""
        found, done = {t.effect: t for t in tried}, set()
        for larger in sorted(tried, key=lambda t: t.error_after):
            for smaller in nested_effects(self.problem, larger.effect):
                known = found.get(smaller)
                if smaller in done or (known and known.error_after <= larger.error_after):
                    continue
                done.add(smaller)
                again = self.evaluate((smaller, nested_start(self.problem, larger, smaller)), judged)
                if again and (known is None or again.fit.cost < known.fit.cost):
                    found[smaller] = again
        return list(found.values())


def min_gain(problem: EstimationProblem, base: Fit, error: float, effect: Effect) -> float:
    """Expected fall of the sum of squares from which an effect is refitted, in noise variances.

    What is missing in a fit whose error lies in the noise is small, and the expectation can be trusted: there it must
    be a good part of what makes an effect worth naming.
    """
    enough = MIN_GAIN_PER_COEFFICIENT * len(effect.parameters)
    return (
        max(enough, MIN_GAIN_SHARE * 2.0 * MIN_RELATIVE_ERROR_DECREASE * base.count)
        if error < MAX_NOISE_LEVEL_ERROR_RATIO * problem.floor
        else enough
    )


def nested_start(problem: EstimationProblem, larger: CandidateFit, smaller: str) -> Fit:
    """Where an effect is nearest to one that contains or approaches it: its own refit may have gone astray."""

    def turned(values: Mapping[str, float]) -> dict[str, float]:
        return with_nested_effect(problem, larger.effect, smaller, values)

    return replace(larger.fit, values=turned(larger.fit.values), per_log=tuple(map(turned, larger.fit.per_log)))


def nested_effects(problem: EstimationProblem, effect: str) -> list[str]:
    """Effects that one contains, and the one that it approaches, as far as the model may be missing them."""
    approached = derive.effects.find(effect).approaches
    missable = {e.name for e in problem.candidates()}
    return [*with_contained(problem, [effect])[1:], *([approached] if approached in missable else [])]


def rank_candidates(problem: EstimationProblem, tried: Iterable[CandidateFit]) -> list[CandidateFit]:
    """Effects by held-out error, the best first; one that frees something and leaves a rest counts with reluctance.

    Where even the best leaves much, its lead over one with fewer parameters says little: more parameters bend further
    to whatever else is missing. Then the simplest of those that are nearly as good comes first; else only one that the
    best contains or approaches, and that these data cannot tell from it.
    """

    def rank(one: CandidateFit) -> float:
        partial = derive.effects.find(one.effect).frees and one.error_after > MAX_EXPLAINED_ERROR_RATIO * problem.floor
        return one.error_after * (INTERNAL_EFFECT_ERROR_PENALTY if partial else 1.0)

    ordered = sorted(tried, key=rank)
    if not ordered:
        return []
    best, far = ordered[0], ordered[0].error_after >= WRONG_START_ERROR_RATIO * problem.floor
    alike, known = (
        MAX_SIMILAR_ERROR_RATIO if far else 1.0 + MAX_EQUIVALENT_ERROR_DIFFERENCE,
        nested_effects(problem, best.effect),
    )
    rivals = [t for t in ordered if t.physical and rank(t) < alike * rank(best) and (far or t.effect in known)]
    simplest = min(rivals, key=lambda t: (len(t.coefficients), rank(t)), default=best)
    first = simplest if len(simplest.coefficients) < len(best.coefficients) else best
    return [first, *(t for t in ordered if t is not first)]


def with_contained(problem: EstimationProblem, names: Sequence[str]) -> list[str]:
    """The names, and those of the effects that they contain: an effect is judged beside what it contains."""
    judged = {e.name for e in problem.candidates()}
    contained = [s for n in names for s in problem.module.CONTAINS.get(n, {}) if s in judged]
    return list(dict.fromkeys([*names, *contained]))


def is_clearly_better(best: Fit, other: Fit, floor: float) -> bool:
    """Whether the best fit on short segments has settled the matter: it reaches the noise and the other does not."""
    return best.error < MAX_EXPLAINED_ERROR_RATIO * floor and other.cost > MAX_EVALUATED_COST_RATIO * best.cost
