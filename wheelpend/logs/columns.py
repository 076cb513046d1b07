"""Columns of a log: those that a plant needs, with their units, and the mapping of a file's columns onto them."""

from __future__ import annotations

import difflib
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import chain
from typing import NamedTuple

from derive.plant_signature import INPUT_WORDS, WORDS_FOR_ANY, PlantSignature, PlantWords, Sensor
from derive.plants import wheel_pendulum as default_plant
from wheelpend.errors import Failure, did_you_mean
from wheelpend.logs.csv_text import NAMELESS_PREFIX
from wheelpend.logs.units import UNIT_CONVERSIONS, speed_unit, unit_base, unit_ending, without_unit

TIME_ALIASES = ("time", "timestamp", "stamp", "sec")  # other names of columns; only used to propose a mapping
NO_RATES = "gyro of a robot on wheels, rate_sensor of any plant"  # assumptions of a machine without a sensor of a rate
HELD_WORDS = HELD_AFTER, HELD_BEFORE = ("after", "before")  # when a row's input acts: until the next, since the last
ROW_NUMBER = "row number"  # stands for a column that counts the rows, in a log without a clock
INPUT_ALIASES = (
    "volt", "input", "motor", "command", "u", "ua", "u_a", "vir", "effort", "torque", "tau", "force", "current", "pwm",
    "duty",
)  # fmt: skip
INPUT_NAME_UNITS = {"volt": "V", "current": "A", "torque": "N m", "tau": "N m", "force": "N"}  # what a name suggests


@dataclass(frozen=True)
class ColumnMap:
    """The column of a log that holds a quantity, with its unit, its sign against ours, its scale and its zero.

    measured = sign · scale · (value in SI units) · times + offset, times being the value of another column; behind a
    Gaussian that looks both ways, where an input is smoothed. An input acts from its row to the next, or since the row
    before, as ``held`` says.
    """

    column: str
    unit: str = ""  # one of UNIT_CONVERSIONS; empty means the quantity's own
    sign: int = 1  # -1 where the log counts the other way
    scale: float = 1.0  # by which a column is multiplied that is in no such unit: rad per count, V per duty
    offset: float = 0.0  # what is measured where the column reads zero, in the quantity's own unit
    times: str = ""  # another column, which multiplies it sample by sample: a battery's volts beside a duty
    smooth: float = 0.0  # s, standard deviation of a Gaussian behind which an input is that a sensor reads
    held: str = HELD_AFTER  # or before: whether an input in a row acts after it, or acted before it

    def __post_init__(self) -> None:
        if self.unit and self.unit not in UNIT_CONVERSIONS:
            hint = did_you_mean(self.unit, UNIT_CONVERSIONS)
            raise Failure(f"No unit named '{self.unit}'. Known units: {', '.join(UNIT_CONVERSIONS)}.{hint}")
        if self.sign not in (1, -1):
            raise Failure(f"sign must be 1 or -1, not {self.sign}.")
        if not (math.isfinite(self.scale) and self.scale > 0):
            raise Failure(f"scale must be a positive number, not {self.scale}; sign = -1 turns a column round.")
        if not math.isfinite(self.offset):
            raise Failure(f"offset must be a finite number, in the unit of the quantity, not {self.offset}.")
        if not (math.isfinite(self.smooth) and self.smooth >= 0):
            raise Failure(f"smooth must be a time in s, over which an input is smoothed, not {self.smooth}.")
        if self.held not in HELD_WORDS:
            raise Failure(f"held must be one of {', '.join(HELD_WORDS)}, of the row of an input, not '{self.held}'.")


@dataclass(frozen=True)
class ColumnTable:
    """The columns that the logs of a plant have, by our names."""

    input: str  # empty where nothing drives the plant
    channels: tuple[str, ...]
    units: Mapping[str, str]  # of t, the input, the channels and the reference
    reference: str = ""  # column of what was commanded; empty where nothing is
    range_channel: str = ""  # channel that must stay within ±π/2
    further: tuple[str, ...] = ()  # inputs beside the first
    rates: Mapping[str, str] = field(default_factory=dict)  # channels that are rates of others, with these
    sensors: Mapping[str, Sensor] = field(default_factory=dict)  # what is known of them, by channel
    words: PlantWords = WORDS_FOR_ANY
    wiring_check: str = ""  # check of the inspection that knows how such a machine is wired
    pulled: bool = True  # gravity acts on the machine

    @classmethod
    def of(cls, plant: PlantSignature) -> ColumnTable:
        """The columns that a log of a plant has."""
        units = {"t": "s", **{c.name: c.unit for c in plant.channels}}
        if plant.driven:
            units |= dict.fromkeys(plant.inputs, plant.input_unit)
        if plant.reference:
            units[plant.reference] = plant.channel(plant.controlled[0]).unit
        return cls(
            input=plant.input if plant.driven else "",
            channels=tuple(c.name for c in plant.channels),
            units=units,
            reference=plant.reference,
            range_channel=plant.range_channel,
            further=plant.further,
            rates={c.name: c.rate_of for c in plant.channels if c.rate_of},
            sensors={c.name: c.sensor for c in plant.channels},
            words=plant.words,
            wiring_check=plant.wiring_check,
            pulled=plant.pulled,
        )

    def aliases(self, name: str) -> tuple[str, ...]:
        """Other names of a column in files."""
        if name == "t":
            return TIME_ALIASES
        if name == self.input:
            return () if self.further else INPUT_ALIASES
        return self.sensors[name].aliases if name in self.sensors else ()

    @property
    def inputs(self) -> tuple[str, ...]:
        """Columns of all inputs."""
        return (*((self.input,) if self.input else ()), *self.further)

    @property
    def places(self) -> tuple[str, ...]:
        """Channels that are positions: angles and ways."""
        return tuple(c for c in self.channels if self.units[c] in ("rad", "m"))

    @property
    def required(self) -> tuple[str, ...]:
        """Columns without which a log cannot be used."""
        return ("t", *self.inputs, *self.channels)

    @property
    def names(self) -> tuple[str, ...]:
        """Every column that is read where a log has it."""
        return (*self.required, *((self.reference,) if self.reference else ()))


