"""What a file's columns are, without a model: time, inputs, positions, their rates, references, constants."""

from __future__ import annotations

import math
import re
from collections.abc import Collection, Mapping, Sequence
from itertools import permutations
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from scipy.ndimage import median_filter

from wheelpend.errors import Failure
from wheelpend.inspection.column_names import (
    ANGLE_NAMES,
    ERROR_NAMES,
    REFERENCE_NAMES,
    contains,
    has_word,
    inputs_among,
    is_acceleration,
    is_called_angle,
    is_called_clock,
    is_called_rate,
    is_called_time,
    is_command,
    is_gyro_axis,
    is_increment,
    is_likely_input,
    is_magnitude,
    is_no_place,
    kind_by_name,
    left_name,
    may_be_sensor,
    stated_base,
    stated_factor,
)
from wheelpend.inspection.counters import coordinates_among, copies_among, counter_sentence, replaced_clock
from wheelpend.inspection.file_values import (
    MAX_STEP_SHARE,
    analysed,
    columns_with_bad_cells,
    moving_columns,
    numeric_columns,
)
from wheelpend.inspection.kinematics import ANGLE_SCALES, RatePair, rate_misfit, sum_misfit
from wheelpend.inspection.raw_units import MIN_LEVEL_SHARE, full_scale, level_share, states_volts
from wheelpend.inspection.signals import MAX_SWAPPED_MISFIT_SHARE, Signals, all_signals, is_whole, uniform_signals
from wheelpend.inspection.unnamed_columns import is_battery, unnamed_command
from wheelpend.logs.checks import INTERVAL_CURE, check_time, repeated_cure, starts_at_rest
from wheelpend.logs.columns import ROW_NUMBER, ColumnMap
from wheelpend.logs.csv_text import NAMELESS_PREFIX
from wheelpend.logs.log import gapless_ranges
from wheelpend.logs.noise import find_quantum, rounding_sigma
from wheelpend.logs.outliers import MAX_SPIKE_SAMPLES, MAX_SPIKE_SHARE
from wheelpend.logs.read import clock_rank, find_time_column, open_file
from wheelpend.logs.summed_speed import summed_over_time
from wheelpend.logs.tables import Table, check_length, scalars_of
from wheelpend.logs.units import UNIT_CONVERSIONS, speed_unit, words_of
from wheelpend.logs.unwrap import whole_turn
from wheelpend.logs.white_noise import difference_noise
from wheelpend.numerics import gaussian_smoothed

MAX_FOLLOWING_SHARE = 0.05  # of a position's variance, by which another one that it follows differs at most
MIN_NAMED_RATE_SHARE = 0.3  # unexplained, up to which a column that is called a rate is that of a position
MAX_ALIKE_RATIO, MAX_ALIKE_MISFIT = 2.0, 0.01  # of misfits, up to which names tell which place a rate is of
MAX_SUM_MISFIT_SHARE = 0.02  # of a place's variance about a line, that the sum of its rate leaves
COMPUTED_SHARE = 0.9  # of a rate's scatter that a filter of its angle gives, from which on it was computed
ROUNDING_SHARE = 0.4  # the same where the angle scatters by little more than its rounding: no motion is shared then
MAX_ROUNDING_GROWTH = 3.0  # of the scatter of an angle's slope over what rounding makes of it, for that
MAX_SHARED_NOISE = 0.05  # of a rate's white noise, that a filter of its angle gives where the noise is the sensor's
MIN_OWN_ROUNDINGS = 2.0  # of the error of rounding, from which on such noise is no rounding
MIN_ENCODER_COUNTS = 100  # of a turn
USUAL_INTERVAL_S = 1e-3  # from row to row, of a file that says nothing of its times
COMPUTED, COUNTS_ENDING = "no sensor of its own.", "counts a turn."  # ends of remarks
COMMAND_REMARK = "whole numbers within a timer's full scale, which the sensors' motion follows"
SCATTER_LAG_SAMPLES, MAX_RAW_GROWTH = 4, 1.9  # growth of a raw signal's scatter over so many samples
MAX_REMARK_SAMPLES = 20_000  # looked at for that
BODY_SENSORS = ("gyro", "imu")
OUTPUT_NAMES = ("y", "yk", "y_k", "y(k)", "out", "output", "response", "measured", "measurement")
SUMMED_PLACE = "place"  # what a speed comes to that is summed over time
MAX_BACKWARD_SHARE = 0.05  # of the rows of a clock that now and then goes back
MIN_PLACES = 10  # different readings of a place
MAX_LEAD_SAMPLES = 60  # by which a reference is looked for ahead of the position that follows it
MIN_LEAD_SHARE = 4  # parts of a log, of which a lead is one at most: the rest shows it
MAX_COPY_ROUGHNESS = 0.5  # of a signal's noise, which a filtered copy of it has at most
ERROR_SMOOTHING_SAMPLES = 3.0  # standard deviation of the Gaussian beyond which a signal is error
MIN_FILTER_SAMPLES, MAX_FILTER_SAMPLES = 5, 15  # samples before and after, from which such a filter takes them
MIN_SAMPLES_PER_TAP = 20  # of a log, for each of these


