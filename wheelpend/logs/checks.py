"""Checks of a log that was read: errors of clock, values and input, and warnings of a log that can be used."""

from __future__ import annotations

import math
from collections.abc import Mapping
from itertools import pairwise

import numpy as np

from wheelpend.errors import Failure
from wheelpend.logs.columns import NO_RATES, ROW_NUMBER, ColumnSource, ColumnTable
from wheelpend.logs.commands import unknown_input_text
from wheelpend.logs.log import MAX_SAMPLE_INTERVAL_S, MIN_SAMPLE_INTERVAL_S, Log
from wheelpend.logs.units import UNIT_CONVERSIONS
from wheelpend.logs.white_noise import difference_noise

MAX_VALUE = 1e12  # in SI units; nothing that a machine does is larger, and squares of it are far from overflowing
READABLE_INTERVALS_S = 1e-12, 1e12  # s; with the right unit no log is beyond, and a wrong one can still be told
MIN_SHAKING_SIGMAS = 20.0  # of white noise, by which a channel is off its mean that moves within such a block
MOTION_BLOCK_S = 0.1  # over which readings are averaged to tell motion from noise
MAX_UNEVEN_SHARE = 0.1  # of the way, by which a place is off a straight line, and of its rate, that goes evenly
MIN_READINGS = 5  # of a channel, below which its noise is not known
MOVE_CURE = "Record a log in which {words.works} and the {words.machine} moves."
INTERVAL_CURE = (
    "say how many seconds are from row to row, by --interval S of `inspect` and `new`, or in a model's [columns] by "
    f't = {{ column = "{ROW_NUMBER}", scale = S }}'
)
WHOLE_TURN, MIN_ONE_WAY_SHARE = 2.0 * math.pi, 0.95  # of the way gone, that an angle ends away which never comes back
MIN_SWING_UP_PERCENT = 10.0  # of a log's samples beyond the range, from which on that may be meant
MAX_FIRST_STEP_SHARE = 0.25  # of the largest step, of a machine that begins at rest
MIN_RECORDING_ROWS = 10  # of a recording in a file with others
MAX_FIRST_STEPS = 20.0  # usual steps, that its first is long at most: a single wrong stamp is followed by a longer one
MAX_ANEW_SHARE = 0.1  # of a recording's time, after its first stamp, at which the next one's begins at most
MAX_RUNS_TOLD = 5  # of which it is said where they begin
STILL_BAND_SIGMAS = 8.0  # standard deviations of these means within which a channel stands still: a thousand reach 6.5


def check_time(log: str, t: np.ndarray) -> None:
    """Raise Failure unless every sample has a finite time, later than the one before."""
    unknown = np.flatnonzero(~np.isfinite(t))
    if len(unknown):
        raise Failure(f"{log}: every sample needs its time; row {unknown[0] + 1} of t has none. Remove such rows.")
    backward = np.flatnonzero(np.diff(t) <= 0)
    if len(backward):
        k = int(backward[0])
        cure = repeated_cure(t) if (np.diff(t) >= 0).all() else backward_cure(t)
        raise Failure(
            f"{log}: t must grow from row to row, but row {k + 2} has {t[k + 1]:.15g} after {t[k]:.15g} in row {k + 1} "
            f"({len(backward)} such rows). {cure}"
        )


def backward_cure(stamps: np.ndarray) -> str:
    """What to do about stamps (N,) that go back before some rows."""
    begins = [0, *(np.flatnonzero(np.diff(stamps) < 0) + 1), len(stamps)]
    anew = (stamps[b] - stamps[a] < MAX_ANEW_SHARE * (stamps[b - 1] - stamps[a]) for a, b in pairwise(begins[:-1]))
    if all(anew) and all(_is_a_recording(stamps[a:b]) for a, b in pairwise(begins)):
        rows = ", ".join(str(k + 1) for k in begins[1:-1][:MAX_RUNS_TOLD])
        return (f"The times begin anew: {len(begins) - 1} recordings are in this file, or its clock starts over. Save "
                f"each recording as a file of its own (the next ones begin in row {rows}), and give them all; or go on "
                "counting where the clock starts over.")  # fmt: skip
    return "Sort the rows and remove repeated ones, and those with a wrong time."


