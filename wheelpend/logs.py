"""Measurement files: one row per sample, as CSV, Parquet or MATLAB file.

Angles in rad, rates in rad/s, times in s, voltages in V after reading, whatever the file used. Rows are counted from 1,
the header not included.
"""

from __future__ import annotations

import difflib
import math
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import NamedTuple

import numpy as np

from wheelpend.bags import bag_table, is_bag
from wheelpend.continuity import continued
from wheelpend.failures import Failure, did_you_mean
from wheelpend.tables import Table, check_length, open_table

CHANNELS = ("theta_w", "theta_p", "dtheta_p")  # of the wheel-driven pendulum
REFERENCE = "theta_ref"
PITCH = "theta_p"  # the angle that must stay within ±π/2
UNITS = {  # unit: (the unit it becomes, factor)
    "rad": ("rad", 1.0),
    "deg": ("rad", math.pi / 180),
    "rev": ("rad", 2 * math.pi),
    "rad/s": ("rad/s", 1.0),
    "deg/s": ("rad/s", math.pi / 180),
    "rev/s": ("rad/s", 2 * math.pi),
    "rpm": ("rad/s", 2 * math.pi / 60),
    "m": ("m", 1.0),
    "mm": ("m", 1e-3),
    "um": ("m", 1e-6),
    "m/s": ("m/s", 1.0),
    "mm/s": ("m/s", 1e-3),
    "s": ("s", 1.0),
    "ms": ("s", 1e-3),
    "us": ("s", 1e-6),
    "ns": ("s", 1e-9),
    "V": ("V", 1.0),
    "mV": ("V", 1e-3),
}
ALIASES = {  # what other people call our columns; only used to propose a mapping
    "t": ("time", "timestamp", "stamp", "sec"),
    "v_in": ("volt", "input", "motor", "command", "u", "vir", "effort", "torque", "force", "current", "pwm", "duty"),
    "theta_w": ("wheel", "encoder", "enc", "position"),
    "dtheta_p": ("gyro", "pitch_rate", "dpitch", "angular_velocity.y", "angular_velocity", "rate"),
    "theta_p": ("pitch", "tilt", "lean", "imu", "pole"),
    "theta_1": ("theta", "angle", "position", "encoder", "q1", "qm", "pos"),
    "theta_2": ("theta2", "angle2", "encoder2", "elbow", "q2"),
    "x": ("pos", "position", "cart", "slide", "axis", "qm"),
}
SHORTEST_SEGMENT = 5  # samples
ENOUGH, PIECES = 400_000, 8  # samples, in so many pieces, that tell of a long log's noise and interval
SLOW = 0.5  # s, beyond which samples are too far apart to be those of a log
GAP = 5.0  # an interval this many times the median one is a gap


@dataclass(frozen=True)
class ColumnMap:
    """Where a log keeps a quantity: name of its column, unit, and the sign that turns it our way."""

    column: str
    unit: str = ""  # one of UNITS; empty means the quantity's own
    sign: int = 1  # -1 where the log counts the other way
    scale: float = 1.0  # by which a column is multiplied that is in no such unit: rad per count, V per duty

    def __post_init__(self) -> None:
        if self.unit and self.unit not in UNITS:
            hint = did_you_mean(self.unit, UNITS)
            raise Failure(f"No unit named '{self.unit}'. Known units: {', '.join(UNITS)}.{hint}")
        if self.sign not in (1, -1):
            raise Failure(f"sign must be 1 or -1, not {self.sign}.")
        if not (math.isfinite(self.scale) and self.scale > 0):
            raise Failure(f"scale must be a positive number, not {self.scale}; sign = -1 turns a column round.")


@dataclass(frozen=True)
class ColumnTable:
    """The columns that the logs of a plant have, by our names."""

    input: str  # empty where nothing drives the plant
    channels: tuple[str, ...]
    units: Mapping[str, str]  # of t, the input, the channels and the reference
    reference: str = ""  # column of what was commanded; empty where nothing is
    falls: str = ""  # channel that must stay within ±π/2
    further: tuple[str, ...] = ()  # inputs beside the first

    @property
    def inputs(self) -> tuple[str, ...]:
        """Columns of all inputs."""
        return (*((self.input,) if self.input else ()), *self.further)

    @property
    def needed(self) -> tuple[str, ...]:
        """Columns without which a log cannot be used."""
        return ("t", *self.inputs, *self.channels)

    @property
    def names(self) -> tuple[str, ...]:
        """Every column that is read where a log has it."""
        return (*self.needed, *((self.reference,) if self.reference else ()))