class FileColumn(NamedTuple):
    """A column of a file: what it is taken for, and why."""

    name: str
    role: str  # time, input, position, rate, reference, supply, constant, counter, copy, further, unread
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
    stamps = None if interval else own_clock(path, file, values)
    values = {n: v for n, v in values.items() if not interval or not is_called_time(n)} or values
    clock = stamps or ColumnMap(ROW_NUMBER, "s", scale=interval or USUAL_INTERVAL_S)
    raw = values.pop(clock.column, None)
    raw = np.arange(1.0, len(next(iter(values.values()))) + 1.0) if raw is None else raw
    check_time(path.name, raw)
    times = "read" if stamps else "said" if interval else "made up"
    found = with_summed_speed(surveyed(path, clock, raw, values, times), path, raw, values)
    broken = columns_with_bad_cells(file, [c.name for c in found.columns])
    unread = [FileColumn(name, "unread", "", np.nan, np.nan, 0.0, text) for name, text in broken.items()]
    return found._replace(columns=(*found.columns, *unread))


def with_summed_speed(as_read: Survey, path: Path, raw: np.ndarray, values: dict[str, np.ndarray]) -> Survey:
    """A survey of a file without a place, with one that a speed comes to, of two wheels the left; others as read.

    A speed is called so, or is the one column called nothing, or an increment, that follows a command's level, as a
    motor's speed does: a place that is called an increment is none. Or it is what a gyro reads on what nothing drives.
    """
    speed = next((c.name for c in as_read.columns if c.role == "further" and may_be_summed(c.name)), "")
    speed = speed or following_speed(as_read, values) or swinging_gyro(as_read, values)
    if any(n != speed for n in as_read.of_role("position")) or not speed or SUMMED_PLACE in values:
        return as_read
    others = {n: v for n, v in values.items() if n != speed and not is_of_right_wheel(n, values)}
    way = summed_over_time(values[speed] * stated_factor(speed), clock_seconds(raw, as_read.clock))
    summed = surveyed(path, as_read.clock, raw, {**others, SUMMED_PLACE: way}, as_read.times)
    return summed._replace(speed=speed) if summed.of_role("position") == [SUMMED_PLACE] else as_read


def following_speed(as_read: Survey, values: Mapping[str, np.ndarray]) -> str:
    """The one column whose name says nothing, or an increment, that settles at levels which a command sets; or nothing.

    Nothing where several do. What is called a place, a current or a temperature may follow its command as well.
    """
    commands = [n for n in as_read.of_role("input") if not is_of_right_wheel(n, values)]
    if len(commands) != 1:
        return ""
    free = [c.name for c in as_read.columns if c.role == "further" and says_nothing(c.name)]
    free += [c.name for c in as_read.columns if c.role in ("further", "position") and is_increment(c.name)]
    able = [n for n in free if not is_of_right_wheel(n, values)]
    known = {n: np.isfinite(values[n]) & np.isfinite(values[commands[0]]) for n in able}
    found = [n for n in able if level_share(values[commands[0]][known[n]], values[n][known[n]]) > MIN_LEVEL_SHARE]
    return found[0] if len(found) == 1 else ""


def is_of_right_wheel(name: str, names: Collection[str]) -> bool:
    """True of a column of a right wheel where one of the left wheel's has the same words."""
    return left_name(name) in {words for n in names if (words := tuple(words_of(n)))}


def says_nothing(name: str) -> bool:
    """True of a column without a header, or called no more than an output."""
    return name.startswith(NAMELESS_PREFIX) or name.strip().lower() in OUTPUT_NAMES


