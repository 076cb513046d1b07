"""Measurement files and tables in memory: one row per sample, as CSV, Parquet, MATLAB file, DataFrame or arrays.

Angles in rad, rates in rad/s, times in s, voltages in V after reading, whatever the file used. Rows are counted from 1,
the header not included.
"""

from __future__ import annotations

import math
import os
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from wheelpend.errors import Failure
from wheelpend.files import replacing
from wheelpend.logs.bags import bag_table, is_bag
from wheelpend.logs.checks import (
    check_input_acts,
    check_interval_in_memory,
    check_readable_interval,
    check_time,
    check_values,
    log_warnings,
    unit_of_interval,
)
from wheelpend.logs.columns import DEFAULT_TABLE, ROW_NUMBER, ColumnMap, ColumnSource, ColumnTable, find_sources
from wheelpend.logs.commands import held_commands, of_next_row
from wheelpend.logs.log import MAX_SAMPLE_INTERVAL_S, Log, stack_inputs
from wheelpend.logs.noise import noise_of_moving
from wheelpend.logs.recording import cured, seams_of
from wheelpend.logs.smoothed_input import smoothed_input
from wheelpend.logs.sources import LogLike, table_in_memory
from wheelpend.logs.summed_speed import way_and_count
from wheelpend.logs.tables import Table, check_length, open_table, read_file_head, with_row_numbers
from wheelpend.logs.units import UNIT_CONVERSIONS, unit_ending, words_of
from wheelpend.logs.unwrap import make_continuous
from wheelpend.numerics import last_true

CLOCK_UNITS = {"micros": "us", "millis": "ms"}  # units that clocks are called after
MINUTES = (["min"], ["mins"], ["minute"], ["minutes"])  # last words of a column of times
EPOCH_S = (9.5e8, 2.5e9)  # s since 1970, of logs from the year 2000 on
MIN_USUAL_INTERVAL_S = 1e-4  # s between samples, below which a stated unit is doubted
MAX_CLOCK_SPREAD = 0.5  # of a usual interval, by which half of a clock's differ at most
MAX_SPREAD_FROM_BELOW = 0.05  # the same of one that begins below zero, as before a trigger


def load_log(
    source: LogLike,
    columns: Mapping[str, ColumnMap] | None = None,
    table: ColumnTable = DEFAULT_TABLE,
    *,
    name: str = "log",
) -> Log:
    """Make a log of a plant whose columns are those of ``table``, from a file or from what is in memory.

    ``source`` is a path, a DataFrame of pandas or Polars, or a dict of arrays (N,): t [s], strictly increasing, inputs
    and channels in the plant's units, NaN where a value is missing; ``name`` is what a log from memory is called. A Log
    is returned as it is. ``columns`` maps our names to the source's, and units, where they differ. Angles that wrap and
    encoders that start again are made continuous. Raises Failure when the source cannot be used; the log's ``warnings``
    say what is odd about one that can.
    """
    if isinstance(source, Log):
        return source
    if isinstance(source, (str, os.PathLike)):
        path = Path(source)
        return replace(log_of_table(path.name, open_file(path), columns or {}, table), source=path.resolve())
    log = log_of_table(name, table_in_memory(name, source), columns or {}, table)
    check_interval_in_memory(log)
    return log


def log_of_table(log_name: str, file: Table, columns: Mapping[str, ColumnMap], table: ColumnTable) -> Log:
    """The log of a file's columns, or of columns in memory; raises Failure when they cannot be used."""
    file = numbered(file, columns)
    sources, notes = find_sources(log_name, file.names, table, columns, file.units, file.kind)
    raw_t, columns_by_name, empty = read_scaled_columns(log_name, file, sources, table)
    notes += empty_row_notes(empty)
    t = elapsed_seconds(raw_t, sources)
    for name in table.required[1:]:
        check_values(log_name, name, columns_by_name[name])
    speed_noise = sum_speeds(columns_by_name, t, sources)
    for name in table.inputs:
        columns_by_name[name], remarks = held_commands(log_name, name, columns_by_name[name])
        notes += remarks
        if width := sources[name].smooth:
            columns_by_name[name] = smoothed_input(columns_by_name[name], t, width)
        if sources[name].acted_before:
            columns_by_name[name] = of_next_row(columns_by_name[name])
    check_input_acts(log_name, columns_by_name, table)
    seams = seams_of(raw_t, columns_by_name, table)  # before they are made continuous
    notes += unwrap_positions(columns_by_name, raw_t, table, sources)
    for name, source in sources.items():  # not before: an encoder that starts again does so at its own zero
        if source.offset:
            columns_by_name[name] = columns_by_name[name] + source.offset
    check_readable_interval(log_name, t)
    as_read = replace(log_of_columns(log_name, t, columns_by_name, table), speed_noise=speed_noise)
    log = cured(as_read, table, seams)
    faults = [f"{f.sentence} {f.cure}" for f in log.faults]
    return replace(log, warnings=(*faults, *notes, *log_warnings(as_read, table, sources)))