WHEEL_PENDULUM = ColumnTable(
    "v_in",
    CHANNELS,
    {"t": "s", "v_in": "V", "theta_w": "rad", "theta_p": "rad", "dtheta_p": "rad/s", REFERENCE: "rad"},
    REFERENCE,
    PITCH,
)


@dataclass(frozen=True, eq=False)
class Log:
    """A measured or simulated log; t grows strictly and starts at 0 for a whole log."""

    name: str  # file name, for messages
    t: np.ndarray  # (N,) s, from the first sample
    voltage: np.ndarray  # (N,) V commanded, held until the next sample, (N, inputs) of several; NaN where not logged
    measured: np.ndarray  # (N, channels), NaN where a sensor gave no value
    channels: tuple[str, ...]  # column names of measured
    reference: np.ndarray | None = None  # (N,) rad, commanded pitch
    warnings: tuple[str, ...] = ()  # what is odd about the file, for people
    falls: str = PITCH  # channel that must stay within ±π/2, where the log has it

    def __len__(self) -> int:
        """Count the samples."""
        return len(self.t)

    @property
    def inputs(self) -> np.ndarray:
        """Each input by itself (inputs, N)."""
        return self.voltage.reshape(len(self), -1).T

    @cached_property
    def dt(self) -> float:
        """Median sample interval [s]."""
        return float(np.median(np.diff(self.t[:ENOUGH])))

    @property
    def duration(self) -> float:
        """Time from the first sample to the last [s]."""
        return float(self.t[-1] - self.t[0])

    def excerpt(self) -> Log:
        """Pieces from all over a long log, a missing sample between them; a shorter one as it is."""
        if len(self) <= ENOUGH:
            return self
        length = ENOUGH // PIECES
        begins = np.arange(PIECES) * (len(self) - length) // (PIECES - 1)
        places = (begins[:, None] + np.arange(length)).ravel()
        measured = self.measured[places]
        measured[::length] = np.nan
        reference = None if self.reference is None else self.reference[places]
        return replace(self, t=self.t[places], voltage=self.voltage[places], measured=measured, reference=reference)

    def part(self, first: int, last: int) -> Log:
        """Samples first to last - 1, with t still counted from the start of the whole log."""
        cut = slice(first, last)
        return replace(
            self,
            t=self.t[cut],
            voltage=self.voltage[cut],
            measured=self.measured[cut],
            reference=None if self.reference is None else self.reference[cut],
        )


class Source(NamedTuple):
    """A column of a file and the factor that brings it to our unit and sign."""

    column: str
    factor: float


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
    numbers = file.on_one_clock(wanted, held) if file.on_one_clock else file.read(wanted)
    check_length(path.name, len(next(iter(numbers.values()))))
    raw_t = numbers[sources["t"].column]
    check_time(path.name, raw_t)
    scaled = {}
    for name, source in sources.items():  # in place where it can be: an hour's log is not held twice
        values = numbers[source.column]
        scaled[name] = values if source.factor == 1.0 else values * source.factor
    del numbers, scaled["t"]
    for name in table.needed[1:]:
        check_values(path.name, name, scaled[name])
    for name in table.inputs:
        check_moves(path.name, name, scaled[name], table.units[name])
    for name in (c for c in table.channels if table.units[c] in ("rad", "m")):
        scaled[name], remarks = continued(
            name, scaled[name], raw_t, table.units[name], starts_again=name != table.falls
        )
        notes += remarks
    reference = scaled.get(table.reference, np.array([math.nan])) if table.reference else np.array([math.nan])
    log = Log(
        name=path.name,
        t=(raw_t - raw_t[0]) * sources["t"].factor,  # subtract first: a clock's large offset would cost digits
        voltage=side_by_side([scaled[name] for name in table.inputs], len(raw_t)),
        measured=np.column_stack([scaled[c] for c in table.channels]),
        channels=table.channels,
        reference=None if np.isnan(reference).all() else reference,
        falls=table.falls,
    )
    return replace(log, warnings=(*notes, *oddities(log, table.inputs, sources)))


