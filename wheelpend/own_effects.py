"""A user's own effects: effects.toml beside model.toml, read strictly and never executed."""

from __future__ import annotations

import os
import re
import tomllib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any, Literal

import tomlkit
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from derive import effects as library
from derive.effects import Effect, EffectParameter
from derive.effects.own import enters
from derive.grammar import GrammarError
from derive.records import Plant
from wheelpend.failures import Failure

FILE = "effects.toml"
NAME = re.compile(r"[a-z][a-z0-9_]{0,39}")
MOST = 20  # effects in a file, and parameters of one
Text = Annotated[str, Field(max_length=400)]
Number = Annotated[float, Field(allow_inf_nan=False)]


class _Strict(BaseModel):
    model_config = ConfigDict(extra="forbid", strict=True)


class OwnParameter(_Strict):
    """One number of an effect."""

    unit: Annotated[str, Field(max_length=20)]
    typical: Number
    minimum: Number | None = None
    maximum: Number | None = None
    scope: Literal["shared", "per log"] = "shared"
    starts: Annotated[tuple[Number, ...], Field(max_length=12, strict=False)] = ()  # of a shape: values to try


class OwnEffect(_Strict):
    """One table of effects.toml."""

    family: Literal["drive", "ground", "body", "actuator", "sensor"]
    sentence: Text
    on: Text
    law: Annotated[str, Field(max_length=1000)]
    parameters: Annotated[dict[str, OwnParameter], Field(min_length=1, max_length=MOST)]
    dissipates: bool = False
    means: Text = ""


def read_own(workspace: Path, plant: Plant) -> tuple[Effect, ...]:
    """Rows of a workspace's effects.toml; none without one. Raises Failure saying what in it is wrong."""
    path = workspace / FILE
    try:
        text = path.read_bytes().decode("utf-8-sig")
    except FileNotFoundError:
        return ()
    except (OSError, UnicodeDecodeError) as error:
        raise Failure(f"{path} must be UTF-8 text that can be read: {error}.") from None
    try:
        return rows_of(text, plant)
    except Failure as failure:
        raise Failure(f"{path}: {failure}") from None


def write_own(workspace: Path, tables: Mapping[str, Mapping[str, Any]], plant: Plant) -> Path:
    """Add tables to a workspace's effects.toml, whose text stays as it is; complete or not at all.

    Raises Failure where a name is taken or a table is no effect, and then changes nothing.
    """
    path = workspace / FILE
    taken = [row.name for row in read_own(workspace, plant)]
    for name in tables:
        refuse_taken(name, taken, path)
    old = path.read_bytes().decode("utf-8-sig") if path.exists() else ""
    end = "\r\n" if "\r\n" in old else "\n"
    added = (end * 2).join(text_of(name, table).replace("\n", end) for name, table in tables.items())
    gap = "" if not old else end if old.endswith(end) else end * 2
    text = old + gap + added + end
    rows_of(text, plant)
    beside = path.with_name(f".{path.name}.{os.getpid()}.partial")
    try:
        beside.write_bytes(text.encode())
        os.replace(beside, path.resolve())
    except OSError as error:
        raise Failure(f"{path} cannot be written: {error.strerror or error}.") from error
    finally:
        beside.unlink(missing_ok=True)
    return path


def refuse_taken(name: str, taken: Sequence[str], path: Path) -> None:
    """Raise Failure unless a name can be that of a new effect."""
    if not NAME.fullmatch(name) or name.startswith("missing"):
        raise Failure(f"An effect must have a name of small letters, digits and _, not '{name}'. Choose another.")
    if name in taken or name in library.LIBRARY:
        where = "the library" if name in library.LIBRARY else str(path)
        raise Failure(f"A new effect needs a name that is free, but {name} is in {where} already. Choose another.")


def text_of(name: str, table: Mapping[str, Any]) -> str:
    """A table of effects.toml as text, each parameter on a line of its own."""
    lines = [f"[{name}]", *(f"{k} = {tomlkit.item(v).as_string()}" for k, v in table.items() if k != "parameters")]
    lines.append(f"[{name}.parameters]")
    for parameter, numbers in table["parameters"].items():
        entries = ", ".join(f"{k} = {tomlkit.item(v).as_string()}" for k, v in numbers.items())
        lines.append(f"{parameter} = {{ {entries} }}")
    return "\n".join(lines)


def rows_of(text: str, plant: Plant) -> tuple[Effect, ...]:
    """Rows of the text of an effects.toml."""
    try:
        tables = tomllib.loads(text)
    except (tomllib.TOMLDecodeError, RecursionError) as error:
        raise Failure(f"this is not valid TOML: {error}. Correct that line.") from None
    if len(tables) > MOST:
        raise Failure(f"at most {MOST} effects may be written, not {len(tables)}. Take some out.")
    return tuple(row_of(name, table, plant) for name, table in tables.items())


def row_of(name: str, table: object, plant: Plant) -> Effect:
    """One table as a row."""
    if not NAME.fullmatch(name) or name in library.LIBRARY or name.startswith("missing"):
        raise Failure(f"[{name}] must be a new name of small letters, digits and _. "
                      f"{'That one is in the library. ' if name in library.LIBRARY else ''}Rename it.")  # fmt: skip
    try:
        found = OwnEffect.model_validate(table)
        parameters = tuple(_parameter(n, p) for n, p in found.parameters.items())
        way = enters(found.on, found.law, parameters, plant)
    except ValidationError as error:
        raise Failure("; ".join(_phrase(name, e) for e in error.errors()) + ".") from None
    except GrammarError as error:
        raise Failure(f"[{name}]: {error}") from None
    return Effect(name, found.family, found.sentence, found.law, parameters, way, found.dissipates, found.means)


def _parameter(name: str, given: OwnParameter) -> EffectParameter:
    if not NAME.fullmatch(name):
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


def _phrase(name: str, error) -> str:
    place = ".".join([name, *map(str, error["loc"])])
    message = error["msg"][0].lower() + error["msg"][1:]
    return f"{place} is missing" if error["type"] == "missing" else f"{place}: {message}, not {error['input']!r:.60}"