def signals_of_file(
    path: Path, columns: Mapping[str, ColumnMap], table: ColumnTable
) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """Times from the first sample on [s] and signals (N,) of a file as a model reads them, by our names; faults stay.

    Raises Failure where a column is missing or is no number, or the times do not grow.
    """
    file = numbered(open_file(path), columns)
    sources, _ = find_sources(path.name, file.names, table, columns, file.units, file.kind)
    raw_t, signals, _ = read_scaled_columns(path.name, file, sources, table)
    t = elapsed_seconds(raw_t, sources)
    sum_speeds(signals, t, sources)
    for name in (n for n in table.inputs if sources[n].acted_before):
        signals[name] = of_next_row(signals[name])
    unwrap_positions(signals, raw_t, table, sources)
    for name, source in sources.items():
        if source.offset:
            signals[name] = signals[name] + source.offset
    return t, signals


def numbered(file: Table, columns: Mapping[str, ColumnMap]) -> Table:
    """A table with its rows' numbers as a column, where that is what the times are mapped to."""
    return with_row_numbers(file) if "t" in columns and columns["t"].column == ROW_NUMBER else file


class ScaledColumns(NamedTuple):
    """What a file says, as it is stated."""

    raw_t: np.ndarray  # (N,) times in the file's unit
    by_name: dict[str, np.ndarray]  # (N,) of the other columns, in the plant's units and signs, by our names
    empty: np.ndarray  # rows, from 0, in which nothing stands, and which are left out


def read_scaled_columns(
    log: str, file: Table, sources: Mapping[str, ColumnSource], table: ColumnTable
) -> ScaledColumns:
    """The columns that a log is made of, in the plant's units; rows in which nothing stands are left out.

    Raises Failure when the log is too short or its times do not grow.
    """
    factors = sorted({s.times for s in sources.values() if s.times})
    wanted = sorted({*factors, *(s.column for s in sources.values())}, key=file.names.index)
    zero_order_hold = [*factors, *(sources[n].column for n in (*table.inputs, table.reference) if n in sources)]
    numbers = file.read_on_one_clock(wanted, zero_order_hold) if file.read_on_one_clock else file.read(wanted)
    numbers, empty = without_empty_rows(numbers)
    check_length(log, len(next(iter(numbers.values()))))
    raw_t = numbers[sources["t"].column]
    check_time(log, raw_t)
    scaled = {}
    for name, source in sources.items():  # not copied where the factor is 1: an hour's log is not held twice
        values = numbers[source.column]
        scaled[name] = values if source.factor == 1.0 else values * source.factor
        if source.times:
            scaled[name] = scaled[name] * held_factor(log, source.times, numbers[source.times])
    del scaled["t"]
    return ScaledColumns(raw_t, scaled, empty)


def without_empty_rows(columns: dict[str, np.ndarray]) -> tuple[dict[str, np.ndarray], np.ndarray]:
    """Columns (N,) without the rows in which nothing stands, and which rows these were, from 0."""
    first, *others = columns.values()
    empty = np.isnan(first)
    for values in others if empty.any() else ():  # where the first is always there nothing else need be looked at
        empty &= np.isnan(values)
    if not empty.any() or empty.all():
        return columns, np.zeros(0, dtype=np.int64)
    return {name: values[~empty] for name, values in columns.items()}, np.flatnonzero(empty)


def empty_row_notes(empty: np.ndarray) -> list[str]:
    """The sentence that rows were left out in which nothing stood, if there were any."""
    if not len(empty):
        return []
    rows = "1 row in which nothing stands is" if len(empty) == 1 else f"{len(empty)} rows in which nothing stands are"
    return [f"{rows} left out, the first of them row {empty[0] + 1}."]


def held_factor(log: str, column: str, values: np.ndarray) -> np.ndarray:
    """A column (N,) that multiplies another, each value held until the next; before the first one it is missing.

    Raises Failure where a value is infinite or none is there.
    """
    check_values(log, column, values)
    return values[np.maximum(last_true(~np.isnan(values)), 0)]


def elapsed_seconds(raw_t: np.ndarray, sources: Mapping[str, ColumnSource]) -> np.ndarray:
    """Times (N,) [s] from the first sample on, of times in the file's unit."""
    return (raw_t - raw_t[0]) * sources["t"].factor  # subtract first: a clock's large offset would cost digits


def sum_speeds(
    columns_by_name: dict[str, np.ndarray], t: np.ndarray, sources: Mapping[str, ColumnSource]
) -> dict[str, float]:
    """Sum over the times (N,) [s], in place, what is a speed of the place that it is read as; noise of the speeds.

    Not of those that an encoder counted: counts sum to counts.
    """
    noise = {}
    for name in (n for n, source in sources.items() if source.is_speed):
        speed = columns_by_name[name]
        columns_by_name[name], counted = way_and_count(speed, t)
        if not counted:
            noise[name] = noise_of_moving(speed)
    return noise


