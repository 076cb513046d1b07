"""Columns that tell nothing of their own: counters of samples or frames, further clocks, and copies of others."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from itertools import combinations

import numpy as np

MAX_COPY_DEVIATION = 2e-4  # of its largest value, by which a column is off another one times a factor
MAX_COMPARED_SAMPLES = 500  # of two columns, before all of them
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


def copies_among(values: Mapping[str, np.ndarray], states_unit: Callable[[str], object]) -> dict[str, str]:
    """Columns (N,) that are another one times a factor, with a sentence on it.

    Of two the one that states a unit is kept. Not where the factor is 1, or minus that: two motors may have the same
    command.
    """
    found: dict[str, str] = {}
    moving = [n for n, v in values.items() if np.isfinite(v).all() and np.ptp(v) > 0.0]
    for a, b in combinations(sorted(moving, key=lambda n: not states_unit(n)), 2):
        if a in found or b in found or (states_unit(a) and states_unit(b)):
            continue
        every = max(1, len(values[a]) // MAX_COMPARED_SAMPLES)
        factor = _factor_between(values[a][::every], values[b][::every]) and _factor_between(values[a], values[b])
        if factor and abs(abs(factor) - 1.0) > MAX_COPY_DEVIATION:
            found[b] = f"{b} is {factor:.4g} times {a} throughout: the same once more, and left out."
    return found


def _factor_between(one: np.ndarray, other: np.ndarray) -> float:
    """The factor by which values (N,) are other ones; 0 where they are not."""
    factor = float(one @ other) / (float(one @ one) or 1.0)
    return factor if np.abs(other - factor * one).max() < MAX_COPY_DEVIATION * np.abs(other).max() else 0.0


def deviation_from_line(x: np.ndarray, y: np.ndarray) -> float:
    """Largest distance of values (N,) from the straight line of least squares through them."""
    slope, level = np.polyfit(x - x.mean(), y, 1)
    return float(np.abs(y - level - slope * (x - x.mean())).max())
