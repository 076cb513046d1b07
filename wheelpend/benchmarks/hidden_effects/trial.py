"""One log of the benchmark: hide, explain, and compare with the truth; where nothing is hidden, identify too."""

from __future__ import annotations

from dataclasses import dataclass, replace
from time import monotonic
from typing import Any

import numpy as np

import derive
from derive.parameter_name import effect_of
from wheelpend.api import explain
from wheelpend.benchmarks.hidden_effects.cases import Case
from wheelpend.benchmarks.hidden_effects.engine import engine_log
from wheelpend.benchmarks.hidden_effects.scene import TRUE_PARAMETERS
from wheelpend.diagnosis.explain import Ladder
from wheelpend.diagnosis.score_test import linear_names
from wheelpend.diagnosis.stepwise import reduced_model
from wheelpend.errors import Failure, OutOfRange
from wheelpend.estimation.continuation import fit_model
from wheelpend.estimation.fit import Fit
from wheelpend.estimation.free_parameters import free_names
from wheelpend.estimation.parameters import FreeParameter
from wheelpend.estimation.problem import with_stable_step
from wheelpend.estimation.validation import validation_residuals
from wheelpend.identification.identify import identify
from wheelpend.logs.log import Log
from wheelpend.model.record import Model
from wheelpend.simulation.hidden import machine_values
from wheelpend.simulation.simulate import simulate

MAX_REDRAWS = 8  # times that a log is made with smaller effects because the robot falls


@dataclass(frozen=True)
class Outcome:
    """The answer to a case beside the truth; errors are on validation data, in standard deviations of the noise."""

    key: str  # of the case as planned
    kind: str
    source: str
    size: float
    hidden: tuple[str, ...]
    soft: bool  # dry friction that engages slowly, which no law of the library has
    failure: str | None = None
    verdict: str = ""  # of the first diagnosis
    named: tuple[str, ...] = ()  # effects added, in order
    equivalents: tuple[tuple[str, ...], ...] = ()  # declared with each
    final: str = ""  # verdict of the whole explanation
    base_error: float = 0.0  # with the model's own parameters refitted
    error: float = 0.0  # at the end
    true_error: float | None = None  # of the true model, refitted
    floor: float = 1.0
    costs: tuple[float, ...] = ()  # of several: how much larger the error is without each
    strength: float = 0.0  # hidden sizes in standard deviations of the true model's fit
    deviations: tuple[float, ...] = ()  # of what is identifiable in standard errors, where the right effects were named
    estimates: tuple[tuple[str, float], ...] = ()  # nothing hidden: name, error in standard errors
    made: str = ""  # key of the log that was made where the robot would have fallen with the one planned
    seconds: float = 0.0

    def to_json(self) -> dict[str, Any]:
        """The outcome under the keys of its journal."""
        return {
            "key": self.key,
            "kind": self.kind,
            "source": self.source,
            "size": self.size,
            "hidden": self.hidden,
            "soft": self.soft,
            "failure": self.failure,
            "verdict": self.verdict,
            "named": self.named,
            "equivalents": self.equivalents,
            "final": self.final,
            "base_error": self.base_error,
            "error": self.error,
            "true_error": self.true_error,
            "floor": self.floor,
            "costs": self.costs,
            "strength": self.strength,
            "deviations": self.deviations,
            "estimates": self.estimates,
            "made": self.made,
            "seconds": self.seconds,
        }

    @property
    def cost(self) -> float:
        """Relative increase of the error by leaving out the hidden effects; 0 without an error of the true model."""
        return self.base_error / self.true_error - 1.0 if self.true_error else 0.0

    @property
    def found(self) -> tuple[str, ...]:
        """The hidden effects that were named, or declared equivalent to one that was."""
        answers = [{n, *e} for n, e in zip(self.named, self.equivalents, strict=True)]
        return tuple(h for h in self.hidden if any(h in answer for answer in answers))

    @property
    def first_right(self) -> bool:
        """True if the first answer is a hidden effect, or declares one equivalent."""
        return bool(self.named) and bool({self.named[0], *self.equivalents[0]} & set(self.hidden))


