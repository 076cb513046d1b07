"""Units that no name states, guessed from the numbers: degrees, encoder counts, PWM counts of a supply.

A guess stands in the model.toml that is proposed, with its reason as a comment, so that its user knows what to replace.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from scipy.integrate import cumulative_trapezoid

from wheelpend.inspection.angle_unit import A_TURN_DEG, is_in_degrees, is_small_swing
from wheelpend.inspection.column_names import (
    SUPPLY_NAMES,
    contains,
    has_word,
    is_called_time,
    is_command,
    is_counting,
    is_of_joint_states,
    left_name,
    stated_base,
    stated_factor,
)
from wheelpend.inspection.column_roles import MAX_SUM_MISFIT_SHARE
from wheelpend.inspection.gravity import turning_points
from wheelpend.inspection.kinematics import ratio_of, sum_misfit, units_by_ratio
from wheelpend.inspection.plant_fit import MAX_WAY_M
from wheelpend.inspection.raw_units import MIN_COUNTS_NAMED, MIN_PWM_PEAK, full_scale, states_volts
from wheelpend.inspection.signals import is_whole
from wheelpend.inspection.survey import SUMMED_PLACE, Survey
from wheelpend.logs.columns import ColumnMap, ColumnTable
from wheelpend.logs.units import UNIT_CONVERSIONS, stated_unit, unknown_unit

USUAL_SUPPLY_V, MIN_SUPPLY_V, MAX_SUPPLY_V = 12.0, 2.0, 100.0
MAX_STEADY_SAG = 0.01  # of a supply's volts, by which they vary and one number still does
USUAL_COUNTS = 4096  # of a turn
USUAL_WAY_M = 1e-4  # along an axis in a count
MIN_COUNTS_OF_RATE = 1.5  # that a rate makes one unit of: below it counts in the same unit
MAX_RATE_MISFIT = 0.01  # of a place's variance, that a rate summed over time leaves in another unit
MAX_TURNS_DEG = 720.0  # range of whole numbers that may be degrees
PUT_SECONDS = "put the seconds from row to row in the place of this scale"
MAX_TURNS_TO_AND_FRO = 30.0  # of a shaft in rad: in degrees it would be half a turn
MAX_SHAFT_SPEED_RAD_S = 3000.0  # rad/s of a shaft, beyond which hardly a motor with an encoder turns
MIN_OVERFLOW_RATIO = 1.5  # of its readings' range, that a counter goes which overflowed
GEARED_NAMES = ("motor", "gear", "joint", "output", "load")  # beginnings of words, of one side of a gear
MAX_PEAK_RATIO = 2.0  # of the largest value that is no spike, up to which a short peak of a command is a command


class Guess(NamedTuple):
    """How a column is read, by a guess, and why."""

    column: ColumnMap
    reason: str


def guess_units(
    survey: Survey, table: ColumnTable, columns: Mapping[str, str], unit: str, untold: Collection[str] = ()
) -> dict[str, Guess]:
    """Guesses of the units of quantities whose columns state none; ``unit`` is that of the inputs.

    ``untold`` are channels in counts of which the equations of motion did not say how many are a turn.
    """
    found: dict[str, Guess] = {"t": guess} if (guess := guess_clock(survey)) else {}
    for name, column in columns.items():
        values = survey.values.get(column)
        if stated_base(column) == "rad" and table.units.get(name) == "m" and name not in table.inputs:
            said = f"{stated_unit(column)} of a shaft, which are then rad in the place of m"
            found[name] = Guess(ColumnMap(column, scale=stated_factor(column)), said)
        if stated_unit(column) or (values is None and name not in table.inputs):
            continue
        own = unit if name in table.inputs else table.units[name]
        if unknown := unknown_unit(column):
            found[name] = Guess(ColumnMap(column), f"{unknown} is no known unit: put scale = {own} per {unknown}")
            continue
        if name in table.inputs:
            guess = guess_supply(survey, column) if own == "V" else None
        elif values is not None and name in untold:
            guess = guess_counts(column, values, own)
        elif values is not None and own in ("rad", "m") and not (table.wiring_check and survey.signals):
            turns = any(table.units[c] == "rad" for c in table.channels)
            inputs = survey.of_role("input")
            guess = guess_place(survey, column, values, own, inputs, beside_angle=turns, hangs=table.pulled)
        else:
            guess = None  # the equations of motion say it
        found |= {name: guess} if guess else {}
    return found | guess_rates(survey, table, columns, found)


def guess_rates(
    survey: Survey, table: ColumnTable, columns: Mapping[str, str], places: Mapping[str, Guess]
) -> dict[str, Guess]:
    """Guesses of rates that state no unit: that of the place whose unit was guessed, where they sum up to it."""
    found, t = dict[str, Guess](), survey.values["t"]
    for name, place in table.rates.items():
        column, of = columns.get(name, ""), columns.get(place, "")
        is_shaft = table.units[place] == "rad" and place != table.range_channel
        if is_shaft and column and column == _rate_of(survey, of) and (units := units_beside(survey, of)):
            found[name] = Guess(ColumnMap(column, units[1]), _said_of_both(of, column, units))
            continue
        if place not in places or stated_unit(column) or column not in survey.values or of not in survey.values:
            continue
        if sum_misfit(survey.values[of], survey.values[column], t, scales=(1.0,)) < MAX_SUM_MISFIT_SHARE:
            guessed = places[place].column
            unit = f"{guessed.unit}/s" if guessed.unit else ""
            found[name] = Guess(replace(guessed, column=column, unit=unit), f"that of {of}, of which it is the rate")
    return found


def guess_clock(survey: Survey) -> Guess | None:
    """A guess of the time between two rows, where the only clock counts them: frames, samples."""
    clock, scale = survey.clock, UNIT_CONVERSIONS[survey.clock.unit][1] * survey.clock.scale
    if survey.times == "made up":
        return Guess(
            replace(clock, unit=""),
            f"no column is the time, so that rows are counted, taken for {scale:g} s each: {PUT_SECONDS}",
        )
    called = is_called_time(clock.column) or stated_unit(clock.column)
    if called or survey.times == "said" or not np.allclose(np.diff(survey.values["t"]), scale):
        return None
    return Guess(ColumnMap(clock.column, scale=scale), f"it counts rows, taken for {scale:g} s each: {PUT_SECONDS}")


def guess_place(
    survey: Survey,
    column: str,
    values: np.ndarray,
    own: str,
    inputs: list[str],
    *,
    beside_angle: bool = False,
    hangs: bool = True,
) -> Guess | None:
    """A guess of the unit of a position (N,) whose quantity is in rad or m; None of one that may be in that.

    A way ``beside_angle``, a cart's beside its pole, is one: along a slide it may be what its motor's shaft turns.
    Gravity tells the unit of what ``hangs`` in it alone: beside a sine what it does to a shaft is a third harmonic.
    """
    if own == "rad" and is_of_joint_states(column):
        return None
    called = is_counting(column) or has_overflowed(survey, column, values)
    counting = called and is_whole(values) and np.nanmax(np.abs(values)) > MIN_COUNTS_NAMED
    alone = len(survey.of_role("position")) == 1 and survey.base_of(column) != "rad"
    if own == "rad" and alone and not counting and is_small_swing(values, survey.longest_with(column), column, inputs):
        said = ("a way, for gravity pulls it back by itself and not by a sine: mm of a pendulum of 1 m, put 0.001 / "
                "its length in m in the place of this scale")  # fmt: skip
        return guess_counts(column, values, own) if is_whole(values) else Guess(ColumnMap(column, scale=0.001), said)
    if own == "rad" and not stated_unit(column) and survey.turns.get(column) == A_TURN_DEG:
        return Guess(ColumnMap(column, "deg"), "degrees, for it jumps by about 360 where a turn ends")
    if (
        own == "rad"
        and not stated_unit(column)
        and not is_whole(values)  # counts
        and (speed := _high_speed(survey, values)) > MAX_SHAFT_SPEED_RAD_S
    ):
        return Guess(
            ColumnMap(column, "deg"), f"degrees, for in rad it would turn {speed / (2 * math.pi):.0f} times a second"
        )
    told_by_gravity = own == "rad" and hangs and not counting
    if told_by_gravity and (why := is_in_degrees(values, survey.longest_with(column), column, inputs)):
        return Guess(ColumnMap(column, "deg"), f"degrees, for {why}")
    if by_rate := guess_by_rate(survey, column, values, own):
        return by_rate
    way = float(np.nanmax(values) - np.nanmin(values))
    if (
        own == "rad"
        and alone
        and inputs
        and not counting
        and not is_whole(values)
        and column != SUMMED_PLACE
        and way > MAX_TURNS_TO_AND_FRO * 2 * math.pi
        and turning_points(values).size
    ):
        said = f"degrees, for what goes to and fro hardly turns {way / (2 * math.pi):.0f} times, as it would in rad"
        return Guess(ColumnMap(column, "deg"), said)
    if own == "m" and way > MAX_WAY_M and is_of_joint_states(column):
        return Guess(ColumnMap(column), "rad of a shaft, as the messages of ROS hold them, in the place of m")
    if own == "m" and not counting and way > MAX_WAY_M and beside_angle:
        return Guess(ColumnMap(column, "mm"), f"millimetres, for no carriage goes {way:.3g} m")
    if own == "m" and not counting and way > MAX_WAY_M and column != SUMMED_PLACE:
        said = f"degrees of a shaft, which are then rad, for no carriage goes {way:.3g} m"
        return Guess(ColumnMap(column, scale=math.pi / 180), said)
    if not is_whole(values):
        return None
    if own == "rad" and not counting and way < MAX_TURNS_DEG:
        return Guess(ColumnMap(column, "deg"), "degrees, for all readings are whole numbers; or an encoder's counts")
    return guess_counts(column, values, own)


def has_overflowed(survey: Survey, column: str, values: np.ndarray) -> bool:
    """True of a position (N,) that was made continuous, and is no angle within a turn: a counter."""
    entry = survey.column(column)
    goes_on = float(np.ptp(values[np.isfinite(values)])) > MIN_OVERFLOW_RATIO * (entry.maximum - entry.minimum)
    return goes_on and column not in survey.turns and column != SUMMED_PLACE


def guess_by_rate(survey: Survey, column: str, values: np.ndarray, own: str) -> Guess | None:
    """A guess of what one count of a position (N,) is, by a rate beside it that counts in another unit; or None."""
    if own == "rad" and (units := units_beside(survey, column)) and units[0] != own:
        return Guess(ColumnMap(column, units[0]), _said_of_both(column, _rate_of(survey, column), units))
    if not is_whole(values[np.isfinite(values)]) or stated_unit(column):
        return None
    counts = _units_per_summed(survey, column)
    if abs(counts) < MIN_COUNTS_OF_RATE:
        return None
    rate = _rate_of(survey, column)
    unit = "m, or one rad of a shaft" if own == "m" else own
    stated = "" if stated_unit(rate) else f" if {rate} is per second"
    said = f"counts, for {rate} makes {abs(counts):.4g} of them one {unit}{stated}: put the exact number in its place"
    return Guess(ColumnMap(column, scale=float(f"{1.0 / abs(counts):.5g}")), said)


def units_beside(survey: Survey, column: str) -> tuple[str, str] | None:
    """Units of an angle of a shaft and the rate beside it, where neither states one and their ratio tells both."""
    rate = _rate_of(survey, column)
    if not rate or stated_unit(column) or stated_unit(rate) or column in survey.turns:
        return None
    if is_whole(survey.values[column]) or any(has_word(n, GEARED_NAMES) for n in (column, rate)):
        return None  # counts, or the two sides of a gear, whose ratio to any speed is any
    counts = _units_per_summed(survey, column)
    return units_by_ratio(1.0 / abs(counts)) if counts else None


def _said_of_both(place: str, rate: str, units: tuple[str, str]) -> str:
    """Why an angle and its rate are read in units."""
    return f"{units[0]} of {place} and {units[1]} of {rate}, which is {ratio_of(*units):.3g} times its derivative"


def _rate_of(survey: Survey, place: str) -> str:
    """The column that is a place's rate; nothing where there is none."""
    rates = (c.name for c in survey.columns if c.role == "rate" and c.of == place and c.name in survey.values)
    return next(rates, "")


