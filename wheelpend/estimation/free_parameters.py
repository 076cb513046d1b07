"""Names of a model's free parameters, their bounds, scopes and known values."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence

import numpy as np

import derive
from derive.effects import EffectParameter
from derive.parameter_name import MISSING_FORCE, ParameterName, effect_of, full_name
from derive.plant_signature import PlantSignature
from wheelpend.estimation.parameters import PER_LOG_SCOPES, FreeParameter, Role
from wheelpend.estimation.problem import EstimationProblem
from wheelpend.model.record import Model


def values_of_model_effects(problem: EstimationProblem, values: Mapping[str, float]) -> dict[str, float]:
    """Values without those of effects that are not in the problem's model."""
    return {n: v for n, v in values.items() if effect_of(n) in (*problem.model.effects, "")}


def event_time_names(effect: str) -> list[str]:
    """Full names of the times at which an event begins and ends."""
    row = derive.effects.find(effect)
    return [row.name_of(p) for p in row.parameters if p.event_time]


def known_values(model: Model) -> dict[str, float]:
    """Constants, and the identified or nominal values of parameters that the model gives."""
    values = dict(model.constants)
    names = [*model.parameters, *(n for e in model.effects for n in derive.effects.find(e).full_names)]
    return values | {n: v for n in names if (v := model.value(n)) is not None}


def limits_of(
    names: Sequence[str], plant: PlantSignature | None = None, signed: Collection[str] = ()
) -> dict[str, tuple[float, float]]:
    """Bounds (lowest, highest) by name, those that a simulation needs; infinite where it needs none."""
    return {name: bounds_of(name, effect_parameter(name, plant), signed) for name in names}


def bounds_of(name: str, parameter: EffectParameter | None, signed: Collection[str] = ()) -> tuple[float, float]:
    """Lowest and highest value with which a simulation can be made, of a parameter and its row in the library.

    The plant's own parameters are sums of positive constants, but for the ``signed`` ones; effect parameters have
    the bounds of their row, where a simulation needs these.
    """
    if parameter is not None:
        return (parameter.minimum, parameter.maximum) if parameter.bounded else (-np.inf, np.inf)
    return (-np.inf, np.inf) if effect_of(name) or name in signed else (0.0, np.inf)


def free_parameters(problem: EstimationProblem, names: Iterable[str]) -> tuple[FreeParameter, ...]:
    """Free parameters of these names, as kernels and library describe them."""
    return tuple(_free_parameter(problem, n) for n in names)


def _free_parameter(problem: EstimationProblem, name: str) -> FreeParameter:
    module, row = problem.module, effect_parameter(name, problem.plant)
    place = module.PARAMETERS.index(name)
    return FreeParameter(
        name=name,
        effect=effect_of(name),
        scope=row.scope if row else "shared",
        unit=module.UNITS[place],
        bounds=problem.restrictions.narrowed(name, bounds_of(name, row, module.SIGNED)),
        absent=module.ABSENT[place],
        role=_role_of(name, row),
    )


def _role_of(name: str, parameter: EffectParameter | None) -> Role:
    if parameter is None:
        return "missing force" if effect_of(name) else "own"
    if parameter.event_time:
        return "event time"
    return "size" if parameter.absent == 0.0 or np.isinf(parameter.absent) else "shape"


def effect_parameter(name: str, plant: PlantSignature | None = None) -> EffectParameter | None:
    """The library's row of effect.parameter, as it reads on a plant where one is given.

    None for the plant's own parameters and for missing forces.
    """
    effect, parameter = ParameterName.parse(name)
    if effect in ("", MISSING_FORCE):
        return None
    row = derive.effects.find(effect)
    rows = (derive.effects.in_plant_units(row, plant) if plant else row).parameters
    return next((p for p in rows if p.name == parameter), None)


def per_log_names(names: Sequence[str]) -> list[str]:
    """Names with a value of their own in every log: those of scope per log, and the parameters of an event."""
    return [n for n in names if (p := effect_parameter(n)) and p.scope in PER_LOG_SCOPES]


def tied_pairs(names: Sequence[str]) -> list[tuple[str, str]]:
    """Pairs of sine and cosine among names whose amplitude is the machine's and whose phase is each log's own."""
    effects = [e for e in dict.fromkeys(map(effect_of, names)) if e not in ("", MISSING_FORCE)]
    rows = [(e, derive.effects.find(e).phased) for e in effects]
    pairs = [(full_name(e, row[0]), full_name(e, row[1])) for e, row in rows if row]
    return [p for p in pairs if set(p) <= set(names)]


def free_names(problem: EstimationProblem, effects: Sequence[str]) -> list[str]:
    """Names of the free parameters of a model with these effects: without those that are fixed."""
    return problem.restrictions.free([*problem.base, *(n for e in effects for n in derive.effects.find(e).full_names)])
