"""What a file's columns are, without a model: time, inputs, positions, their rates, references, constants."""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from wheelpend.errors import Failure
from wheelpend.inspection.column_names import (
    ANGLE_NAMES,
    REFERENCE_NAMES,
    are_body_and_wheel,
    contains,
    has_word,
    is_acceleration,
    is_called_rate,
    is_called_time,
    is_command,
    is_increment,
    is_magnitude,
    is_no_place,
    is_of_gyro,
    left_name,
    stated_base,
    stated_factor,
)
from wheelpend.inspection.column_roles import currents_beside, held_inputs, is_unnamed, right_sides, roles_of
from wheelpend.inspection.counters import coordinates_among, copies_among, filtered_among, replaced_clock
from wheelpend.inspection.file_values import (
    analysed,
    moving_columns,
    numeric_columns,
    unread_columns,
)
from wheelpend.inspection.own_clock import beside_clock, clock_seconds, own_clock
from wheelpend.inspection.rate_origin import COMPUTED, COUNTS_ENDING, SAME_READINGS, rate_remark, step_remark
from wheelpend.inspection.raw_units import MIN_LEVEL_SHARE, is_followed, level_share
from wheelpend.inspection.signals import Signals, all_signals, uniform_signals
from wheelpend.logs.checks import check_time
from wheelpend.logs.columns import ROW_NUMBER, ColumnMap
from wheelpend.logs.csv_text import NAMELESS_PREFIX
from wheelpend.logs.log import gapless_ranges
from wheelpend.logs.noise import find_quantum
from wheelpend.logs.read import clock_rank, open_file, without_empty_rows
from wheelpend.logs.summed_speed import summed_over_time
from wheelpend.logs.tables import check_length, scalars_of
from wheelpend.logs.units import speed_unit, words_of
from wheelpend.logs.unwrap import whole_turn

USUAL_INTERVAL_S = 1e-3  # from row to row, of a file that says nothing of its times
COMMAND_REMARK = "whole numbers within a timer's full scale, which the sensors' motion follows"
ONE_MOTOR = re.compile(r"(m|mot|motor|wheel)[ _]?(\d+|l|r|left|right)")  # one of several
OUTPUT_NAMES = ("y", "yk", "y_k", "y(k)", "out", "output", "response", "measured", "measurement")
SUMMED_PLACE = "place"  # what a speed comes to that is summed over time


class FileColumn(NamedTuple):
    """A column of a file: what it is taken for, and why."""

    name: str
    role: str  # time, input, position, rate, reference, supply, constant, counter, copy, further, unread, text
    of: str  # the position of a rate or a reference
    minimum: float
    maximum: float
    step: float  # 0 where it has none
    remark: str  # a sentence, or nothing

    @property
    def words(self) -> str:
        """What it is in words: rate of theta_p, not recognised."""
        what = "not recognised" if self.role == "further" else self.role
        return what + (f" of {self.of}" if self.of else "")

    def to_json(self) -> dict[str, Any]:
        """The column under the keys of JSON."""
        return self._asdict()


class Survey(NamedTuple):
    """The columns of a file, its clock, and its signals on a uniform grid."""

    file: str
    columns: tuple[FileColumn, ...]
    clock: ColumnMap
    signals: Signals | None
    values: dict[str, np.ndarray]
    scalars: dict[str, float]
    stretches: tuple[Signals, ...] = ()  # without a gap, short ones too
    times: str = "read"  # or said: the rows are counted, and how long each is, or made up where nobody said that
    turns: Mapping[str, float] = {}  # of angles that are wrapped into one turn: 2π or 360; their values are continuous
    speed: str = ""  # column that was summed over time to SUMMED_PLACE, as nothing else is a place

    def of_role(self, role: str) -> list[str]:
        """Names of the columns of a role, in the file's order."""
        return [c.name for c in self.columns if c.role == role]

    def is_computed(self, name: str) -> bool:
        """True of a rate that is no sensor of its own."""
        return self.column(name).remark.endswith(COMPUTED)

    def repeats_angle(self, name: str) -> bool:
        """True of a rate whose readings are its angle's too, whichever of the two was made from the other."""
        return self.column(name).remark.endswith(SAME_READINGS)

    @property
    def may_hold_place(self) -> bool:
        """True where a column may be a position that was not recognised as one."""
        return any(c.role == "further" and not is_no_place(c.name) for c in self.columns)

    def with_places_of_rates(self) -> Survey:
        """The survey with such positions alone as have a rate among the columns; as it is where less than two have."""
        rated = {c.of for c in self.columns if c.role == "rate"}
        if len(rated) < 2:
            return self
        others = [c.role == "position" and c.name not in rated for c in self.columns]
        return self._replace(
            columns=tuple(c._replace(role="further") if o else c for c, o in zip(self.columns, others, strict=True))
        )

    def column(self, name: str) -> FileColumn:
        """A column by its name."""
        return next(c for c in self.columns if c.name == name)

    @property
    def longest(self) -> Signals | None:
        """The signals; of a log too short for most of what they are asked, its longest stretch without a gap."""
        return self.signals or max(self.stretches, key=lambda s: len(s.voltage), default=None)

    def longest_with(self, *places: str) -> Signals | None:
        """The same, where it has these channels: one that is read too seldom is in no stretch."""
        found = self.longest
        return found if found is not None and all(p in found.channels for p in places) else None

    def title(self, name: str) -> str:
        """What a column is called; the place that a speed was summed to is called after that speed."""
        return f"{self.speed}, summed" if self.speed and name == SUMMED_PLACE else name

    def base_of(self, name: str) -> str:
        """The unit of SI that a column's name states or the step of its encoder shows; rad of one called an angle."""
        shown = self.column(name).remark.endswith(COUNTS_ENDING) or has_word(name, ANGLE_NAMES)
        of_speed = stated_base(self.speed) if name == SUMMED_PLACE else ""
        summed = next((own for own in ("rad", "m") if of_speed == speed_unit(own)), "")
        return summed or stated_base(name) or ("rad" if shown else "")


