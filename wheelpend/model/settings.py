"""Settings of a model file made from KEY=VALUE, checked as the file's reader checks them; comments survive."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from wheelpend.errors import Failure, did_you_mean
from wheelpend.logs.columns import ColumnMap, unit_conversion
from wheelpend.logs.units import UNIT_CONVERSIONS
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
GUESSED_KEYS = ("column", "unit", "scale")  # of a column: who sets one of them has looked at what was guessed
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

    @classmethod
    def parse(cls, text: str) -> Setting:
        """A setting from KEY=VALUE; raises Failure for other forms, and for what other commands change.

        VALUE is TOML, or a word without quotes; nothing takes the entry out.
        """
        key, equals, value = text.partition("=")
        if not equals:
            raise Failure(f"A setting must be KEY=VALUE, such as columns.theta_p.sign=-1, not '{text:.60}'.")
        place = _checked_place(key.strip())
        return cls(place, _value(place[-1], value))


class Changed(NamedTuple):
    """An entry that was changed, with what the file had and has; None where that is nothing."""

    key: str
    before: Any
    after: Any


def with_settings(model: Model, settings: Sequence[Setting]) -> Model:
    """The model with these settings; raises Failure where one cannot be."""
    from wheelpend.model.toml_edits import with_entry, without_guess_mark  # imported late: tomlkit is slow to load

    text = model.text
    for setting in _with_consequences(model, settings):
        if setting.value is None and _entry(parse_toml(text), setting) is None:
            raise Failure(f"An entry must be there to be taken away, but model.toml has no {setting.key}.")
        if not _holds_already(parse_toml(text), setting):
            text = with_entry(text, setting.place, setting.value)
        if setting.place[0] == "columns" and setting.place[-1] in GUESSED_KEYS:
            text = without_guess_mark(text, setting.place[:2])
    wanted = Model.parse(text, model.path)
    for name in {s.place[1] for s in settings if s.place[0] == "columns"} & set(wanted.columns):
        unit_conversion(name, wanted.columns[name].unit, wanted.table)
    return wanted


def changes(before: Model, after: Model, settings: Sequence[Setting]) -> list[Changed]:
    """The entries that settings changed from one model to another."""
    texts = parse_toml(before.text), parse_toml(after.text)
    places = (Setting(s.place, None) for s in _with_consequences(before, settings))
    found = (Changed(s.key, *(_entry(text, s) for text in texts)) for s in places)
    return [c for c in found if c.before != c.after]


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


def _with_consequences(model: Model, settings: Sequence[Setting]) -> list[Setting]:
    """The settings entry by entry, and what else they change."""
    complete = _complete(model, settings)
    return [*complete, *_rescaled(model, complete)]


def _complete(model: Model, settings: Sequence[Setting]) -> list[Setting]:
    """The settings entry by entry, those of a table in it too, and the column's name of one that nobody says."""
    tables, found = parse_toml(model.text), dict[tuple[str, ...], Setting]()
    for setting in (inner for outer in settings for inner in _entries(tables, outer)):
        if setting.place in found:
            raise Failure(f"Each setting must be there once, but {setting.key} is there twice. Leave one out.")
        found[setting.place] = setting
    begun = [
        s.place[1] for s in found.values() if s.place[0] == "columns" and len(s.place) == 3 and s.value is not None
    ]
    names = [n for n in dict.fromkeys(begun) if n not in model.columns and ("columns", n, "column") not in found]
    return [*(Setting(("columns", name, "column"), name) for name in names), *found.values()]


