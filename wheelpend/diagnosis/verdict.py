"""The verdict: the candidates that are named, their equivalents, and the sizes that the data would have shown."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np

import derive
from derive.parameter_name import short_name
from wheelpend.diagnosis.block_evidence import p_value_of_rest
from wheelpend.diagnosis.criteria import MAX_EQUIVALENT_ERROR_DIFFERENCE, MIN_RELATIVE_ERROR_DECREASE
from wheelpend.diagnosis.evidence import CandidateFit, ValidatedFit
from wheelpend.diagnosis.missing_force.estimate import ForceConcentration, MissingForce
from wheelpend.diagnosis.missing_force.repeatability import ExplainedForce, explained_forces
from wheelpend.diagnosis.missing_force.smoothed_force import missing_forces, where_it_shows
from wheelpend.diagnosis.negligible import is_negligible, negligible_sentences
from wheelpend.diagnosis.refit import Progress
from wheelpend.diagnosis.score_test import ScoreTest
from wheelpend.diagnosis.structures import (
    MIN_NOTHING_PROBABILITY,
    RoundEvidence,
    Structure,
    probability_of,
    probability_of_none,
    probability_of_nothing_seen,
    probability_outside,
    structures,
)
from wheelpend.estimation.criteria import MAX_EXPLAINED_ERROR_RATIO, MAX_NOISE_LEVEL_ERROR_RATIO
from wheelpend.estimation.estimate import ESTIMATE_COLUMNS, Estimate
from wheelpend.estimation.fit import Fit
from wheelpend.estimation.free_parameters import per_log_names
from wheelpend.estimation.noise_alarm import is_overstated, overstated_noise
from wheelpend.estimation.parameter_table import parameter_table
from wheelpend.estimation.problem import EstimationProblem, narrower_effects
from wheelpend.estimation.validation import fit_percent, unpredicted_share, validation_residuals
from wheelpend.identification.remainder import Remainder
from wheelpend.identification.remainder_at import refitted_remainder, remainder_or_warning
from wheelpend.identification.remainder_warnings import determine_nothing, remainder_warnings, undetermined_warnings
from wheelpend.notebook import DrawnResult, ResultTable

if TYPE_CHECKING:
    from wheelpend.diagnosis.missing_force.law_search import FreeLaw

MAX_UNKNOWN_PROBABILITY = 0.5  # that something is missing which no effect is, where it is said that nothing is
CANDIDATE_COLUMNS = {**ESTIMATE_COLUMNS, "p_value": float, "probability": float}  # of tables of effects


@dataclass(frozen=True, repr=False)
class Diagnosis(DrawnResult):
    """What is missing in a model, according to logs."""

    verdict: str  # nothing_missing, effect_missing, ambiguous or unexplained
    horizon_s: float
    error: float  # on validation data [σ], after refitting the model's own parameters
    noise_floor: float
    fit_percent: dict[str, float]
    candidates: tuple[CandidateFit, ...]  # worth naming, best first; then those that are physically impossible
    experiment: str | None  # that would tell the first candidate from its equivalents, once advice was asked for
    detectable: dict[str, dict[str, float]]
    where: tuple[ForceConcentration, ...]
    not_judged: dict[str, str]  # effects left out, and why
    warnings: tuple[str, ...]
    fit: Fit = field(repr=False)
    problem: EstimationProblem = field(repr=False)
    missing: tuple[MissingForce, ...] = field(repr=False, default=())  # of each log
    score_test: ScoreTest | None = field(repr=False, default=None)
    refitted: tuple[CandidateFit, ...] = field(repr=False, default=())  # every effect that was refitted
    repeats: tuple[ExplainedForce, ...] = ()  # of what is unexplained: on what it depends, and how much of it repeats
    law: FreeLaw | None = None  # for what is unexplained, on request
    remainder: Remainder | None = None  # what the model leaves to chance with its own parameters refitted
    p_rest: float = field(repr=False, default=1.0)  # p-value of what is held out being no more than the model expects
    structures: tuple[Structure, ...] = ()  # what may be missing, the likeliest first, once every round is known
    is_doubtful: bool = False  # True where it is likelier that one more effect is missing than that none is
    steps: tuple[str, ...] = ()  # effects that were added in turn while the search looked for the rest
    error_with_steps: float | None = None  # that they leave
    determines_nothing: bool = False  # True where no noise alone is left, and the logs determine no parameter
    by_likelihood: bool = False  # True where effects were judged with a random force: sensor noise is out of reach

    @staticmethod
    def of(
        problem: EstimationProblem, base: ValidatedFit, verdict: str, candidates: Sequence[CandidateFit]
    ) -> Diagnosis:
        """A verdict on a model as it was fitted, and the effects that may be missing; nothing further is known yet."""
        judged = problem.data.held_out or problem.data.estimation
        return Diagnosis(
            verdict=verdict,
            horizon_s=problem.horizon,
            error=base.error,
            noise_floor=problem.floor,
            fit_percent=fit_percent(problem, base.residuals),
            candidates=tuple(candidates),
            experiment=None,
            detectable={},
            where=(),
            not_judged=not_testable(problem),
            warnings=(*problem.warnings, *overstated_noise(problem, base.error, judged, base.residuals)),
            fit=base.fit,
            problem=problem,
        )

    def to_json(self) -> dict[str, Any]:
        """The result under the keys of JSON."""
        return {
            "verdict": self.verdict,
            "horizon_s": self.horizon_s,
            "error": self.error,
            "noise_floor": self.noise_floor,
            "fit_percent": self.fit_percent,
            "candidates": self.candidates,
            "experiment": self.experiment,
            "detectable": self.detectable,
            "where": self.where,
            "not_judged": self.not_judged,
            "warnings": self.warnings,
            "missing": self.repeats,
            "law": self.law,
            "remainder": self.remainder,
            "structures": self.structures,
            "steps": self.steps,
            "error_with_steps": self.error_with_steps,
        }

    def headline(self) -> str:
        """The verdict, and the error of the model without any candidate."""
        return f"Diagnosis: {self.verdict}, error {self.error:.3g} σ at a noise floor of {self.noise_floor:.3g} σ"

    def table(self) -> ResultTable:
        """A row per parameter of every candidate, best candidate first; sizes and errors in the row's unit."""
        columns = {**CANDIDATE_COLUMNS, "error_after": float, "physical": bool, "equivalent_to": str}
        rows = [
            (*row, c.p_value, c.probability, c.error_after, c.physical, ", ".join(c.equivalent_to))
            for c in self.candidates
            for row in c.rows()
        ]
        return ResultTable(columns, rows)

    @property
    def named(self) -> tuple[CandidateFit, ...]:
        """Candidates that are worth naming."""
        return tuple(t for t in self.candidates if t.physical)

    @property
    def replaces(self) -> dict[str, tuple[str, ...]]:
        """Effects of the model that each refitted one contains or approaches, and whose place it takes."""
        return {c.effect: self.problem.replaced(c.effect) for c in self.refitted}

    @property
    def p_value_of_rest(self) -> float:
        """P-value of nothing more being there, with the first candidate where there is one."""
        own, left = self.named[0].p_rest if self.named else self.p_rest, self.remainder
        told = [] if left is None else [found.p_value for found in (*left.what_repeats, *left.repeating, *left.slow)]
        return float(min([own, *told]) if self.by_likelihood else min(told, default=own))

    @property
    def leaves_unknown(self) -> bool:
        """More than noise is left, and it is likelier than not that something is missing which no effect is."""
        above_noise = not self.error <= MAX_EXPLAINED_ERROR_RATIO * self.noise_floor
        return above_noise and probability_of_none(self.p_value_of_rest) > MAX_UNKNOWN_PROBABILITY

    @property
    def is_explained(self) -> bool:
        """Nothing but noise is left, with the first candidate where there is one; or a force that no law predicts."""
        if self.by_likelihood:
            return self.verdict == "nothing_missing"
        left = self.named[0].error_after if self.named else self.error
        return left <= MAX_EXPLAINED_ERROR_RATIO * self.noise_floor