def _units_per_summed(survey: Survey, place: str) -> float:
    """How far a place goes where its rate sums up to 1; 0 where it does not follow it, or has none."""
    rate, values = survey.values.get(_rate_of(survey, place)), survey.values.get(place)
    if rate is None or values is None:
        return 0.0
    known = np.isfinite(values) & np.isfinite(rate)
    summed = cumulative_trapezoid(rate[known], survey.values["t"][known], initial=0.0)
    summed, moved = summed - summed.mean(), values[known] - values[known].mean()
    ratio = float(summed @ moved) / (float(summed @ summed) or 1.0)
    rest = moved - ratio * summed
    return ratio if float(rest @ rest) <= MAX_RATE_MISFIT * float(moved @ moved) else 0.0


def _high_speed(survey: Survey, values: np.ndarray) -> float:
    """The speed that a position (N,) has at least in a tenth of a log [its unit/s]."""
    return float(np.nanquantile(np.abs(np.diff(values)) / np.diff(survey.values["t"]), 0.9))


def guess_counts(column: str, values: np.ndarray, own: str) -> Guess:
    """A guess of what one count of a position (N,) in counts is, of an encoder that is usual."""
    reach = float(np.nanmax(np.abs(values)))
    if own == "rad":
        return Guess(
            ColumnMap(column, scale=float(f"{2 * math.pi / USUAL_COUNTS:.7g}")),
            f"counts up to {reach:g}, no rad; 2 pi / {USUAL_COUNTS}, put your encoder's counts per turn in its place",
        )
    return Guess(
        ColumnMap(column, scale=USUAL_WAY_M),
        f"counts up to {reach:g}, no metres; {USUAL_WAY_M:g} m per count, put the way per turn / counts per turn in "
        "its place",
    )


