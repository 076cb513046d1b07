"""The error ladder: diagnose and add in turn until nothing is missing."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from wheelpend.diagnosis.criteria import MAX_ADDED_EFFECTS
from wheelpend.diagnosis.evidence import CandidateFit, LogEstimate
from wheelpend.diagnosis.missing_force.repeatability import ExplainedForce
from wheelpend.diagnosis.stepwise import Rounds, stepwise
from wheelpend.diagnosis.structures import Structure, probability_of
from wheelpend.diagnosis.verdict import (
    CANDIDATE_COLUMNS,
    Diagnosis,
    and_what_replaced,
    revise_verdict,
    with_law,
    with_missing_force,
    with_remainder,
    with_repeating_force,
    with_structures,
)
from wheelpend.estimation.criteria import MAX_EXPLAINED_ERROR_RATIO
from wheelpend.estimation.data import prepare
from wheelpend.estimation.estimate import EffectEstimate, Estimate
from wheelpend.estimation.fit import Fit
from wheelpend.estimation.free_parameters import known_values
from wheelpend.estimation.parameter_table import parameter_table
from wheelpend.estimation.problem import EstimationProblem
from wheelpend.estimation.validation import validation_residuals
from wheelpend.estimation.workable_horizon import over_workable_horizon
from wheelpend.identification.remainder import Remainder
from wheelpend.identification.remainder import with_remainder as model_with_remainder
from wheelpend.logs.sources import LogsLike
from wheelpend.model.record import Model
from wheelpend.notebook import DrawnResult, ResultTable
from wheelpend.parallel import with_one_blas_thread

if TYPE_CHECKING:
    from wheelpend.diagnosis.missing_force.law_search import FreeLaw


@dataclass(frozen=True)
class Step(EffectEstimate):
    """One effect added or removed, and the validation error before and after."""

    p_value: float | None
    equivalent_to: tuple[str, ...]
    error_before: float
    error_after: float
    parameters: dict[str, float] = field(default_factory=dict)  # base parameters after the step
    per_log: tuple[LogEstimate, ...] = ()  # of several logs, where the effect has a size in each
    blocks_agree: str | None = None
    held_out_gain: float | None = None  # of log-likelihood with a random force [nats], where that is what judged
    force_before: float | None = None  # the random force that is left, as a share of the drive; None where not known
    force_after: float | None = None
    probability: float | None = None  # that the effect is missing, alone or with others

    def to_json(self) -> dict[str, Any]:
        """The step under the keys of JSON."""
        return {
            "effect": self.effect,
            "coefficients": self.coefficients,
            "sigma": self.sigma,
            "unit": self.unit,
            "p_value": self.p_value,
            "equivalent_to": self.equivalent_to,
            "error_before": self.error_before,
            "error_after": self.error_after,
            "parameters": self.parameters,
            "per_log": self.per_log,
            "blocks_agree": self.blocks_agree,
            "held_out_gain": self.held_out_gain,
            "force_before": self.force_before,
            "force_after": self.force_after,
            "probability": self.probability,
        }


STEP_COLUMNS = {"step": int, **CANDIDATE_COLUMNS, "error_before": float, "error_after": float}


@dataclass(frozen=True, repr=False)
class Ladder(DrawnResult):
    """The error ladder of a model on its logs."""

    verdict: str
    nominal_error: float | None
    base_error: float
    steps: tuple[Step, ...]
    effects: tuple[str, ...]
    error: float
    noise_floor: float
    horizon_s: float
    parameters: dict[str, Estimate]  # by name
    experiment: str | None
    warnings: tuple[str, ...]
    model: Model = field(repr=False)  # with the effects and the fitted values
    first: Diagnosis = field(repr=False)
    last: Diagnosis = field(repr=False)
    fit: Fit = field(repr=False)
    problem: EstimationProblem = field(repr=False)
    repeats: tuple[ExplainedForce, ...] = ()  # of the unexplained force: its variables, and how much of it repeats
    law: FreeLaw | None = None  # for the unexplained force, on request
    remainder: Remainder | None = None  # what the model leaves to chance after the last step
    structures: tuple[Structure, ...] = ()  # what may be missing in the model as it came, the likeliest first
    unclear: Diagnosis | None = field(repr=False, default=None)  # the first of the rounds between that is ambiguous

    def to_json(self) -> dict[str, Any]:
        """The result under the keys of JSON."""
        return {
            "verdict": self.verdict,
            "nominal_error": self.nominal_error,
            "base_error": self.base_error,
            "steps": self.steps,
            "effects": self.effects,
            "error": self.error,
            "noise_floor": self.noise_floor,
            "horizon_s": self.horizon_s,
            "parameters": self.parameters,
            "experiment": self.experiment,
            "warnings": self.warnings,
            "missing": self.repeats,
            "law": self.law,
            "remainder": self.remainder,
            "structures": self.structures,
        }

    def headline(self) -> str:
        """The verdict, and how far the error fell."""
        fall = f"error {self.base_error:.3g} -> {self.error:.3g} σ at a noise floor of {self.noise_floor:.3g} σ"
        return f"Ladder: {self.verdict}, {fall}, {len(self.steps)} step{'' if len(self.steps) == 1 else 's'}"

    def table(self) -> ResultTable:
        """A row per parameter of every step, in order; sizes in the row's unit, errors in σ."""
        return ResultTable(STEP_COLUMNS, [row for k, step in enumerate(self.steps, 1) for row in step_rows(k, step)])


