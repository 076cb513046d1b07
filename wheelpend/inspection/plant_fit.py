"""Which plants, under which assumptions, have the columns that a file has."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from itertools import product
from typing import Any, NamedTuple

import numpy as np

from derive import plants
from derive.plant_signature import PlantSignature
from wheelpend.inspection.column_names import is_of_joint_states, stated_base, suggested_input_base, unit_within
from wheelpend.inspection.signals import is_whole
from wheelpend.inspection.survey import SUMMED_PLACE, Survey
from wheelpend.kernels.plant_signature import plant_signature
from wheelpend.logs.columns import ColumnTable, guess_columns
from wheelpend.logs.units import without_unit

IGNORED_SENSOR_COST = 0.3  # in preference, of a rate's sensor that a plant has no place for: more than of a name
OPTIONAL_SENSOR_COST = 0.15  # of one that such a machine seldom has
COUNTED_WAY_COST = 0.3  # of a way that is a motor's shaft by its numbers: more than of a name
CARRIAGE_PREFERENCE = 0.005  # against a shaft, where nothing says which
MAX_WAY_M = 20.0  # along an axis, beyond which a place is no carriage's
RATE_SENSOR_WORDS = ("gyro", "gyr_", "imu")


class Candidate(NamedTuple):
    """A plant under assumptions that has the file's kinds of columns."""

    plant: str
    assumptions: Mapping[str, Any]  # those that are not the defaults
    table: ColumnTable
    columns: Mapping[str, str]  # our name: the file's
    named: int  # of them under its own name or another known one
    computed: int  # of its rates, those that are no sensor of their own and not called so
    ignored: int = 0  # rates of the file that are sensors of their own and that it has no place for
    by_name: bool = False  # the file has every one of its columns under its own name, whatever they do
    counted: bool = False  # a way along which it goes is an encoder's counts, or longer than any axis: a shaft's

    @property
    def swings(self) -> bool:
        """True of a plant whose one angle may hang."""
        table, own = self.table, self.table.places
        return table.pulled and len(own) == 1 and table.units[own[0]] == "rad" and not table.range_channel

    @property
    def words(self) -> str:
        """The plant with its assumptions: pendulum (links = 2)."""
        chosen = ", ".join(f"{k} = {toml_value(v)}" for k, v in self.assumptions.items())
        return self.plant + (f" ({chosen})" if chosen else "")


def candidates(survey: Survey, among: Sequence[str]) -> list[Candidate]:
    """The plants among those named, under each choice that changes their columns, that a file has the columns of.

    Where none has as many positions, several that have their rates beside them are a machine's coordinates, and others
    are made from them: a tip's way, say.
    """
    return _with_columns_of(survey, among) or _with_columns_of(survey.with_places_of_rates(), among)


def _with_columns_of(survey: Survey, among: Sequence[str]) -> list[Candidate]:
    found = []
    for plant in among:
        for chosen in column_choices(plant):
            signature = plant_signature(plant, plants.complete_assumptions(plant, chosen))
            if candidate := fitted(plant, chosen, signature, survey):
                found.append(candidate)
    by_name = [c for c in found if c.by_name]
    most = max((len(c.columns) for c in by_name), default=0)
    found = [c for c in found if not c.by_name or len(c.columns) == most]
    return [c for c in found if input_suits(c)] or found


def input_suits(candidate: Candidate) -> bool:
    """False where an input in N m would push the plant's first coordinate along, or one in N would turn it."""
    first = candidate.table.units[candidate.table.places[0]]
    bases = {suggested_input_base(candidate.columns[n]) for n in candidate.table.inputs}
    return ("m" if "N m" in bases else "rad" if "N" in bases else "") != first


def column_choices(plant: str) -> list[dict[str, Any]]:
    """Choices of a plant's assumptions, apart from the defaults, under which it has other columns."""
    default = plant_signature(plant, plants.complete_assumptions(plant, {}))
    options = {}
    for assumption in plants.assumptions_of(plant):
        others = [c for c in assumption.choices if changes_columns(plant, {assumption.name: c}, default)]
        if others:
            options[assumption.name] = [assumption.default, *(c for c in others if c != assumption.default)]
    sets = [dict(zip(options, values, strict=True)) for values in product(*options.values())]
    defaults = {a.name: a.default for a in plants.assumptions_of(plant)}
    return [{k: v for k, v in s.items() if v != defaults[k]} for s in sets if buildable(plant, s)]