def swinging_gyro(as_read: Survey, values: Mapping[str, np.ndarray]) -> str:
    """Of the axes of a gyro the one that turns most, in a log without an input, as of a phone that swings; or nothing.

    A robot that something drives has wheels, too, which its gyro does not see.
    """
    further = [c.name for c in as_read.columns if c.role == "further"]
    axes = [n for n in further if is_of_gyro(n) and is_called_rate(n) and not is_magnitude(n)]
    driven = as_read.of_role("input") or any(map(is_command, further))
    return "" if driven else max(axes, key=lambda n: float(np.nanstd(values[n] * stated_factor(n))), default="")


def is_of_gyro(name: str) -> bool:
    """True of a column that is called after a body's gyro."""
    return has_word(name, BODY_SENSORS) or is_gyro_axis(name)


def may_be_summed(name: str) -> bool:
    """True of a column that is called a speed, and neither a commanded one nor that of a body's gyro."""
    is_speed = is_no_place(name) and not is_acceleration(name) and not is_magnitude(name)
    return is_speed and not contains(name, REFERENCE_NAMES) and not is_of_gyro(name)


def clock_seconds(raw: np.ndarray, clock: ColumnMap) -> np.ndarray:
    """Times (N,) [s] from the first sample on."""
    return (raw - raw[0]) * UNIT_CONVERSIONS[clock.unit][1] * clock.scale


def surveyed(path: Path, clock: ColumnMap, raw: np.ndarray, values: dict[str, np.ndarray], times: str) -> Survey:
    """What each of a file's columns (N,) is beside its clock ``raw`` (N,)."""
    t = clock_seconds(raw, clock)
    counters = {n: text for n, v in values.items() if (text := beside_clock(n, v, t))}
    if times == "said" and (first := next(iter(values))) not in counters and first.startswith(NAMELESS_PREFIX):
        counters |= replaced_clock(first, values[first])
    rest = {n: v for n, v in values.items() if n not in counters}
    copies = copies_among(rest) | coordinates_among(rest)
    no_reading = counters | copies
    log = analysed(path.name, t, moving_columns(path, {n: v for n, v in values.items() if n not in no_reading}))
    moving = dict(zip(log.channels, log.measured.T, strict=True))
    signals = uniform_signals(log, "", in_range=False, all_needed=False)
    roles = roles_of(moving, t, signals, gapless_ranges(log, 0, len(t)))
    roles |= dict.fromkeys(counters, ("counter", "")) | dict.fromkeys(copies, ("copy", ""))
    roles |= held_inputs(values, moving, roles)
    sides = right_sides(roles)
    roles |= dict.fromkeys(sides, ("further", ""))
    columns = [column_of(clock.column, "time", "", raw, "")]
    for name, v in values.items():
        role, of = roles.get(name, ("constant", ""))
        remark = rate_remark(moving[of], moving[name], t) if role == "rate" else ""
        remark = step_remark(find_quantum(v) * stated_factor(name)) if role == "position" else remark
        remark = no_reading.get(name, sides.get(name, remark))
        remark = COMMAND_REMARK if role == "input" and is_unnamed(name) else remark
        columns.append(column_of(name, role, of, v, remark))
    signals_of = {**moving, "t": t}
    turns = {n: turn for n in moving if (turn := whole_turn(values[n] * stated_factor(n)))}
    stretches = all_signals(log)
    return Survey(path.name, tuple(columns), clock, signals, signals_of, scalars_of(path), stretches, times, turns)


def own_clock(path: Path, file: Table, values: Mapping[str, np.ndarray]) -> ColumnMap | None:
    """The column (N,) that is the time; None where none looks like one.

    Raises Failure where one is called so but does not grow from row to row, and where one grows only now and then, as
    stamps of arrival do, or falls evenly.
    """
    called = [n for n, v in values.items() if n == "t" or (is_called_clock(n) and np.ptp(v) != 0.0)]
    likely = min(called, key=lambda n: (n != "t", unevenness(values[n])), default="")
    clock = find_time_column(file._replace(read=lambda names: {n: values[n] for n in names}), likely, list(values))
    if clock is None and likely:
        check_time(path.name, values[likely])  # says in which row it does not grow
    if clock is None and (cure := times_cure(values)):
        raise Failure(f"{path.name}: one column must be the time, growing from row to row; none of {', '.join(values)} "
                      f"does. {cure}")  # fmt: skip
    return clock


