"""One round of the search: score test, refits of the leading candidates, and the verdict on them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

import derive
from derive.effects import InternalPlay
from wheelpend.diagnosis.candidates import CandidateSelection, ScreenedModel, min_gain, rank_candidates
from wheelpend.diagnosis.events import find_events, fit_event
from wheelpend.diagnosis.evidence import MIN_RELATIVE_ERROR_DECREASE, CandidateFit, evaluate_candidate
from wheelpend.diagnosis.missing_force.estimate import estimate_missing_force
from wheelpend.diagnosis.pair_search import leading_pair
from wheelpend.diagnosis.refit import SHORT_HORIZON_SHARE, Progress, refit_backlash, short_score_tests
from wheelpend.diagnosis.score_test import Candidate, score_test
from wheelpend.diagnosis.verdict import Diagnosis, conclude, verdict_on
from wheelpend.estimation.continuation import fit_model, fit_segments
from wheelpend.estimation.criteria import MAX_EXPLAINED_ERROR_RATIO, MAX_NOISE_LEVEL_ERROR_RATIO
from wheelpend.estimation.fit import Fit
from wheelpend.estimation.free_parameters import free_names, values_of_model_effects
from wheelpend.estimation.problem import EstimationProblem, extended_effects, with_stable_step
from wheelpend.estimation.profiled_starts import profile_grids
from wheelpend.estimation.validation import validation_residuals

MAX_PAIR_CANDIDATES = 3  # effects that are tried as one of a pair where none is worth naming alone
MIN_PARTNER_GAIN_SHARE = 0.2  # share of the sum of squares that a partner must promise to take away
MIN_EVENT_GAIN_SHARE = 0.1  # share of what is above the noise that an event must promise to take away
MIN_EVENT_GAIN = 40.0  # expected fall of the sum of squares, in noise variances, from which an event is looked at


def first_round(problem: EstimationProblem, start: dict[str, float], progress: Progress) -> Diagnosis:
    """Diagnose a prepared study from a start: by lasting effects, by events, and by two effects where one fails."""
    found = with_event(diagnose_problem(problem, start, with_force=True, progress=progress), progress)
    return with_partner(found, progress) if found.verdict == "unexplained" and not found.named else found


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
    own = [values_of_model_effects(larger, values) for values in best.fit.per_log]
    start = values_of_model_effects(larger, best.fit.of_log(0))
    return diagnose_problem(larger, start, own=own, known=best.fit, min_gain_share=min_gain_share, progress=progress)


def with_partner(found: Diagnosis, progress: Progress) -> Diagnosis:
    """A diagnosis that names an effect which explains too little alone, if a second one explains the rest with it.

    Two effects can hide each other: either alone bends the other parameters so far that it does not pay. The one that
    lowers the held-out error more alone is named, with the evidence that it has beside the other. What frees something
    inside the machine is not tried as the first of a pair: that takes long.
    """
    problem = found.problem
    quick = (t for t in found.tried if t.physical and not derive.effects.find(t.effect).releases)
    together = leading_pair(problem, found.fit)
    likely = sorted(quick, key=lambda t: (t.effect not in together, t.fit.cost))[:MAX_PAIR_CANDIDATES]
    for number, one in enumerate(likely, 1):
        progress(f"looking for a partner of {one.effect}")
        first = diagnose_with_effect(problem, one, min_gain_share=MIN_PARTNER_GAIN_SHARE, progress=progress)
        if not (first.named and first.is_explained):
            continue
        other = first.named[0]
        second = diagnose_with_effect(problem, other, progress=progress)
        if not (second.named and second.is_explained and second.named[0].effect == one.effect):
            continue
        beside, alone = (other, second) if second.error < first.error else (second.named[0], first)
        if alone.error < (1.0 - MIN_RELATIVE_ERROR_DECREASE) * found.error:
            p_value = min(1.0, number * max(beside.p_value, second.named[0].p_value))
            best = replace(beside, p_value=p_value, error_after=alone.error, fit=alone.fit)
            verdict = verdict_on(problem, [best], found.error)
            return replace(found, verdict=verdict, candidates=(best, *found.candidates))
    return found


def diagnose_problem(
    problem: EstimationProblem,
    start: dict[str, float],
    *,
    own: Sequence[Mapping[str, float]] = (),
    known: Fit | None = None,
    min_gain_share: float = 0.0,
    with_force: bool = False,
    progress: Progress,
) -> Diagnosis:
    """Diagnose a study by lasting effects, from a start for its parameters, and for those that each log has for itself.

    A fit of this very model to these logs that is ``known`` is not repeated. Nothing is refitted unless an effect is
    expected to take away the share ``promise`` of the sum of squares.
    """
    present = problem.model.effects
    free = free_names(problem, present)
    progress("fitting the model as it is")
    fits_here = known and known.count == sum(p.values for p in problem.training) and set(known.names) == set(free)
    short = None if fits_here else fit_model(problem, start, free, horizons=(SHORT_HORIZON_SHARE,), start_per_log=own)
    base = fit_model(problem, short.values, free, horizons=(0.3, 1.0), start_per_log=short.per_log) if short else known
    assert base is not None, "without a known fit there is a new one"
    before, residuals = validation_residuals(problem, base)
    progress("scoring every effect")
    if in_noise := max(base.error, before) < MAX_NOISE_LEVEL_ERROR_RATIO * problem.floor:
        short = base
    short = short or fit_model(problem, start, free, horizons=(SHORT_HORIZON_SHARE,), start_per_log=own)
    shapes = profile_grids(problem, short, problem.candidates())
    far = score_test(problem, base, problem.training, shapes)
    if in_noise:  # what is missing, if anything, is small: one screening tells all
        near = [(base.values, far)]
    else:
        near = short_score_tests(
            problem, short, start, shapes, corrupted=before > MAX_EXPLAINED_ERROR_RATIO * problem.floor
        )
    hopeful = not min_gain_share or far.candidates[0].gain >= min_gain_share * base.count
    scored = ScreenedModel(problem, base, short, before, residuals, near, far)
    tried = CandidateSelection(scored, progress).run() if hopeful else []
    missing = None
    if with_force:
        progress("estimating the missing force")
        missing = estimate_missing_force(problem, base)
    return conclude(problem, base, before, residuals, tried, far, missing)


def with_event(found: Diagnosis, progress: Progress) -> Diagnosis:
    """A diagnosis that names an event, if one accounts for more than the first candidate does.

    Then error and evidence are those of every second segment of the log in which it happened.
    """
    if found.named and found.is_explained:
        return found
    error = max(found.fit.error, found.error)
    places = find_events(found.problem, found.fit, error)
    excess = max(1.0 - (found.problem.floor / error) ** 2, 0.0) * found.fit.count  # what is above the noise
    enough = max(MIN_EVENT_GAIN, MIN_EVENT_GAIN_SHARE * excess)
    places = [p for p in places if p.gain > max(enough, min_gain(found.problem, found.fit, error, p.effect))]
    if not places:
        return found
    by_effect = {p.effect.name: [q for q in places if q.effect == p.effect] for p in places}
    progress(f"looking at what may have happened: {', '.join(by_effect)}")
    free = free_names(found.problem, found.problem.model.effects)
    assert found.score_test is not None, "a diagnosis has screened every effect"
    families = len(found.score_test.candidates) + len(
        by_effect
    )  # each has the same share of the chance of a false alarm
    best, least = found, found.named[0].error_after / found.error if found.named else 1.0
    for seen in by_effect.values():
        problem, fitted = fit_event(found.problem, found.fit, seen, free)
        if not np.isfinite(fitted.cost):
            continue
        base = fit_model(problem, found.fit.values, free, horizons=(1.0,), start_per_log=found.fit.per_log)
        before, residuals = validation_residuals(problem, base)
        candidate = Candidate(seen[0].effect, (seen[0].start,), seen[0].gain, {}, seen[0].trials)
        tests = families * seen[0].trials
        tried = evaluate_candidate(
            problem, candidate, fitted, fitted, before, residuals, tests=tests, judged=len(by_effect)
        )
        if tried.is_supported(before) and tried.error_after / before < least:
            least = tried.error_after / before
            best = conclude(problem, base, before, residuals, [tried], found.score_test, found.missing)
    return best


def with_backlash(found: Diagnosis, progress: Progress) -> Diagnosis:
    """A diagnosis that names a play, if it is worth naming once its contacts are followed from a start before any fit.

    That takes half a minute, so it is tried where nothing else explains what is missing.
    """
    problem, before = found.problem, found.error
    plays = [e for e in problem.candidates() if isinstance(e.enters, InternalPlay)]
    if not plays or found.score_test is None:
        return found
    residuals = validation_residuals(problem, found.fit)[1]
    tests = sum(c.trials for c in found.score_test.candidates)
    tried = []
    for effect in plays:
        progress(f"following the contacts of {effect.name}")
        begun = refit_backlash(problem, found.fit, effect)
        if begun is None:
            continue
        able = with_stable_step(problem.with_candidates(effect.name), begun.values)
        fitted = fit_segments(able, able.training, begun.values, begun.names, start_per_log=begun.per_log)
        candidate = next(c for c in found.score_test.candidates if c.effect == effect)
        judged = len(found.tried) + len(plays)
        tried.append(evaluate_candidate(able, candidate, fitted, fitted, before, residuals, tests=tests, judged=judged))
    tried = [t for t in tried if t.is_supported(before)]
    if not tried:
        return found
    best_first = rank_candidates(problem, (*found.tried, *tried))
    return conclude(problem, found.fit, before, residuals, best_first, found.score_test, found.missing)
