"""Whether the effects of a model mean what they are called, as they were fitted: possible, reached, determined."""

from __future__ import annotations

from collections.abc import Mapping

from derive.effects import Effect, Quantiles
from wheelpend.diagnosis.evidence import estimate_of
from wheelpend.diagnosis.likelihood.filtered_model import FilteredModel
from wheelpend.diagnosis.physical import is_physical, is_within_its_friction
from wheelpend.estimation.fit import Fit
from wheelpend.estimation.problem import EstimationProblem
from wheelpend.estimation.profiled_starts import magnitude


def without_meaning(model: FilteredModel) -> list[str]:
    """The effects of a model that are physically impossible as they were fitted."""
    rows, log_values = [model.problem.effect(e) for e in model.problem.model.effects], model.log_values
    return [
        row.name
        for row in rows
        if not all(
            has_meaning(model.problem, row, {p.name: values[row.name_of(p)] for p in row.parameters})
            for values in log_values
        )
    ]


def rest_has_meaning(model: FilteredModel, fitted: Fit, effect: str) -> bool:
    """True where no other effect of a model has become physically impossible beside one, beyond its errors.

    Nor any difference between directions larger than its friction, that of the one too.
    """
    rows = [model.problem.effect(e) for e in model.problem.model.effects]
    found = [(row, estimate_of(fitted, row)) for row in rows if row.name != effect]
    possible = all(is_physical(row, e.coefficients, e.sigma) for row, e in found)
    return possible and all(is_within_its_friction(model.problem, row, fitted) for row in rows)


def has_meaning(problem: EstimationProblem, effect: Effect, coefficients: Mapping[str, float]) -> bool:
    """True where parameters are possible, in order, and within the logs where they are compared with a signal.

    Else the effect is another one in disguise: friction that drives, a speed that was never reached.
    """
    if not is_physical(effect, coefficients, dict.fromkeys(coefficients, 0.0)):
        return False
    parameter = effect.profiled
    if parameter is None or not isinstance(parameter.starts, Quantiles):
        return True
    of = parameter.starts.of
    reached = max(float(magnitude(problem, s, of).max(initial=0.0)) for s in problem.data.estimation)
    return abs(coefficients[parameter.name]) <= reached
