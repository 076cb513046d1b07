"""Measurement files: one row per sample, as CSV, Parquet or MATLAB file.

Angles in rad, rates in rad/s, times in s, voltages in V after reading, whatever the file used. Rows are counted from 1,
the header not included.

"""

from __future__ import annotations

import math
import os
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from wheelpend.errors import Failure
from wheelpend.files import replacing
from wheelpend.logs.bags import bag_table, is_bag
from wheelpend.logs.checks import check_input_varies, check_time, check_values, log_warnings
from wheelpend.logs.columns import UNIT_CONVERSIONS, WHEEL_PENDULUM, ColumnMap, ColumnTable, find_sources
from wheelpend.logs.log import MAX_SAMPLE_INTERVAL_S, Log, stack_inputs
from wheelpend.logs.tables import Table, check_length, open_table
from wheelpend.logs.unwrap import make_continuous


def load_log(
    path: str | os.PathLike,
    columns: Mapping[str, ColumnMap] | None = None,
    table: ColumnTable = WHEEL_PENDULUM,
) -> Log:
    """Read a measurement file of a plant whose columns are those of ``table``.

    ``columns`` maps our names to the file's where they differ. Angles that wrap and encoders that start again are made
    continuous. Raises Failure when the file cannot be used; what is odd but usable is in the log's ``warnings``.
    """
    path = Path(path)
    file = open_file(path)
    sources, notes = find_sources(path.name, file.names, table, columns or {})
    wanted = sorted({s.column for s in sources.values()}, key=file.names.index)
    held = [sources[n].column for n in (*table.inputs, table.reference) if n in sources]
    numbers = file.read_on_one_clock(wanted, held) if file.read_on_one_clock else file.read(wanted)
    check_length(path.name, len(next(iter(numbers.values()))))
    raw_t = numbers[sources["t"].column]
    check_time(path.name, raw_t)
    scaled = {}
    for name, source in sources.items():  # in place where it can be: an hour's log is not held twice
        values = numbers[source.column]
        scaled[name] = values if source.factor == 1.0 else values * source.factor
    del numbers, scaled["t"]
    for name in table.required[1:]:
        check_values(path.name, name, scaled[name])
    for name in table.inputs:
        check_input_varies(path.name, name, scaled[name], table.units[name])
    for name in (c for c in table.channels if table.units[c] in ("rad", "m")):
        scaled[name], remarks = make_continuous(
            name, scaled[name], raw_t, table.units[name], can_reset=name != table.falls
        )
        notes += remarks
    reference = scaled.get(table.reference, np.array([math.nan])) if table.reference else np.array([math.nan])
    log = Log(
        name=path.name,
        t=(raw_t - raw_t[0]) * sources["t"].factor,  # subtract first: a clock's large offset would cost digits
        voltage=stack_inputs([scaled[name] for name in table.inputs], len(raw_t)),
        measured=np.column_stack([scaled[c] for c in table.channels]),
        channels=table.channels,
        reference=None if np.isnan(reference).all() else reference,
        falls=table.falls,
    )
    return replace(log, warnings=(*notes, *log_warnings(log, table.inputs, sources)))


def open_file(path: Path) -> Table:
    """A file's columns, of a table or of a bag; raises Failure where it is neither."""
    if is_bag(path):
        return bag_table(path)
    return open_table(path)


def save_log(
    path: str | os.PathLike,
    log: Log,
    extra: Mapping[str, np.ndarray] | None = None,
    table: ColumnTable = WHEEL_PENDULUM,
) -> None:
    """Write a log as Parquet (.parquet, .pq) or CSV (any other suffix); ``extra`` holds further (N,) columns.

    The file appears complete or not at all.
    """
    import polars as pl  # imported late: reading a short log needs none of it

    path = Path(path)
    data = {"t": log.t, **dict(zip(table.inputs, log.inputs, strict=False))}
    data |= {c: log.measured[:, k] for k, c in enumerate(log.channels)}
    if log.reference is not None and table.reference:
        data[table.reference] = log.reference
    data.update({name: np.asarray(column) for name, column in (extra or {}).items()})
    for name, column in data.items():
        if len(column) != len(log):
            raise Failure(f"Every column must have {len(log)} values to be saved; {name} has {len(column)}.")
    rows = pl.DataFrame(data).fill_nan(None)
    with replacing(path) as partial:
        if path.suffix in (".parquet", ".pq"):
            rows.write_parquet(partial)
        else:
            rows.write_csv(partial)


def find_time_column(file: Table, likely: str, free: Sequence[str]) -> ColumnMap | None:
    """The column that tells time: the likely one, or else the first that grows from row to row."""
    for name in (*([likely] if likely else []), *free):
        try:
            values = file.read([name])[name]
        except Failure:
            continue
        steps = np.diff(values)
        if len(steps) and np.isfinite(values).all() and (steps > 0).all():
            usual = float(np.median(steps))
            unit = next(
                (u for u in ("s", "ms", "us", "ns") if usual * UNIT_CONVERSIONS[u][1] < MAX_SAMPLE_INTERVAL_S), "ns"
            )
            return ColumnMap(name, unit)
    return None