def revise_verdict(found: Diagnosis, last: Diagnosis) -> Diagnosis:
    """A diagnosis in the light of the last of the rounds that followed it.

    An effect that leaves more than noise is the answer only if further effects explain the rest.
    """
    if last.is_explained or found.verdict == "nothing_missing":
        return found
    return replace(found, verdict="unexplained", experiment=None)


def with_structures(found: Diagnosis, rounds: Sequence[Diagnosis]) -> Diagnosis:
    """A diagnosis with the probabilities of what may be missing, by the rounds of its search.

    Where no further effect is certain, but that nothing more is missing is improbable too, something is unexplained.
    Where that nothing is missing is likelier than the effect that is named, a warning says so.
    """
    evidence = [_round_evidence(one) for one in rounds]
    known = structures(evidence, [e.name for e in rounds[0].problem.candidates()], rounds[-1].p_value_of_rest)
    nothing = probability_of_nothing_seen(known, _standing(rounds), rounds[-1].replaces)
    if found.verdict == "nothing_missing" and found.problem is rounds[-1].problem and not found.named:
        improbable = nothing < MIN_NOTHING_PROBABILITY
        found = replace(found, verdict="unexplained", detectable={}) if improbable else found
    if rounds[0].named and (said := _less_likely_than_nothing(rounds, known)):
        found = replace(found, warnings=(*found.warnings, said))
    likely = [(c, probability_of(and_what_replaced(c.effect, rounds), known)) for c in found.candidates]
    candidates = tuple(replace(c, probability=p) for c, p in likely)
    return replace(
        found, structures=known, candidates=candidates, is_doubtful=1.0 - nothing - probability_outside(known) > nothing
    )