def try_case(case: Case, model: Model | None = None) -> Outcome:
    """Make a case's log, explain it, and compare."""
    model, begin = model or Model.default(), monotonic()
    outcome = Outcome(case.key, case.kind, case.source, case.size, case.effects, case.engage > 0.0)
    try:
        made, log = make_standing_log(case, model)
        outcome = replace(outcome, made=made.key if made != case else "")
        explanation = explain(model, [log], without=made.without)
        outcome = replace(outcome, **explanation_fields(explanation))
        outcome = compare_with_truth(outcome, made, explanation, model)
        if made.kind == "complete":
            outcome = replace(outcome, estimates=estimates(made, log, model))
    except (Failure, np.linalg.LinAlgError) as failure:
        outcome = replace(outcome, failure=str(failure))
    return replace(outcome, seconds=monotonic() - begin)


def make_standing_log(case: Case, model: Model) -> tuple[Case, Log]:
    """The log, and the case it shows: with smaller effects than planned where the robot would fall."""
    for _ in range(MAX_REDRAWS):
        try:
            return case, make_log(case, model)
        except OutOfRange:
            case = case.with_smaller_effects()
    return case, make_log(case, model)


def make_log(case: Case, model: Model) -> Log:
    """The measured log."""
    hide = dict(case.hide)
    if case.source == "engine":
        soft = {"engage": case.engage} if case.engage else {}
        return engine_log(hide, command=case.command, seed=case.seed, noise=case.noise, **soft)
    return simulate(model, command=case.command, hide=hide, seed=case.seed)


def explanation_fields(explanation: Ladder) -> dict:
    """Fields of an Outcome that the explanation gives."""
    return {
        "verdict": explanation.first.verdict,
        "named": tuple(s.effect for s in explanation.steps),
        "equivalents": tuple(s.equivalent_to for s in explanation.steps),
        "final": explanation.verdict,
        "base_error": explanation.base_error,
        "error": explanation.error,
        "floor": explanation.noise_floor,
    }


def compare_with_truth(outcome: Outcome, case: Case, explanation: Ladder, model: Model) -> Outcome:
    """Add the true model's error, refitted from the true values, and the named model's deviations from the truth."""
    truth = true_values(case, model)
    open_to_all = replace(explanation.problem, without=(), redundant_effects=())
    problem = with_stable_step(open_to_all.with_effects(case.effects), truth)
    fitted = fit_model(problem, truth, free_names(problem, case.effects), horizons=(1.0,))
    error = validation_residuals(problem, fitted)[0]
    several = case.effects if len(case.effects) > 1 else ()
    fewer = [[e for e in case.effects if e != without] for without in several]
    costs = tuple(reduced_model(open_to_all, effects, fitted).error / error - 1.0 for effects in fewer)
    deviations: tuple[float, ...] = ()
    if set(explanation.effects) == set(case.effects):
        known = {n: e for n, e in explanation.parameters.items() if e.identifiable}
        deviations = tuple((e.value - truth[n]) / e.sigma for n, e in known.items())
    size = size_in_standard_deviations(fitted, case.effects)
    return replace(outcome, true_error=error, strength=size, deviations=deviations, costs=costs)


def estimates(case: Case, log: Log, model: Model) -> tuple[tuple[str, float], ...]:
    """(name, (estimate − truth) / σ) of each of the model's own parameters, identified from the whole log."""
    truth = true_values(case, model)
    found = identify(model, [log]).parameters
    return tuple((name, (e.value - truth[name]) / e.sigma) for name, e in found.items())


def true_values(case: Case, model: Model) -> dict[str, float]:
    """Parameters that the log was made with, the hidden ones included."""
    plain = (
        TRUE_PARAMETERS
        if case.source == "engine"
        else {n: v for n, v in machine_values(model, {}).items() if not effect_of(n)}
    )
    return {**model.constants, **plain, **dict(case.hide)}


def size_in_standard_deviations(fitted: Fit, effects: tuple[str, ...]) -> float:
    """√(θᵀ Σ⁻¹ θ) over the sizes of the effects: the signal of a likelihood-ratio test that knows them."""
    sizes = [n for e in effects for n in linear_names(derive.effects.find(e))]
    keys = [k for k, p in enumerate(fitted.free) if p.name in sizes]
    if not keys:
        return 0.0
    values = np.array([_value(fitted, fitted.free[k]) for k in keys])
    matrix = fitted.covariance[np.ix_(keys, keys)]
    return float(np.sqrt(max(values @ np.linalg.pinv(matrix) @ values, 0.0)))


def _value(fitted: Fit, parameter: FreeParameter) -> float:
    return float(fitted.of_log(parameter.log or 0)[parameter.name])


__all__ = ["Outcome", "try_case"]