def _is_a_recording(stamps: np.ndarray) -> bool:
    """True of stamps (n,) that are enough for a recording of its own, and go on evenly after the first."""
    steps = np.diff(stamps)
    return len(stamps) >= MIN_RECORDING_ROWS and bool(steps[0] <= MAX_FIRST_STEPS * float(np.median(steps)))


def repeated_cure(stamps: np.ndarray) -> str:
    """What to do about stamps (N,) that stay the same in some rows."""
    same = np.diff(stamps) == 0
    if any(same[k::2].all() and not same[1 - k :: 2].any() for k in range(2)):
        return "Every time is there twice: if two sensors take turns, keep the rows of one, every second row."
    return ("If such rows are the same once more, remove them. If they were sampled one after the other and stamped as "
            f"they arrived, the stamps are no times: {INTERVAL_CURE}.")  # fmt: skip


def check_values(log: str, name: str, values: np.ndarray) -> None:
    """Raise Failure when a column has an infinite value or none at all."""
    infinite = np.flatnonzero(np.isinf(values))
    if len(infinite):
        raise Failure(
            f"{log}: values must be finite; row {infinite[0] + 1} of {name} is infinite. Leave the cell "
            "empty where the sensor gave no value."
        )
    if np.isnan(values).all():
        raise Failure(f"{log}: {name} has no values at all. It must be measured, at least now and then.")
    largest = float(np.nanmax(np.abs(values)))
    if largest > MAX_VALUE or 0.0 < largest < 1.0 / MAX_VALUE:
        raise Failure(
            f"{log}: values must be numbers that somebody measured, between {1.0 / MAX_VALUE:g} and {MAX_VALUE:g} in "
            f"size, but {name} reaches {largest:.3g}. Check its unit, and its scale in [columns]."
        )


def check_input_acts(log: str, values: Mapping[str, np.ndarray], table: ColumnTable) -> None:
    """Raise Failure when an input never changes: without excitation no parameter is identifiable.

    One that is constant and not zero acts where it sets a machine at rest in motion: a step that the log begins with.
    """
    for name in table.inputs:
        lowest = np.nanmin(values[name])
        if lowest != np.nanmax(values[name]) or (lowest and is_step_from_rest(values, table)):
            continue
        raise Failure(
            f"{log}: {name} must vary for anything to be learnt, or set a machine at rest in motion, but it is "
            f"{lowest:g} {table.units[name]} throughout. Record a log in which {table.words.works}."
        )


def check_sensors_act(log: Log, table: ColumnTable) -> None:
    """Raise Failure of a channel that is silent."""
    for sentence, cure in silent_channels(log, table).values():
        raise Failure(f"{log.name}: {sentence} {cure}")


def silent_channels(log: Log, table: ColumnTable) -> dict[str, tuple[str, str]]:
    """Channels that are hardly read, and rates that never change though their places do: what is wrong, and a cure.

    The noise of neither is known, and at what is found in its place such readings outweigh all others.
    """
    values, found = dict(zip(log.channels, log.measured.T, strict=True)), {}
    for name, readings in values.items():
        place = values.get(table.rates.get(name, ""))
        without = "" if place is None else f", or say in the model's [assumptions] that nothing reads it ({NO_RATES})"
        known = readings[np.isfinite(readings)]
        if known.size < min(MIN_READINGS, len(readings)):
            what = f"{name} must be read often enough to tell its noise, but has {known.size} values."
            found[name] = what, f"Log it in more rows{without}."
        elif place is not None and known.min() == known.max() and not _is_rate(float(known[0]), place, log):
            what = (f"{name} must change where {table.rates[name]} does, of which it is the rate, but is {known[0]:g} "
                    f"{table.units[name]} throughout.")  # fmt: skip
            found[name] = what, f"Look whether it is connected{without}."
    return found


def _is_rate(rate: float, place: np.ndarray, log: Log) -> bool:
    """True of a rate at which a place (N,) of a log goes throughout, or of one that does not leave its noise."""
    known = np.isfinite(place)
    if not moves(place, log.dt) or np.ptp(place[known]) == 0.0:
        return True
    t, way = log.t[known], float(np.ptp(place[known]))
    slope, start = np.polyfit(t, place[known], 1)
    even = float(np.abs(place[known] - slope * t - start).max()) < MAX_UNEVEN_SHARE * way
    return even and abs(slope - rate) < MAX_UNEVEN_SHARE * abs(slope)