def unevenness(stamps: np.ndarray) -> float:
    """Scatter of the steps between stamps (N,) over their mean; infinite where they do not grow from row to row."""
    steps = np.diff(stamps)
    return float(np.std(steps) / np.mean(steps)) if len(steps) and (steps > 0).all() else math.inf


def beside_clock(name: str, values: np.ndarray, t: np.ndarray) -> str:
    """That a column (N,) is a counter or a further clock; nothing of any other, nor of a commanded ramp."""
    return "" if contains(name, REFERENCE_NAMES) else counter_sentence(name, values, t)


def right_sides(roles: Mapping[str, tuple[str, str]]) -> dict[str, str]:
    """Columns of the right wheel of two that are all that moves, with a sentence: the left one is looked at alone.

    Not where only the right one's command is logged, or something that may be read at the body.
    """
    lefts = {(tuple(words_of(n)), role): n for n, (role, _) in roles.items()}
    found = {n: lefts[key] for n, (role, _) in roles.items() if (key := (left_name(n), role)) in lefts}
    places = [n for n, (role, _) in roles.items() if role == "position"]
    of_body = [n for n, (role, _) in roles.items() if role == "further" and has_word(n, (*ANGLE_NAMES, *BODY_SENSORS))]
    alone = [n for n, (role, _) in roles.items() if role == "input" and n not in found and left_name(n)]
    if len(places) != 2 or not any(n in found for n in places) or of_body or alone:
        return {}
    said = {n: f"{n} is the other wheel's {left}: one wheel is looked at alone." for n, left in found.items()}
    rates = {n: of for n, (role, of) in roles.items() if role == "rate" and of in found and n not in found}
    return said | {n: f"{n} is the rate of {of}, the other wheel's." for n, of in rates.items()}


def held_inputs(
    values: dict[str, np.ndarray], moving: dict[str, np.ndarray], roles: dict[str, tuple[str, str]]
) -> dict[str, tuple[str, str]]:
    """Commands that are constant and not zero, where no other acts and the machine begins at rest: steps."""
    places = [n for n, (role, _) in roles.items() if role == "position"]
    if any(role == "input" for role, _ in roles.values()) or not places:
        return {}
    if not all(starts_at_rest(moving[n]) for n in places):
        return {}
    held = [n for n, v in values.items() if np.isfinite(v).all() and v[0] and np.ptp(v) == 0.0]
    if all(n.startswith(NAMELESS_PREFIX) for n in values):  # a file without a header
        return dict.fromkeys(held[:1], ("input", ""))
    return dict.fromkeys(inputs_among(held), ("input", ""))


def column_of(name: str, role: str, of: str, values: np.ndarray, remark: str) -> FileColumn:
    """A column with its range and step."""
    known = values[np.isfinite(values)]
    low, high = (float(known.min()), float(known.max())) if known.size else (np.nan, np.nan)
    return FileColumn(name, role, of, low, high, find_quantum(values) if role != "time" else 0.0, remark)


def roles_of(
    values: dict[str, np.ndarray], t: np.ndarray, signals: Signals | None, ranges: Sequence[tuple[int, int]]
) -> dict[str, tuple[str, str]]:
    """Role of each column that changes, and of rates and references the position: by names, then by what they do.

    A column that is read too seldom to be among the signals is none of a machine's. What it does is judged within the
    ranges of samples that follow each other without a gap.
    """
    places = [n for n in values if is_place(values[n], ranges)]
    places = places or [n for n in values if is_called_place(n) and len(np.unique(values[n])) >= MIN_PLACES]
    roles: dict[str, tuple[str, str]] = dict.fromkeys(inputs_among(list(values)), ("input", ""))
    seldom = {n for n in values if signals is not None and n not in signals.channels}
    free = [n for n in values if n not in roles and n not in seldom and may_be_sensor(n)]
    roles |= rates_by_sum(free, values, t) if signals is None else rates_among(free, signals)
    if not any(r == "input" for r, _ in roles.values()):
        roles |= {n: ("input", "") for n in free if is_likely_input(n) and n not in roles}
    roles |= unnamed_roles(free, values, roles, places)
    free = [n for n in free if n not in roles and not is_no_place(n)]
    roles |= references_among(free, values)
    roles |= {n: ("position", "") for n in free if n not in roles and n in places}
    return roles | {n: ("further", "") for n in values if n not in roles}