DEFAULT_TABLE = ColumnTable(
    input=default_plant.INPUT,
    channels=tuple(default_plant.SENSORS),
    units=default_plant.UNITS,
    reference=default_plant.REFERENCE,
    range_channel=default_plant.RANGE_CHANNEL,
    rates=default_plant.RATES,
    sensors=default_plant.SENSORS,
    words=default_plant.WORDS,
    wiring_check=default_plant.WIRING_CHECK,
)  # of logs that are read without saying of which plant


class ColumnSource(NamedTuple):
    """A column of a file, the factor that brings it to our unit and sign, and what is added then."""

    column: str
    factor: float
    offset: float = 0.0  # in the quantity's unit
    times: str = ""  # a column of the file that multiplies it sample by sample; nothing where none does
    is_speed: bool = False  # of the place that it is read as: it is summed over time
    smooth: float = 0.0  # s, of an input that a sensor reads
    acted_before: bool = False  # of an input: since the row before, not from its own row on


def find_sources(
    log: str,
    names: Sequence[str],
    table: ColumnTable,
    columns: Mapping[str, ColumnMap],
    file_units: Mapping[str, str] | None = None,
    kind: str = "file",
) -> tuple[dict[str, ColumnSource], list[str]]:
    """The column and factor of each quantity in a file, with remarks; raises Failure when one is missing.

    ``file_units`` are those that the file itself states, by its columns; a unit in ``columns`` goes before. ``kind`` is
    what sentences call the source.
    """
    sources, notes = {}, []
    for name in table.names:
        mapped, stated = with_file_unit(name, columns.get(name), names, table, file_units or {})
        notes += stated
        if mapped and mapped.column in names:
            known, is_speed = unit_conversion(name, mapped.unit, table)
            if name == "t" and mapped.offset:
                raise Failure("[columns] t must have no offset: times count from the first sample. Remove it.")
            if mapped.smooth and name not in table.inputs:
                raise Failure(f"[columns] {name} must have no smooth: only an input may be smoothed; what reads the "
                              "machine counts by its noise. Remove it.")  # fmt: skip
            if mapped.held != HELD_AFTER and name not in table.inputs:
                raise Failure(f"[columns] {name} must have no held: only an input is held from row to row. Remove it.")
            check_factor(log, name, mapped, names, kind)
            factor, acted_before = mapped.sign * mapped.scale * known, mapped.held == HELD_BEFORE
            sources[name] = ColumnSource(
                mapped.column, factor, mapped.offset, mapped.times, is_speed, mapped.smooth, acted_before
            )
        elif name in names:
            sources[name] = ColumnSource(name, 1.0)
            if mapped and name in columns:
                notes.append(f"[columns] maps {name} to '{mapped.column}', which is not in the file; '{name}' is read.")
    absent = [n for n in table.required if n not in sources]
    if absent:
        raise Failure(missing_columns_text(log, names, absent, {s.column for s in sources.values()}, table, kind))
    return sources, notes


def check_factor(log: str, name: str, mapped: ColumnMap, names: Sequence[str], kind: str) -> None:
    """Raise Failure where the column that multiplies a quantity is not there, or the quantity is the time."""
    if mapped.times and name == "t":
        raise Failure("[columns] t must have no times: no other column multiplies a clock. Remove it.")
    if mapped.times and mapped.times not in names:
        raise Failure(
            f"{log}: [columns] {name} is multiplied by '{mapped.times}', which must be a column of the {kind}; it has "
            f"{', '.join(names)}.{did_you_mean(mapped.times, names)}"
        )


