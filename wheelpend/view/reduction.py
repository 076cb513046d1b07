"""Hours of samples as what a window of a few hundred pixels can show of them: least and greatest value per pixel."""

from __future__ import annotations

import numpy as np


def window_of(t: np.ndarray, begin: float, end: float) -> slice:
    """The samples of a stretch of time, and one more on either side, so that lines reach the edges."""
    first, last = np.searchsorted(t, (begin, end))
    return slice(max(int(first) - 1, 0), int(last) + 1)


def reduced(t: np.ndarray, values: np.ndarray, pixels: int) -> tuple[np.ndarray, np.ndarray]:
    """Times and values of a line that looks as all samples do on so many pixels: two points per pixel.

    Values may be NaN: where all of a pixel's are, the line has a gap.
    """
    if len(t) <= 2 * pixels:
        return np.asarray(t), np.asarray(values)
    starts = np.linspace(0, len(t), pixels, endpoint=False).astype(int)
    least, greatest = np.fmin.reduceat(values, starts), np.fmax.reduceat(values, starts)
    return np.repeat(t[starts], 2), np.column_stack([least, greatest]).ravel()