def guess_supply(survey: Survey, column: str) -> Guess | None:
    """A guess of the volts that a duty stands for; None of a column that is no duty."""
    if states_volts(column):
        return None
    entry = survey.column(column)
    values = read_or_held(survey, column)
    limit = full_scale(column, values)
    if limit:  # the motors of one machine have one timer
        motors = [*survey.of_role("input"), *(n for n in survey.of_role("further") if is_command(n) and left_name(n))]
        scales = {n: full_scale(n, read_or_held(survey, n)) for n in motors if not states_volts(n)}
        limit = max([limit, *scales.values()])
    if not limit and entry.minimum == entry.maximum == round(entry.minimum) and abs(entry.minimum) > MIN_PWM_PEAK:
        limit = full_scale("pwm", values)  # a step of so many volts is rarer than one in counts
    if not limit:
        return None
    why, scale, times = supply_of(survey)
    reason = f"a duty of ±{limit:g} {why}"
    reason = f"{entry.remark}; {reason}" if entry.remark else reason
    return Guess(ColumnMap(column, scale=float(f"{scale / limit:.6g}"), times=times), reason)


def read_or_held(survey: Survey, column: str) -> np.ndarray:
    """Known values (N,) of a column with its ends; the two ends of one that is constant.

    Software wrote a command, so that its short peaks are none of a sensor's spikes; what is far beyond is a bad cell.
    """
    entry = survey.column(column)
    ends = np.array([entry.minimum, entry.maximum])
    values = survey.values.get(column, ends)
    known = values[np.isfinite(values)]
    is_peak = np.abs(ends) <= MAX_PEAK_RATIO * np.abs(known).max(initial=0.0)
    return np.append(known, ends[is_peak])