def survey_file(path: Path, interval: float | None = None) -> Survey:
    """What each column of a file is; raises Failure where a column that is called a time does not grow.

    ``interval`` [s] is that from row to row, of a file whose times are missing or of no use.
    """
    file, path = open_file(path), Path(path)
    values = numeric_columns(path, file)
    if not values:
        raise Failure(f"{path.name}: a log must have columns of numbers; it has none. It needs a header row and "
                      "one row per sample.")  # fmt: skip
    check_length(path.name, len(next(iter(values.values()))))
    broken, texts = unread_columns(file, list(values))
    filled, _ = without_empty_rows(values)
    stamps = None if interval else own_clock(path, file, filled)
    values = filled if stamps else values  # without a clock every row counts
    if not interval and not (stamps and clock_rank(np.diff(values[stamps.column])) < 2):
        require_readable_clock(path, broken)
    values = {n: v for n, v in values.items() if not interval or not is_called_time(n)} or values
    clock = stamps or ColumnMap(ROW_NUMBER, "s", scale=interval or USUAL_INTERVAL_S)
    raw = values.pop(clock.column, None)
    raw = np.arange(1.0, len(next(iter(values.values()))) + 1.0) if raw is None else raw
    check_time(path.name, raw)
    times = "read" if stamps else "said" if interval else "made up"
    found = with_summed_speed(surveyed(path, clock, raw, values, times), path, raw, values)
    require_readable_input(path, broken, found)
    unread = [FileColumn(name, "unread", "", np.nan, np.nan, 0.0, text) for name, text in broken.items()]
    text = [FileColumn(name, "text", "", np.nan, np.nan, 0.0, "") for name in texts]
    return found._replace(columns=(*found.columns, *unread, *text))


def require_readable_clock(path: Path, broken: Mapping[str, str]) -> None:
    """Raise Failure where the column that is called the time cannot be read; nothing else in the file is a clock."""
    clock = next((name for name in broken if is_called_time(name)), "")
    if clock:
        raise Failure(f"{broken[clock]} Without its times a log tells no rate: {path.name} needs them, or the seconds "
                      "from row to row (--interval).")  # fmt: skip


def require_readable_input(path: Path, broken: Mapping[str, str], found: Survey) -> None:
    """Raise Failure where the column that is called the input cannot be read, and no other is one."""
    lost = "" if found.of_role("input") else next((n for n in broken if is_command(n)), "")
    if lost:
        raise Failure(f"{broken[lost]} Without its input {path.name} is the log of a machine that nothing drives.")


def with_summed_speed(as_read: Survey, path: Path, raw: np.ndarray, values: dict[str, np.ndarray]) -> Survey:
    """A survey of a file without a place, with one that a speed comes to, of two wheels the left; others as read.

    A speed is called so, or is the one column called nothing, or an increment, that follows a command's level, as a
    motor's speed does: a place that is called an increment is none. Or it is what a gyro reads on what nothing drives.
    A body that balances has a place, and so have the wheels whose speed alone is logged beside it.
    """
    places = as_read.of_role("position")
    speeds = [c.name for c in as_read.columns if c.role == "further" and may_be_summed(c.name)]
    of_wheels = [n for n in speeds if len(places) == 1 and are_body_and_wheel(places[0], n)]
    speed = next(iter(of_wheels or speeds), "")
    speed = speed or following_speed(as_read, values) or swinging_gyro(as_read, values)
    others = [n for n in places if n != speed]
    beside_body = speed in of_wheels and as_read.of_role("input")
    if not speed or SUMMED_PLACE in values or (others and not beside_body):
        return as_read
    copies = tuple(c for c in as_read.columns if c.role == "copy")
    aside = {speed, *(c.name for c in copies)}
    rest = {n: v for n, v in values.items() if n not in aside and not is_of_right_wheel(n, values)}
    way = summed_over_time(values[speed] * stated_factor(speed), clock_seconds(raw, as_read.clock))
    summed = surveyed(path, as_read.clock, raw, {**rest, SUMMED_PLACE: way}, as_read.times)
    if set(summed.of_role("position")) != {*others, SUMMED_PLACE}:
        return as_read
    return summed._replace(speed=speed, columns=(*summed.columns, *copies))