def side_by_side(inputs: Sequence[np.ndarray], samples: int) -> np.ndarray:
    """Inputs as a log has them: zeros (N,) of none, (N,) of one, (N, inputs) of several."""
    if len(inputs) < 2:
        return inputs[0] if inputs else np.zeros(samples)
    return np.column_stack(inputs)


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
    beside = path.with_name(f".{path.name}.{os.getpid()}.partial")
    try:
        if path.suffix in (".parquet", ".pq"):
            rows.write_parquet(beside)
        else:
            rows.write_csv(beside)
        os.replace(beside, path)
    except OSError as error:
        raise Failure(f"{path} cannot be written: {error.strerror or error}.") from error
    finally:
        beside.unlink(missing_ok=True)


def segment_bounds(log: Log, horizon_s: float, start: int = 0, stop: int | None = None) -> np.ndarray:
    """Cut a log into consecutive segments that can each be simulated: (n, 2) int, half-open sample ranges.

    A segment is ``horizon_s`` seconds long but has at least 5 samples; the next one begins at the sample after its
    last. None contains a gap, a sample without input, or one with the body beyond ±π/2. What is left over at the end of
    a stretch becomes a segment of its own, unless it is shorter than 5 samples or a fifth of the horizon.
    """
    if not (math.isfinite(horizon_s) and horizon_s > 0):
        raise Failure(f"The horizon must be a positive time in s, not {horizon_s}.")
    dt = log.dt
    # The sample nearest to the end of the horizon begins the next segment; just under a half, so that ties are stable.
    length = horizon_s - 0.49 * dt
    shortest = max(SHORTEST_SEGMENT, math.ceil(horizon_s / (5 * dt) - 1e-6))
    bounds = []
    for begin, end in stretches(log, start, len(log) if stop is None else stop):
        first = begin
        while end - first >= shortest:
            following = int(np.searchsorted(log.t, log.t[first] + length))
            last = min(max(following, first + SHORTEST_SEGMENT), end)
            bounds.append((first, last))
            first = last
    return np.array(bounds, dtype=np.int64).reshape(-1, 2)


def stretches(log: Log, start: int, stop: int) -> list[tuple[int, int]]:
    """Ranges of usable samples between start and stop, each without a gap."""
    pieces = [(a, min(a + ENOUGH, stop)) for a in range(start, stop, ENOUGH)]  # a long log is not held twice for this
    if not pieces:
        return []
    usable = np.concatenate([_usable(log, a, b) for a, b in pieces])
    near = np.concatenate([np.diff(log.t[a : b + 1]) <= GAP * log.dt for a, b in pieces])[: len(usable) - 1]
    joined = usable[1:] & usable[:-1] & near
    begins = np.flatnonzero(usable & ~np.concatenate(([False], joined)))
    ends = np.flatnonzero(usable & ~np.concatenate((joined, [False]))) + 1
    return [(start + int(a), start + int(b)) for a, b in zip(begins, ends, strict=True)]


def _usable(log: Log, start: int, stop: int) -> np.ndarray:
    """Which samples of a range have an input and the body within ±π/2."""
    known = ~np.isnan(log.voltage[start:stop].reshape(stop - start, -1)).any(axis=1)
    if log.falls in log.channels:
        known &= ~(np.abs(log.measured[start:stop, log.channels.index(log.falls)]) > math.pi / 2)
    return known


# ---- finding columns


def find_sources(
    log: str, names: Sequence[str], table: ColumnTable, columns: Mapping[str, ColumnMap]
) -> tuple[dict[str, Source], list[str]]:
    """Where each quantity is in a file, with remarks; raises Failure when one that is needed is not there."""
    sources, notes = {}, []
    for name in table.names:
        mapped = columns.get(name)
        if mapped and mapped.column in names:
            known = factor(name, mapped.unit, table.units[name])
            sources[name] = Source(mapped.column, mapped.sign * mapped.scale * known)
        elif name in names:
            sources[name] = Source(name, 1.0)
            if mapped:
                notes.append(f"[columns] maps {name} to '{mapped.column}', which is not in the file; '{name}' is read.")
    absent = [n for n in table.needed if n not in sources]
    if absent:
        raise Failure(missing_columns(log, names, absent, {s.column for s in sources.values()}, table.units))
    return sources, notes