def is_step_from_rest(values: Mapping[str, np.ndarray], table: ColumnTable) -> bool:
    """True of a machine that need not be balanced and that is at rest in the first sample and moves in later ones."""
    return not table.range_channel and bool(table.places) and all(starts_at_rest(values[c]) for c in table.places)


def starts_at_rest(place: np.ndarray) -> bool:
    """True of a place (N,) whose first step is small against its largest."""
    steps = np.abs(np.diff(place[np.isfinite(place)]))
    return steps.size > 1 and bool(steps[0] < MAX_FIRST_STEP_SHARE * steps.max())


def check_motion(log: Log, table: ColumnTable) -> None:
    """Raise Failure when no channel ever leaves its noise: without motion no parameter is identifiable."""
    if sentence := stillness(log, table):
        raise Failure(f"{log.name}: {sentence} {MOVE_CURE.format(words=table.words)}")


def stillness(log: Log, table: ColumnTable) -> str:
    """The sentence that no channel ever leaves its noise; nothing where one does."""
    if any(moves(values, log.dt) for values in log.measured.T):
        return ""
    lowest, highest = float(np.nanmin(log.voltage)), float(np.nanmax(log.voltage))
    unit = table.units.get(table.input, "")
    driven = f" while {table.input} goes from {lowest:.3g} to {highest:.3g} {unit}" if table.input else ""
    return (
        f"Nothing can be identified: {', '.join(log.channels)} stay within their noise throughout{driven}, and "
        "inertia, friction and gravity show in motion only."
    )