def following_speed(as_read: Survey, values: Mapping[str, np.ndarray]) -> str:
    """The one column whose name says nothing, or an increment, that settles at levels which a command sets; or nothing.

    Nothing where several do, or where it goes to just what is commanded: that is a servo's place. What is called a
    place, a current or a temperature may follow its command as well.
    """
    commands = [n for n in as_read.of_role("input") if not is_of_right_wheel(n, values)]
    if len(commands) != 1:
        return ""
    unsure = [c.name for c in as_read.columns if c.role in ("further", "position")]
    free = [n for n in unsure if says_nothing(n) or is_increment(n)]
    able = [n for n in free if not is_of_right_wheel(n, values)]
    known = {n: np.isfinite(values[n]) & np.isfinite(values[commands[0]]) for n in able}
    pairs = {n: (values[commands[0]][known[n]], values[n][known[n]]) for n in able}
    found = [n for n, pair in pairs.items() if level_share(*pair) > MIN_LEVEL_SHARE and not is_followed(*pair)]
    return found[0] if len(found) == 1 else ""


def is_of_right_wheel(name: str, names: Collection[str]) -> bool:
    """True of a column of a right wheel where one of the left wheel's has the same words."""
    return left_name(name) in {words for n in names if (words := tuple(words_of(n)))}


def says_nothing(name: str) -> bool:
    """True of a column without a header, or called no more than an output, or after a motor by its number or side."""
    called = name.strip().lower()
    return name.startswith(NAMELESS_PREFIX) or called in OUTPUT_NAMES or bool(ONE_MOTOR.fullmatch(called))


def swinging_gyro(as_read: Survey, values: Mapping[str, np.ndarray]) -> str:
    """Of the axes of a gyro the one that turns most, in a log without an input, as of a phone that swings; or nothing.

    A robot that something drives has wheels, too, which its gyro does not see.
    """
    further = [c.name for c in as_read.columns if c.role == "further"]
    axes = [n for n in further if is_of_gyro(n) and is_called_rate(n) and not is_magnitude(n)]
    driven = as_read.of_role("input") or any(map(is_command, further))
    return "" if driven else max(axes, key=lambda n: float(np.nanstd(values[n] * stated_factor(n))), default="")


def may_be_summed(name: str) -> bool:
    """True of a column that is called a speed, and neither a commanded one nor that of a body's gyro."""
    is_speed = is_no_place(name) and not is_acceleration(name) and not is_magnitude(name)
    return is_speed and not contains(name, REFERENCE_NAMES) and not is_of_gyro(name)


def surveyed(path: Path, clock: ColumnMap, raw: np.ndarray, values: dict[str, np.ndarray], times: str) -> Survey:
    """What each of a file's columns (N,) is beside its clock ``raw`` (N,)."""
    t = clock_seconds(raw, clock)
    counters = {n: text for n, v in values.items() if (text := beside_clock(n, v, t))}
    if times == "said" and (first := next(iter(values))) not in counters and first.startswith(NAMELESS_PREFIX):
        counters |= replaced_clock(first, values[first])
    rest = {n: v for n, v in values.items() if n not in counters}
    copies = copies_among(rest) | coordinates_among(rest) | filtered_among(rest)
    no_reading = counters | copies
    log = analysed(path.name, t, moving_columns(path, {n: v for n, v in values.items() if n not in no_reading}))
    moving = dict(zip(log.channels, log.measured.T, strict=True))
    signals = uniform_signals(log, "", in_range=False, all_needed=False)
    roles = roles_of(moving, t, signals, gapless_ranges(log, 0, len(t)))
    roles |= dict.fromkeys(counters, ("counter", "")) | dict.fromkeys(copies, ("copy", ""))
    roles |= held_inputs(values, moving, roles)
    aside = right_sides(roles) | currents_beside(roles)
    roles |= dict.fromkeys(aside, ("further", ""))
    columns = [column_of(clock.column, "time", "", raw, "")]
    for name, v in values.items():
        role, of = roles.get(name, ("constant", ""))
        remark = rate_remark(moving[of], moving[name], t) if role == "rate" else ""
        remark = step_remark(find_quantum(v) * stated_factor(name)) if role == "position" else remark
        remark = no_reading.get(name, aside.get(name, remark))
        remark = COMMAND_REMARK if role == "input" and is_unnamed(name) else remark
        columns.append(column_of(name, role, of, v, remark))
    signals_of = {**moving, "t": t}
    turns = {n: turn for n in moving if (turn := whole_turn(values[n] * stated_factor(n)))}
    stretches = all_signals(log)
    return Survey(path.name, tuple(columns), clock, signals, signals_of, scalars_of(path), stretches, times, turns)


def column_of(name: str, role: str, of: str, values: np.ndarray, remark: str) -> FileColumn:
    """A column with its range and step."""
    known = values[np.isfinite(values)]
    low, high = (float(known.min()), float(known.max())) if known.size else (np.nan, np.nan)
    return FileColumn(name, role, of, low, high, find_quantum(values) if role != "time" else 0.0, remark)
