"""Angles that wrap into one turn and encoders that start again at zero, made continuous."""

from __future__ import annotations

import math

import numpy as np

TURN_RAD = 2 * math.pi
TURNS = (TURN_RAD, 360.0)  # in rad, in degrees
JUMP_TOLERANCE_TURNS = 0.25  # of a turn, by which a jump may differ from a whole one
MIN_FAST_JUMPS = 5  # of an angle that goes far from sample to sample, from which on it is wrapped
MAX_UNEVEN_TURNS = 0.1  # of a turn, by which the way of such an angle changes from one interval to the next
MIN_EVEN_SHARE = 0.9  # of its jumps, before and after which it goes on as within them: a command jumps from rest
MAX_WRAPPED_RANGE_TURNS = 1.05  # turns that a wrapped angle covers at most
RESET_JUMP_RATIO = 20.0  # times the usual step from which a jump to zero is a new start
MAX_NEIGHBOUR_INTERVAL_RATIO = 5.0  # times the usual interval, up to which samples are neighbours
COUNTER_BITS = range(8, 33)  # of a counter that overflows, or of an encoder's turn
MIN_WHOLE_VALUES = 20  # different whole numbers, of such a counter
MIN_COVERED_SHARE = 0.9  # of what its bits can count, that it has counted
MIN_COUNTED_SAMPLES = 3  # that an encoder has counted before it started again
MIN_RESET_SAMPLES = 10  # samples that an encoder which started again stays there


def make_continuous(
    name: str, values: np.ndarray, t: np.ndarray, unit: str, can_reset: bool = True, count: float = 0.0
) -> tuple[np.ndarray, list[str]]:
    """A channel (N,) without the jumps of wrapping and of counter resets, and a sentence on each kind that was found.

    ``t`` (N,) are the times of the samples; ``count`` is what one of the file's own numbers is in the channel's unit.
    A jump counts only between neighbours: across missing samples or a gap anything may have happened.
    """
    known = np.flatnonzero(np.isfinite(values))
    if known.size < 2:
        return values, []
    adjacent = (np.diff(known) == 1) & (np.diff(t[known]) < MAX_NEIGHBOUR_INTERVAL_RATIO * np.median(np.diff(t)))
    remarks = []
    if unit == "rad" and (jumps := count_wraps(values[known], adjacent)):
        continuous = unwrapped(values, TURN_RAD)
        across = int(np.sum(~adjacent & (np.abs(np.diff((continuous - values)[known])) > 0.5 * TURN_RAD)))
        over = "" if not across else f", over {across} gap{'s' * (across > 1)} by the nearest turn"
        remarks.append(f"{name} jumps by a turn in {jumps} places: it was wrapped, and is made continuous{over}.")
        values = continuous
    elif count and (full := overflowing_count(values / count)):
        remarks.append(f"{name} jumps by {full:.0f} counts: its counter overflows, and is made continuous.")
        values = unwrapped(values, full * abs(count))
    resets = find_counter_resets(values[known], adjacent) if can_reset else np.zeros(0, dtype=int)
    if len(resets) and resets[0] < MIN_COUNTED_SAMPLES:  # nothing had been counted yet
        values = values.copy()
        values[known[: resets[0]]] = np.nan
        what = "a reading" if resets[0] == 1 else f"{resets[0]} readings"
        remarks.append(f"{name} begins with {what} far off zero, from which it goes on: left out.")
        known, resets = known[resets[0] :], resets[1:] - resets[0]
    if len(resets):
        steps = np.diff(values[known], prepend=values[known][0])
        steps[resets] = 0.0
        values = values.copy()
        values[known] = values[known][0] + np.cumsum(steps)
        first = t[known[resets[0]]] - t[0]
        times = "once" if len(resets) == 1 else f"{len(resets)} times"
        remarks.append(f"{name} jumps to zero {times}, first {first:.6g} after the log's beginning: the encoder "
                       "started again, and its jumps are taken out.")  # fmt: skip
    return values, remarks


def unwrapped(values: np.ndarray, turn: float) -> np.ndarray:
    """A wrapped angle (N,) made continuous."""
    continuous, known = values.copy(), np.isfinite(values)
    continuous[known] = np.unwrap(values[known], period=turn)
    return continuous


