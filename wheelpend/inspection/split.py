"""A log's stretch held out: one file with it, that judges, and one with the rest, to be fitted to."""

from __future__ import annotations

import csv
import io
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from wheelpend.errors import Failure
from wheelpend.files import write_text
from wheelpend.inspection.file_values import numeric_columns
from wheelpend.logs.bags import is_bag
from wheelpend.logs.columns import ColumnMap
from wheelpend.logs.read import find_time_column, numbered, open_file
from wheelpend.logs.tables import MIN_LOG_SAMPLES
from wheelpend.logs.units import UNIT_CONVERSIONS

ROUNDED_SHARE = 1e-3  # of a sample interval, within which a sample is where a stretch begins or ends


class SplitLog(NamedTuple):
    """The two files of a log, and the stretch that was held out."""

    log: Path
    rest: Path
    held_out: Path
    begin_s: float
    end_s: float
    samples: tuple[int, int]  # of the rest and of what is held out
    left_out: tuple[str, ...]  # columns that hold no numbers

    def to_json(self) -> dict[str, Any]:
        """The files and the stretch under the keys of JSON."""
        return {
            "log": str(self.log),
            "rest": str(self.rest),
            "held_out": str(self.held_out),
            "from_s": self.begin_s,
            "to_s": self.end_s,
            "samples": {"rest": self.samples[0], "held_out": self.samples[1]},
            "left_out": list(self.left_out),
        }


def split_paths(log: Path, begin_s: float, end_s: float, folder: Path) -> tuple[Path, Path]:
    """The files of the rest and of what is held out, in a folder; their names say which stretch it is."""
    stretch = f"{begin_s:g}-{end_s:g}s"
    return folder / f"{log.stem}_without_{stretch}.csv", folder / f"{log.stem}_{stretch}.csv"


def split_log(log: Path, begin_s: float, end_s: float, folder: Path, stated: ColumnMap | None = None) -> SplitLog:
    """Write a log's samples from ``begin_s`` up to ``end_s`` [s after its first] and all others as two CSV files.

    Columns keep their names, units and numbers, so that a model reads both files as it reads the log; the rest has a
    gap where the stretch was. ``stated`` is how the model reads times. Raises Failure where the log has no column of
    times or several clocks, and where either file would have too few samples.
    """
    if not begin_s < end_s:
        raise Failure(f"A stretch must end after it begins, but it is from {begin_s:g} to {end_s:g} s. Name another.")
    if is_bag(log):
        raise Failure(
            f"{log.name} must be a table with one clock to be split, but it holds messages, each kind with its own. "
            "Save its signals as one table, or record what is to be held out apart."
        )
    file = open_file(log) if stated is None else numbered(open_file(log), {"t": stated})
    columns = numeric_columns(log, file)
    likely = stated.column if stated is not None and stated.column in columns else ""
    clock = find_time_column(file, likely, list(columns))
    if clock is None:
        raise Failure(f"{log.name}: a column must grow as a clock does to say which samples are in the stretch, but "
                      "none does. Add the times, in s.")  # fmt: skip
    if stated is not None and clock.column == likely:  # a scale is of the column as it is
        clock = replace(stated, unit=stated.unit or ("" if stated.scale != 1.0 else clock.unit))
    t = columns[clock.column]
    seconds = clock.scale * (UNIT_CONVERSIONS[clock.unit][1] if clock.unit else 1.0) * (t - t[0])
    rounding = ROUNDED_SHARE * float(np.median(np.diff(seconds)))
    inside = (seconds >= begin_s - rounding) & (seconds < end_s - rounding)
    samples = int(np.sum(~inside)), int(np.sum(inside))
    if min(samples) < MIN_LOG_SAMPLES:
        raise Failure(
            f"{log.name}: {MIN_LOG_SAMPLES} samples must be held out, and as many left, but from {begin_s:g} to "
            f"{end_s:g} s of its {seconds[-1]:g} s there are {samples[1]}, and {samples[0]} elsewhere. "
            "Name another stretch."
        )
    rest, held_out = split_paths(log, begin_s, end_s, folder)
    write_text(rest, csv_text(columns, ~inside, file.units))
    write_text(held_out, csv_text(columns, inside, file.units))
    left_out = tuple(name for name in file.names if name not in columns)
    return SplitLog(log, rest, held_out, begin_s, end_s, samples, left_out)


def csv_text(columns: Mapping[str, np.ndarray], chosen: np.ndarray, units: Mapping[str, str]) -> str:
    """The chosen rows (mask (N,)) of columns as CSV, with the row of units of a file that has one; NaN is empty."""
    import polars as pl  # imported late: no other inspection needs it

    head = io.StringIO()
    lines = csv.writer(head, lineterminator="\n")
    lines.writerow(columns)
    if units:
        lines.writerow([units.get(name, "") for name in columns])
    rows = pl.DataFrame({name: values[chosen] for name, values in columns.items()}).fill_nan(None)
    return head.getvalue() + rows.write_csv(include_header=False)
