"""Columns that tell no more than the row they stand in: counters of samples or frames, and further clocks."""

from __future__ import annotations

import numpy as np

MAX_CLOCK_DEVIATION = 0.5  # of a step, by which a clock is off a straight line at most


def counter_sentence(name: str, values: np.ndarray, t: np.ndarray) -> str:
    """That a column (N,) counts rows or is a clock beside the times (N,) [s]; nothing of any other column."""
    rows = np.arange(len(values), dtype=float)
    steps = np.diff(values)
    if not (np.isfinite(values).all() and (steps > 0).all()):
        return ""
    usual = float(np.median(steps))
    if deviation_from_line(rows, values) < MAX_CLOCK_DEVIATION * usual:
        whole = (values == np.round(values)).all()
        return f"{name} grows by {usual:g} from row to row: {'a counter' if whole else 'a clock'}, and no reading."
    if deviation_from_line(t, values) < MAX_CLOCK_DEVIATION * usual:
        return f"{name} grows in proportion to the time: a clock, and no reading."
    return ""


def deviation_from_line(x: np.ndarray, y: np.ndarray) -> float:
    """Largest distance of values (N,) from the straight line of least squares through them."""
    slope, level = np.polyfit(x - x.mean(), y, 1)
    return float(np.abs(y - level - slope * (x - x.mean())).max())