def step_rows(number: int, step: Step) -> list[tuple]:
    """Rows of STEP_COLUMNS of a step."""
    judged = (step.p_value, step.probability, step.error_before, step.error_after)
    return [(number, *row, *judged) for row in step.rows()]


@with_one_blas_thread
def explain(
    model: Model,
    logs: LogsLike,
    holdout: LogsLike = (),
    *,
    max_effects: int = MAX_ADDED_EFFECTS,
    without: Sequence[str] = (),
    law: bool = False,
    progress: Callable[[str], None] = lambda text: None,
) -> Ladder:
    """Add effects, the best first, until nothing is missing or max_effects were added. Writes no files.

    Effects named in ``without`` are not tried. With ``law`` a free-form law is fitted to what no effect explains.
    """
    searched = over_workable_horizon(
        lambda horizon: prepare(model, logs, holdout, horizon=horizon, without=without),
        lambda problem, start: stepwise(problem, start, lambda found: len(found) > max_effects, progress),
        progress,
    )
    rounds = told_apart(searched)
    last = with_structures(revise_verdict(rounds[-1], rounds[-1]), rounds)
    last = with_repeating_force(with_remainder(last, progress=progress), progress=progress)
    first = with_missing_force(revise_verdict(rounds[0], last) if rounds[1:] else last, progress=progress)
    nominal = nominal_error(rounds[0].problem)  # on the data of all the steps
    return _error_ladder(rounds, first, with_law(last, progress=progress) if law else last, nominal)


def _error_ladder(rounds: Rounds, first: Diagnosis, last: Diagnosis, nominal: float | None) -> Ladder:
    """The ladder of some rounds, with the first and the last diagnosis as they are concluded."""
    steps = tuple(
        replace(
            step_between(before, after),
            probability=probability_of(and_what_replaced(before.named[0].effect, rounds), last.structures),
        )
        for before, after in pairwise([*rounds[:-1], last])
    )
    problem = last.problem
    unclear = [] if last.verdict == "unexplained" else rounds[1:-1]  # no experiment helps where a rest is unexplained
    return Ladder(
        verdict=overall_verdict(steps, last),
        nominal_error=nominal,
        base_error=first.error,
        steps=steps,
        effects=problem.model.effects,
        error=last.error,
        noise_floor=problem.floor,
        horizon_s=problem.horizon,
        parameters=parameter_table(problem, last.fit),
        experiment=first.experiment or last.experiment,
        warnings=last.warnings,
        repeats=last.repeats,
        law=last.law,
        remainder=last.remainder,
        structures=last.structures,
        model=fitted_model(problem, last.fit, last.remainder),
        first=first,
        last=last,
        unclear=next((r for r in unclear if r.verdict == "ambiguous"), None),
        fit=last.fit,
        problem=problem,
    )