def _standing(rounds: Sequence[Diagnosis]) -> list[str]:
    """Effects that the rounds of a search named first, but those in whose place a later one came."""
    found: list[str] = []
    for one in (r for r in rounds if r.named):
        effect = one.named[0].effect
        found = [*(e for e in found if e not in one.problem.replaced(effect)), effect]
    return found


def _less_likely_than_nothing(rounds: Sequence[Diagnosis], known: Sequence[Structure]) -> str:
    """That the first effect of a search is less likely than that nothing is missing; nothing where it is not."""
    first = rounds[0].named[0].effect
    own, nothing = probability_of(and_what_replaced(first, rounds), known), probability_of_nothing_seen(known)
    if own >= nothing or nothing < MIN_NOTHING_PROBABILITY:  # of two that are improbable neither is a suspect
        return ""
    return (
        f"{first} is significant, but that nothing is missing is likelier (probability {100 * nothing:.0f} % against "
        f"{100 * own:.0f} %): a log so short names it only as a suspect. Record a longer one."
    )


def with_steps(found: Diagnosis, rounds: Sequence[Diagnosis]) -> Diagnosis:
    """A diagnosis that says what the rounds of its search added, each the first of its round, and what that leaves."""
    added = tuple(r.named[0].effect for r in rounds[:-1])
    return replace(found, steps=added, error_with_steps=rounds[-1].error if added else None)


def _round_evidence(found: Diagnosis) -> RoundEvidence:
    """Evidence of the laws that a round tried: of those that may be, and of the one that is named even so.

    A law whose shape is open is named only where the library has no simpler one that explains as much.
    """
    named = found.named[0].effect if found.named else ""
    tried = {c.effect: c for c in found.refitted}
    told = {n: c.evidence for n, c in tried.items() if c.evidence is not None and (c.is_possible or n == named)}
    return RoundEvidence(told, named, found.replaces)


