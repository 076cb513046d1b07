"""One round of the search: score test, refits of the leading candidates, and the verdict on them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import derive
from wheelpend.diagnosis.alternatives import with_event
from wheelpend.diagnosis.candidates import CandidateSelection, ScreenedModel
from wheelpend.diagnosis.criteria import MIDDLE_HORIZON_SHARE, MIN_RELATIVE_ERROR_DECREASE, SHORT_HORIZON_SHARE
from wheelpend.diagnosis.equation_scores import equation_scores
from wheelpend.diagnosis.evidence import CandidateFit, ValidatedFit
from wheelpend.diagnosis.pair_search import leading_pair
from wheelpend.diagnosis.refit import Progress, short_score_tests
from wheelpend.diagnosis.score_test import score_test
from wheelpend.diagnosis.verdict import Diagnosis, conclude, verdict_on
from wheelpend.estimation.continuation import fit_model
from wheelpend.estimation.criteria import MAX_EXPLAINED_ERROR_RATIO, MAX_NOISE_LEVEL_ERROR_RATIO
from wheelpend.estimation.fit import Fit
from wheelpend.estimation.free_parameters import free_names, values_of_model_effects
from wheelpend.estimation.problem import EstimationProblem, extended_effects, with_stable_step
from wheelpend.estimation.profiled_starts import profile_grids

MAX_PAIR_CANDIDATES = 3  # effects that are tried as one of a pair where none is worth naming alone
MIN_PARTNER_GAIN_SHARE = 0.2  # share of the sum of squares that a partner must be expected to take away


class RoundStart(NamedTuple):
    """Values from which a round's base fit starts."""

    values: dict[str, float]
    per_log: Sequence[Mapping[str, float]] = ()  # of the parameters that each log has for itself
    known: Fit | None = None  # a fit that is not repeated where it is of this very model to these logs


def first_round(problem: EstimationProblem, start: dict[str, float], progress: Progress) -> Diagnosis:
    """Diagnose a prepared problem from a start: by lasting effects, and by events."""
    return with_event(diagnose_problem(problem, RoundStart(start), progress=progress), progress)


def next_round(found: Diagnosis, progress: Progress) -> Diagnosis:
    """Diagnose again with the first candidate in the model."""
    best = found.named[0]
    progress(f"added {best.effect}: error {found.error:.4g} → {best.error_after:.4g}")
    return with_event(diagnose_with_effect(found.problem, best, progress=progress), progress)


def diagnose_with_effect(
    problem: EstimationProblem, best: CandidateFit, *, min_gain_share: float = 0.0, progress: Progress
) -> Diagnosis:
    """Diagnose by lasting effects, with one in the model."""
    larger = with_stable_step(problem.with_effects(extended_effects(problem.model, best.effect)), best.fit.values)
    per_log = [values_of_model_effects(larger, values) for values in best.fit.per_log]
    start = RoundStart(values_of_model_effects(larger, best.fit.of_log(0)), per_log, best.fit)
    return diagnose_problem(larger, start, min_gain_share=min_gain_share, progress=progress)


def with_partner(found: Diagnosis, progress: Progress) -> Diagnosis:
    """A diagnosis that names an effect which explains too little alone, if a second one explains the rest with it.

    Two effects can hide each other: either alone bends the other parameters so far that it does not pay. The one that
    lowers the validation error more alone is named, with the evidence that it has beside the other. An effect that
    releases an internal coordinate is not tried as the first of a pair: that takes long.
    """
    problem = found.problem
    quick = (c for c in found.refitted if c.physical and not derive.effects.find(c.effect).releases)
    together = leading_pair(problem, found.fit)
    likely = sorted(quick, key=lambda c: (c.effect not in together, c.fit.cost))[:MAX_PAIR_CANDIDATES]
    for number, one in enumerate(likely, 1):
        progress(f"looking for a partner of {one.effect}")
        named = _named_of_pair(found, one, number, progress)
        if named is not None:
            return replace(
                found, verdict=verdict_on(problem, [named], found.error), candidates=(named, *found.candidates)
            )
    return found


def _named_of_pair(found: Diagnosis, one: CandidateFit, number: int, progress: Progress) -> CandidateFit | None:
    """The effect to be named of a pair with one, the so-manieth that is tried; None where no pair explains the rest."""
    first = diagnose_with_effect(found.problem, one, min_gain_share=MIN_PARTNER_GAIN_SHARE, progress=progress)
    if not (first.named and first.is_explained):
        return None
    other = first.named[0]
    second = diagnose_with_effect(found.problem, other, progress=progress)
    if not (second.named and second.is_explained and second.named[0].effect == one.effect):
        return None
    beside, alone = (other, second) if second.error < first.error else (second.named[0], first)
    if not alone.error < (1.0 - MIN_RELATIVE_ERROR_DECREASE) * found.error:
        return None
    p_value = min(1.0, number * max(beside.p_value, second.named[0].p_value))
    return replace(beside, p_value=p_value, error_after=alone.error, fit=alone.fit)


def diagnose_problem(
    problem: EstimationProblem,
    start: RoundStart,
    *,
    min_gain_share: float = 0.0,
    progress: Progress,
) -> Diagnosis:
    """Diagnose a problem by lasting effects.

    Nothing is refitted unless an effect is expected to take away the share ``min_gain_share`` of the sum of squares.
    """
    screened = screen(problem, start, progress)
    base, leading = screened.base, screened.full_score_test.candidates
    promising = not min_gain_share or leading[0].gain >= min_gain_share * base.fit.count
    candidates = CandidateSelection(screened, progress).run() if promising else []
    return conclude(problem, base, candidates, screened.full_score_test)


def screen(problem: EstimationProblem, start: RoundStart, progress: Progress) -> ScreenedModel:
    """Fit the model as it is, validate it, and score every effect that it may be missing."""
    progress("fitting the model as it is")
    short, fitted = _fit_base(problem, start)
    base = ValidatedFit.of(problem, fitted)
    progress("scoring every effect")
    in_noise = max(fitted.error, base.error) < MAX_NOISE_LEVEL_ERROR_RATIO * problem.floor
    short = fitted if in_noise else short or _short_fit(problem, start)
    grids = profile_grids(problem, short, problem.candidates())
    full_score_test = score_test(problem, fitted, problem.data.estimation, grids)
    if in_noise:  # what is missing, if anything, is small: one score test tells all
        return ScreenedModel(problem, base, short, [(fitted.values, full_score_test)], full_score_test, {})
    corrupted = base.error > MAX_EXPLAINED_ERROR_RATIO * problem.floor
    short_tests = short_score_tests(problem, short, start.values, grids, corrupted=corrupted)
    by_equations = equation_scores(problem, fitted.values) if corrupted else {}
    return ScreenedModel(problem, base, short, short_tests, full_score_test, by_equations)


def _fit_base(problem: EstimationProblem, start: RoundStart) -> tuple[Fit | None, Fit]:
    """A fit of the model to short segments, unless one to full segments is known, and the one to full segments."""
    free, known = free_names(problem, problem.model.effects), start.known
    if known and known.count == problem.data.values and set(known.names) == set(free):
        return None, known
    short = _short_fit(problem, start)
    horizons = (MIDDLE_HORIZON_SHARE, 1.0)
    return short, fit_model(problem, short.values, free, horizons=horizons, start_per_log=short.per_log)


def _short_fit(problem: EstimationProblem, start: RoundStart) -> Fit:
    free = free_names(problem, problem.model.effects)
    return fit_model(problem, start.values, free, horizons=(SHORT_HORIZON_SHARE,), start_per_log=start.per_log)