def moves(values: np.ndarray, dt: float) -> bool:
    """True of a channel (N,) whose means over MOTION_BLOCK_S differ by more than its white noise makes them.

    Or that is far from its mean, as what shakes to and fro within such a block.
    """
    known = values[np.isfinite(values)]
    length = max(round(MOTION_BLOCK_S / dt), 1)
    means = known[: len(known) // length * length].reshape(-1, length).mean(axis=1)
    if len(means) < 2:
        return True
    noise = difference_noise(known)
    shakes = float(np.std(known)) > MIN_SHAKING_SIGMAS * noise
    return shakes or bool(np.ptp(means) > STILL_BAND_SIGMAS * noise / math.sqrt(length))


def log_warnings(log: Log, table: ColumnTable, sources: Mapping[str, ColumnSource]) -> list[str]:
    """Sentences on gaps, ranges, missing values and constant channels of a log that can be used."""
    inputs = zip(table.inputs, log.inputs, strict=False)
    unknown = [text for name, values in inputs if (text := unknown_input_text(name, log.t, values))]
    named = [*range_warnings(log, table, sources), *unknown, *channel_warnings(log), *runaway_warnings(log, table)]
    return [*time_warnings(log), *named]


def runaway_warnings(log: Log, table: ColumnTable) -> list[str]:
    """A sentence on an angle that turns on and on from rest, though nothing is said to drive it."""
    found = []
    for name, values in zip(log.channels, log.measured.T, strict=True):
        way = np.diff(values[np.isfinite(values)])
        if table.inputs or name not in table.places or table.units[name] != "rad" or not starts_at_rest(values):
            continue
        turned = abs(float(way.sum()))
        if turned > WHOLE_TURN and turned > MIN_ONE_WAY_SHARE * float(np.abs(way).sum()):
            found.append(f"{name} begins at rest and turns {turned / WHOLE_TURN:.2g} times round without coming back, "
                         "which nothing does that only gravity pulls. Look at its unit (degrees?); or else something "
                         "drives it: its command must be in the log, and the plant one with a motor.")  # fmt: skip
    return found


def time_warnings(log: Log) -> list[str]:
    """Gaps, and a sample interval that looks like another unit."""
    found = []
    interval = np.diff(log.t)
    gaps = np.flatnonzero(interval > log.longest_interval)
    if len(gaps):
        k = int(gaps[np.argmax(interval[gaps])])
        count = "1 gap" if len(gaps) == 1 else f"{len(gaps)} gaps"
        found.append(f"{count} in the sampling, the longest {interval[k]:.3g} s after t = {log.t[k]:.6g} s.")
    if sentence := interval_text(log):
        found.append(sentence)
    return found


def check_readable_interval(log: str, t: np.ndarray) -> None:
    """Raise Failure where the times [s] are so small or so large that no unit of theirs explains it."""
    interval = float(np.median(np.diff(t)))
    least, most = READABLE_INTERVALS_S
    if not least <= interval <= most:
        raise Failure(f"{log}: t must be a time, but its samples are {interval:.3g} s apart. Check its column.")


def check_interval(log: Log, unit: str = "") -> None:
    """Raise Failure where samples are so far apart, or so close, that their times must be in another ``unit``."""
    if sentence := interval_text(log, unit or "s"):
        raise Failure(f"{log.name}: {sentence}")


def check_interval_in_memory(log: Log) -> None:
    """The same of times in memory, which can be divided."""
    if sentence := interval_text(log):
        unit = unit_of_interval(log.dt)
        divided = (
            f" Or give it in s: divide it by {1.0 / UNIT_CONVERSIONS[unit][1]:g}." if unit not in ("", "s") else ""
        )
        raise Failure(f"{log.name}: {sentence}{divided}")


def interval_text(log: Log, read_in: str = "s") -> str:
    """The sentence that samples are too far apart or too close for their times to be in s; nothing where they are not.

    Nothing balances on two samples a second, and no sensor is read a million times a second.
    """
    if MIN_SAMPLE_INTERVAL_S <= log.dt <= MAX_SAMPLE_INTERVAL_S:
        return ""
    if not log.dt > MAX_SAMPLE_INTERVAL_S:
        least = f"at least {MIN_SAMPLE_INTERVAL_S:g} s apart"
        return f"Samples must be {least}, but they are {log.dt:.3g} s. Check the unit of t."
    unit = unit_of_interval(log.dt / UNIT_CONVERSIONS[read_in][1])
    said = f"Samples must be at most {MAX_SAMPLE_INTERVAL_S:g} s apart, but they are {log.dt:.6g} s."
    if not unit or unit == read_in:
        return f"{said} Check the unit of t."
    return f'{said} If t is in {unit}, say so under [columns] of model.toml: t = {{ column = "t", unit = "{unit}" }}.'


def unit_of_interval(interval: float) -> str:
    """The largest unit of time in which samples of this interval are near enough to each other; empty without one."""
    near = (u for u in ("s", "ms", "us", "ns") if interval * UNIT_CONVERSIONS[u][1] <= MAX_SAMPLE_INTERVAL_S)
    return next(near, "")


def range_warnings(log: Log, table: ColumnTable, sources: Mapping[str, ColumnSource]) -> list[str]:
    """An angle that looks like degrees, or a machine that left its range."""
    name = log.range_channel
    if name not in log.channels:
        return []
    angle = np.abs(log.measured[:, log.channels.index(name)])
    outside = np.flatnonzero(angle > math.pi / 2)
    found = []
    if np.nanmax(angle) > 3.2 and np.nanmin(angle) < math.pi / 2:  # else it hangs, or the log would begin on the floor
        found.append(
            f"{name} reaches {np.nanmax(angle):.3g} rad and looks like degrees; if it is, map it in model.toml: "
            f'{name} = {{ column = "{sources[name].column}", unit = "deg" }}.'
        )
    if len(outside):
        share = 100 * len(outside) / len(angle)
        meant = share >= MIN_SWING_UP_PERCENT and table.words.anywhere
        found.append(
            f"{name} is beyond ±π/2 from t = {log.t[outside[0]]:.6g} s: the {table.words.machine} "
            f"{table.words.left}. "
            f"Those samples ({share:.3g} %) are left out."
            + (f" If it was meant to go there, as in a swing-up, {table.words.anywhere}." if meant else "")
        )
    return found


def channel_warnings(log: Log) -> list[str]:
    """Missing cells and channels that never change."""
    found = []
    for name, values in zip(log.channels, log.measured.T, strict=True):
        missing = int(np.isnan(values).sum())
        if missing:
            share = 100 * missing / len(values)
            found.append(f"{name} is missing in {missing} of {len(values)} samples ({share:.3g} %).")
        if np.nanmin(values) == np.nanmax(values):
            found.append(f"{name} is {np.nanmin(values):g} throughout: this sensor says nothing.")
    return found
