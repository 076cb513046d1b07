"""Findings on when samples were taken: rows that are missing, times made up, a clock that jitters.

A place that is measured finely moves in proportion to the time that passed: its steps tell the true intervals.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from wheelpend.inspection.findings import Finding
from wheelpend.inspection.signals import channel_values
from wheelpend.logs.columns import ColumnTable
from wheelpend.logs.log import GAP_INTERVAL_RATIO, Log
from wheelpend.logs.noise import find_quantum, noise_of_values, rounding_sigma
from wheelpend.logs.white_noise import difference_noise

MIN_DROPPED_SHARE = 1e-3  # share of the rows, from which on missing ones are named
WHOLE_INTERVAL_TOLERANCE = 0.15  # of an interval, by which a multiple of the usual one may be off
MIN_WHOLE_PER_BETWEEN = 3.0  # whole multiples for each interval just between two: an irregular clock gives about one
WALK_ROWS = 36.0  # variance of the rows lost in a window [rows²], by which lost rows and rounded times are told apart
MAX_ROUNDED_SCATTER = 0.75  # of the usual interval, by which rounded times scatter: lost rows leave more than 1
MAX_ROUNDED_WAY = 1.5  # times as far as in usual intervals does a place move in long ones, where times are rounded
FAST_STEP_SIGMAS = 8.0  # a step that tells its time is so many times its scatter
NEIGHBOUR_STEPS = 9  # steps whose median says how fast the place moves
MIN_DOUBLE_STEPS = 20  # steps twice as long as their neighbours, from which on rows were dropped
MIN_FAST_STEPS = 200  # steps from which on something is concluded
MIN_JITTER_SHARE = 0.005  # of an interval, the smallest jitter looked for
MIN_JITTER_SIGMAS = 2.0  # of a place, by which a jitter that is named moves it
MIN_JITTER_GROWTH = 4.0  # times the scatter of a fast place that of a slow one, squared
JITTER_DIFFERENCES, JITTER_VARIANCE_FACTOR = 4, 70.0  # order of the differences that leave no motion; of white noise


def find_sampling_faults(log: Log, table: ColumnTable) -> list[Finding]:
    """The findings on dropped rows, made-up times and jitter."""
    if len(log) < MIN_FAST_STEPS:
        return []
    places = [c for c in log.channels if table.units.get(c) in ("rad", "m") and c != table.range_channel]
    found = dropped_rows(log, places)
    for name in places:
        values = channel_values(log, name)
        of_this = retimed_rows(log, name, values) or stamp_jitter(log, name, values) or sample_jitter(log, name, values)
        if of_this:
            return found + of_this
    return found


def dropped_rows(log: Log, places: Sequence[str] = ()) -> list[Finding]:
    """The finding that times skip whole intervals: rows were lost, and the times say which; or they are rounded.

    Some of ``places``, if they move fast enough, tell which it is.
    """
    ratio = np.diff(log.t) / log.dt
    whole = np.round(ratio)
    skips = (whole >= 2) & (ratio <= GAP_INTERVAL_RATIO) & (np.abs(ratio - whole) < WHOLE_INTERVAL_TOLERANCE)
    between = (ratio > 1.5 - WHOLE_INTERVAL_TOLERANCE) & (ratio <= GAP_INTERVAL_RATIO)
    between &= np.abs(ratio - np.floor(ratio) - 0.5) < WHOLE_INTERVAL_TOLERANCE
    missing = float(np.sum(whole[skips] - 1))
    share = missing / (len(log) + missing)
    if share < MIN_DROPPED_SHARE or skips.sum() < MIN_WHOLE_PER_BETWEEN * between.sum():
        return []
    if times_are_rounded(ratio, missing / len(ratio)):
        way = next((w for name in places if (w := way_in_long_intervals(log, name, skips)) is not None), None)
        if way is None or way < MAX_ROUNDED_WAY:
            return [rounded_times(log, is_known=way is not None)]
    multiples = f"{int(skips.sum())} intervals are whole multiples of the usual one"
    sentence = f"{100 * share:.2g} % of the rows are missing: {multiples}."
    cure = "The times are right, but the input within such intervals is not known: log every row, or average over more."
    return [Finding("dropped_rows", "t", sentence, cure, share)]


def times_are_rounded(ratio: np.ndarray, excess: float) -> bool:
    """True where intervals (N,), as multiples of the usual one, are those of an even clock rounded to it.

    The times then keep to a straight line; where rows were lost at random they go away from it as a random walk does.
    """
    window = int(WALK_ROWS / max(excess * (1.0 - excess), 1e-9))
    times = np.concatenate(([0.0], np.cumsum(ratio)))
    if (
        not 0.0 < excess < 1.0
        or window > len(times)
        or np.abs(ratio - np.round(ratio)).max() > WHOLE_INTERVAL_TOLERANCE
    ):
        return False
    parts = times[: len(times) // window * window].reshape(-1, window)
    rows = np.arange(window) - 0.5 * (window - 1)
    centred = parts - parts.mean(axis=1, keepdims=True)
    rest = centred - np.outer(centred @ rows / (rows @ rows), rows)
    return float(np.median(rest.std(axis=1))) < MAX_ROUNDED_SCATTER


def way_in_long_intervals(log: Log, name: str, skips: np.ndarray) -> float | None:
    """How far a place moves in intervals (N - 1,) that are whole multiples, over how far in usual ones beside them.

    Twice as far and more where rows are missing there, as far where the times are rounded. None where it moves too
    slowly to tell.
    """
    values = channel_values(log, name)
    steps, alone = np.diff(values), skips[1:-1] & ~skips[:-2] & ~skips[2:]
    beside = 0.5 * (steps[:-2] + steps[2:])
    told = alone & (np.abs(beside) > FAST_STEP_SIGMAS * noise_of_values(values))
    return float(np.median(steps[1:-1][told] / beside[told])) if told.sum() >= MIN_DOUBLE_STEPS else None


def rounded_times(log: Log, *, is_known: bool) -> Finding:
    """The finding that times are whole steps of a clock that is coarser than the sampling.

    Where no place tells, ``is_known`` false, rows may as well be missing at regular intervals.
    """
    interval = log.duration / (len(log) - 1)
    sentence = f"The times are rounded to {1e3 * log.dt:.3g} ms, while a row comes every {1e3 * interval:.4g} ms"
    rest = ": no row need be missing." if is_known else "; or rows are missing at regular intervals."
    cure = "The times are used as they are: log finer ones (µs), if they are rounded."
    return Finding("rounded_times", "t", sentence + rest, cure, log.dt)


def median_of_neighbours(steps: np.ndarray) -> np.ndarray:
    """Running median of steps (N - 1,)."""
    edge = NEIGHBOUR_STEPS // 2
    windows = np.lib.stride_tricks.sliding_window_view(np.pad(steps, edge, mode="edge"), NEIGHBOUR_STEPS)
    return np.median(windows, axis=1)


def fast_steps(log: Log, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Steps (N - 1,) of a place over those expected by their neighbours' speed, NaN of slow ones, and the expected."""
    steps = np.diff(values)
    expected = median_of_neighbours(steps)
    fast = np.abs(expected) > FAST_STEP_SIGMAS * noise_of_values(values)
    return np.where(fast, steps / np.where(fast, expected, 1.0), np.nan), expected


