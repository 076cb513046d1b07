"""An input that a sensor reads: smoothed from both sides, since its noise does not act."""

from __future__ import annotations

import numpy as np

from wheelpend.logs.log import GAP_INTERVAL_RATIO
from wheelpend.logs.runs import runs_of
from wheelpend.numerics import gaussian_smoothed

WIDTHS_ROWS = tuple(float(w) for w in np.geomspace(0.5, 32.0, 13))  # standard deviations that are tried [rows]


def smoothed_input(values: np.ndarray, t: np.ndarray, width: float) -> np.ndarray:
    """An input (N,) behind a Gaussian of a standard deviation [s], without delay; across no gap of its times (N,) [s].

    Where it is not known it stays so.
    """
    interval = float(np.median(np.diff(t)))
    apart = np.diff(t, prepend=t[0]) > GAP_INTERVAL_RATIO * interval
    result = values.astype(float)
    for first, last in runs_of(np.isfinite(values)):
        for part in np.split(np.arange(first, last), np.flatnonzero(apart[first + 1 : last]) + 1):
            result[part] = gaussian_smoothed(values[part], width / interval)
    return result


def likeliest_width(values: np.ndarray) -> tuple[float, float]:
    """The standard deviation [rows] of the Gaussian that predicts a value (N,) best by the others, and what it misses.

    Leave-one-out cross-validation (Craven and Wahba 1979): of a smooth signal with white noise what is missed has the
    noise's standard deviation. Of a signal without noise, or one that goes in steps, the least width is best.
    """

    def missed(width: float) -> float:
        own = float(gaussian_smoothed(np.eye(1, 401, 200)[0], width)[200])  # weight of a value in its own mean
        return float(np.sqrt(np.mean(((values - gaussian_smoothed(values, width)) / (1.0 - own)) ** 2)))

    best = min(WIDTHS_ROWS, key=missed)
    return best, missed(best)