def factor(name: str, unit: str, own: str) -> float:
    """Factor from a unit to a quantity's own; raises Failure when the quantity cannot have that unit."""
    becomes, value = UNITS[unit] if unit else (own, 1.0)
    if own != becomes:
        fitting = ", ".join(u for u, (base, _) in UNITS.items() if base == own)
        raise Failure(f"[columns] {name} must have a unit that turns into {own} ({fitting}), not '{unit}'.")
    return value


def missing_columns(log: str, names: Sequence[str], absent: list[str], used: set[str], units: Mapping[str, str]) -> str:
    """Message that says what is there and how to map it."""
    guesses = guessed_columns([n for n in names if n not in used], absent)
    lines = [
        f'{name} = {{ column = "{guesses[name] or "..."}"{unit_part(units[name], guesses[name])} }}' for name in guesses
    ]
    what = f"the column {absent[0]} is" if len(absent) == 1 else f"the columns {', '.join(absent)} are"
    return (
        f"{log}: {what} missing. The file has: {', '.join(names)}. "
        "If they are there under another name, say so in model.toml:\n\n[columns]\n" + "\n".join(lines)
    )


def guess_column(name: str, free: Sequence[str]) -> str:
    """The unused column that is most likely meant, or nothing."""
    for alias in ALIASES.get(name, ()):
        for column in free:
            if column.lower() == alias or (len(alias) > 2 and alias in column.lower()):
                return column
    return next(iter(difflib.get_close_matches(name, free, 1)), "")


def unit_part(own: str, column: str) -> str:
    """The unit of a column as a part of its entry; nothing where the unit is none that turns into others."""
    unit = guess_unit(own, column)
    return f', unit = "{unit}"' if unit else ""


def guessed_columns(free: Sequence[str], wanted: Sequence[str]) -> dict[str, str]:
    """The unused column that is most likely meant by each name, or nothing; none is meant twice."""
    left, found = list(free), {}
    for name in sorted(wanted, key=lambda n: -len(n)):  # dtheta_p before theta_p: a pitch rate is also called pitch
        found[name] = guess_column(name, left)
        left = [n for n in left if n != found[name]]
    return found


def guessed_map(path: Path, columns: Mapping[str, ColumnMap], table: ColumnTable) -> dict[str, ColumnMap]:
    """Where a file may have what it has under no name that is known; raises Failure where it cannot be read.

    By name, with the unit that a name ends with; time also as the first column that grows from row to row, in the unit
    in which its samples are as far apart as those of a log are.
    """
    path = Path(path)
    file = open_file(path)
    known = {n: columns[n].column if n in columns else n for n in table.names}
    absent = [n for n in table.needed if known[n] not in file.names and n not in file.names]
    free = [n for n in file.names if n not in known.values()]
    found = {n: ColumnMap(c, guess_unit(table.units[n], c)) for n, c in guessed_columns(free, absent).items() if c}
    if "t" in absent and (clock := find_clock(file, found["t"].column if "t" in found else "", free)):
        found["t"] = clock
    return {n: c if c.unit != table.units[n] else replace(c, unit="") for n, c in found.items()}


def find_clock(file: Table, likely: str, free: Sequence[str]) -> ColumnMap | None:
    """The column that tells time: the likely one, or else the first that grows from row to row."""
    for name in (*([likely] if likely else []), *free):
        try:
            values = file.read([name])[name]
        except Failure:
            continue
        steps = np.diff(values)
        if len(steps) and np.isfinite(values).all() and (steps > 0).all():
            usual = float(np.median(steps))
            unit = next((u for u in ("s", "ms", "us", "ns") if usual * UNITS[u][1] < SLOW), "ns")
            return ColumnMap(name, unit)
    return None


def guess_unit(own: str, column: str) -> str:
    """The unit that a column's name ends with, or else the quantity's own."""
    ending = column.lower().replace("_per_s", "/s").replace("dps", "deg/s").replace("[", "_").rstrip("])")
    endings = {u: (f"_{u.lower()}", f"({u.lower()}") for u, (base, _) in UNITS.items() if base == own}
    fitting = [u for u, known in endings.items() if ending.endswith(known)]
    return max(fitting, key=len, default=own if own in UNITS else "")


