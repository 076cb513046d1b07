"""The numbers of a file's columns, read at once, and made ready to be compared: in SI units, no spikes, no wraps."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy.ndimage import median_filter

from wheelpend.errors import BadCell, Failure
from wheelpend.inspection.column_names import is_command, is_no_place, kind_by_name, stated_factor
from wheelpend.logs.log import Log
from wheelpend.logs.noise import find_quantum
from wheelpend.logs.outliers import MAX_SPIKE_SAMPLES, MAX_SPIKE_SHARE, find_outliers, without_outliers
from wheelpend.logs.tables import Table
from wheelpend.logs.unwrap import TURNS, overflowing_count, unwrapped, whole_turn

MAX_STEP_SHARE = 0.3  # of its range, by which a place moves from sample to sample at most
TURN_TOLERANCE = 0.25  # of a turn, by which a wrapped angle's jump may differ from one
MIN_MEDIAN_RATIO = 8.0  # of a spike's distance from the running median to the usual one: 5.6 σ of white noise


def numeric_columns(path: Path, file: Table) -> dict[str, np.ndarray]:
    """The columns (N,) of a file that hold numbers, all of one length; raises Failure where none does."""
    read = (lambda names: file.read_on_one_clock(names, [])) if file.read_on_one_clock else file.read
    try:
        return read(list(file.names))
    except Failure:
        found, reason = [], ""
    for name in file.names:
        try:
            file.read([name])
        except Failure as failure:  # text, which no quantity is
            reason = reason or str(failure)
        else:
            found.append(name)
    if not found:
        raise Failure(f"{path.name}: at least the time and one column beside it must hold numbers, and no column does. "
                      f"{reason}")  # fmt: skip
    return read(found)


def unread_columns(file: Table, read: Collection[str]) -> tuple[dict[str, str], list[str]]:
    """Columns besides those read: those of numbers, with a sentence on the cell that is to blame, and those of text."""
    broken, text = {}, []
    for name in (n for n in file.names if n not in read):
        try:
            file.read([name])
        except BadCell as failure:
            broken[name] = f"{failure} The whole column is left out: mend or remove that row."
        except Failure:  # no numbers at all
            text.append(name)
    return broken, text


def moving_columns(path: Path, values: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    """The columns (N,) that change; raises Failure where none does."""
    found = {n: v for n, v in values.items() if np.isfinite(v).any() and np.nanmin(v) < np.nanmax(v)}
    if found:
        return found
    still = ", ".join(f"{n} is {v[np.isfinite(v)][0]:g}" if np.isfinite(v).any() else f"{n} has no values"
                      for n, v in values.items())  # fmt: skip
    what = f"{still} throughout" if still else "there is none"
    raise Failure(
        f"{path.name}: a column beside the time must vary for anything to be learnt, but {what}. Record a log in which "
        "the machine is driven and moves, and check that its sensors are connected."
    )


def analysed(name: str, t: np.ndarray, values: Mapping[str, np.ndarray]) -> Log:
    """A log of columns (N,) at times (N,) [s] for analysis: in SI units by their names, without spikes and wraps."""
    columns = [
        v * stated_factor(n) if is_no_place(n) else continuous(v * stated_factor(n), None if is_command(n) else v)
        for n, v in values.items()
    ]
    log = Log(name, t, np.zeros(len(t)), np.column_stack(columns), tuple(values), rates={})
    places = [n for n in values if kind_by_name(n) in ("", "position")]  # their spikes may last two samples
    found = find_outliers(log, [find_quantum(c) for c in columns], places)
    log = without_outliers(log, found._replace(jumps=()))
    return replace(log, measured=np.column_stack([without_rest(c) for c in log.measured.T]))


def without_rest(values: np.ndarray) -> np.ndarray:
    """A signal (N,) without the spikes that stand close together: what is far from its running median, if little is.

    Its ends go on: mirrored, the first row of what sets out would be far from the median.
    """
    known = np.flatnonzero(np.isfinite(values))
    off = np.abs(values[known] - median_filter(values[known], 2 * MAX_SPIKE_SAMPLES + 1, mode="nearest"))
    far = off > MIN_MEDIAN_RATIO * np.mean(off)
    if np.mean(far) > MAX_SPIKE_SHARE:
        return values
    result = values.copy()
    result[known[far]] = np.nan
    return result


def continuous(values: np.ndarray, counts: np.ndarray | None = None) -> np.ndarray:
    """A signal (N,) without the jumps by a turn of a wrapped angle, in rad or in degrees, or of a counter's overflow.

    Any other as it is. A wrapped angle is within a turn, but for its rounding; ``counts`` (N,) are the signal's as they
    stand in the file.
    """
    known = np.flatnonzero(np.isfinite(values))
    steps = np.abs(np.diff(values[known]))
    jumps = steps[steps > MAX_STEP_SHARE * np.ptp(values[known])]
    for turn in TURNS:
        within = np.ptp(values[known]) <= (1.0 + TURN_TOLERANCE) * turn
        if jumps.size and within and bool(np.all(np.abs(jumps - turn) < TURN_TOLERANCE * turn)):
            return unwrapped(values, turn)
    turn = whole_turn(values)
    if turn:
        return unwrapped(values, turn)
    if counts is None or not (full := overflowing_count(counts)):
        return values
    return unwrapped(values, full * float(np.ptp(values[known]) / np.ptp(counts[known])))