def told_apart(rounds: Rounds) -> Rounds:
    """Rounds in which no step is said to be hard to tell from another step: the model has both of them."""
    steps = {found.named[0].effect for found in rounds[:-1]}
    return [*(_told_from(steps, found) for found in rounds[:-1]), rounds[-1]]


def _told_from(steps: Collection[str], found: Diagnosis) -> Diagnosis:
    """A diagnosis whose first effect, one of the steps of a ladder, data tell from the others of these."""
    first = found.named[0]
    others = tuple(e for e in first.equivalent_to if e not in steps)
    if others == first.equivalent_to:
        return found
    candidates = tuple(replace(c, equivalent_to=others) if c is first else c for c in found.candidates)
    told = found.verdict == "ambiguous" and not others and bool(found.problem.data.validation)
    return replace(found, candidates=candidates, verdict="effect_missing" if told else found.verdict)


def step_between(before: Diagnosis, after: Diagnosis) -> Step:
    """The step from one diagnosis to the next; beside a random force its effect was judged before the fit's end."""
    step = ladder_step(before.problem, before.named[0], before.error)
    if before.by_likelihood:
        base = {n: after.fit.values[n] for n in before.problem.base}
        step = replace(step, error_after=after.error, parameters=base)
    return replace(step, force_before=remaining_force(before), force_after=remaining_force(after))


def remaining_force(found: Diagnosis) -> float | None:
    """The largest random force that is left on a row, as a share of its drive; None where it was not measured."""
    return None if found.remainder is None else found.remainder.share


def overall_verdict(steps: Sequence[Step], last: Diagnosis) -> str:
    """Verdict of a ladder: unexplained if the last diagnosis says so, else ambiguous if any step was.

    A ladder that had to end before the rest was added leaves that rest unexplained.
    """
    more_than_noise = last.error > MAX_EXPLAINED_ERROR_RATIO * last.noise_floor
    if last.verdict == "unexplained" or (bool(last.named) if last.by_likelihood else more_than_noise):
        return "unexplained"
    return "ambiguous" if any(s.equivalent_to for s in steps) else "nothing_missing"


def nominal_error(problem: EstimationProblem) -> float | None:
    """Validation error with the model's nominal values, before any fit; None without them, or where it diverges."""
    values = {n: v.nominal for n, v in problem.model.parameters.items() if v.nominal is not None}
    if any(n not in values for n in problem.base):
        return None
    fixed = Fit.at({**known_values(problem.model), **values}, [{} for _ in problem.data.estimation])
    error, _ = validation_residuals(problem, fixed)
    return error if np.isfinite(error) else None


def ladder_step(problem: EstimationProblem, candidate: CandidateFit, error_before: float) -> Step:
    """A ladder's step from a refitted candidate."""
    return Step(
        effect=candidate.effect,
        estimates=candidate.estimates,
        p_value=candidate.p_value,
        equivalent_to=candidate.equivalent_to,
        error_before=error_before,
        error_after=candidate.error_after,
        parameters={n: candidate.fit.values[n] for n in problem.base},
        per_log=candidate.per_log,
        blocks_agree=candidate.blocks_agree,
        held_out_gain=candidate.held_out_gain,
    )


def fitted_model(problem: EstimationProblem, fitted: Fit, left: Remainder | None) -> Model:
    """The model with fitted values, and with what is left to chance where that is known."""
    table = parameter_table(problem, fitted)
    return model_with_remainder(problem.model.with_fit({n: (e.value, e.sigma) for n, e in table.items()}), left)