def with_file_unit(
    name: str, mapped: ColumnMap | None, names: Sequence[str], table: ColumnTable, file_units: Mapping[str, str]
) -> tuple[ColumnMap | None, list[str]]:
    """The map of a quantity with the unit that the file states for its column, and a remark on what that changes."""
    column = mapped.column if mapped and mapped.column in names else name
    unit = file_units.get(column, "")
    if not unit or unit == table.units[name] or (mapped and (mapped.unit or mapped.scale != 1.0 or mapped.times)):
        return mapped, []
    summed = is_summed(name, unit, table)
    if unit_base(unit) != table.units[name] and not summed:
        return mapped, [f"{column} is in '{unit}' by the file's row of units; it is read as {table.units[name]}."]
    what = "a speed, and is summed over time" if summed else f"and is converted to {table.units[name]}"
    note = f"{column} is in {unit} by the file's row of units, {what}."
    return replace(mapped or ColumnMap(column), column=column, unit=unit), [note]


def unit_conversion(name: str, unit: str, table: ColumnTable) -> tuple[float, bool]:
    """Factor from a unit to a quantity's own, and whether it is the speed of a place, which is summed over time.

    Raises Failure when the quantity cannot have that unit.
    """
    own, is_speed = table.units[name], is_summed(name, unit, table)
    return unit_factor(name, unit, speed_unit(own) if is_speed else own, table.inputs), is_speed


def is_summed(name: str, unit: str, table: ColumnTable) -> bool:
    """True of the unit of a place's speed, but of one that is held to the vertical, which no sum is."""
    summable = name in table.places and name != table.range_channel
    return summable and unit_base(unit) == speed_unit(table.units[name])


def unit_factor(name: str, unit: str, own: str, inputs: Sequence[str] = ()) -> float:
    """Factor from a unit to a quantity's own; raises Failure when the quantity cannot have that unit."""
    becomes, value = UNIT_CONVERSIONS[unit] if unit else (own, 1.0)
    if own != becomes:
        fitting = ", ".join(u for u, (base, _) in UNIT_CONVERSIONS.items() if base == own)
        other = becomes if name in inputs and becomes in INPUT_WORDS else ""
        cure = (
            f' If the machine is commanded a {INPUT_WORDS[other]}, say so: [input] unit = "{other}".' if other else ""
        )
        raise Failure(f"[columns] {name} must have a unit that turns into {own} ({fitting}), not '{unit}'.{cure}")
    return value


def missing_columns_text(
    log: str, names: Sequence[str], absent: list[str], used: set[str], table: ColumnTable, kind: str = "file"
) -> str:
    """Message that lists the source's columns and the lines of a model.toml that would map them."""
    guesses = guess_columns([n for n in names if n not in used], absent, table)
    counted = f't = {{ column = "{ROW_NUMBER}", scale = 0.001 }}  # without a clock: the seconds from row to row'
    lines = [
        f'{name} = {{ column = "{guesses[name] or "..."}"{unit_entry(table.units[name], guesses[name])} }}'
        if guesses[name] or name != "t"
        else counted
        for name in guesses
    ]
    nameless = all(n == f"{NAMELESS_PREFIX}{k}" for k, n in enumerate(names, 1))
    rates = " and ".join(n for n in absent if n in table.rates)
    unread = f"If no sensor reads {rates}, the model's [assumptions] say so ({NO_RATES}). " if rates else ""
    what = f"the column {absent[0]} is" if len(absent) == 1 else f"the columns {', '.join(absent)} are"
    return (
        f"{log}: {what} missing. The {kind} has{', without a header' if nameless else ''}: {', '.join(names)}. "
        f"{unread}If they are there under another name, say so in model.toml:\n\n[columns]\n" + "\n".join(lines)
    )


def guess_column(name: str, free: Sequence[str], table: ColumnTable) -> str:
    """The unused column that is most likely meant, or nothing."""
    for alias in table.aliases(name):
        for column in free:
            if alias in (column.lower(), without_unit(column).lower()) or (len(alias) > 2 and alias in column.lower()):
                return column
    return next(iter(difflib.get_close_matches(name, free, 1)), "")


def unit_entry(own: str, column: str) -> str:
    """The unit of a column as a part of its entry; nothing where the unit is none that turns into others."""
    unit = guess_unit(own, column)
    return f', unit = "{unit}"' if unit else ""


def guess_columns(free: Sequence[str], wanted: Sequence[str], table: ColumnTable) -> dict[str, str]:
    """The unused column that is most likely meant by each name, or nothing; none is meant twice."""
    left, found = list(free), {}
    for name in sorted(wanted, key=lambda n: -len(n)):  # dtheta_p before theta_p: a pitch rate is also called pitch
        found[name] = guess_column(name, left, table)
        left = [n for n in left if n != found[name]]
    return found


def guess_unit(own: str, column: str) -> str:
    """The unit that a column's name ends with, or else the quantity's own."""
    return unit_ending(own, column) or (own if own in UNIT_CONVERSIONS else "")


def guess_input_unit(column: str) -> str:
    """V, A, N m or N as an input's column ends with it or is called after it; nothing where its name tells nothing."""
    stated = (base for base in INPUT_WORDS if unit_ending(base, column))
    suggested = (unit for name, unit in INPUT_NAME_UNITS.items() if name in column.lower())
    return next(chain(stated, suggested), "")