def whole_turn(values: np.ndarray) -> float:
    """The turn into which an angle (N,) is wrapped, 2π or 360; 0 of one that is not."""
    known = values[np.isfinite(values)]
    neighbours = np.ones(max(known.size - 1, 0), dtype=bool)
    return next((turn for turn in TURNS if count_wraps(known * (TURN_RAD / turn), neighbours)), 0.0)


def overflowing_count(values: np.ndarray) -> float:
    """The power of two by which whole numbers (N,) of a counter jump as it overflows; 0 of any other signal.

    It has counted all that its bits can, and between the jumps it goes on by less than a quarter of that, always: a
    command has steps of any size.
    """
    known = values[np.isfinite(values)]
    whole = np.round(known)
    if not known.size or np.abs(known - whole).max() > 1e-6 or len(np.unique(whole[:10_000])) < MIN_WHOLE_VALUES:
        return 0.0
    full = next((2.0**bits for bits in COUNTER_BITS if np.ptp(whole) < 2.0**bits), 0.0)
    if not full or np.ptp(whole) <= MIN_COVERED_SHARE * full:
        return 0.0
    steps = np.abs(np.diff(whole)) / full
    jumps = steps > 1.0 - JUMP_TOLERANCE_TURNS
    return full if jumps.any() and (steps[~jumps] < JUMP_TOLERANCE_TURNS).all() else 0.0


def count_wraps(values: np.ndarray, adjacent: np.ndarray) -> int:
    """Number of jumps by a turn of a wrapped angle (N,) [rad]; 0 of one that is not wrapped.

    ``adjacent`` (N - 1,) is true of steps between neighbouring samples.
    """
    if values.size < 2 or np.ptp(values) > MAX_WRAPPED_RANGE_TURNS * TURN_RAD:
        return 0
    steps = np.abs(np.diff(values))
    jumps = adjacent & (np.abs(steps - TURN_RAD) < JUMP_TOLERANCE_TURNS * TURN_RAD)
    others = steps[adjacent & ~jumps]
    usual_step = float(np.quantile(others, 0.99)) if others.size else 0.0
    if jumps.any() and usual_step <= JUMP_TOLERANCE_TURNS * TURN_RAD:
        return int(jumps.sum())
    return _fast_wraps(values, adjacent)


def _fast_wraps(values: np.ndarray, adjacent: np.ndarray) -> int:
    """The same of one that goes on by up to half a turn from sample to sample, before and after each of its jumps."""
    fast = np.flatnonzero(adjacent & (np.abs(np.diff(values)) > 0.5 * TURN_RAD))
    within = fast[(fast > 0) & (fast < len(adjacent) - 1)]
    if within.size < MIN_FAST_JUMPS:
        return 0
    steps = np.diff(np.unwrap(values))
    uneven = np.maximum(np.abs(steps[within] - steps[within - 1]), np.abs(steps[within] - steps[within + 1]))
    goes_on = (uneven < MAX_UNEVEN_TURNS * TURN_RAD) & (np.abs(steps[within]) > MAX_UNEVEN_TURNS * TURN_RAD)
    return int(fast.size) if np.mean(goes_on) > MIN_EVEN_SHARE else 0


def find_counter_resets(values: np.ndarray, adjacent: np.ndarray) -> np.ndarray:
    """Indices of a counter (N,) at which it jumps to zero and goes on from there; not where it ever jumps back.

    ``adjacent`` (N - 1,) is true of steps between neighbouring samples.
    """
    if values.size < 4 * MIN_RESET_SAMPLES:
        return np.zeros(0, dtype=int)
    steps = np.diff(values)
    sizes = np.abs(steps)
    usual_step = float(np.quantile(sizes[adjacent], 0.999 if sizes.size > 5000 else 0.98)) if adjacent.any() else 0.0
    if usual_step == 0.0:
        return np.zeros(0, dtype=int)
    large = sizes > RESET_JUMP_RATIO * usual_step
    to_zero = large & adjacent & (np.abs(values[1:]) <= usual_step)
    resets = [k for k in np.flatnonzero(to_zero) if not large[k + 1 : k + 1 + MIN_RESET_SAMPLES].any()]
    back = [k for k in np.flatnonzero(large) if not to_zero[k]]  # motion, or a sensor that gave nothing for a while
    undone = [k for k in resets if any(steps[j] * steps[k] < 0 and sizes[j] > 0.5 * sizes[k] for j in back)]
    return np.array([k + 1 for k in resets if k not in undone], dtype=int)
