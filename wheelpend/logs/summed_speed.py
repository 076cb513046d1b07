"""The way that a speed comes to: even from reading to reading, or the counts of an encoder that it was made of."""

from __future__ import annotations

import math

import numpy as np

from wheelpend.logs.noise import find_quantum
from wheelpend.logs.outliers import without_spikes

SPEED_UNITS = (1.0, math.radians(1.0), math.pi / 30.0, 2.0 * math.pi)  # rad/s, deg/s, rpm and rev/s, in rad/s
MAX_INTERVAL_SCATTER = 1e-2  # of the interval: of a clock that scatters more, counts of a row tell no speed in steps
MAX_LATE_SHARE = 0.5  # of the interval, by which a row is late that follows the one before
MIN_EVEN_SHARE = 0.9  # of the intervals that scatter less, gaps aside
COUNTS_PER_TURN = (4.0, 1e5)  # of a shaft
WHOLE_TOLERANCE = 0.005  # by which such a number is off a whole one: one in 30 is by chance, of three turns
TURN_SIZES = (2.0 * math.pi, 360.0, 1.0)  # in rad, degrees and turns


def summed_over_time(speed: np.ndarray, t: np.ndarray) -> np.ndarray:
    """The way (N,) since the first time (N,) [s] by a speed (N,), without spikes.

    Even from one known value to the next; of counts per row just these counts.
    """
    speed = without_spikes(speed)
    known = np.isfinite(speed)
    if not known.any():
        return speed
    whole, step = np.interp(t, t[known], speed[known]), counted_step(speed, t)
    steps = counted(whole, t, step) if step else 0.5 * (whole[1:] + whole[:-1]) * np.diff(t)
    return np.where(known, np.concatenate([np.zeros(1), np.cumsum(steps)]), np.nan)


def is_counted(speed: np.ndarray, t: np.ndarray) -> bool:
    """True of a speed (N,) that is summed to an encoder's counts."""
    return counted_step(without_spikes(speed), t) > 0.0


def counts_per_turn(speed: np.ndarray, t: np.ndarray) -> int:
    """Counts per turn of an encoder whose counts in the interval before each row a speed (N,) is; 0 of others.

    Such a speed lies on a grid whose step times the interval is a whole part of a turn. It is the mean since the row
    before: taken for the speed of that moment it would come half an interval late, which a delay would explain. A step
    of a round number in a usual unit may as well be that of its digits. The speed is in rad/s, or in deg/s or rev/s
    where nothing says so.
    """
    intervals = np.diff(t)
    interval = float(np.median(intervals)) if intervals.size else 0.0
    step = find_quantum(speed)
    even = np.abs(intervals - interval) < MAX_INTERVAL_SCATTER * interval
    if not (step and interval and np.mean(even) > MIN_EVEN_SHARE) or any(is_round(step / unit) for unit in SPEED_UNITS):
        return 0
    known = _levels(speed)
    counts, step = whole_counts(known, step)
    scatter = float(np.std(known - step * counts) / np.sqrt(counts @ counts))
    possible = [turn / (step * interval) for turn in TURN_SIZES]
    sure = [
        n for n in possible if COUNTS_PER_TURN[0] <= n <= COUNTS_PER_TURN[1] and n * scatter < WHOLE_TOLERANCE * step
    ]
    return next((round(n) for n in sure if abs(n - round(n)) < WHOLE_TOLERANCE), 0)


def counted_step(speed: np.ndarray, t: np.ndarray) -> float:
    """The speed (N,) that is one count of an encoder in the interval before each row; 0 of one that is not counted."""
    return whole_counts(_levels(speed), find_quantum(speed))[1] if counts_per_turn(speed, t) else 0.0


def counted(speed: np.ndarray, t: np.ndarray, step: float) -> np.ndarray:
    """The ways (N - 1,) that a speed (N,) without gaps was made of by an encoder, in its counts, at times (N,) [s].

    The digits of the speed are no part of them, nor is how late a row came: the speed was made for the usual interval.
    """
    intervals = np.diff(t)
    usual = float(np.median(intervals))
    even = np.abs(intervals - usual) < MAX_LATE_SHARE * usual
    return np.asarray(step * np.round(speed[1:] / step) * np.where(even, usual, intervals))


def _levels(speed: np.ndarray) -> np.ndarray:
    """The values of a speed (N,), each once: the same counts have the same digits, and the same error."""
    return np.unique(speed[np.isfinite(speed)])


def whole_counts(speed: np.ndarray, step: float) -> tuple[np.ndarray, float]:
    """How many steps each value of a speed (N,) is, and the step that all of them make of a first one."""
    counts = np.round(speed / step)
    return counts, float(speed @ counts / (counts @ counts))


def is_round(step: float) -> bool:
    """True of 1, 2 or 5 times a power of ten."""
    mantissa = step / 10.0 ** math.floor(math.log10(step))
    return any(math.isclose(mantissa, digit, rel_tol=1e-6) for digit in (1.0, 2.0, 5.0, 10.0))
