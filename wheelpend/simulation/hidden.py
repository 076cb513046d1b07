"""Effects hidden in a simulation: their values read from text, checked, and put into the simulated machine."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

import derive
from derive.effects import EffectParameter
from derive.parameter_name import ParameterName, effect_of, full_name
from wheelpend.errors import Failure
from wheelpend.estimation.free_parameters import known_values
from wheelpend.estimation.problem import needed_constants
from wheelpend.model.model_kernels import library_module_of
from wheelpend.model.record import Model

MAX_HIDDEN_SIZE = 1e9  # in the parameter's unit; beyond it a simulation only loses digits


def with_full_parameter_names(hide: Mapping[str, float]) -> dict[str, float]:
    """Hidden values by effect.parameter; raises Failure for an unknown or an ambiguous name."""
    found = {}
    for name, value in hide.items():
        effect, parameter = _parts_of(name)
        try:
            known = {p.name: p for p in derive.effects.find(effect).parameters}
        except KeyError as error:
            raise Failure(error.args[0]) from None
        if parameter not in known and (parameter or len(known) > 1):
            raise Failure(f"'{name}' must be one of {', '.join(full_name(effect, k) for k in known)}.")
        parameter = parameter or next(iter(known))
        found[full_name(effect, parameter)] = _possible_value(known[parameter], float(value), effect)
    return found


def _possible_value(parameter: EffectParameter, value: float, effect: str) -> float:
    """The value; raises Failure where no machine has it."""
    least, most = max(parameter.minimum, -MAX_HIDDEN_SIZE), min(parameter.maximum, MAX_HIDDEN_SIZE)
    if not least <= value <= most and value != parameter.absent:
        raise Failure(f"{full_name(effect, parameter.name)} must be between {least:g} and {most:g} {parameter.unit} to "
                      f"be hidden, not {value:g}.")  # fmt: skip
    return value


def _parts_of(name: str) -> ParameterName:
    """The parts of effect.parameter, or of an effect alone."""
    return ParameterName.parse(name) if effect_of(name) else ParameterName(name, "")


def machine_values(model: Model, hide: Mapping[str, float]) -> dict[str, float]:
    """Parameter values of the machine to simulate, hidden ones included; raises Failure for those that are missing."""
    if model.simulation:
        values = {**model.constants, **{k: float(v) for k, v in model.simulation.items()}}
    else:
        values = known_values(model)
    missing = [p for p in base_parameter_names(model) if p not in values]
    if missing:
        raise Failure(f"{', '.join(missing)} must have a value to simulate: give it in [simulation] or [parameters], "
                      "or identify the model first.")  # fmt: skip
    absent = {c for e in set(map(effect_of, hide)) for c in needed_constants(model, e) if c not in values}
    if absent:
        raise Failure(f"{', '.join(sorted(absent))} must be in [constants] to simulate these effects.")
    return with_absorbed_effects(model, {**values, **hide})


def with_absorbed_effects(model: Model, values: Mapping[str, float]) -> dict[str, float]:
    """Values in which effects that are part of the plant's own parameters are added to those."""
    absorbed = library_module_of(model).ABSORBED
    total = {n: v for n, v in values.items() if n not in absorbed}
    for name, weights in absorbed.items():
        for own, weight in weights.items():
            total[own] += weight * values.get(name, 0.0)
    return total


def base_parameter_names(model: Model) -> tuple[str, ...]:
    """Names of the plant's own parameters under the model's assumptions."""
    module = library_module_of(model)
    return module.PARAMETERS[: module.OWN_PARAMETERS]


def parse_hidden(texts: Sequence[str]) -> dict[str, float]:
    """Values by effect.parameter from NAME=VALUE or NAME=param:value,param:value; raises Failure naming the form."""
    hidden: dict[str, float] = {}
    for text in texts:
        name, equals, rest = text.partition("=")
        try:
            effect = derive.effects.find(name.strip())
        except KeyError as error:
            raise Failure(error.args[0]) from None
        known = [p.name for p in effect.parameters]
        form = f"--hide {name}={'VALUE' if len(known) == 1 else ','.join(f'{k}:VALUE' for k in known)}"
        if not equals:
            raise Failure(f"--hide takes a size, but '{text}' has none. Write {form}.")
        for entry in rest.split(","):
            parameter, number = _parse_entry(entry, known)
            if parameter not in known or not np.isfinite(number):
                raise Failure(f"--hide {text} must give {', '.join(known)} as numbers. Write {form}.")
            hidden[full_name(effect.name, parameter)] = number
        required = [p.name for p in effect.parameters if p not in effect.sizes]
        unset = [n for n in required if full_name(effect.name, n) not in hidden]
        if unset:
            raise Failure(f"--hide {text} must give {', '.join(unset)}. Write {form}.")
    return hidden


def _parse_entry(entry: str, known: Sequence[str]) -> tuple[str, float]:
    """Parameter and value of param:value, or of VALUE where there is one parameter; NaN for what is no number."""
    parameter, colon, value = entry.rpartition(":")
    parameter = parameter.strip() if colon else (known[0] if len(known) == 1 else "")
    try:
        return parameter, float(value)
    except ValueError:
        return parameter, float("nan")