def buildable(plant: str, chosen: Mapping[str, Any]) -> bool:
    """True of choices that go together."""
    try:
        plant_signature(plant, plants.complete_assumptions(plant, chosen))
    except (KeyError, ValueError):
        return False
    return True


def changes_columns(plant: str, chosen: Mapping[str, Any], default: PlantSignature) -> bool:
    """True of a choice that gives other columns, or that needs another choice beside it."""
    try:
        signature = plant_signature(plant, plants.complete_assumptions(plant, chosen))
    except (KeyError, ValueError):
        return True
    return ColumnTable.of(signature).required != ColumnTable.of(default).required


def fitted(plant: str, chosen: Mapping[str, Any], signature: PlantSignature, survey: Survey) -> Candidate | None:
    """A plant with the file's columns in its places; None where their kinds or numbers differ."""
    table = ColumnTable.of(signature)
    inputs, places = survey.of_role("input"), survey.of_role("position")
    own, names = table.places, [c.name for c in survey.columns]
    if set(table.required) <= set(names):
        every = {n: n for n in table.required[1:]}
        return Candidate(plant, chosen, table, every, len(every), 0, by_name=True)
    if len(table.inputs) != len(inputs) or len(own) != len(places):
        return None
    columns = {**in_order(table.inputs, inputs, table), **kept_in_range(in_order(own, places, table), table, survey)}
    rates = {survey.column(r).of: r for r in survey.of_role("rate")}
    for channel in (c for c in table.channels if c not in own):
        rate = (
            channel if channel in survey.of_role("rate") else rates.get(columns.get(table.rates.get(channel, ""), ""))
        )
        if rate is None:
            return None
        columns[channel] = rate
    if any(survey.base_of(columns[c]) not in ("", table.units[c]) for c in own):
        return None  # an angle by its unit is no way along a slide
    named = sum(c.lower() == n or is_called(n, c, table) for n, c in columns.items())
    rates_found = {n: c for n, c in columns.items() if n not in (*own, *table.inputs)}
    is_optional = bool(chosen.get("rate_sensor"))  # the angle alone says it all, and both would say it twice
    unlike = [c for n, c in rates_found.items() if n != c and not names_rate_sensor(c)]
    computed = sum(survey.is_computed(c) or (is_optional and survey.repeats_angle(c)) for c in unlike)
    ignored = sum(not survey.is_computed(r) and r not in rates_found.values() for r in survey.of_role("rate"))
    counted = len(own) == 1 and table.units[own[0]] == "m" and may_be_shaft(survey, columns[own[0]])
    return Candidate(plant, chosen, table, columns, named, computed, ignored, counted=counted)


def may_be_shaft(survey: Survey, column: str) -> bool:
    """True of a position that is a motor's shaft rather than a carriage: summed, an encoder's counts, or too long.

    Not of one that states a unit of length.
    """
    if survey.base_of(column):
        return False
    values = survey.values[column]
    known = values[np.isfinite(values)]
    return column == SUMMED_PLACE or is_of_joint_states(column) or is_whole(known) or float(np.ptp(known)) > MAX_WAY_M


def partly_fitted(plant: str, survey: Survey) -> Candidate | None:
    """A plant with those of the file's columns that fit its places, under the choices that take most of its inputs.

    None where no position does, nor may be one among what was not recognised.
    """
    chosen = _with_inputs_of(survey, plant)
    table = ColumnTable.of(plant_signature(plant, plants.complete_assumptions(plant, chosen)))
    own, rates = table.places, {survey.column(r).of: r for r in survey.of_role("rate")}
    places = [*survey.of_role("position"), *(c for c in rates if survey.column(c).role == "further")]
    if all(table.units[n] == "rad" for n in own):
        places = [c for c in places if survey.base_of(c) != "m"]
    named = {n: c for n, c in guess_columns(places, own, table).items() if c}
    with_rate = [a for a in table.rates.values() if a in own and a not in named]
    named |= dict(zip(with_rate, [c for c in places if c in rates and c not in named.values()], strict=False))
    free, left = [c for c in places if c not in named.values()], [n for n in own if n not in named]
    free.sort(key=lambda c: not is_whole(survey.values[c]))  # an encoder's counts before what may be anything
    found = dict(zip(left, free, strict=False)) | named
    if not found and not survey.may_hold_place:
        return None
    inputs = sorted(survey.of_role("input"), key=lambda c: not suggested_input_base(c))  # a current before a set point
    columns = dict(zip(table.inputs, inputs, strict=False)) | {n: found[n] for n in own if n in found}
    columns |= {r: rates[columns[a]] for r, a in table.rates.items() if columns.get(a) in rates and r in table.channels}
    return Candidate(plant, chosen, table, columns, 0, 0)


