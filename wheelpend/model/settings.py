"""Settings of a model.toml changed by name: KEY=VALUE, in the fewest edits that will do."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Any, NamedTuple

import tomlkit
import tomlkit.exceptions
import tomlkit.items

from wheelpend.errors import Failure, did_you_mean
from wheelpend.model.record import Model
from wheelpend.model.toml_edits import insert_line, parsed, without_table

SETTABLE_SECTIONS = (
    "assumptions", "columns", "constants", "controller", "input", "parameters", "sensors", "simulation",
)  # fmt: skip
OTHER_WAYS = {  # what has a command of its own
    "effects": "`wheelpend add EFFECT` and `wheelpend remove EFFECT` change the effects",
    "effect": "`wheelpend identify LOG --save` fits the sizes of effects",
    "plant": "`wheelpend new DIR --plant NAME` starts a workspace of another plant",
    "random_force": "`wheelpend identify LOG --save` finds what is left to chance",
    "sensor_error": "`wheelpend identify LOG --save` finds what is left to chance",
}
KEY_PATTERN = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")


class Setting(NamedTuple):
    """A value for a key of a model.toml, or none where the key is to go."""

    keys: tuple[str, ...]
    value: Any  # an item of tomlkit's, or None

    @classmethod
    def parse(cls, text: str) -> Setting:
        """A setting as the command line has it; raises Failure where it is none that can be made.

        A value is TOML, or a word, which needs no quotes then; without one the key goes.
        """
        name, equals, value = text.partition("=")
        keys = tuple(key.strip() for key in name.split("."))
        if not equals or not all(map(KEY_PATTERN.fullmatch, keys)):
            raise Failure(
                f"A setting must be KEY=VALUE, as columns.theta_p.unit=deg, but one is '{text}'. "
                "KEY is as in model.toml, with dots; an empty VALUE takes it away."
            )
        section = keys[0]
        if section in OTHER_WAYS:
            raise Failure(f"{section} must be changed otherwise: {OTHER_WAYS[section]}.")
        if section not in SETTABLE_SECTIONS or len(keys) < 2:
            raise Failure(
                f"A setting must be in one of the sections {', '.join(SETTABLE_SECTIONS)}, but '{name}' is not."
                f"{did_you_mean(section, SETTABLE_SECTIONS)}"
            )
        return cls(keys, _value(value.strip()) if value.strip() else None)


def _value(text: str) -> Any:
    """A value of TOML, or a word as a text."""
    try:
        return tomlkit.value(text)
    except (tomlkit.exceptions.TOMLKitError, ValueError, RecursionError):
        return tomlkit.item(text)


def with_settings(model: Model, settings: Sequence[Setting]) -> Model:
    """The model with these settings; raises Failure where that is none, or where one takes away what is not there."""
    text = model.text
    for setting in settings:
        text = _with_setting(text, setting)
    return Model.parse(text, model.path)


def _with_setting(text: str, setting: Setting) -> str:
    """The text with a setting, in the place and form that the file has for it."""
    tables = list(setting.keys[:-1])
    document = parsed(text)
    place, depth = _innermost(document, tables)
    if setting.value is None:
        return _without(text, setting.keys, place if depth == len(tables) else {})
    value: Any = setting.value
    for name in reversed(setting.keys[depth + 1 :]):  # tables that are not there yet become part of one line
        value = {name: value}
    name = setting.keys[depth]
    if tables == ["columns", name]:  # a quantity that is read from a column of its own name
        value = {"column": name, **value}
    if name in place or isinstance(place, tomlkit.items.InlineTable):
        place[name] = tomlkit.value(_spaced(value))
        return _tidied(document, tables[:depth])
    if not depth:  # not even the section is there
        for inner, own in value.items():
            text = insert_line(text, (name,), f"{inner} = {_spaced(own)}")
        return text
    return insert_line(text, tuple(tables[:depth]), f"{name} = {_spaced(value)}")


def _tidied(document: Any, tables: Sequence[str]) -> str:
    """The text of a document in which the outermost of some tables that is one line is spaced as people write it."""
    place = document
    for name in tables:
        if isinstance(place[name], tomlkit.items.InlineTable):
            place[name] = tomlkit.value(_spaced(place[name]))
            break
        place = place[name]
    return tomlkit.dumps(document)


def _innermost(document: Any, tables: Sequence[str]) -> tuple[Any, int]:
    """The innermost of some nested tables that is there, and how many of them are."""
    place = document
    for depth, name in enumerate(tables):
        if name not in place:
            return place, depth
        place = place[name]
        if not isinstance(place, dict):
            raise Failure(f"{'.'.join(tables[: depth + 1])} must be a table, but model.toml has a value there.")
    return place, len(tables)


def _spaced(value: Any) -> str:
    """A value as text, an inline table spaced as people write it."""
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{name} = {_spaced(own)}" for name, own in value.items()) + " }"
    return str(tomlkit.item(value).as_string())


def _without(text: str, keys: Sequence[str], place: Any) -> str:
    """The text without an entry."""
    *tables, key = keys
    if key not in place:
        raise Failure(f"An entry must be there to be taken away, but model.toml has no {'.'.join(keys)}.")
    if len(tables) == 1 and isinstance(place[key], tomlkit.items.Table):
        return without_table(text, tables[0], key)
    document = parsed(text)
    place, _ = _innermost(document, tables)
    place.remove(key)
    return _tidied(document, tables)
