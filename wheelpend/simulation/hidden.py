"""Effects hidden in a simulation: their values read from text, checked, and put into the machine that is played."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

import derive
from wheelpend.errors import Failure
from wheelpend.estimation.free_parameters import known_values
from wheelpend.model import model_kernels
from wheelpend.model.record import Model


def with_full_parameter_names(hide: Mapping[str, float]) -> dict[str, float]:
    """Hidden values by effect.parameter; raises Failure where a name is none, or says too little."""
    found = {}
    for name, value in hide.items():
        effect, _, parameter = name.partition(".")
        try:
            known = [p.name for p in derive.effects.find(effect).parameters]
        except KeyError as error:
            raise Failure(error.args[0]) from None
        if parameter not in known and (parameter or len(known) > 1):
            raise Failure(f"'{name}' must be one of {', '.join(f'{effect}.{k}' for k in known)}.")
        found[f"{effect}.{parameter or known[0]}"] = float(value)
    return found


def machine_values(model: Model, hide: Mapping[str, float]) -> dict[str, float]:
    """Parameter values of the machine to simulate."""
    if model.simulation:
        values = {**model.constants, **{k: float(v) for k, v in model.simulation.items()}}
    else:
        values = known_values(model)
    plain = [p for p in base_parameter_names(model) if p not in values]
    if plain:
        raise Failure(f"{', '.join(plain)} must have a value to simulate: give it in [simulation] or [parameters], "
                      "or identify the model first.")  # fmt: skip
    absent = {c for e in {n.partition(".")[0] for n in hide} for c in _needed_constants(model, e) if c not in values}
    if absent:
        raise Failure(f"{', '.join(sorted(absent))} must be in [constants] to simulate these effects.")
    return with_absorbed_effects(model, {**values, **hide})


def with_absorbed_effects(model: Model, values: Mapping[str, float]) -> dict[str, float]:
    """Values in which effects that are part of the plant's own parameters are added to those."""
    absorbed = model_kernels.library_module_of(model).ABSORBED
    total = {n: v for n, v in values.items() if n not in absorbed}
    for name, weights in absorbed.items():
        for own, weight in weights.items():
            total[own] += weight * values.get(name, 0.0)
    return total


def _needed_constants(model: Model, effect: str) -> Sequence[str]:
    from wheelpend.estimation.problem import needed_constants

    return needed_constants(model, effect)


def base_parameter_names(model: Model) -> tuple[str, ...]:
    """Names of the plant's own parameters under the model's assumptions."""
    module = model_kernels.library_module_of(model)
    return tuple(n for n in module.PARAMETERS[: module.FITTED] if "." not in n)


def parse_hidden(texts: Sequence[str]) -> dict[str, float]:
    """Read NAME=VALUE or NAME=param:value,param:value; raises Failure saying how it must look."""
    hidden: dict[str, float] = {}
    for text in texts:
        name, equals, rest = text.partition("=")
        try:
            effect = derive.effects.find(name.strip())
        except KeyError as error:
            raise Failure(error.args[0]) from None
        known = [p.name for p in effect.parameters]
        how = f"--hide {name}={'VALUE' if len(known) == 1 else ','.join(f'{k}:VALUE' for k in known)}"
        if not equals:
            raise Failure(f"--hide takes a size, but '{text}' has none. Write {how}.")
        for piece in rest.split(","):
            parameter, colon, value = piece.rpartition(":")
            parameter = parameter.strip() if colon else (known[0] if len(known) == 1 else "")
            try:
                number = float(value)
            except ValueError:
                number = float("nan")
            if parameter not in known or not np.isfinite(number):
                raise Failure(f"--hide {text} must give {', '.join(known)} as numbers. Write {how}.")
            hidden[f"{effect.name}.{parameter}"] = number
        shapes = [p.name for p in effect.parameters if p not in effect.sizes]
        unset = [n for n in shapes if f"{effect.name}.{n}" not in hidden]
        if unset:
            raise Failure(f"--hide {text} must give {', '.join(unset)}. Write {how}.")
    return hidden
