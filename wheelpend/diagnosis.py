"""Which physical effect is missing: the verdict on what screening and refits found."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np

import derive
from derive.effects import InnerPlay
from wheelpend.contest import EQUIVALENT, Contest, Scored, least_gain, ranked
from wheelpend.evidence import WORTHWHILE, Tried, judge
from wheelpend.happenings import find_happenings, found_at
from wheelpend.missing_force import MissingForce, Place, concentrations, find_missing_force
from wheelpend.pairs import leading_pair
from wheelpend.refit import SHORT, Progress, near_screens, refit_play
from wheelpend.repeatable import Repeats, repeats_of
from wheelpend.screening import Candidate, Screen, screen
from wheelpend.shapes import shapes_of
from wheelpend.shooting import Fit
from wheelpend.study import (
    EXPLAINED,
    VISIBLE,
    Study,
    enlarged,
    fit_model,
    fit_parts,
    free_names,
    held_residuals,
    per_log_names,
    steadied,
    without_others,
)

if TYPE_CHECKING:
    from wheelpend.free_law import FreeLaw

PARTNERED = 3  # effects that are tried as one of a pair where none is worth naming alone
PARTNER = 0.2  # share of the sum of squares that a partner must promise to take away
SUBSTANTIAL = 0.1  # share of what is above the noise that an event must promise to take away
SUDDEN = 40.0  # expected fall of the sum of squares, in noise variances, from which an event is looked at


@dataclass(frozen=True)
class Diagnosis:
    """What is missing in a model, according to logs."""

    verdict: str
    horizon_s: float
    error: float  # held out, after refitting the model's own parameters
    noise_floor: float
    fit_percent: dict[str, float]
    candidates: tuple[Tried, ...]  # worth naming, best first; then improbable ones that are physically impossible
    experiment: str | None
    detectable: dict[str, dict[str, float]]
    where: tuple[Place, ...]
    not_judged: dict[str, str]  # effects left out, and why
    warnings: tuple[str, ...]
    fit: Fit = field(repr=False)
    study: Study = field(repr=False)
    missing: MissingForce | None = field(repr=False, default=None)
    screen: Screen | None = field(repr=False, default=None)
    tried: tuple[Tried, ...] = field(repr=False, default=())  # every effect that was refitted
    repeats: tuple[Repeats, ...] = ()  # of what is unexplained: on what it depends, and how much of it repeats
    law: FreeLaw | None = None  # for what is unexplained, on request

    @property
    def named(self) -> tuple[Tried, ...]:
        """Candidates that are worth naming."""
        return tuple(t for t in self.candidates if t.physical)

    @property
    def accounted(self) -> bool:
        """Whether nothing but noise is left, with the first candidate where there is one."""
        left = self.named[0].error_after if self.named else self.error
        return left <= EXPLAINED * self.noise_floor


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
            advice = experiment(study, best) if verdict == "ambiguous" else None
            return replace(found, verdict=verdict, candidates=(best, *found.candidates), experiment=advice)
    return found


def settled(found: Diagnosis, last: Diagnosis) -> Diagnosis:
    """A diagnosis in the light of the last of the rounds that followed it.

    An effect that leaves more than noise is the answer only if further effects explain the rest.
    """
    if last.accounted or found.verdict == "nothing_missing":
        return found
    return replace(found, verdict="unexplained", experiment=None)


def located(found: Diagnosis, *, progress: Progress = lambda text: None) -> Diagnosis:
    """A diagnosis that says where the model fails and how much of it repeats, if something is unexplained."""
    if found.verdict != "unexplained":
        return found
    progress("looking for what the missing force depends on")
    if not found.missing:
        missing = find_missing_force(found.study, found.fit)
        found = replace(found, missing=missing, where=concentrations(found.study, missing))
    return replace(found, repeats=repeats_of(found.study, found.fit))


def with_law(found: Diagnosis, *, progress: Progress = lambda text: None) -> Diagnosis:
    """A diagnosis with a free-form law for what is unexplained, if there is such a thing."""
    if found.verdict != "unexplained":
        return found
    from wheelpend.free_law import find_law  # imported late: reading laws takes SymPy

    return replace(found, law=find_law(found.study, found.fit, progress=progress))


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


def conclude(study, base, before, residuals, tried, far: Screen, missing: MissingForce | None) -> Diagnosis:
    """Turn the refits into a verdict."""
    named = [t for t in tried if t.worth_naming(before) and stands_alone(study, t, tried)]
    impossible = [t for t in tried if not t.physical and t.error_after < (1.0 - WORTHWHILE) * before]
    named = [_with_equivalents(study, t, named, far) for t in named]
    verdict = verdict_on(study, named, before)
    return Diagnosis(
        verdict=verdict,
        horizon_s=study.horizon,
        error=before,
        noise_floor=study.floor,
        fit_percent=fit_percent(study, residuals),
        candidates=(*named, *impossible),
        experiment=experiment(study, named[0], named[1:]) if verdict == "ambiguous" else None,
        detectable=detectable(study, far) if verdict == "nothing_missing" else {},
        where=concentrations(study, missing) if missing and before > VISIBLE * study.floor else (),
        not_judged={
            e.name: why for e in derive.effects.possible_on(study.plant, study.model.own) if (why := study.lacking(e))
        },
        warnings=study.warnings,
        fit=base,
        study=study,
        missing=missing,
        screen=far,
        tried=tuple(tried),
    )


def verdict_on(study: Study, named: Sequence[Tried], before: float) -> str:
    """Verdict on what is worth naming, best first, where the error without it is ``before``."""
    if not named:
        return "unexplained" if before > EXPLAINED * study.floor else "nothing_missing"
    return "effect_missing" if study.held and not named[0].equivalent_to else "ambiguous"


def stands_alone(study: Study, tried: Tried, others: Sequence[Tried]) -> bool:
    """Whether an effect is worth naming over every effect that it contains, and over what it approaches."""
    smaller = {*study.module.CONTAINS.get(tried.effect, {}), derive.effects.find(tried.effect).approaches}
    return all(tried.worth_more_than(o) for o in others if o.effect in smaller)


def always_alike(study: Study, tried: Tried) -> set[str]:
    """Effects that the equations cannot tell from one.

    With several logs one with a value in each is not matched by one with a value for all.
    """
    own = derive.effects.find(tried.effect)
    single = len(study.noise) == 1
    judged = {e.name: e for e in study.missable()}
    alike = [judged[n] for n in study.module.TWINS.get(tried.effect, ()) if n in judged]
    return {e.name for e in alike if single or per_log_names(e.full_names) or not per_log_names(own.full_names)}


def _with_equivalents(study: Study, tried: Tried, named: Sequence[Tried], far: Screen) -> Tried:
    close = {o.effect for o in named if o is not tried and abs(o.error_after / tried.error_after - 1.0) <= EQUIVALENT}
    close |= set(far.twins.get(tried.effect, ())) | always_alike(study, tried)
    return replace(tried, equivalent_to=tuple(sorted(close)))


def fit_percent(study: Study, residuals: list[np.ndarray]) -> dict[str, float]:
    """100 (1 − NRMSE) of each channel over the held-out segments."""
    found = {}
    parts = [h.part for h in study.held] or list(study.training)
    for c, channel in enumerate(parts[0].log.channels):
        error = np.concatenate([r[:, c] * p.sigma[c] for r, p in zip(residuals, parts, strict=False)] or [np.zeros(1)])
        values = np.concatenate([np.where(np.isfinite(r[:, c]), p.log.measured[:, c], np.nan)
                                 for r, p in zip(residuals, parts, strict=False)] or [np.zeros(1)])  # fmt: skip
        spread = np.nanstd(values) * np.sqrt(np.isfinite(values).sum())
        found[channel] = float(100.0 * (1.0 - np.sqrt(np.nansum(error**2)) / spread)) if spread > 0 else 0.0
    return found


def detectable(study: Study, far: Screen) -> dict[str, dict[str, float]]:
    """The smallest size of each effect that this log would have shown.

    It must stand 5 standard errors clear of zero and lower the error by what makes it worth naming.
    """
    values = sum(p.values for p in study.training)
    factor = max(5.0, float(np.sqrt(2.0 * WORTHWHILE * values)))
    return {
        c.effect.name: {n.partition(".")[2]: factor * s for n, s in c.sigma.items()}
        for c in sorted(far.candidates, key=lambda c: c.effect.name)
        if c.sigma and all(0.0 < s < 1e6 for s in c.sigma.values())
    }


def experiment(study: Study, first: Tried, others: Sequence[Tried] = ()) -> str:
    """What would tell the first candidate from its equivalents."""
    from wheelpend.separation import advice

    return advice(study, first, others)
