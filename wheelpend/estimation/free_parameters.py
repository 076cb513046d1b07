"""Names of a model's free parameters, their bounds, scopes and known values."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence

import numpy as np

import derive
from derive.effects import EffectParameter
from derive.plant_signature import PlantSignature
from wheelpend.estimation.problem import EstimationProblem
from wheelpend.model.record import Model


def values_of_model_effects(problem: EstimationProblem, values: Mapping[str, float]) -> dict[str, float]:
    """Values without those of effects that are not in the problem's model."""
    return {n: v for n, v in values.items() if n.rpartition(".")[0] in (*problem.model.effects, "")}


def event_time_names(effect: str) -> list[str]:
    """Full names of the times at which an event begins and ends."""
    return [f"{effect}.{p.name}" for p in derive.effects.find(effect).parameters if p.event_time]


def known_values(model: Model) -> dict[str, float]:
    """Constants, and the identified or nominal values of parameters that the model gives."""
    values = dict(model.constants)
    names = [*model.parameters, *(n for e in model.effects for n in derive.effects.find(e).full_names)]
    return values | {n: v for n in names if (v := model.value(n)) is not None}


def limits_of(
    names: Sequence[str], plant: PlantSignature | None = None, signed: Collection[str] = ()
) -> dict[str, tuple[float, float]]:
    """Bounds (lowest, highest) by name, those that a simulation needs; names without any are left out.

    The plant's own parameters are sums of positive constants, but for the ``signed`` ones; effect parameters have
    the bounds of their row in the library, as it reads on a plant where one is given.
    """
    limits = {name: (0.0, np.inf) for name in names if "." not in name and name not in signed}
    bounded = {n: p for n in names if (p := effect_parameter(n, plant)) and p.bounded}
    return limits | {n: (p.minimum, p.maximum) for n, p in bounded.items()}


def effect_parameter(name: str, plant: PlantSignature | None = None) -> EffectParameter | None:
    """The library's row of effect.parameter, as it reads on a plant where one is given.

    None for the plant's own parameters and for missing forces.
    """
    effect, _, parameter = name.partition(".")
    if not parameter or effect.startswith("missing"):
        return None
    row = derive.effects.find(effect)
    rows = (derive.effects.in_plant_units(row, plant) if plant else row).parameters
    return next((p for p in rows if p.name == parameter), None)


def per_log_names(names: Sequence[str]) -> list[str]:
    """Names with a value of their own in every log: those of scope per log, and the parameters of an event."""
    return [n for n in names if (p := effect_parameter(n)) and p.scope in ("per log", "event")]


def tied_pairs(names: Sequence[str]) -> list[tuple[str, str]]:
    """Pairs of sine and cosine among names whose amplitude is the machine's and whose phase is each log's own."""
    effects = dict.fromkeys(n.partition(".")[0] for n in names if "." in n and not n.startswith("missing"))
    rows = [(e, derive.effects.find(e).phased) for e in effects]
    pairs = [(f"{e}.{row[0]}", f"{e}.{row[1]}") for e, row in rows if row]
    return [p for p in pairs if set(p) <= set(names)]


def free_names(problem: EstimationProblem, effects: Sequence[str]) -> list[str]:
    """Names of the free parameters of a model with these effects."""
    return [*problem.base, *(n for e in effects for n in derive.effects.find(e).full_names)]
