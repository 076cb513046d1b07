"""Explanations other than a lasting effect refitted from its score: an event in one log, and backlash."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from derive.effects import Effect, InternalPlay
from wheelpend.diagnosis.candidates import min_gain
from wheelpend.diagnosis.events import EventCandidate, find_events, fit_event
from wheelpend.diagnosis.evidence import CandidateFit, Comparisons, ValidatedFit, evaluate_candidate
from wheelpend.diagnosis.ranking import rank_candidates
from wheelpend.diagnosis.refit import Progress, refit_backlash
from wheelpend.diagnosis.verdict import Diagnosis, conclude
from wheelpend.estimation.continuation import fit_model, fit_segments
from wheelpend.estimation.free_parameters import free_names
from wheelpend.estimation.problem import EstimationProblem, with_stable_step

MIN_EVENT_GAIN_SHARE = 0.1  # of the sum of squares above the noise, that an event must be expected to take away
MIN_EVENT_GAIN = 40.0  # expected fall of the sum of squares, in noise variances, from which an event is fitted


def with_event(found: Diagnosis, progress: Progress) -> Diagnosis:
    """A diagnosis that names an event, if one accounts for more than the first candidate does.

    Then error and evidence are those of every second segment of the log in which it happened.
    """
    if found.named and found.is_explained:
        return found
    by_effect = promising_events(found)
    if not by_effect:
        return found
    progress(f"looking at what may have happened: {', '.join(by_effect)}")
    assert found.score_test is not None, "a diagnosis has scored every effect"
    families = len(found.score_test.candidates) + len(by_effect)  # each with the same share of the false alarms
    best, least = found, found.named[0].error_after / found.error if found.named else 1.0
    for events in by_effect.values():
        comparisons = Comparisons(families * events[0].trials, len(by_effect))
        judged = evaluate_event(found, events, comparisons)
        if judged is None:
            continue
        problem, base, candidate = judged
        if candidate.is_supported(base.error) and candidate.error_after / base.error < least:
            least = candidate.error_after / base.error
            best = conclude(problem, base, [candidate], found.score_test)
    return best


def promising_events(found: Diagnosis) -> dict[str, list[EventCandidate]]:
    """Events that are expected to take away enough, by effect, the largest expected gain first."""
    problem, error = found.problem, max(found.fit.error, found.error)
    events = find_events(problem, found.fit, error)
    excess = max(1.0 - (problem.floor / error) ** 2, 0.0) * found.fit.count  # sum of squares above the noise
    enough = max(MIN_EVENT_GAIN, MIN_EVENT_GAIN_SHARE * excess)
    events = [e for e in events if e.gain_by_time > max(enough, min_gain(problem, found.fit, error, e.effect))]
    return {e.effect.name: [other for other in events if other.effect == e.effect] for e in events}


def evaluate_event(
    found: Diagnosis, events: Sequence[EventCandidate], comparisons: Comparisons
) -> tuple[EstimationProblem, ValidatedFit, CandidateFit] | None:
    """The problem that judges an event, the model without it fitted there, and the event; None where it cannot be."""
    free = free_names(found.problem, found.problem.model.effects)
    problem, fitted = fit_event(found.problem, found.fit, events, free)
    if not np.isfinite(fitted.cost):
        return None
    without = fit_model(problem, found.fit.values, free, horizons=(1.0,), start_per_log=found.fit.per_log)
    base = ValidatedFit.of(problem, without)
    return problem, base, evaluate_candidate(problem, events[0].effect, fitted, base, comparisons)


def with_backlash(found: Diagnosis, progress: Progress) -> Diagnosis:
    """A diagnosis that names backlash, if it is worth naming once its contacts are followed from before any fit.

    That takes half a minute, so it is tried where nothing else explains what is missing.
    """
    problem = found.problem
    effects = [e for e in problem.candidates() if isinstance(e.enters, InternalPlay)]
    if not effects or found.score_test is None:
        return found
    base = ValidatedFit.of(problem, found.fit)._replace(error=found.error)
    tests = sum(c.trials for c in found.score_test.candidates)
    comparisons = Comparisons(tests, len(found.refitted) + len(effects))
    supported = []
    for effect in effects:
        progress(f"following the contacts of {effect.name}")
        candidate = evaluate_backlash(problem, base, effect, comparisons)
        if candidate is not None and candidate.is_supported(base.error):
            supported.append(candidate)
    if not supported:
        return found
    best_first = rank_candidates(problem, (*found.refitted, *supported))
    return conclude(problem, base, best_first, found.score_test)


def evaluate_backlash(
    problem: EstimationProblem, base: ValidatedFit, effect: Effect, comparisons: Comparisons
) -> CandidateFit | None:
    """Evidence for backlash refitted from a start that follows its contacts; None where there is no such start."""
    start = refit_backlash(problem, base.fit, effect)
    if start is None:
        return None
    extended = with_stable_step(problem.with_candidates(effect.name), start.values)
    fitted = fit_segments(extended, extended.data.estimation, start.values, start.names, start_per_log=start.per_log)
    return evaluate_candidate(extended, effect, fitted, base, comparisons)