def supply_of(survey: Survey) -> tuple[str, float, str]:
    """Words for the supply's volts, by which a duty is scaled, that number, and the column that multiplies beside it.

    The column is one that varies; of one that does not, the number is its median, and without any what is usual.
    """
    for entry in survey.columns:
        if entry.role == "time" or not (entry.role == "supply" or contains(entry.name, SUPPLY_NAMES)):
            continue
        values = survey.values.get(entry.name)
        factor = stated_factor(entry.name)
        middle = 0.5 * (entry.minimum + entry.maximum) * factor if values is None else float(np.nanmedian(values))
        if not stated_unit(entry.name) and middle > MAX_SUPPLY_V:
            factor, middle = 1e-3, 1e-3 * middle  # in mV
        if MIN_SUPPLY_V <= middle <= MAX_SUPPLY_V:
            sag = abs(entry.maximum - entry.minimum) * factor / middle
            if sag > MAX_STEADY_SAG:
                return f"times the volts of {entry.name}, which vary by {100 * sag:.2g} %", factor, entry.name
            volts = float(f"{middle:.4g}")
            return f"of {volts:g} V, the median of {entry.name}", volts, ""
    return f"of {USUAL_SUPPLY_V:g} V: put your supply's volts in its place", USUAL_SUPPLY_V, ""
