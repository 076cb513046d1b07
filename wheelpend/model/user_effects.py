"""A user's own effects: effects.toml beside model.toml, read strictly and never executed."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import tomlkit

from derive import effects as library
from derive.effects import Effect, EffectParameter
from derive.effects.user_laws import entry_from_text
from derive.grammar import GrammarError
from derive.plant_signature import PlantSignature
from wheelpend.errors import Failure
from wheelpend.files import read_text, write_text
from wheelpend.model.toml_checks import InvalidValue, boolean, list_of, mapping, number, one_of, short_text, table
from wheelpend.model.toml_file import USER_EFFECTS_FILE, parse_toml

NAME_PATTERN = re.compile(r"[a-z][a-z0-9_]{0,39}")
MAX_EFFECTS_AND_PARAMETERS = 20  # effects in a file, and parameters of one


@dataclass(frozen=True)
class UserParameter:
    """One parameter of an effect, as its table states it."""

    unit: str
    typical: float
    minimum: float | None = None
    maximum: float | None = None
    scope: str = "shared"
    starts: tuple[float, ...] = ()  # of a profiled parameter: values to try


@dataclass(frozen=True)
class UserEffect:
    """One table of effects.toml."""

    family: str
    sentence: str
    on: str
    law: str
    parameters: dict[str, UserParameter]
    dissipates: bool = False
    means: str = ""


PARAMETER_CHECK = table(
    UserParameter,
    unit=short_text(20),
    typical=number,
    minimum=number,
    maximum=number,
    scope=one_of("shared", "per log"),
    starts=list_of(number, max_entries=12),
)
EFFECT_CHECK = table(
    UserEffect,
    family=one_of("drive", "ground", "body", "actuator", "sensor"),
    sentence=short_text(400),
    on=short_text(400),
    law=short_text(1000),
    parameters=mapping(PARAMETER_CHECK, min_entries=1, max_entries=MAX_EFFECTS_AND_PARAMETERS),
    dissipates=boolean,
    means=short_text(400),
)


def read_user_effects(workspace: Path, plant: PlantSignature) -> tuple[Effect, ...]:
    """Effects of a workspace's effects.toml, none without one; raises Failure saying what in it is wrong."""
    path = workspace / USER_EFFECTS_FILE
    try:
        text = read_text(path)
    except FileNotFoundError:
        return ()
    try:
        return effects_from_text(text, plant)
    except Failure as failure:
        raise Failure(f"{path}: {failure}") from None


def write_user_effects(workspace: Path, tables: Mapping[str, Mapping[str, Any]], plant: PlantSignature) -> Path:
    """Add tables to a workspace's effects.toml, whose text stays as it is; complete or not at all.

    Raises Failure where a name is taken or a table is no effect, and then changes nothing.
    """
    path = workspace / USER_EFFECTS_FILE
    taken = [row.name for row in read_user_effects(workspace, plant)]
    for name in tables:
        check_name_is_free(name, taken, path)
    old = read_text(path) if path.exists() else ""
    end = "\r\n" if "\r\n" in old else "\n"
    added = (end * 2).join(effect_table_text(name, table).replace("\n", end) for name, table in tables.items())
    gap = "" if not old else end if old.endswith(end) else end * 2
    text = old + gap + added + end
    effects_from_text(text, plant)
    write_text(path, text)
    return path


def define_user_effects(workspace: Path, file: Path, plant: PlantSignature) -> list[str]:
    """Add the tables of a file to a workspace's effects.toml, all or none; returns their names.

    Raises Failure where the file cannot be read, states no effect, or one that is wrong or whose name is taken.
    """
    try:
        text = read_text(file)
        effects = effects_from_text(text, plant)
    except FileNotFoundError:
        raise Failure(f"--define must name a file of effects; there is none at {file}.") from None
    except Failure as failure:
        raise Failure(f"{file}: {failure}") from None
    if not effects:
        raise Failure(f"{file}: a table in square brackets must name an effect, but there is none. Write one.")
    write_user_effects(workspace, parse_toml(text), plant)
    return [effect.name for effect in effects]


def check_name_is_free(name: str, taken: Sequence[str], path: Path) -> None:
    """Raise Failure unless a name can be that of a new effect."""
    if not NAME_PATTERN.fullmatch(name) or name.startswith("missing"):
        raise Failure(f"An effect must have a name of small letters, digits and _, not '{name}'. Choose another.")
    if name in taken or name in library.EFFECT_LIBRARY:
        where = "the library" if name in library.EFFECT_LIBRARY else str(path)
        raise Failure(f"A new effect needs a name that is free, but {name} is in {where} already. Choose another.")


def effect_table_text(name: str, table: Mapping[str, Any]) -> str:
    """A table of effects.toml as text, each parameter on a line of its own."""
    lines = [f"[{name}]", *(f"{k} = {tomlkit.item(v).as_string()}" for k, v in table.items() if k != "parameters")]
    lines.append(f"[{name}.parameters]")
    for parameter, numbers in table["parameters"].items():
        entries = ", ".join(f"{k} = {tomlkit.item(v).as_string()}" for k, v in numbers.items())
        lines.append(f"{parameter} = {{ {entries} }}")
    return "\n".join(lines)


def effects_from_text(text: str, plant: PlantSignature) -> tuple[Effect, ...]:
    """Effects of the text of an effects.toml; raises Failure saying what in it is wrong."""
    tables = parse_toml(text)
    if len(tables) > MAX_EFFECTS_AND_PARAMETERS:
        raise Failure(f"at most {MAX_EFFECTS_AND_PARAMETERS} effects may be written, not {len(tables)}. Take some out.")
    return tuple(effect_from_table(name, table, plant) for name, table in tables.items())


def effect_from_table(name: str, given: object, plant: PlantSignature) -> Effect:
    """The effect of one table; raises Failure where the table does not state one."""
    if not NAME_PATTERN.fullmatch(name) or name in library.EFFECT_LIBRARY or name.startswith("missing"):
        taken = "That one is in the library. " if name in library.EFFECT_LIBRARY else ""
        raise Failure(f"[{name}] must be a new name of small letters, digits and _. {taken}Rename it.")
    try:
        stated: UserEffect = EFFECT_CHECK(given, name)
        parameters = tuple(_effect_parameter(n, p) for n, p in stated.parameters.items())
        way = entry_from_text(stated.on, stated.law, parameters, plant)
    except InvalidValue as wrong:
        raise Failure("; ".join(wrong.args) + ".") from None
    except GrammarError as error:
        raise Failure(f"[{name}]: {error}") from None
    return Effect(name, stated.family, stated.sentence, stated.law, parameters, way, stated.dissipates, stated.means)


def _effect_parameter(name: str, given: UserParameter) -> EffectParameter:
    if not NAME_PATTERN.fullmatch(name):
        raise GrammarError(f"A parameter must be a name of small letters, digits and _, not '{name}'.")
    low = -float("inf") if given.minimum is None else given.minimum
    high = float("inf") if given.maximum is None else given.maximum
    shape = bool(given.starts)
    for value in (given.typical, *given.starts, *(() if shape else (0.0,))):
        if not low <= value <= high:
            raise GrammarError(f"{name} must be able to be {value:g}, but its range is {low:g} to {high:g}. A "
                               "parameter that is not 0 while the effect is absent needs starts.")  # fmt: skip
    return EffectParameter(
        name, given.unit, given.scope, low, high, typical=given.typical,
        absent=given.starts[len(given.starts) // 2] if shape else 0.0,
        starts=library.Values(given.starts) if shape else None, bounded=shape,
    )  # fmt: skip
