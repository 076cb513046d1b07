"""Columns that tell nothing of their own: counters of samples or frames, further clocks, and copies of others."""

from __future__ import annotations

import math
from collections.abc import Mapping
from itertools import combinations, permutations
from typing import NamedTuple

import numpy as np

from wheelpend.inspection.column_names import (
    ANGLE_NAMES,
    ERROR_NAMES,
    RATE_NAMES,
    REFERENCE_NAMES,
    SENSOR_NAMES,
    contains,
    has_word,
    is_called_time,
    is_command,
    left_name,
    stated_base,
    stated_factor,
)
from wheelpend.logs.columns import ColumnTable
from wheelpend.logs.csv_text import NAMELESS_PREFIX
from wheelpend.logs.finding import Finding
from wheelpend.logs.log import Log
from wheelpend.logs.noise import find_quantum
from wheelpend.logs.units import stated_unit, words_of

COUNTER_WORDS = frozenset(("seq", "id", "idx", "index", "sample", "frame", "row", "number"))
MAX_COPY_DEVIATION = 2e-4  # of its range, by which a column is off another's line, and of a factor that is 1
MAX_FILTER_DEVIATION, MIN_KEPT_SHARE = 0.02, 0.05  # of what a filter changes, and of its last value, that it keeps
MAX_DIRECTION_DEVIATION = 2e-3  # of its range, by which an angle is off the direction of two coordinates
MIN_COMMON_SAMPLES, MIN_COMMON_SHARE = 20, 0.1  # in which both are known, and share of a log, of a copy of a channel
MAX_COMPARED_SAMPLES = 500  # of two columns, before all of them
MIN_EVEN_SHARE = 0.8  # of the steps of such stamps, that are alike: an encoder's at a nearly even speed are not
MAX_LATE_STEPS = 3.0  # by which stamps that come late, or twice, are off a straight line
MAX_CLOCK_DIGITS = 0.005  # by which the logarithm of a clock's unit is off a whole number: 1 %
MAX_CLOCK_DEVIATION = 0.5  # of a step, by which a clock is off a straight line at most


def counter_sentence(name: str, values: np.ndarray, t: np.ndarray) -> str:
    """That a column (N,) counts rows or is a clock beside the times (N,) [s]; nothing of any other column.

    What is called a command may go up evenly, and so may what is called nothing that tells: a clock tells the time in
    some power of ten of a second, or is called one.
    """
    rows = np.arange(len(values), dtype=float)
    steps = np.diff(values)
    is_told = is_command(name) and not is_called_time(name) and COUNTER_WORDS.isdisjoint(words_of(name))
    if not (steps.size and np.isfinite(values).all() and (steps > 0).all()) or is_told:
        return ""
    usual = float(np.median(steps))
    whole = bool((values == np.round(values)).all())
    digits = math.log10(usual / max(float(np.median(np.diff(t))), 1e-300))
    may_be_clock = whole or is_called_time(name) or abs(digits - round(digits)) < MAX_CLOCK_DIGITS
    if deviation_from_line(rows, values) < MAX_CLOCK_DEVIATION * usual and may_be_clock:
        return f"{name} grows by {usual:g} from row to row: {'a counter' if whole else 'a clock'}, and no reading."
    if deviation_from_line(t, values) < MAX_CLOCK_DEVIATION * usual and may_be_clock:
        return f"{name} grows in proportion to the time: a clock, and no reading."
    return ""


def replaced_clock(name: str, values: np.ndarray) -> dict[str, str]:
    """A file's first column (N,), with a sentence, where it is a clock of no use: stamped late, some times twice.

    Asked where the interval is said. Nothing of any other column.
    """
    steps = np.diff(values)
    usual = float(np.median(steps)) if np.isfinite(values).all() and steps.size else 0.0
    even = usual > 0.0 and (steps >= 0).all() and np.mean(np.abs(steps - usual) < 1e-6 * usual) > MIN_EVEN_SHARE
    if not even or deviation_from_line(np.arange(len(values), dtype=float), values) > MAX_LATE_STEPS * usual:
        return {}
    return {name: f"{name} grows with the rows, and seems to be their times; those that are said are used."}


