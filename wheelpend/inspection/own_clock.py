"""The column of a file that is its time, and what to do about stamps that are none."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from wheelpend.errors import Failure
from wheelpend.inspection.column_names import REFERENCE_NAMES, contains, is_called_clock, is_of_wheel
from wheelpend.inspection.counters import counter_sentence
from wheelpend.logs.checks import INTERVAL_CURE, check_time, repeated_cure
from wheelpend.logs.columns import ColumnMap
from wheelpend.logs.csv_text import NAMELESS_PREFIX
from wheelpend.logs.read import clock_rank, find_time_column
from wheelpend.logs.tables import Table
from wheelpend.logs.units import UNIT_CONVERSIONS
from wheelpend.logs.unwrap import whole_turn

MIN_STAMPS = 10  # different ones, of a clock
MAX_BACKWARD_SHARE = 0.05  # of the rows of a clock that now and then goes back


def clock_seconds(raw: np.ndarray, clock: ColumnMap) -> np.ndarray:
    """Times (N,) [s] from the first sample on."""
    return (raw - raw[0]) * UNIT_CONVERSIONS[clock.unit][1] * clock.scale


def own_clock(path: Path, file: Table, values: Mapping[str, np.ndarray]) -> ColumnMap | None:
    """The column (N,) that is the time; None where none looks like one.

    Raises Failure where one is called so but does not grow from row to row, and where one grows only now and then, as
    stamps of arrival do, or falls evenly.
    """
    called = [n for n, v in values.items() if n == "t" or (is_called_clock(n) and np.ptp(v) != 0.0)]
    likely = min(called, key=lambda n: (n != "t", unevenness(values[n])), default="")
    others = [n for n in values if not is_of_wheel(n)]
    clock = find_time_column(file._replace(read=lambda names: {n: values[n] for n in names}), likely, others)
    if clock is None and likely:
        check_time(path.name, values[likely])  # says in which row it does not grow
    if clock is None and (cure := times_cure(values)):
        raise Failure(f"{path.name}: one column must be the time, growing from row to row; none of {', '.join(values)} "
                      f"does. {cure}")  # fmt: skip
    return clock


def unevenness(stamps: np.ndarray) -> float:
    """Scatter of the steps between stamps (N,) over their mean; infinite where they do not grow from row to row."""
    steps = np.diff(stamps)
    return float(np.std(steps) / np.mean(steps)) if len(steps) and (steps > 0).all() else math.inf


def beside_clock(name: str, values: np.ndarray, t: np.ndarray) -> str:
    """That a column (N,) is a counter or a further clock; nothing of an encoder, a ramp or any other."""
    return "" if contains(name, REFERENCE_NAMES) or is_of_wheel(name) else counter_sentence(name, values, t)


def times_cure(values: Mapping[str, np.ndarray]) -> str:
    """What to do about a file with stamps that do not grow from row to row; nothing where it has none."""
    for name, stamps in values.items():
        steps = np.diff(stamps)
        if not np.isfinite(stamps).all():
            continue
        if (steps >= 0).all() and (steps > 0).sum() >= MIN_STAMPS:
            return f"{name} grows, but stays the same in {np.count_nonzero(steps == 0)} rows. {repeated_cure(stamps)}"
        if (steps <= 0).all() and (steps < 0).sum() >= MIN_STAMPS and clock_rank(-steps[steps < 0]) == 0:
            return f"{name} falls evenly: if it is the time, sort the rows by it; else {INTERVAL_CURE}."
        back = np.flatnonzero(steps <= 0)
        seldom = 0 < len(back) <= MAX_BACKWARD_SHARE * len(steps) and back[-1] < len(steps) - 1
        apart = seldom and bool(np.all(np.diff(back) > 1)) and not whole_turn(stamps)
        if apart and name.startswith(NAMELESS_PREFIX) and clock_rank(steps[steps > 0]) == 0:
            k = int(back[0])
            return (
                f"{name} grows evenly, but in row {k + 2} goes from {stamps[k]:.15g} to {stamps[k + 1]:.15g} "
                f"({len(back)} such rows): if it is the time, cut the file there, or leave these rows out; else "
                f"{INTERVAL_CURE}."
            )
    return ""
