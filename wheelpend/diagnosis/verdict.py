"""The verdict: which candidate is named, what stands beside it, and which sizes the data would have shown."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np

import derive
from wheelpend.diagnosis.candidates import MAX_EQUIVALENT_ERROR_DIFFERENCE
from wheelpend.diagnosis.evidence import MIN_RELATIVE_ERROR_DECREASE, CandidateFit
from wheelpend.diagnosis.missing_force.estimate import (
    ForceConcentration,
    MissingForce,
    concentrations,
    estimate_missing_force,
)
from wheelpend.diagnosis.missing_force.repeatability import ExplainedForce, explained_forces
from wheelpend.diagnosis.refit import Progress
from wheelpend.diagnosis.score_test import ScoreTest
from wheelpend.estimation.criteria import MAX_EXPLAINED_ERROR_RATIO, MAX_NOISE_LEVEL_ERROR_RATIO
from wheelpend.estimation.fit import Fit
from wheelpend.estimation.free_parameters import per_log_names
from wheelpend.estimation.problem import EstimationProblem
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
    candidates: tuple[
        CandidateFit, ...
    ]  # worth naming, best first; then improbable ones that are physically impossible
    experiment: str | None  # what would tell the first candidate from its equivalents, once advice was asked for
    detectable: dict[str, dict[str, float]]
    where: tuple[ForceConcentration, ...]
    not_judged: dict[str, str]  # effects left out, and why
    warnings: tuple[str, ...]
    fit: Fit = field(repr=False)
    problem: EstimationProblem = field(repr=False)
    missing: MissingForce | None = field(repr=False, default=None)
    score_test: ScoreTest | None = field(repr=False, default=None)
    tried: tuple[CandidateFit, ...] = field(repr=False, default=())  # every effect that was refitted
    repeats: tuple[ExplainedForce, ...] = ()  # of what is unexplained: on what it depends, and how much of it repeats
    law: FreeLaw | None = None  # for what is unexplained, on request

    @property
    def named(self) -> tuple[CandidateFit, ...]:
        """Candidates that are worth naming."""
        return tuple(t for t in self.candidates if t.physical)

    @property
    def is_explained(self) -> bool:
        """Whether nothing but noise is left, with the first candidate where there is one."""
        left = self.named[0].error_after if self.named else self.error
        return left <= MAX_EXPLAINED_ERROR_RATIO * self.noise_floor


def revise_verdict(found: Diagnosis, last: Diagnosis) -> Diagnosis:
    """A diagnosis in the light of the last of the rounds that followed it.

    An effect that leaves more than noise is the answer only if further effects explain the rest.
    """
    if last.is_explained or found.verdict == "nothing_missing":
        return found
    return replace(found, verdict="unexplained", experiment=None)


def with_missing_force(found: Diagnosis, *, progress: Progress = lambda text: None) -> Diagnosis:
    """A diagnosis that says where the model fails and how much of it repeats, if something is unexplained."""
    if found.verdict != "unexplained":
        return found
    progress("looking for what the missing force depends on")
    if not found.missing:
        missing = estimate_missing_force(found.problem, found.fit)
        found = replace(found, missing=missing, where=concentrations(found.problem, missing))
    return replace(found, repeats=explained_forces(found.problem, found.fit))


def with_law(found: Diagnosis, *, progress: Progress = lambda text: None) -> Diagnosis:
    """A diagnosis with a free-form law for what is unexplained, if there is such a thing."""
    if found.verdict != "unexplained":
        return found
    from wheelpend.diagnosis.missing_force.law_search import find_law  # imported late: reading laws takes SymPy

    return replace(found, law=find_law(found.problem, found.fit, progress=progress))


def conclude(
    problem, base, before, residuals, tried, full_score_test: ScoreTest, missing: MissingForce | None
) -> Diagnosis:
    """Turn the refits into a verdict."""
    named = [t for t in tried if t.is_supported(before) and improves_on_nested(problem, t, tried)]
    impossible = [t for t in tried if not t.physical and t.error_after < (1.0 - MIN_RELATIVE_ERROR_DECREASE) * before]
    named = [_with_equivalents(problem, t, named, full_score_test) for t in named]
    verdict = verdict_on(problem, named, before)
    return Diagnosis(
        verdict=verdict,
        horizon_s=problem.horizon,
        error=before,
        noise_floor=problem.floor,
        fit_percent=fit_percent(problem, residuals),
        candidates=(*named, *impossible),
        experiment=None,
        detectable=detectable(problem, full_score_test) if verdict == "nothing_missing" else {},
        where=concentrations(problem, missing)
        if missing and before > MAX_NOISE_LEVEL_ERROR_RATIO * problem.floor
        else (),
        not_judged={
            e.name: why
            for e in derive.effects.applicable_to(problem.plant, problem.model.own)
            if (why := problem.why_not_testable(e))
        },
        warnings=problem.warnings,
        fit=base,
        problem=problem,
        missing=missing,
        score_test=full_score_test,
        tried=tuple(tried),
    )


def verdict_on(problem: EstimationProblem, named: Sequence[CandidateFit], before: float) -> str:
    """Verdict on what is worth naming, best first, where the error without it is ``before``."""
    if not named:
        return "unexplained" if before > MAX_EXPLAINED_ERROR_RATIO * problem.floor else "nothing_missing"
    return "effect_missing" if problem.validation and not named[0].equivalent_to else "ambiguous"


def improves_on_nested(problem: EstimationProblem, tried: CandidateFit, others: Sequence[CandidateFit]) -> bool:
    """Whether an effect is worth naming over every effect that it contains, and over what it approaches."""
    smaller = {*problem.module.CONTAINS.get(tried.effect, {}), derive.effects.find(tried.effect).approaches}
    return all(tried.improves_on(o) for o in others if o.effect in smaller)


def structurally_equivalent(problem: EstimationProblem, tried: CandidateFit) -> set[str]:
    """Effects that the equations cannot tell from one.

    With several logs one with a value in each is not matched by one with a value for all.
    """
    own = derive.effects.find(tried.effect)
    single = len(problem.noise) == 1
    judged = {e.name: e for e in problem.candidates()}
    alike = [judged[n] for n in problem.module.TWINS.get(tried.effect, ()) if n in judged]
    return {e.name for e in alike if single or per_log_names(e.full_names) or not per_log_names(own.full_names)}


def _with_equivalents(
    problem: EstimationProblem, tried: CandidateFit, named: Sequence[CandidateFit], full_score_test: ScoreTest
) -> CandidateFit:
    close = {
        o.effect
        for o in named
        if o is not tried and abs(o.error_after / tried.error_after - 1.0) <= MAX_EQUIVALENT_ERROR_DIFFERENCE
    }
    close |= set(full_score_test.twins.get(tried.effect, ())) | structurally_equivalent(problem, tried)
    return replace(tried, equivalent_to=tuple(sorted(close)))


def detectable(problem: EstimationProblem, full_score_test: ScoreTest) -> dict[str, dict[str, float]]:
    """The smallest size of each effect that this log would have shown.

    It must stand 5 standard errors clear of zero and lower the error by what makes it worth naming.
    """
    values = sum(p.values for p in problem.training)
    factor = max(5.0, float(np.sqrt(2.0 * MIN_RELATIVE_ERROR_DECREASE * values)))
    return {
        c.effect.name: {n.partition(".")[2]: factor * s for n, s in c.sigma.items()}
        for c in sorted(full_score_test.candidates, key=lambda c: c.effect.name)
        if c.sigma and all(0.0 < s < 1e6 for s in c.sigma.values())
    }