def copies_among(values: Mapping[str, np.ndarray]) -> dict[str, str]:
    """Columns (N,) that are another one times a factor, or that from a constant, with a sentence on it.

    Of two the one that states a unit is kept, else one that is not called an error. Two motors may have one command but
    for the sign, and two wheels one way. A command is no copy of what is read: a controller made it.
    """
    found: dict[str, str] = {}
    moving = [n for n, v in values.items() if np.isfinite(v).all() and np.ptp(v) > 0.0]
    for a, b in combinations(sorted(moving, key=lambda n: (not stated_unit(n), has_word(n, ERROR_NAMES))), 2):
        wanted = contains(a, REFERENCE_NAMES) or contains(b, REFERENCE_NAMES)
        others = stated_unit(a) and stated_unit(b) and (wanted or stated_base(a) != stated_base(b))
        if a in found or b in found or others or _may_control(a, b):
            continue
        every = max(1, len(values[a]) // MAX_COMPARED_SAMPLES)
        if not _line_between(values[a][::every], values[b][::every]):
            continue
        line = _line_between(values[a], values[b])
        if line and (line not in ((1.0, 0.0), (-1.0, 0.0)) or _are_one_reading(a, b)):
            found[b] = f"{b} is {_line_text(line, a)} throughout: the same once more, and left out."
    return found


class LowPass(NamedTuple):
    """A digital low-pass filter of first order."""

    share: float  # of its value before that it keeps
    off: float  # the furthest that a signal is from it


def filtered_among(values: Mapping[str, np.ndarray]) -> dict[str, str]:
    """Columns (N,) that are another one behind a digital low-pass filter of first order, with a sentence on it.

    x_k = a x_(k−1) + (1 − a) y_k, but for what they are rounded by. Of readings of one kind alone: a motor may follow
    its command so. The filtered one lags, and has nothing that the other has not.
    """
    found: dict[str, str] = {}
    moving = {n: v for n, v in values.items() if np.isfinite(v).all() and np.ptp(v) > 0.0 and not is_command(n)}
    for raw, filtered in permutations(moving, 2):
        alike = stated_unit(raw) and stated_unit(raw) == stated_unit(filtered)
        wanted = contains(raw, REFERENCE_NAMES) or contains(filtered, REFERENCE_NAMES)
        if alike and not wanted and raw not in found and (kept := _kept_share(moving[raw], moving[filtered])):
            found[filtered] = (f"{filtered} is {raw} behind a low-pass filter, {kept:.3g} of its row before and "
                               f"{1.0 - kept:.3g} of the row: it lags, and is left out.")  # fmt: skip
    return found


def _kept_share(raw: np.ndarray, filtered: np.ndarray) -> float:
    """The share of its value before that a low-pass filter of a signal (N,) keeps; 0 where it is no such filter.

    Where both differ most it is looked at first.
    """
    most = int(np.argmax(np.abs(filtered - raw)))
    near = slice(max(most - MAX_COMPARED_SAMPLES // 2, 0), most + MAX_COMPARED_SAMPLES // 2)
    if _filter_between(raw[near], filtered[near]) is None:
        return 0.0
    found = _filter_between(raw, filtered)
    return found.share if found and found.off <= find_quantum(raw) + find_quantum(filtered) else 0.0


def _filter_between(raw: np.ndarray, filtered: np.ndarray) -> LowPass | None:
    """The filter of first order between two signals (N,), by least squares; None where it explains no great part."""
    before, now = filtered[:-1] - raw[1:], filtered[1:] - raw[1:]
    share = float(before @ now / max(before @ before, 1e-300))
    off = np.abs(now - share * before)
    is_small = float(np.sqrt(np.mean(off**2))) < MAX_FILTER_DEVIATION * float(np.std(before))
    return LowPass(share, float(off.max())) if is_small and MIN_KEPT_SHARE < share < 1.0 - MIN_KEPT_SHARE else None


def find_copies(log: Log, table: ColumnTable) -> list[Finding]:
    """The findings on channels that are an input, or another channel times a factor: one of both is no measurement.

    An input may well be a channel times a factor: a proportional controller made it.
    """
    read = {**dict(zip(table.inputs, log.inputs, strict=False)), **dict(zip(log.channels, log.measured.T, strict=True))}
    known = {n: v for n, v in read.items() if np.isfinite(v).any() and np.nanmax(v) > np.nanmin(v)}
    found = []
    for one, other in combinations(known, 2):
        both = np.isfinite(known[one]) & np.isfinite(known[other])
        enough = both.sum() >= max(MIN_COMMON_SAMPLES, MIN_COMMON_SHARE * len(log)) and other in log.channels
        line = _line_between(known[one][both], known[other][both]) if enough else None
        if line and (one in log.channels or line == (1.0, 0.0)):
            sentence = f"{other} is {_line_text(line, one)} throughout: the same once more, and no measurement."
            cure = f"Map {one} and {other} in [columns] to the columns in which each was logged."
            found.append(Finding("copy", other, sentence, cure, None))
    return found


def coordinates_among(values: Mapping[str, np.ndarray]) -> dict[str, str]:
    """Columns (N,) that are the two coordinates of what an angle is the direction of, as trackers of a camera write."""
    moving = {n: v for n, v in values.items() if np.isfinite(v).all() and np.ptp(v) > 0.0}
    angles = {n: v * stated_factor(n) for n, v in moving.items() if stated_base(n) == "rad" or has_word(n, ANGLE_NAMES)}
    for angle, direction in angles.items():
        for one, other in combinations([n for n in moving if n not in angles], 2):
            if any(_is_direction(direction, moving[one], sign * moving[other]) for sign in (1.0, -1.0)):
                said = "is one of the coordinates whose direction is {}: the same once more, and left out."
                return {n: f"{n} {said.format(angle)}" for n in (one, other)}
    return {}


def _is_direction(angle: np.ndarray, one: np.ndarray, other: np.ndarray) -> bool:
    """True of an angle (N,) [rad] that is the direction of two coordinates, whichever way and from where it counts."""
    every = max(1, len(angle) // MAX_COMPARED_SAMPLES)
    found, read = np.unwrap(np.arctan2(one, other)[::every]), np.unwrap(angle[::every])
    off = min(float(np.ptp(read - found)), float(np.ptp(read + found)))
    return off < MAX_DIRECTION_DEVIATION * float(np.ptp(read))


def _are_one_reading(one: str, other: str) -> bool:
    """True of names of which one is of a reading, none a command's, and both are of no two sides: it was read once."""
    sided = tuple(words_of(one)) == left_name(other) or tuple(words_of(other)) == left_name(one)
    named = not (one.startswith(NAMELESS_PREFIX) or other.startswith(NAMELESS_PREFIX))
    read = any(has_word(n, (*SENSOR_NAMES, *ANGLE_NAMES, *RATE_NAMES)) for n in (one, other))
    return named and read and not sided and not is_command(one) and not is_command(other)


def _may_control(one: str, other: str) -> bool:
    """True of a command and of what is not called after it: a controller may have made the one from the other."""
    alike = min((words_of(one), words_of(other)), key=len)
    return is_command(one) != is_command(other) and not ({*words_of(one)} & {*words_of(other)} >= {*alike})


def _line_between(one: np.ndarray, other: np.ndarray) -> tuple[float, float] | None:
    """Factor and constant by which values (N,) are made of other ones; None where they are not.

    A factor of 1 or -1 is just that within the tolerance, and a constant of 0.
    """
    within, away, level = MAX_COPY_DEVIATION * float(np.ptp(other)), one - one.mean(), float(other.mean())
    factor = float(away @ (other - level)) / (float(away @ away) or 1.0)
    if within == 0.0 or np.abs(other - level - factor * away).max() >= within:
        return None
    constant = level - factor * float(one.mean())
    same = abs(abs(factor) - 1.0) <= MAX_COPY_DEVIATION
    return float(np.sign(factor)) if same else factor, 0.0 if abs(constant) < within else constant


def _line_text(line: tuple[float, float], name: str) -> str:
    factor, constant = line
    times = name if abs(factor) == 1.0 else f"{abs(factor) if constant else factor:.4g} times {name}"
    return f"{constant:.4g} {'-' if factor < 0.0 else '+'} {times}" if constant else times


def deviation_from_line(x: np.ndarray, y: np.ndarray) -> float:
    """Largest distance of values (N,) from the straight line of least squares through them."""
    slope, level = np.polyfit(x - x.mean(), y, 1)
    return float(np.abs(y - level - slope * (x - x.mean())).max())