def unnamed_roles(
    free: list[str], values: dict[str, np.ndarray], roles: dict[str, tuple[str, str]], places: list[str]
) -> dict[str, tuple[str, str]]:
    """The command among columns whose names say nothing, where none is called one, and the battery beside a duty.

    The battery may be called an input, by its volts. One place at least is left: what moves is no command.
    """
    found: dict[str, tuple[str, str]] = {}
    turning = {of for role, of in roles.values() if role == "rate"}
    open_names = [n for n in free if n not in roles]
    if not any(r == "input" for r, _ in roles.values()) and (
        command := unnamed_command([n for n in open_names if n not in turning], values, sensors=free)
    ):
        found[command] = ("input", "")
    inputs = [n for n, (role, _) in (roles | found).items() if role == "input"]
    duties = [n for n in inputs if full_scale(n, values[n][np.isfinite(values[n])]) and not states_volts(n)]
    if duties:
        able = [n for n in values if n not in duties and (n in inputs or n not in roles | found)]
        found |= {n: ("supply", "") for n in able if is_battery(n, values[n])}
    return found if any(n in places for n in open_names if n not in found) else {}


def is_unnamed(name: str) -> bool:
    """True of an input whose name did not say that it is one."""
    return not (is_command(name) or name.startswith(NAMELESS_PREFIX))


def possible_rates(names: list[str]) -> list[tuple[str, str]]:
    """Pairs of columns of which the second may be the rate of the first by what their names state."""
    places = [n for n in names if kind_by_name(n) != "rate" and not contains(n, REFERENCE_NAMES)]
    places = [n for n in places if not is_acceleration(n)]
    able = [n for n in names if kind_by_name(n) != "position" and not has_word(n, ERROR_NAMES)]
    return [(a, b) for a in places for b in able if a != b]


def rates_by_sum(names: list[str], values: dict[str, np.ndarray], t: np.ndarray) -> dict[str, tuple[str, str]]:
    """Columns that give others when they are summed over the time, with these: of a log too short for derivatives."""
    sizes: dict[bool, tuple[float, ...]] = {False: ANGLE_SCALES, True: ()}  # what is called a rate may have any
    pairs = possible_rates(names)
    misfit = {(a, b): sum_misfit(values[a], values[b], t, sizes[is_called_rate(b)]) for a, b in pairs}
    return with_their_places(misfit, {b: MAX_SUM_MISFIT_SHARE for _, b in pairs})


def rates_among(names: list[str], signals: Signals) -> dict[str, tuple[str, str]]:
    """Columns that are derivatives of others, with these."""
    pairs = possible_rates(names)
    misfit = {(a, b): rate_misfit(signals, RatePair(a, b), own=False) for a, b in pairs}
    limits = {b: MIN_NAMED_RATE_SHARE if is_called_rate(b) else MAX_SWAPPED_MISFIT_SHARE for _, b in pairs}
    misfit |= {(a, b): min(misfit[a, b], rate_misfit(signals, RatePair(a, b), lenient=True)) for a, b in misfit
               if is_called_rate(b) and not is_called_rate(a) and misfit[a, b] >= limits[b]}  # fmt: skip
    return with_their_places(misfit, limits)


def with_their_places(
    misfit: Mapping[tuple[str, str], float], limits: Mapping[str, float]
) -> dict[str, tuple[str, str]]:
    """Rates with the place of each, by the misfit of every place and rate: the least ones below the rate's limit.

    Of places that fit about as well it is the one whose name has most in common: two joints may move alike.
    """
    found: dict[str, tuple[str, str]] = {}
    for a, b in sorted(misfit, key=lambda p: misfit[p]):
        if misfit[a, b] < limits[b] and a not in found and b not in found:
            most = min(limits[b], MAX_ALIKE_RATIO * misfit[a, b] + MAX_ALIKE_MISFIT)
            near = [n for n, rate in misfit if rate == b and n not in found and misfit[n, b] <= most]
            found[b] = ("rate", max(near, key=lambda n: (common_words(n, b), -misfit[n, b])))
    return found


def common_words(one: str, other: str) -> int:
    """How many words and numbers two names have in common."""
    words, others = (set(re.findall(r"[a-z]+|[0-9]+", n.lower())) for n in (one, other))
    return len(words & others)


