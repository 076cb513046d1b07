"""The verdict: which candidate is named, what stands beside it, and which sizes the data would have shown."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np

import derive
from wheelpend.diagnosis.candidates import EQUIVALENT
from wheelpend.diagnosis.evidence import WORTHWHILE, Tried
from wheelpend.diagnosis.missing_force.estimate import MissingForce, Place, concentrations, find_missing_force
from wheelpend.diagnosis.missing_force.repeatability import Repeats, repeats_of
from wheelpend.diagnosis.refit import Progress
from wheelpend.diagnosis.score_test import Screen
from wheelpend.estimation.criteria import EXPLAINED, VISIBLE
from wheelpend.estimation.fit import Fit
from wheelpend.estimation.free_parameters import per_log_names
from wheelpend.estimation.problem import Study
from wheelpend.estimation.validation import fit_percent

if TYPE_CHECKING:
    from wheelpend.diagnosis.missing_force.law_search import FreeLaw


@dataclass(frozen=True)
class Diagnosis:
    """What is missing in a model, according to logs."""

    verdict: str
    horizon_s: float
    error: float  # held out, after refitting the model's own parameters
    noise_floor: float
    fit_percent: dict[str, float]
    candidates: tuple[Tried, ...]  # worth naming, best first; then improbable ones that are physically impossible
    experiment: str | None  # what would tell the first candidate from its equivalents, once advice was asked for
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
    from wheelpend.diagnosis.missing_force.law_search import find_law  # imported late: reading laws takes SymPy

    return replace(found, law=find_law(found.study, found.fit, progress=progress))


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
        experiment=None,
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
