"""One round of the search: score test, refits of the leading candidates, and the verdict on them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

import derive
from derive.effects import InnerPlay
from wheelpend.diagnosis.candidates import Contest, Scored, least_gain, ranked
from wheelpend.diagnosis.events import find_happenings, found_at
from wheelpend.diagnosis.evidence import WORTHWHILE, Tried, judge
from wheelpend.diagnosis.missing_force.estimate import find_missing_force
from wheelpend.diagnosis.pair_search import leading_pair
from wheelpend.diagnosis.refit import SHORT, Progress, near_screens, refit_play
from wheelpend.diagnosis.score_test import Candidate, screen
from wheelpend.diagnosis.verdict import Diagnosis, conclude, verdict_on
from wheelpend.estimation.continuation import fit_model, fit_parts
from wheelpend.estimation.criteria import EXPLAINED, VISIBLE
from wheelpend.estimation.fit import Fit
from wheelpend.estimation.free_parameters import free_names, without_others
from wheelpend.estimation.problem import Study, enlarged, steadied
from wheelpend.estimation.profiled_starts import shapes_of
from wheelpend.estimation.validation import held_residuals

PARTNERED = 3  # effects that are tried as one of a pair where none is worth naming alone
PARTNER = 0.2  # share of the sum of squares that a partner must promise to take away
SUBSTANTIAL = 0.1  # share of what is above the noise that an event must promise to take away
SUDDEN = 40.0  # expected fall of the sum of squares, in noise variances, from which an event is looked at


def first_round(study: Study, start: dict[str, float], progress: Progress) -> Diagnosis:
    """Diagnose a prepared study from a start: by lasting effects, by events, and by two effects where one fails."""
    found = with_event(diagnose_study(study, start, with_force=True, progress=progress), progress)
    return with_partner(found, progress) if found.verdict == "unexplained" and not found.named else found


def next_round(found: Diagnosis, progress: Progress) -> Diagnosis:
    """Diagnose again with the first candidate in the model."""
    best = found.named[0]
    progress(f"added {best.effect}: error {found.error:.4g} → {best.error_after:.4g}")
    return with_event(behind(found.study, best, progress=progress), progress)


def behind(study: Study, best: Tried, *, promise: float = 0.0, progress: Progress) -> Diagnosis:
    """Diagnose by lasting effects, with one in the model."""
    larger = steadied(study.having(enlarged(study.model, best.effect)), best.fit.values)
    own = [without_others(larger, values) for values in best.fit.per_log]
    start = without_others(larger, best.fit.of_log(0))
    return diagnose_study(larger, start, own=own, known=best.fit, promise=promise, progress=progress)


def with_partner(found: Diagnosis, progress: Progress) -> Diagnosis:
    """A diagnosis that names an effect which explains too little alone, if a second one explains the rest with it.

    Two effects can hide each other: either alone bends the other parameters so far that it does not pay. The one that
    lowers the held-out error more alone is named, with the evidence that it has beside the other. What frees something
    inside the machine is not tried as the first of a pair: that takes long.
    """
    study = found.study
    quick = (t for t in found.tried if t.physical and not derive.effects.find(t.effect).frees)
    together = leading_pair(study, found.fit)
    likely = sorted(quick, key=lambda t: (t.effect not in together, t.fit.cost))[:PARTNERED]
    for number, one in enumerate(likely, 1):
        progress(f"looking for a partner of {one.effect}")
        first = behind(study, one, promise=PARTNER, progress=progress)
        if not (first.named and first.accounted):
            continue
        other = first.named[0]
        second = behind(study, other, progress=progress)
        if not (second.named and second.accounted and second.named[0].effect == one.effect):
            continue
        beside, alone = (other, second) if second.error < first.error else (second.named[0], first)
        if alone.error < (1.0 - WORTHWHILE) * found.error:
            p_value = min(1.0, number * max(beside.p_value, second.named[0].p_value))
            best = replace(beside, p_value=p_value, error_after=alone.error, fit=alone.fit)
            verdict = verdict_on(study, [best], found.error)
            return replace(found, verdict=verdict, candidates=(best, *found.candidates))
    return found


def diagnose_study(
    study: Study,
    start: dict[str, float],
    *,
    own: Sequence[Mapping[str, float]] = (),
    known: Fit | None = None,
    promise: float = 0.0,
    with_force: bool = False,
    progress: Progress,
) -> Diagnosis:
    """Diagnose a study by lasting effects, from a start for its parameters, and for those that each log has for itself.

    A fit of this very model to these logs that is ``known`` is not repeated. Nothing is refitted unless an effect is
    expected to take away the share ``promise`` of the sum of squares.
    """
    present = study.model.effects
    free = free_names(study, present)
    progress("fitting the model as it is")
    fits_here = known and known.count == sum(p.values for p in study.training) and set(known.names) == set(free)
    short = None if fits_here else fit_model(study, start, free, horizons=(SHORT,), start_per_log=own)
    base = fit_model(study, short.values, free, horizons=(0.3, 1.0), start_per_log=short.per_log) if short else known
    assert base is not None, "without a known fit there is a new one"
    before, residuals = held_residuals(study, base)
    progress("scoring every effect")
    if in_noise := max(base.error, before) < VISIBLE * study.floor:
        short = base
    short = short or fit_model(study, start, free, horizons=(SHORT,), start_per_log=own)
    shapes = shapes_of(study, short, study.missable())
    far = screen(study, base, study.training, shapes)
    if in_noise:  # what is missing, if anything, is small: one screening tells all
        near = [(base.values, far)]
    else:
        near = near_screens(study, short, start, shapes, corrupted=before > EXPLAINED * study.floor)
    hopeful = not promise or far.candidates[0].gain >= promise * base.count
    scored = Scored(study, base, short, before, residuals, near, far)
    tried = Contest(scored, progress).run() if hopeful else []
    missing = None
    if with_force:
        progress("estimating the missing force")
        missing = find_missing_force(study, base)
    return conclude(study, base, before, residuals, tried, far, missing)


def with_event(found: Diagnosis, progress: Progress) -> Diagnosis:
    """A diagnosis that names an event, if one accounts for more than the first candidate does.

    Then error and evidence are those of every second segment of the log in which it happened.
    """
    if found.named and found.accounted:
        return found
    error = max(found.fit.error, found.error)
    places = find_happenings(found.study, found.fit, error)
    excess = max(1.0 - (found.study.floor / error) ** 2, 0.0) * found.fit.count  # what is above the noise
    enough = max(SUDDEN, SUBSTANTIAL * excess)
    places = [p for p in places if p.gain > max(enough, least_gain(found.study, found.fit, error, p.effect))]
    if not places:
        return found
    by_effect = {p.effect.name: [q for q in places if q.effect == p.effect] for p in places}
    progress(f"looking at what may have happened: {', '.join(by_effect)}")
    free = free_names(found.study, found.study.model.effects)
    assert found.screen is not None, "a diagnosis has screened every effect"
    families = len(found.screen.candidates) + len(by_effect)  # each has the same share of the chance of a false alarm
    best, least = found, found.named[0].error_after / found.error if found.named else 1.0
    for seen in by_effect.values():
        study, fitted = found_at(found.study, found.fit, seen, free)
        if not np.isfinite(fitted.cost):
            continue
        base = fit_model(study, found.fit.values, free, horizons=(1.0,), start_per_log=found.fit.per_log)
        before, residuals = held_residuals(study, base)
        candidate = Candidate(seen[0].effect, (seen[0].start,), seen[0].gain, {}, seen[0].trials)
        tests = families * seen[0].trials
        tried = judge(study, candidate, fitted, fitted, before, residuals, tests=tests, judged=len(by_effect))
        if tried.worth_naming(before) and tried.error_after / before < least:
            least = tried.error_after / before
            best = conclude(study, base, before, residuals, [tried], found.screen, found.missing)
    return best


def with_play(found: Diagnosis, progress: Progress) -> Diagnosis:
    """A diagnosis that names a play, if it is worth naming once its contacts are followed from a start before any fit.

    That takes half a minute, so it is tried where nothing else explains what is missing.
    """
    study, before = found.study, found.error
    plays = [e for e in study.missable() if isinstance(e.enters, InnerPlay)]
    if not plays or found.screen is None:
        return found
    residuals = held_residuals(study, found.fit)[1]
    tests = sum(c.trials for c in found.screen.candidates)
    tried = []
    for effect in plays:
        progress(f"following the contacts of {effect.name}")
        begun = refit_play(study, found.fit, effect)
        if begun is None:
            continue
        able = steadied(study.able(effect.name), begun.values)
        fitted = fit_parts(able, able.training, begun.values, begun.names, start_per_log=begun.per_log)
        candidate = next(c for c in found.screen.candidates if c.effect == effect)
        judged = len(found.tried) + len(plays)
        tried.append(judge(able, candidate, fitted, fitted, before, residuals, tests=tests, judged=judged))
    tried = [t for t in tried if t.worth_naming(before)]
    if not tried:
        return found
    best_first = ranked(study, (*found.tried, *tried))
    return conclude(study, found.fit, before, residuals, best_first, found.screen, found.missing)