# ---- checks


def check_time(log: str, t: np.ndarray) -> None:
    """Raise Failure unless every sample has a finite time, later than the one before."""
    unknown = np.flatnonzero(~np.isfinite(t))
    if len(unknown):
        raise Failure(f"{log}: every sample needs its time; row {unknown[0] + 1} of t has none. Remove such rows.")
    backward = np.flatnonzero(np.diff(t) <= 0)
    if len(backward):
        k = int(backward[0])
        raise Failure(
            f"{log}: t must grow from row to row, but row {k + 2} has {t[k + 1]:.15g} after {t[k]:.15g} in row {k + 1} "
            f"({len(backward)} such rows). Sort the rows and remove repeated ones."
        )


def check_values(log: str, name: str, values: np.ndarray) -> None:
    """Raise Failure when a column has an infinite value or none at all."""
    infinite = np.flatnonzero(np.isinf(values))
    if len(infinite):
        raise Failure(
            f"{log}: values must be finite; row {infinite[0] + 1} of {name} is infinite. Leave the cell "
            "empty where the sensor gave no value."
        )
    if np.isnan(values).all():
        raise Failure(f"{log}: {name} has no values at all. It must be measured, at least now and then.")


def check_moves(log: str, input: str, voltage: np.ndarray, unit: str) -> None:
    """Raise Failure when the input never changes: nothing can be learnt from it."""
    lowest = np.nanmin(voltage)
    if lowest == np.nanmax(voltage):
        raise Failure(
            f"{log}: {input} must vary for anything to be learnt, but it is {lowest:g} {unit} throughout. "
            "Record a log in which the motors work."
        )


def oddities(log: Log, inputs: Sequence[str], sources: Mapping[str, Source]) -> list[str]:
    """Sentences on what is unusual about a usable log."""
    return [*odd_times(log), *odd_pitch(log, sources), *odd_channels(log, inputs)]


def odd_times(log: Log) -> list[str]:
    """Gaps, and a sample interval that looks like another unit."""
    found = []
    interval, dt = np.diff(log.t), log.dt
    gaps = np.flatnonzero(interval > GAP * dt)
    if len(gaps):
        k = int(gaps[np.argmax(interval[gaps])])
        count = "1 gap" if len(gaps) == 1 else f"{len(gaps)} gaps"
        found.append(f"{count} in the sampling, the longest {interval[k]:.3g} s after t = {log.t[k]:.6g} s.")
    if dt > 0.5:  # no robot balances on so few samples
        found.append(f'Samples are {dt:.3g} s apart; if t is in ms, map it: t = {{ column = "t", unit = "ms" }}.')
    return found


def odd_pitch(log: Log, sources: Mapping[str, Source]) -> list[str]:
    """A pitch that looks like degrees, or a robot that fell over."""
    name = log.falls
    if name not in log.channels:
        return []
    pitch = np.abs(log.measured[:, log.channels.index(name)])
    fallen = np.flatnonzero(pitch > math.pi / 2)
    found = []
    if np.nanmax(pitch) > 3.2:
        found.append(
            f"{name} reaches {np.nanmax(pitch):.3g} rad and looks like degrees; if it is, map it in model.toml: "
            f'{name} = {{ column = "{sources[name].column}", unit = "deg" }}.'
        )
    if len(fallen):
        share = 100 * len(fallen) / len(pitch)
        found.append(
            f"{name} is beyond ±π/2 from t = {log.t[fallen[0]]:.6g} s: the robot fell over. "
            f"Those samples ({share:.2g} %) are left out."
        )
    return found


def odd_channels(log: Log, inputs: Sequence[str]) -> list[str]:
    """Missing cells and channels that never change."""
    found = []
    driven = zip(inputs, log.inputs, strict=False)
    for name, values in (*driven, *zip(log.channels, log.measured.T, strict=True)):
        missing = int(np.isnan(values).sum())
        if missing:
            share = 100 * missing / len(values)
            found.append(f"{name} is missing in {missing} of {len(values)} samples ({share:.2g} %).")
        if np.nanmin(values) == np.nanmax(values):
            found.append(f"{name} is {np.nanmin(values):g} throughout: this sensor says nothing.")
    return found