def matters(log: Log, values: np.ndarray, jitter: float) -> bool:
    """True of a jitter [s] that moves a place (N,) by more than the rounding of its sensor."""
    speed = float(np.sqrt(np.nanmean((np.diff(values) / np.diff(log.t)) ** 2)))
    step = find_quantum(values)  # without one, the noise found holds the jitter itself
    return jitter * speed > (MIN_JITTER_SIGMAS * rounding_sigma(step) if step else 0.5 * difference_noise(values))


def is_uniform(log: Log) -> bool:
    """True of times that are made by counting: intervals alike but for those of gaps."""
    interval = np.diff(log.t)
    usual = interval[interval <= log.longest_interval]
    return bool(np.std(usual) < MIN_JITTER_SHARE * log.dt)


def retimed_rows(log: Log, name: str, values: np.ndarray) -> list[Finding]:
    """The finding that a place moves twice as far in single steps, though times are uniform."""
    ratio, _ = fast_steps(log, values)
    ratio = ratio[np.isfinite(ratio)]
    if not is_uniform(log) or ratio.size < MIN_FAST_STEPS:
        return []
    double = np.abs(ratio - np.round(ratio)) < 0.3
    double &= (np.round(ratio) >= 2) & (np.round(ratio) <= GAP_INTERVAL_RATIO)
    between = np.abs(ratio - 1.5) < 0.2
    if int(double.sum()) < MIN_DOUBLE_STEPS or double.sum() < 3 * between.sum():
        return []
    share = float(np.sum(np.round(ratio[double]) - 1)) / ratio.size
    share = share / (1 + share)
    sentence = (f"{name} moves twice as far or more in single steps, as if {100 * share:.2g} % of the rows had been "
                "dropped and the times made uniform afterwards.")  # fmt: skip
    cure = "Log each row with the time at which it was measured; rates, delays and inertias from this log are wrong."
    return [Finding("retimed_rows", "t", sentence, cure, share)]