def unwrap_positions(
    columns_by_name: dict[str, np.ndarray], raw_t: np.ndarray, table: ColumnTable, sources: Mapping[str, ColumnSource]
) -> list[str]:
    """Make the channels that are angles or positions continuous, in place; returns a sentence on each jump found.

    A way whose column is in degrees is that of a shaft, and wraps as an angle does.
    """
    notes = []
    for name in table.places:
        of_shaft = math.isclose(abs(sources[name].factor), math.radians(1.0), rel_tol=1e-6)
        unit = "rad" if of_shaft else table.units[name]
        count = 0.0 if sources[name].is_speed or sources[name].times else sources[name].factor
        columns_by_name[name], remarks = make_continuous(
            name, columns_by_name[name], raw_t, unit, can_reset=name != table.range_channel, count=count
        )
        notes += remarks
    return notes


def log_of_columns(name: str, t: np.ndarray, columns_by_name: Mapping[str, np.ndarray], table: ColumnTable) -> Log:
    """The log of a plant from times [s] and columns (N,); a reference without any value counts as absent."""
    reference = columns_by_name.get(table.reference) if table.reference else None
    return Log(
        name=name,
        t=t,
        voltage=stack_inputs([columns_by_name[n] for n in table.inputs], len(t)),
        measured=np.column_stack([columns_by_name[c] for c in table.channels]),
        channels=table.channels,
        reference=None if reference is None or np.isnan(reference).all() else reference,
        range_channel=table.range_channel,
        rates=table.rates,
    )


def check_file(path: Path) -> None:
    """Raise Failure where a measurement file is missing, empty, a folder that is no bag, or cannot be read."""
    if not is_bag(path):
        read_file_head(path)


def open_file(path: Path) -> Table:
    """The columns of a file that is a table or a bag; raises Failure where it is neither."""
    if is_bag(path):
        return bag_table(path)
    return open_table(path)


def save_log(
    path: str | os.PathLike,
    log: Log,
    extra: Mapping[str, np.ndarray] | None = None,
    table: ColumnTable = DEFAULT_TABLE,
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
    frame = pl.DataFrame(data).fill_nan(None)
    with replacing(path) as partial, partial.open("wb") as file:  # opened here: Polars takes no name that is not UTF-8
        if path.suffix in (".parquet", ".pq"):
            frame.write_parquet(file)
        else:
            frame.write_csv(file)


def find_time_column(file: Table, likely: str, free: Sequence[str]) -> ColumnMap | None:
    """The column of the times, with its unit: the likely one, or else one that grows as a clock does.

    Of those that grow from row to row the first that grows evenly and counts no rows, then one that does, then any.
    What begins below zero is a clock only where it is as even as one, and no other column is called so: a speed that
    comes to rest grows too, and so does a commanded ramp.
    """
    growing: dict[str, tuple[int, np.ndarray]] = {}  # by name: its rank, and its values
    for name in (*([likely] if likely else []), *free):
        try:
            values = file.read([name])[name]
        except Failure:
            continue
        steps = np.diff(values)
        if not (len(steps) and np.isfinite(values).all() and (steps > 0).all()):
            continue
        if values[0] < 0.0 and name != likely and (likely or step_spread(steps) > MAX_SPREAD_FROM_BELOW):
            continue
        growing.setdefault(name, (clock_rank(steps), values))
        if name == likely or growing[name][0] == 0:
            return clock_map(name, values)
    best = min(growing, key=lambda n: growing[n][0], default="")
    return clock_map(best, growing[best][1]) if best else None


def clock_rank(steps: np.ndarray) -> int:
    """How unlike a clock's are steps (N,) that are all positive: 0 of even ones, 1 of a counter's, 2 of any others."""
    if (steps == 1.0).all():
        return 1
    return 0 if step_spread(steps) < MAX_CLOCK_SPREAD else 2


def step_spread(steps: np.ndarray) -> float:
    """By how much half of the steps (N,) of a column that grows differ, over a usual one."""
    low, usual, high = np.quantile(steps, [0.25, 0.5, 0.75])
    return float((high - low) / usual)


def clock_map(name: str, values: np.ndarray) -> ColumnMap:
    """A column of times (N,) with the unit of its name, minutes too, or else of the interval between its samples.

    Stamps since 1970 tell their unit, where that of the name would make a sample of microseconds.
    """
    interval, stated = float(np.median(np.diff(values))), stated_clock_unit(name)
    if not stated and words_of(name)[-1:] in MINUTES:
        return ColumnMap(name, "s", scale=60.0)
    if stated and interval * UNIT_CONVERSIONS[stated][1] < MIN_USUAL_INTERVAL_S:
        sizes = {unit: UNIT_CONVERSIONS[unit][1] for unit in ("s", "ms", "us", "ns")}
        since_1970 = (u for u, size in sizes.items() if EPOCH_S[0] < values[0] * size < EPOCH_S[1])
        stated = next((u for u in since_1970 if interval * sizes[u] <= MAX_SAMPLE_INTERVAL_S), stated)
    return ColumnMap(name, stated or unit_of_interval(interval) or "ns")


def stated_clock_unit(name: str) -> str:
    """The unit of a column of times by its name; nothing where that says none."""
    return CLOCK_UNITS.get(name.lower()) or unit_ending("s", name)
