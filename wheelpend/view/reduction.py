"""Hours of samples as what a window of a few hundred pixels can show of them: least and greatest value per pixel."""

from __future__ import annotations

import numpy as np

LONG_INTERVALS = 10.0  # median intervals between samples from which on a line has a gap
MANY_INTERVALS = 10_000  # from which the median is taken


def window_of(t: np.ndarray, begin: float, end: float) -> slice:
    """The samples of a stretch of time, and one more on either side, so that lines reach the edges."""
    first, last = np.searchsorted(t, (begin, end))
    return slice(max(int(first) - 1, 0), int(last) + 1)


def reduced(
    t: np.ndarray, values: np.ndarray, pixels: int, long: np.ndarray | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """Times and values of a line that looks as all samples do on so many pixels: at most three points per pixel.

    t (N,) increases, values (N,) may be NaN. A pixel has the least and the greatest value of its stretch of time, each
    where it was measured, and the line a gap where it holds a NaN or where the stamps leave one: after a ``long``
    interval, as ``long_intervals`` finds them.
    """
    broken = long_intervals(t) if long is None else long
    if len(t) > 2 * pixels:
        chosen = _extremes(t, values, pixels)
        t, values, broken = t[chosen], values[chosen], _gaps_between(values, broken, chosen)
    return np.insert(t, broken, t[broken - 1]), np.insert(values, broken, np.nan)


def _extremes(t: np.ndarray, values: np.ndarray, pixels: int) -> np.ndarray:
    """Places of the least and of the greatest value of each pixel's stretch of time, in their order."""
    starts = np.unique(np.searchsorted(t, np.linspace(t[0], t[-1], pixels, endpoint=False)))
    ends = np.append(starts[1:], len(t))
    found = [
        first + int(np.argmax(values[first:end] == wanted))
        for extreme in (np.fmin, np.fmax)  # of what is no NaN
        for first, end, wanted in zip(starts, ends, extreme.reduceat(values, starts), strict=True)
    ]
    return np.unique(found)


def _gaps_between(values: np.ndarray, long: np.ndarray, chosen: np.ndarray) -> np.ndarray:
    """Before which of the chosen samples the line has a gap: a NaN, or a long interval, is between two of them."""
    gaps = np.union1d(np.flatnonzero(np.isnan(values)), long)
    return np.flatnonzero(np.diff(np.searchsorted(gaps, chosen, side="right")) > 0) + 1


def long_intervals(t: np.ndarray) -> np.ndarray:
    """Before which samples there is an interval far longer than the usual one."""
    intervals = np.diff(t)
    usual = np.median(intervals[:: 1 + len(intervals) // MANY_INTERVALS]) if len(intervals) else 0.0
    return np.flatnonzero(intervals > LONG_INTERVALS * usual) + 1


def within(long: np.ndarray, window: slice) -> np.ndarray:
    """Those of all long intervals that lie in a window, counted from its first sample."""
    return long[(long > window.start) & (long < window.stop)] - window.start
