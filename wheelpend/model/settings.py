"""Settings of a model file made from KEY=VALUE, checked as the file's reader checks them; comments survive."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from wheelpend.errors import Failure, did_you_mean
from wheelpend.logs.columns import unit_factor
from wheelpend.model.record import Model
from wheelpend.model.toml_file import parse_toml

SETTABLE_SECTIONS = (
    "columns",
    "sensors",
    "controller",
    "input",
    "constants",
    "assumptions",
    "parameters",
    "simulation",
)
OTHER_COMMANDS = {  # by what they change, which is more than an entry of the file
    "plant": "A plant is chosen when a workspace is started: `wheelpend new FOLDER --plant NAME`.",
    "effects": "`wheelpend add EFFECT` and `wheelpend remove EFFECT` change the list, and what hangs on it.",
    "effect": "`wheelpend identify LOG --save` writes the sizes of effects.",
    "random_force": "`wheelpend identify LOG --save` writes what is left to chance.",
    "sensor_error": "`wheelpend identify LOG --save` writes what is left to chance.",
}
TEXT_KEYS = ("column", "unit", "times")  # whose values are text, also where they look like a number
KEY_PATTERN = re.compile(r"[A-Za-z0-9_-]+(\.[A-Za-z0-9_-]+){1,2}")
MAX_VALUE_CHARACTERS = 1000


class Setting(NamedTuple):
    """An entry of a model file and the value that it shall have; None takes it out."""

    place: tuple[str, ...]  # columns, theta_p, sign
    value: Any

    @property
    def key(self) -> str:
        """The place as one types it."""
        return ".".join(self.place)


class Changed(NamedTuple):
    """A setting that was made, with what the file had; None where it had nothing."""

    key: str
    before: Any
    after: Any


def parse_settings(texts: Sequence[str]) -> list[Setting]:
    """The settings of KEY=VALUE; raises Failure for other forms, and for what other commands change."""
    found: dict[tuple[str, ...], Setting] = {}
    for text in texts:
        key, equals, value = text.partition("=")
        key = key.strip()
        if not equals:
            raise Failure(f"A setting must be KEY=VALUE, such as columns.theta_p.sign=-1, not '{text:.60}'.")
        place = _checked_place(key)
        if place in found:
            raise Failure(f"Each setting must be there once, but {key} is there twice. Leave one out.")
        found[place] = Setting(place, _value(place[-1], value))
    return list(found.values())


def with_settings(model: Model, settings: Sequence[Setting]) -> tuple[Model, list[Changed]]:
    """The model with these settings, and those of them that changed it; raises Failure where one cannot be."""
    from wheelpend.model.toml_edits import with_entry  # imported late: tomlkit is slow to load

    text, changed = model.text, []
    for setting in _with_columns_named(model, settings):
        before = _entry(parse_toml(text), setting)
        if before != setting.value or isinstance(before, bool) != isinstance(setting.value, bool):
            text = with_entry(text, setting.place, setting.value)
            changed.append(Changed(setting.key, before, setting.value))
    wanted = Model.parse(text, model.path)
    for name in {s.place[1] for s in settings if s.place[0] == "columns"} & set(wanted.columns):
        unit_factor(name, wanted.columns[name].unit, wanted.table.units[name], wanted.table.inputs)
    return wanted, changed


def changes_equations(before: Model, after: Model) -> bool:
    """True where two models derive to other code."""
    return (before.plant, before.assumptions, before.effects) != (after.plant, after.assumptions, after.effects)


def _checked_place(key: str) -> tuple[str, ...]:
    section = key.partition(".")[0]
    if section in OTHER_COMMANDS:
        raise Failure(f"`wheelpend set` must not change {section}. {OTHER_COMMANDS[section]}")
    if section not in SETTABLE_SECTIONS:
        hint = did_you_mean(section, SETTABLE_SECTIONS)
        raise Failure(f"A setting must be in one of {', '.join(SETTABLE_SECTIONS)}, not in '{section:.60}'.{hint}")
    if not KEY_PATTERN.fullmatch(key):
        raise Failure(f"A setting must be SECTION.NAME or SECTION.NAME.KEY, such as {section}.a.b, not '{key:.60}'.")
    return tuple(key.split("."))


def _value(key: str, text: str) -> Any:
    """What stands right of the equals sign: nothing, a number, true or false, a list, or else text."""
    if len(text) > MAX_VALUE_CHARACTERS:
        raise Failure(f"A value must have at most {MAX_VALUE_CHARACTERS} characters, but one has {len(text)}.")
    if not text.strip():
        return None
    if key in TEXT_KEYS or not text.isprintable():
        return text
    try:
        found = parse_toml(f"value = {text}")
    except Failure:
        return text.strip()
    return found["value"] if len(found) == 1 else text.strip()


def _with_columns_named(model: Model, settings: Sequence[Setting]) -> list[Setting]:
    """The settings, with a first one for each entry of [columns] that is begun: the column's name, if none says it."""
    begun = [s.place[1] for s in settings if s.place[0] == "columns" and len(s.place) == 3 and s.value is not None]
    said = [s.place[1] for s in settings if s.place[0] == "columns" and s.place[-1] == "column"]
    names = [n for n in dict.fromkeys(begun) if n not in (*model.columns, *said)]
    return [*(Setting(("columns", name, "column"), name) for name in names), *settings]


def _entry(tables: Mapping[str, Any], setting: Setting) -> Any:
    """What a file has in a place, or None; raises Failure where a table and a plain value would take turns there."""
    found: Any = tables
    for depth, key in enumerate(setting.place):
        if not isinstance(found, dict):
            above = ".".join(setting.place[:depth])
            raise Failure(f"{setting.key} must be in a table, but {above} is {found!r:.60}. Set {above} itself.")
        if key not in found:
            return None
        found = found[key]
    if isinstance(found, dict) and setting.value is not None:
        raise Failure(f"{setting.key} must name one entry, but it is a table with {', '.join(found)}. Name one of "
                      f"them: {setting.key}.{next(iter(found), 'NAME')}=VALUE.")  # fmt: skip
    return found