def _rescaled(model: Model, settings: Sequence[Setting]) -> list[Setting]:
    """What is stated of the noise and the step of channels whose unit or scale these settings change, in the new one.

    Nothing where a place becomes a speed, or the other way. But of what they state themselves, and of counts per turn,
    which are the encoder's: only such as were made with a guessed scale follow it.
    """
    tables, given = parse_toml(model.text), {s.place for s in settings}
    found = []
    for name, factor in _changed_scales(model, settings).items():
        sensor = model.table.sensors.get(name)
        places = [
            ("sensors", "noise", name),
            ("sensors", "step", name),
            ("sensors", sensor.noise_key if sensor else ""),
        ]
        stated = {place: _entry(tables, Setting(place, None)) for place in places if place not in given and place[-1]}
        numbers = {p: v for p, v in stated.items() if isinstance(v, int | float)}
        found += [Setting(p, None if factor is None else float(f"{v * factor:.6g}")) for p, v in numbers.items()]
        counts = ("sensors", sensor.counts_key if sensor else "")
        if factor is not None and counts not in given and _is_guessed(model.text, counts):
            found.append(Setting(counts, max(1, round(_entry(tables, Setting(counts, None)) / factor))))
    return found


def _is_guessed(text: str, place: tuple[str, ...]) -> bool:
    """True of an entry that is there with the mark of a guess."""
    from wheelpend.model.toml_edits import has_guess_mark  # imported late: tomlkit is slow to load

    return bool(place[-1]) and has_guess_mark(text, place)


def _changed_scales(model: Model, settings: Sequence[Setting]) -> dict[str, float | None]:
    """By what factor these settings change how a column of the file is read, of those that are changed.

    None where a place becomes a speed that is summed, or the other way: the step of the one is none of the other. Of
    another column nothing is known, nor of one that was read in a unit that it cannot have.
    """
    changes: dict[str, dict[str, Any]] = {}
    for setting in settings:
        if setting.place[0] == "columns" and len(setting.place) == 3:
            changes.setdefault(setting.place[1], {})[setting.place[2]] = setting.value
        elif setting.place[0] == "columns" and len(setting.place) == 2 and setting.value is None:
            name = setting.place[1]  # without an entry a column of the quantity's own name is read, in its own unit
            changes[name] = {"column": name, "unit": "", "scale": None}
    found: dict[str, float | None] = {}
    for name, changed in changes.items():
        before = model.columns.get(name, ColumnMap(name))
        if name not in model.table.channels or changed.get("column", before.column) != before.column:
            continue
        scale = changed.get("scale", before.scale)
        old = _factor(model, name, before.unit, before.scale)
        new = _factor(model, name, changed.get("unit", before.unit) or "", 1.0 if scale is None else scale)
        if old and new and old != new:
            found[name] = new[0] / old[0] if old[1] == new[1] else None
    return found


def _factor(model: Model, name: str, unit: str, scale: Any) -> tuple[float, bool] | None:
    """Factor of a channel's column, and whether it is a speed that is summed; None where it cannot be read so."""
    if not isinstance(scale, int | float) or not 0.0 < scale < math.inf or (unit and unit not in UNIT_CONVERSIONS):
        return None
    try:
        factor, is_speed = unit_conversion(name, unit, model.table)
    except Failure:
        return None  # the reader of the file says so, of a unit that is set
    return scale * factor, is_speed


def _entries(tables: Mapping[str, Any], setting: Setting) -> list[Setting]:
    """A setting; of a table that of each entry, with those that it takes out."""
    if not isinstance(setting.value, dict):
        return [setting]
    if len(setting.place) > 2:
        raise Failure(f"{setting.key} must be one value, not a table. Set {'.'.join(setting.place[:2])} to a table.")
    present = _entry(tables, setting) or {}
    values = {**dict.fromkeys(present if isinstance(present, dict) else ()), **setting.value}
    return [Setting((*setting.place, key), value) for key, value in values.items()]


def _holds_already(tables: Mapping[str, Any], setting: Setting) -> bool:
    before = _entry(tables, setting)
    return before == setting.value and isinstance(before, bool) == isinstance(setting.value, bool)


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
    if isinstance(found, dict) and not (setting.value is None or isinstance(setting.value, dict)):
        raise Failure(f"{setting.key} must name one entry, but it is a table with {', '.join(found)}. Name one of "
                      f"them: {setting.key}.{next(iter(found), 'NAME')}=VALUE.")  # fmt: skip
    return found
