"""The plants: one file of this folder each, stating geometry, actuator, sensors and assumptions.

A plant's file needs a PLANT_NAME and a function ``build(assumptions, free)`` that returns a Plant. It may state
PLANT_ASSUMPTIONS and numbers for a first model.toml: REFERENCE_PARAMETERS for X1, X2, ..., KNOWN_CONSTANTS, and the
CONTROLLER_GAINS of a PID that stabilises it, with a MODEL_TEMPLATE for texts of its own there.
"""

from __future__ import annotations

import difflib
import hashlib
import json
import os
from collections.abc import Mapping
from functools import lru_cache
from importlib import import_module
from pathlib import Path
from pkgutil import iter_modules
from types import ModuleType

from derive.input_units import INPUT_UNIT, INPUT_UNIT_CHOICE, with_input_unit
from derive.plants import wheel_pendulum
from derive.records import Assumption, ModelTemplate, Plant

ENTRY_POINT_GROUP = "wheelpend.plants"
DEFAULT_PLANT = wheel_pendulum.PLANT_NAME
SHIPPED_PLANTS = tuple(import_module(f"{__name__}.{m.name}") for m in iter_modules(__path__))  # all files here
KNOWN_PLANTS: dict[str, ModuleType] = {m.PLANT_NAME: m for m in SHIPPED_PLANTS}


def register(module: ModuleType) -> str:
    """Make a user's plant known under its PLANT_NAME, which is returned; raises ValueError for any other file."""
    for needed in ("PLANT_NAME", "build"):
        if not hasattr(module, needed):
            raise ValueError(f"{module.__name__} must state {needed}")
    known = KNOWN_PLANTS.get(module.PLANT_NAME)
    if known is not None and known.__file__ != module.__file__:
        raise ValueError(
            f"PLANT_NAME must be a new one, but there is a plant '{module.PLANT_NAME}' in {known.__file__}"
        )
    KNOWN_PLANTS[module.PLANT_NAME] = module
    _built.cache_clear()
    return module.PLANT_NAME


def find(name: str) -> ModuleType:
    """Return the plant's module; raises KeyError naming the known plants.

    A plant that is not ours may come with an installed package, which names its module in the group ENTRY_POINT_GROUP.
    """
    if name not in KNOWN_PLANTS:
        from importlib.metadata import (
            entry_points,  # imported late: it is slow, and few look for a plant that is not ours
        )

        for entry in entry_points(group=ENTRY_POINT_GROUP, name=name):
            register(entry.load())
    if name not in KNOWN_PLANTS:
        close = difflib.get_close_matches(name, KNOWN_PLANTS, 1)
        did_you_mean = f". Did you mean '{close[0]}'?" if close else ""
        raise KeyError(
            f"No plant named '{name}'. Known plants: {', '.join(sorted(KNOWN_PLANTS))}. "
            f"One of your own is named on the command line: --plant FILE.py{did_you_mean}"
        )
    return KNOWN_PLANTS[name]


def fingerprint(name: str) -> str:
    """Hash of a plant's file (16 hex digits), on which the derivation of a user's plant depends."""
    file = find(name).__file__
    return _hash_of(file, os.stat(file).st_mtime_ns) if file else ""


@lru_cache
def _hash_of(file: str, changed: int) -> str:
    return hashlib.sha256(Path(file).read_bytes()).hexdigest()[:16]


def assumptions_of(name: str) -> tuple[Assumption, ...]:
    """The choices that a plant's derivation makes."""
    return tuple(getattr(find(name), "PLANT_ASSUMPTIONS", ()))


def reference_of(name: str) -> Mapping[str, float]:
    """A plant's own numbers for X1, X2, ..., where its file has any."""
    return getattr(find(name), "REFERENCE_PARAMETERS", {})


def constants_of(name: str) -> Mapping[str, float]:
    """A plant's own numbers for its known constants, where its file has any."""
    return getattr(find(name), "KNOWN_CONSTANTS", {})


def gains_of(name: str) -> tuple[float, float, float] | None:
    """Gains of a PID that holds a plant with those numbers, where its file has any."""
    return getattr(find(name), "CONTROLLER_GAINS", None)


def template_of(name: str) -> ModelTemplate:
    """A plant's own texts for a first model.toml; empty ones where its file has none."""
    return getattr(find(name), "MODEL_TEMPLATE", ModelTemplate())


def build(name: str, assumptions: Mapping, free: tuple[str, ...] = ()) -> Plant:
    """The plant under assumptions, the others at their defaults, with the coordinates named in ``free`` released."""
    complete = complete_assumptions(name, assumptions)
    return _built(name, fingerprint(name), tuple(sorted(complete.items())), free)


@lru_cache(maxsize=64)
def _built(name: str, fingerprint: str, assumptions: tuple, free: tuple[str, ...]) -> Plant:
    choices = dict(assumptions)
    unit = choices.pop(INPUT_UNIT, "")
    plant = find(name).build(choices, free)
    return with_input_unit(plant, unit) if unit else plant


def implied_effects(name: str, assumptions: dict) -> tuple[str, ...]:
    """Effects that choices of the complete assumptions imply."""
    pairs = ((a.name, choice, effect) for a in assumptions_of(name) for choice, effect in a.implies)
    return tuple(effect for key, choice, effect in pairs if assumptions[key] == choice)


def complete_assumptions(name: str, assumptions: Mapping) -> dict:
    """Complete a plant's assumptions by their defaults; raises KeyError for unknown names and choices.

    So it does for choices that do not go together. The unit of the input is among them where it was given, as another
    than the plant's file states.
    """
    known = {a.name: a for a in assumptions_of(name)}
    known |= {INPUT_UNIT: INPUT_UNIT_CHOICE} if INPUT_UNIT in assumptions else {}
    for key, value in assumptions.items():
        if key not in known:
            others = ", ".join(sorted(known)) or "none"
            raise KeyError(f"No assumption named '{key}' in {name}. Known assumptions: {others}")
        if not any(value is c or (type(value) is type(c) and value == c) for c in known[key].choices):
            raise KeyError(f"Assumption {key} must be one of {list(known[key].choices)}, not {value!r}")
    complete = {a.name: assumptions.get(a.name, a.default) for a in known.values()}
    for own in known.values():
        for choice, other, needed in own.needs:
            if complete[own.name] == choice and complete[other] != needed:
                stated, there, must = (json.dumps(v) for v in (choice, complete[other], needed))
                raise KeyError(f"{own.name} = {stated} needs {other} = {must}, but {other} is {there}")
    return complete