def _with_inputs_of(survey: Survey, plant: str) -> dict[str, Any]:
    """The first choices under which a plant has most inputs, no more than a file, and no place more than by default."""
    tables = [(c, ColumnTable.of(plant_signature(plant, plants.complete_assumptions(plant, c))))
              for c in [{}, *column_choices(plant)]]  # fmt: skip
    inputs, places = len(survey.of_role("input")), len(tables[0][1].places)
    able = [(c, len(t.inputs)) for c, t in tables if len(t.places) <= places and len(t.inputs) <= inputs]
    return max(able, key=lambda choice: choice[1], default=({}, 0))[0]


def names_rate_sensor(column: str) -> bool:
    """True of a column that is called after the sensor that measured it, whatever its numbers look like."""
    return any(word in column.lower() for word in RATE_SENSOR_WORDS)


def is_called(name: str, column: str, table: ColumnTable) -> bool:
    """True of a column under one of a quantity's other names, or in words of its unit."""
    low = column.lower()
    return any(low == a or (len(a) > 2 and a in low) for a in table.aliases(name))


def in_order(names: tuple[str, ...] | list[str], columns: list[str], table: ColumnTable) -> dict[str, str]:
    """A column for each name: its own, the one that is called so, and the others in their order.

    None gets a column that states a unit of another kind, as long as others are left.
    """
    bare = {without_unit(c): c for c in reversed(columns)}
    exact = {n: n if n in columns else bare[n] for n in names if n in columns or n in bare}
    free, left = [c for c in columns if c not in exact.values()], [n for n in names if n not in exact]
    guessed = guess_columns(free, left, table) if len(set(names)) > 1 else {}
    if len(left) > 1 and len(set(map(without_digits, free))) == 1:
        guessed = {}  # pos1, pos2: in their order
    found = exact | {n: c for n, c in guessed.items() if c}
    rest = [c for c in free if c not in found.values()]
    for name in (n for n in names if n not in found):
        suiting = [c for c in rest if stated_base(c) in ("", table.units[name])]
        found[name] = (suiting or rest)[0]
        rest.remove(found[name])
    return {n: found[n] for n in names}


def kept_in_range(columns: dict[str, str], table: ColumnTable, survey: Survey) -> dict[str, str]:
    """Columns of a plant's positions; the one that must stay within ±π/2 does, where another than its own does.

    Unless its own is called so: theta may be a wheel's angle as well as a pitch. Nor where units say otherwise.
    """
    name = table.range_channel
    if name not in columns or columns[name] == name or is_called(name, columns[name], table):
        return columns
    within = [n for n, c in columns.items() if np.nanmax(np.abs(survey.values[c])) < math.pi / 2]
    if name in within or len(within) != 1 or is_called(within[0], columns[within[0]], table):
        return columns
    other = within[0]
    swapped = {name: columns[other], other: columns[name]}
    if any(survey.base_of(c) not in ("", table.units[n]) for n, c in swapped.items()):
        return columns
    return {**columns, **swapped}


def without_digits(name: str) -> str:
    """A name without its numbers."""
    return "".join(c for c in name if not c.isdigit())


def preference(candidate: Candidate, gravity: bool) -> float:
    """How likely a plant is meant: by the names of its columns, then by whether gravity shows, then the simplest.

    A gyro speaks for the machine that always has one, a body on wheels, against a cart with its encoders.
    """
    exact = sum(n == c for n, c in candidate.columns.items())
    first = candidate.table.units[candidate.table.places[0]]
    fits = 0.5 if len(candidate.table.places) == 1 and candidate.swings == gravity else 0.0
    called = 0.1 * candidate.named
    sensors = IGNORED_SENSOR_COST * candidate.ignored
    sensors += OPTIONAL_SENSOR_COST * bool(candidate.assumptions.get("rate_sensor"))
    unit = 0.2 * any(unit_within(first, c) not in ("", first) for c in candidate.columns.values())
    costs = sensors + candidate.computed + COUNTED_WAY_COST * candidate.counted + 0.01 * len(candidate.assumptions)
    costs += CARRIAGE_PREFERENCE * (first == "rad" and not candidate.table.pulled)
    return 10 * exact + fits + called + unit - costs


def toml_value(value: Any) -> str:
    """A value as TOML writes it."""
    return {True: "true", False: "false"}[value] if isinstance(value, bool) else (
        json.dumps(value, ensure_ascii=False) if isinstance(value, str) else f"{value:.7g}")  # fmt: skip