def stamp_jitter(log: Log, name: str, values: np.ndarray) -> list[Finding]:
    """The finding that times jitter though the place moves as if sampled evenly."""
    interval = np.diff(log.t)
    beside = median_of_neighbours(interval)  # what a slower loop does for a while is no jitter
    off = interval / beside - 1
    usual = np.abs(off) < 0.5
    jitter = float(np.std((interval - beside)[usual]))
    ratio, _ = fast_steps(log, values)
    good = np.isfinite(ratio) & usual & (np.abs(ratio - 1) < 1)
    if jitter < MIN_JITTER_SHARE * log.dt or good.sum() < MIN_FAST_STEPS:
        return []
    x, y = off[good] - off[good].mean(), ratio[good] - ratio[good].mean()
    slope = float(x @ y / (x @ x))
    sigma = float(np.std(y - slope * x) / np.sqrt(x @ x))
    if slope + 3 * sigma > 0.5 or sigma > 0.1 or not matters(log, values, jitter):
        return []
    sentence = (f"The times jitter by {1e3 * jitter:.3g} ms, but {name} moves as if sampled evenly: the stamps are at "
                "fault, not the sampling.")  # fmt: skip
    cure = "Make the times uniform, or stamp each row when its sensors are read."
    return [Finding("stamp_jitter", "t", sentence, cure, jitter)]


def sample_jitter(log: Log, name: str, values: np.ndarray) -> list[Finding]:
    """The finding that a place scatters in proportion to its speed, though times are uniform."""
    if not is_uniform(log):
        return []
    order = JITTER_DIFFERENCES
    square = np.diff(values, order) ** 2 / JITTER_VARIANCE_FACTOR
    speed = np.abs(values[order:] - values[:-order]) / (order * log.dt)
    good = np.isfinite(square) & np.isfinite(speed)
    square, speed = square[good], speed[good]
    if square.size < MIN_FAST_STEPS:
        return []
    ranked = np.array_split(np.argsort(speed), 4)
    # medians of squares, over that of a χ² of one degree of freedom, so that single jumps do not count
    scatter = [float(np.median(square[part])) / 0.455 for part in ranked]
    power = [float(np.mean(speed[part] ** 2)) for part in ranked]
    rise = np.array([(s - scatter[0]) / (p - power[0] + 1e-300) for s, p in zip(scatter[1:], power[1:], strict=True)])
    grows = scatter[3] > MIN_JITTER_GROWTH * max(scatter[0], rounding_sigma(find_quantum(values)) ** 2)
    proportional = rise.min() > 0 and rise.max() < 3 * rise.min()
    jitter = float(np.sqrt(max(rise[-1], 0.0)))
    if not (grows and proportional and jitter > MIN_JITTER_SHARE * log.dt and matters(log, values, jitter)):
        return []
    sentence = (f"{name} scatters in proportion to its speed, as if the samples were taken {1e3 * jitter:.3g} ms early "
                "or late: the times are uniform, the sampling is not.")  # fmt: skip
    cure = "Stamp each row when its sensors are read, and log these stamps."
    return [Finding("sample_jitter", "t", sentence, cure, jitter)]