def and_what_replaced(effect: str, rounds: Sequence[Diagnosis]) -> set[str]:
    """An effect, and those that took its place in the rounds of a search: with these in the model it is there too."""
    names = {effect}
    for one in (r for r in rounds if r.named):
        if not names.isdisjoint(one.problem.replaced(one.named[0].effect)):
            names.add(one.named[0].effect)
    return names


def with_missing_force(found: Diagnosis, *, progress: Progress = lambda text: None) -> Diagnosis:
    """A diagnosis with the force that its model lacks along each log, and where it shows if that is more than noise."""
    if found.missing:
        return found
    progress("estimating the missing force")
    missing = missing_forces(found.problem, found.fit)
    failing = found.verdict == "unexplained" or found.error > MAX_NOISE_LEVEL_ERROR_RATIO * found.noise_floor
    where = where_it_shows(found.problem, missing, found.fit) if failing else ()
    return replace(found, missing=missing, where=where)


def with_repeating_force(found: Diagnosis, *, progress: Progress = lambda text: None) -> Diagnosis:
    """A diagnosis that says where its model fails and how much of the missing force repeats, if one is unexplained."""
    if found.verdict != "unexplained" or found.determines_nothing:
        return found
    found = with_missing_force(found, progress=progress)
    progress("looking for what the missing force depends on")
    return replace(found, repeats=explained_forces(found.problem, found.fit))


def with_remainder(found: Diagnosis, *, progress: Progress = lambda text: None) -> Diagnosis:
    """A diagnosis that says what its model leaves to chance and what of it the logs do not determine.

    Or that warns that the former could not be found.
    """
    problem, left = found.problem, found.remainder
    warnings: tuple[str, ...] = ()
    if left is None:
        progress("measuring what is left to chance")
        values = [found.fit.of_log(k) for k in range(len(problem.logs))]
        left, warnings = remainder_or_warning(refitted_remainder, problem, values)
        _, residuals = validation_residuals(problem, found.fit)
        left = left and replace(left, unpredicted=unpredicted_share(problem.data.held_out, residuals))
    table = parameter_table(problem, found.fit)
    undetermined = undetermined_warnings(problem.module, problem.plant, table)
    said = (*found.warnings, *warnings, *remainder_warnings(left, problem.plant), *undetermined)
    found = replace(found, remainder=left, warnings=said)
    return where_nothing_is_determined(where_chance_does_not_explain(found), table)


def where_chance_does_not_explain(found: Diagnosis) -> Diagnosis:
    """A diagnosis that names no effect, as unexplained where held-out data miss more than noise, and no chance is left.

    What was fitted then needs no random force, and so shows less than what is held out.
    """
    at_noise = found.error <= MAX_EXPLAINED_ERROR_RATIO * found.noise_floor
    chance = found.remainder is None or not found.remainder.is_nothing
    if at_noise or chance or found.named or found.verdict != "nothing_missing":
        return found
    return replace(found, verdict="unexplained", detectable={})


def where_nothing_is_determined(found: Diagnosis, table: Mapping[str, Estimate]) -> Diagnosis:
    """A diagnosis that names no effect, as unexplained where its logs determine nothing and leave more than noise.

    Or far less than it, as σ is overstated then. Nothing is known to be missing, and nothing to be there.
    """
    problem = found.problem
    at_noise = found.error <= MAX_EXPLAINED_ERROR_RATIO * found.noise_floor
    at_noise = at_noise and not is_overstated(problem, found.error, problem.data.held_out)
    if at_noise or found.named or not determine_nothing(table, problem.plant):
        return found
    return replace(found, verdict="unexplained", detectable={}, determines_nothing=True)


def with_law(found: Diagnosis, *, progress: Progress = lambda text: None) -> Diagnosis:
    """A diagnosis with a free-form law for what is unexplained, if there is such a thing."""
    if found.verdict != "unexplained" or found.determines_nothing:
        return found
    from wheelpend.diagnosis.missing_force.law_search import find_law  # imported late: reading laws takes SymPy

    return replace(found, law=find_law(found.problem, found.fit, progress=progress))