def references_among(names: list[str], values: dict[str, np.ndarray]) -> dict[str, tuple[str, str]]:
    """Columns that a position follows, called so or ahead of it and smoother; and filtered copies, as further ones."""
    found: dict[str, tuple[str, str]] = {}
    for a, b in permutations(names, 2):
        apart = values[a] - values[b]
        known = np.isfinite(apart)
        close = known.any() and np.mean(apart[known] ** 2) < MAX_FOLLOWING_SHARE * np.nanvar(values[a])
        if not close or a in found or b in found:
            continue
        smoother = difference_noise(values[b][known]) < MAX_COPY_ROUGHNESS * difference_noise(values[a][known])
        lead = lead_samples(values[a], values[b])
        if contains(b, REFERENCE_NAMES) or (smoother and lead >= 1):
            found[b] = ("reference", a)
        elif smoother and not contains(a, REFERENCE_NAMES):
            found[b] = ("further", "")
    return found | {n: ("reference", "") for n in names if contains(n, REFERENCE_NAMES) and n not in found}


def lead_samples(follower: np.ndarray, leader: np.ndarray) -> int:
    """Samples by which a signal (N,) is ahead of another (N,): those of least squares, negative where it is behind."""
    costs = {}
    most = min(MAX_LEAD_SAMPLES, len(leader) // MIN_LEAD_SHARE)
    for k in range(-most, most + 1):
        late, early = (follower[k:], leader[: len(leader) - k]) if k >= 0 else (follower[:k], leader[-k:])
        costs[k] = float(np.nanmean((late - early) ** 2))
    return min(costs, key=lambda k: (costs[k], abs(k)))


def times_cure(values: Mapping[str, np.ndarray]) -> str:
    """What to do about a file with stamps that do not grow from row to row; nothing where it has none."""
    for name, stamps in values.items():
        steps = np.diff(stamps)
        if not np.isfinite(stamps).all():
            continue
        if (steps >= 0).all() and (steps > 0).sum() >= MIN_PLACES:
            return f"{name} grows, but stays the same in {np.count_nonzero(steps == 0)} rows. {repeated_cure(stamps)}"
        if (steps <= 0).all() and (steps < 0).sum() >= MIN_PLACES and clock_rank(-steps[steps < 0]) == 0:
            return f"{name} falls evenly: if it is the time, sort the rows by it; else {INTERVAL_CURE}."
        back = np.flatnonzero(steps <= 0)
        seldom = 0 < len(back) <= MAX_BACKWARD_SHARE * len(steps) and back[-1] < len(steps) - 1
        apart = seldom and bool(np.all(np.diff(back) > 1)) and not whole_turn(stamps)
        if apart and name.startswith(NAMELESS_PREFIX) and clock_rank(steps[steps > 0]) == 0:
            k = int(back[0])
            return (
                f"{name} grows evenly, but in row {k + 2} goes from {stamps[k]:.15g} to {stamps[k + 1]:.15g} "
                f"({len(back)} such rows): if it is the time, cut the file there, or leave these rows out; else "
                f"{INTERVAL_CURE}."
            )
    return ""


def is_called_place(name: str) -> bool:
    """True of a column that is a place by its name or unit, however far apart its readings are."""
    called = stated_base(name) in ("rad", "m") or is_called_angle(name)
    return called and kind_by_name(name) != "rate" and not is_no_place(name)


def is_place(values: np.ndarray, ranges: Sequence[tuple[int, int]]) -> bool:
    """True of a signal (N,), without wraps, that moves on from where it was, as a place does, but for single spikes.

    From one range of samples to the next it may be anywhere.
    """
    known = values[np.isfinite(values)]
    if len(np.unique(known)) < MIN_PLACES:
        return False
    longest = MAX_STEP_SHARE * np.ptp(known)
    parts = [values[begin:end] for begin, end in ranges]
    if sum(np.sum(step_sizes(part) > longest) for part in parts) > MAX_SPIKE_SHARE * (len(known) - 1):
        return False
    return not any((step_sizes(part, 2 * MAX_SPIKE_SAMPLES + 1) > longest).any() for part in parts)


def step_sizes(values: np.ndarray, median_of: int = 1) -> np.ndarray:
    """Steps from reading to reading of a signal (N,), or of its running median."""
    known = values[np.isfinite(values)]
    return np.abs(np.diff(median_filter(known, median_of))) if known.size else np.zeros(0)


def rate_remark(angle: np.ndarray, rate: np.ndarray, t: np.ndarray) -> str:
    """What is known of where a rate comes from: how much of its scatter is that of its angle, and whose it is.

    Fast motion is in both, so that a part of the scatter proves nothing: what was computed has nearly all of it, or
    the angle's rounding in it, and no white noise of its own.
    """
    good = np.flatnonzero(np.isfinite(angle) & np.isfinite(rate))[:MAX_REMARK_SAMPLES]
    taps = min(MAX_FILTER_SAMPLES, good.size // MIN_SAMPLES_PER_TAP)
    if taps < MIN_FILTER_SAMPLES:
        return ""
    slope = np.diff(angle[good]) / np.diff(t[good])
    errors, own = (v - gaussian_smoothed(v, ERROR_SMOOTHING_SAMPLES) for v in (slope, rate[good][1:]))
    lagged = np.lib.stride_tricks.sliding_window_view(errors, 2 * taps + 1)
    target = own[taps:-taps]
    rest = target - lagged @ np.linalg.lstsq(lagged, target, rcond=None)[0]
    shared = 1 - float(rest @ rest) / (float(target @ target) or 1.0)
    gives = f"A filter of the angle gives {100 * shared:.0f} % of its scatter from sample to sample"
    if has_own_noise(slope, rate[good], taps):
        return f"{gives}, motion included, and nothing of its white noise: a sensor of its own."
    quantum = find_quantum(angle) or float(is_whole(angle))
    rounding = quantum / math.sqrt(6) / float(np.median(np.diff(t[good])))  # of the slope between two readings
    smooth = taps == MAX_FILTER_SAMPLES and float(np.std(errors)) < MAX_ROUNDING_GROWTH * rounding  # in a long log
    by_rounding = shared > ROUNDING_SHARE and smooth
    raw_angle = bool(quantum) or not is_filtered(angle)
    if by_rounding or (shared > COMPUTED_SHARE and raw_angle):
        return f"{gives}: computed from it, {COMPUTED}"
    if shared > COMPUTED_SHARE:
        return (f"{100 * shared:.0f} % of its scatter from sample to sample is the angle's too: one of the two was "
                "made from the other, as a fused angle is from a gyro, and is no raw sensor.")  # fmt: skip
    if is_filtered(rate) and raw_angle:
        return f"It is too smooth for a raw sensor, while its angle is not: filtered or computed, {COMPUTED}"
    return f"{gives} and not the rest: a sensor of its own."


def has_own_noise(slope: np.ndarray, rate: np.ndarray, taps: int) -> bool:
    """True of a rate (N,) whose white noise no filter of an angle's slope (N - 1,) with so many taps gives.

    High differences are free of motion. Rounding is no noise of a sensor.
    """
    errors, own = white_differences(slope), white_differences(rate[1:])
    lagged, target = np.lib.stride_tricks.sliding_window_view(errors, 2 * taps + 1), own[taps:-taps]
    rest = target - lagged @ np.linalg.lstsq(lagged, target, rcond=None)[0]
    by_chance = len(target) / max(len(target) - 2 * taps - 1, 1)
    shared = 1.0 - by_chance * float(rest @ rest) / (float(target @ target) or 1.0)
    raw = float(np.std(target)) > MIN_OWN_ROUNDINGS * rounding_sigma(find_quantum(rate)) and not is_filtered(rate)
    return raw and shared < MAX_SHARED_NOISE


def white_differences(values: np.ndarray) -> np.ndarray:
    """Differences of fourth order (N - 4,) of a signal (N,), of the size of its white noise."""
    return np.diff(values, 4) / math.sqrt(math.comb(8, 4))


def is_filtered(values: np.ndarray) -> bool:
    """True of a signal whose scatter grows with the lag as no white noise does: what was raw in it is gone."""
    near = difference_noise(values)
    far = float(np.median([difference_noise(values[k::SCATTER_LAG_SAMPLES]) for k in range(SCATTER_LAG_SAMPLES)]))
    return far > MAX_RAW_GROWTH * near


def step_remark(step: float) -> str:
    """That a step is one of an encoder with a power of two of counts in a turn; nothing of others."""
    counts = 2 * np.pi / step if step else 0.0
    bits = round(float(np.log2(counts))) if counts >= MIN_ENCODER_COUNTS else 0
    return f"Its step is that of {2**bits} {COUNTS_ENDING}" if bits and abs(counts / 2**bits - 1) < 0.002 else ""
