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
SHAPE_ROWS, MAX_SHAPE_WINDOWS, WINDOW_OVERLAP = (
    32,
    2000,
    2.0,
)  # of windows with errors, and in how many of them a row is
MIN_ERROR_POWER = 0.05  # of the 1 or 2 that errors of rounding have there
MIN_COUNTS_LEAD = 5.0  # nats, by which counts must be likelier than a rounded speed
TURN_SIZES = (2.0 * math.pi, 360.0, 1.0)  # in rad, degrees and turns


def summed_over_time(speed: np.ndarray, t: np.ndarray) -> np.ndarray:
    """The way (N,) since the first time (N,) [s] by a speed (N,), without spikes.

    Even from one known value to the next; of counts per row just these counts.
    """
    return way_and_count(speed, t)[0]


def way_and_count(speed: np.ndarray, t: np.ndarray) -> tuple[np.ndarray, float]:
    """The same, and the speed that one count is; 0 of one that was not counted."""
    speed = without_spikes(speed)
    known = np.isfinite(speed)
    if not known.any():
        return speed, 0.0
    whole, count = np.interp(t, t[known], speed[known]), speed_of_count(speed, t)
    steps = counted(whole, t, count) if count else 0.5 * (whole[1:] + whole[:-1]) * np.diff(t)
    return np.where(known, np.concatenate([np.zeros(1), np.cumsum(steps)]), np.nan), count


def speed_of_count(speed: np.ndarray, t: np.ndarray) -> float:
    """The speed that one count in the interval before each row is, of an encoder that made a speed (N,); 0 of others.

    It is the mean since the row before: taken for the speed of that moment it would come half an interval late, which a
    delay would explain. Such a speed lies on a grid. Where the step of that times the interval is a whole part of a
    turn, and no round number in a usual unit, as digits have it, that is enough: the speed is in rad/s, or in deg/s or
    rev/s where nothing says so. Behind a gear it is none; there the errors of the counts tell.
    """
    intervals = np.diff(t)
    interval = float(np.median(intervals)) if intervals.size else 0.0
    step = find_quantum(speed)
    even = np.abs(intervals - interval) < MAX_INTERVAL_SCATTER * interval
    if not (step and interval and np.mean(even) > MIN_EVEN_SHARE):
        return 0.0
    known = np.unique(speed[np.isfinite(speed)])  # the same counts have the same digits, and the same error
    counts = np.round(known / step)
    exact = float(known @ counts / (counts @ counts))  # its digits add up over all values
    scatter = float(np.std(known - exact * counts) / np.sqrt(counts @ counts))
    possible = [turn / (exact * interval) for turn in TURN_SIZES]
    sure = [
        n for n in possible if COUNTS_PER_TURN[0] <= n <= COUNTS_PER_TURN[1] and n * scatter < WHOLE_TOLERANCE * exact
    ]
    makes_a_turn = any(abs(n - round(n)) < WHOLE_TOLERANCE for n in sure)
    if makes_a_turn and not any(is_round(step / unit) for unit in SPEED_UNITS):
        return exact
    return exact if lead_of_counts(np.round(speed / exact)) > MIN_COUNTS_LEAD else 0.0


def lead_of_counts(rounded: np.ndarray) -> float:
    """How much likelier rounded values (N,) are counts of a row than a rounded speed [nats].

    Each count that one row lacks the next one has: the error of counts is the difference of an encoder's rounding from
    row to row, and grows with the frequency; that of a rounded speed is white. In the upper two thirds of what the rows
    show, by Whittle's likelihood, whatever the size.
    """
    if len(rounded) < SHAPE_ROWS:
        return 0.0
    windows = np.lib.stride_tricks.sliding_window_view(rounded, SHAPE_ROWS)[:: SHAPE_ROWS // 2]
    windows = windows[np.isfinite(windows).all(axis=1) & (np.ptp(windows, axis=1) > 0.0)][:MAX_SHAPE_WINDOWS]
    if not len(windows):
        return 0.0
    bend = np.linalg.qr(np.vander(np.linspace(-1.0, 1.0, SHAPE_ROWS), 3))[0]
    power = np.abs(np.fft.rfft((windows - (windows @ bend) @ bend.T) * np.hanning(SHAPE_ROWS), axis=1)) ** 2
    band = slice(SHAPE_ROWS // 6, SHAPE_ROWS // 2)
    shape = 4.0 * np.sin(np.pi * np.arange(power.shape[1]) / SHAPE_ROWS)[band] ** 2
    power = power[:, band]
    if np.mean(power) < MIN_ERROR_POWER:  # what goes on evenly has no errors
        return 0.0
    lead = np.log(np.mean(power)) - np.log(np.mean(power / shape)) - np.mean(np.log(shape))
    return float(lead) * power.size / WINDOW_OVERLAP


def counted(speed: np.ndarray, t: np.ndarray, step: float) -> np.ndarray:
    """The ways (N - 1,) that a speed (N,) without gaps was made of by an encoder, in its counts, at times (N,) [s].

    The digits of the speed are no part of them, nor is how late a row came: the speed was made for the usual interval.
    """
    intervals = np.diff(t)
    usual = float(np.median(intervals))
    even = np.abs(intervals - usual) < MAX_LATE_SHARE * usual
    return np.asarray(step * np.round(speed[1:] / step) * np.where(even, usual, intervals))


def is_round(step: float) -> bool:
    """True of 1, 2 or 5 times a power of ten."""
    mantissa = step / 10.0 ** math.floor(math.log10(step))
    return any(math.isclose(mantissa, digit, rel_tol=1e-6) for digit in (1.0, 2.0, 5.0, 10.0))