def conclude(
    problem: EstimationProblem,
    base: ValidatedFit,
    candidates: Sequence[CandidateFit],
    full_score_test: ScoreTest,
) -> Diagnosis:
    """The verdict on refitted candidates, the best first, against the model without them."""
    supported = [c for c in candidates if c.is_supported(base.error) and improves_on_nested(problem, c, candidates)]
    lowering = [c for c in candidates if c.error_after < (1.0 - MIN_RELATIVE_ERROR_DECREASE) * base.error]
    named = [_with_equivalents(problem, c, supported, full_score_test) for c in supported]
    verdict = verdict_on(problem, named, base.error)
    negligible = [c for c in candidates if verdict == "nothing_missing" and is_negligible(c, base.error)]
    found = Diagnosis.of(problem, base, verdict, [*named, *(c for c in lowering if not c.physical)])
    return replace(
        found,
        warnings=(*found.warnings, *negligible_sentences(negligible)),
        detectable=detectable(problem, full_score_test) if verdict == "nothing_missing" else {},
        score_test=full_score_test,
        refitted=tuple(candidates),
        p_rest=p_value_of_rest(base.residuals, problem.floor),
    )


def not_testable(problem: EstimationProblem) -> dict[str, str]:
    """Effects of the plant that are left out, and why."""
    rows = derive.effects.applicable_to(problem.plant, problem.model.own)
    return {e.name: why for e in rows if (why := problem.why_not_testable(e))}


def verdict_on(problem: EstimationProblem, named: Sequence[CandidateFit], error_before: float) -> str:
    """Verdict on the candidates that are worth naming, best first."""
    if not named:
        return "unexplained" if error_before > MAX_EXPLAINED_ERROR_RATIO * problem.floor else "nothing_missing"
    return "effect_missing" if problem.data.validation and not named[0].equivalent_to else "ambiguous"


def improves_on_nested(problem: EstimationProblem, candidate: CandidateFit, others: Sequence[CandidateFit]) -> bool:
    """An effect worth naming over every simpler one of the same force."""
    simpler = narrower_effects(problem.module, candidate.effect)
    return all(candidate.improves_on(o) for o in others if o.effect in simpler)


def structurally_equivalent(problem: EstimationProblem, candidate: CandidateFit) -> set[str]:
    """Effects that the equations cannot tell from one.

    With several logs one with a value in each is not matched by one with a value for all.
    """
    effect = derive.effects.find(candidate.effect)
    single = len(problem.noise) == 1
    judged = {e.name: e for e in problem.candidates()}
    alike = [judged[n] for n in problem.module.TWINS.get(candidate.effect, ()) if n in judged]
    return {e.name for e in alike if single or per_log_names(e.full_names) or not per_log_names(effect.full_names)}


def _with_equivalents(
    problem: EstimationProblem, candidate: CandidateFit, named: Sequence[CandidateFit], full_score_test: ScoreTest
) -> CandidateFit:
    close = {
        o.effect
        for o in named
        if o is not candidate
        and abs(o.error_after - candidate.error_after) <= MAX_EQUIVALENT_ERROR_DIFFERENCE * candidate.error_after
    }
    close |= set(full_score_test.twins.get(candidate.effect, ())) | structurally_equivalent(problem, candidate)
    return replace(candidate, equivalent_to=tuple(sorted(close)))


def detectable(problem: EstimationProblem, full_score_test: ScoreTest) -> dict[str, dict[str, float]]:
    """The smallest size of each effect that this log would have shown.

    It must stand 5 standard errors clear of zero and lower the error by what makes it worth naming.
    """
    values = problem.data.values
    factor = max(5.0, float(np.sqrt(2.0 * MIN_RELATIVE_ERROR_DECREASE * values)))
    return {
        c.effect.name: {short_name(n): factor * s for n, s in c.sigma.items()}
        for c in sorted(full_score_test.candidates, key=lambda c: c.effect.name)
        if c.sigma and all(0.0 < s < 1e6 for s in c.sigma.values())
    }
