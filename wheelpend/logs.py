"""Measurement files: one header row, then one row per sample, as CSV or Parquet.

Angles in rad, rates in rad/s, times in s, voltages in V after reading, whatever the file used. Rows are counted from 1,
the header not included.
"""

from __future__ import annotations

import csv
import difflib
import math
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
import polars as pl

from wheelpend.failures import Failure, did_you_mean

CHANNELS = ("theta_w", "theta_p", "dtheta_p")
REFERENCE = "theta_ref"
PITCH = "theta_p"  # the angle that must stay within ±π/2
MISSING = ("", "nan", "NaN", "NAN", "NA", "N/A", "null", "None", "-nan")
UNITS = {  # unit: (the unit it becomes, factor)
    "rad": ("rad", 1.0),
    "deg": ("rad", math.pi / 180),
    "rev": ("rad", 2 * math.pi),
    "rad/s": ("rad/s", 1.0),
    "deg/s": ("rad/s", math.pi / 180),
    "rev/s": ("rad/s", 2 * math.pi),
    "rpm": ("rad/s", 2 * math.pi / 60),
    "s": ("s", 1.0),
    "ms": ("s", 1e-3),
    "us": ("s", 1e-6),
    "V": ("V", 1.0),
    "mV": ("V", 1e-3),
}
OWN_UNITS = {"v_": "V", "theta": "rad", "dtheta": "rad/s"}  # by how a quantity's name begins
ALIASES = {  # what other people call our columns; only used to propose a mapping
    "t": ("time", "timestamp", "stamp", "sec"),
    "v_in": ("volt", "input", "motor", "command", "u"),
    "theta_w": ("wheel", "encoder", "enc"),
    "dtheta_p": ("gyro", "rate", "pitch_rate", "dpitch"),
    "theta_p": ("pitch", "tilt", "lean", "imu"),
}
SHORTEST_LOG = 20  # samples
SHORTEST_SEGMENT = 5  # samples
GAP = 5.0  # an interval this many times the median one is a gap


@dataclass(frozen=True)
class ColumnMap:
    """Where a log keeps a quantity: name of its column, unit, and the sign that turns it our way."""

    column: str
    unit: str = ""  # one of UNITS; empty means the quantity's own
    sign: int = 1  # -1 where the log counts the other way

    def __post_init__(self) -> None:
        if self.unit and self.unit not in UNITS:
            hint = did_you_mean(self.unit, UNITS)
            raise Failure(f"No unit named '{self.unit}'. Known units: {', '.join(UNITS)}.{hint}")
        if self.sign not in (1, -1):
            raise Failure(f"sign must be 1 or -1, not {self.sign}.")


@dataclass(frozen=True, eq=False)
class Log:
    """A measured or simulated log; t grows strictly and starts at 0 for a whole log."""

    name: str  # file name, for messages
    t: np.ndarray  # (N,) s, from the first sample
    voltage: np.ndarray  # (N,) V commanded, held until the next sample; NaN where it was not logged
    measured: np.ndarray  # (N, channels), NaN where a sensor gave no value
    channels: tuple[str, ...]  # column names of measured
    reference: np.ndarray | None = None  # (N,) rad, commanded pitch
    warnings: tuple[str, ...] = ()  # what is odd about the file, for people

    def __len__(self) -> int:
        """Count the samples."""
        return len(self.t)

    @property
    def dt(self) -> float:
        """Median sample interval [s]."""
        return float(np.median(np.diff(self.t)))

    @property
    def duration(self) -> float:
        """Time from the first sample to the last [s]."""
        return float(self.t[-1] - self.t[0])

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
    channels: Sequence[str] = CHANNELS,
    input: str = "v_in",
) -> Log:
    """Read a measurement file.

    ``columns`` maps our names to the file's where they differ. Raises Failure when the file cannot be used; what is odd
    but usable is in the log's ``warnings``.
    """
    path = Path(path)
    parquet = is_parquet(path)
    separator = "" if parquet else find_separator(path)
    names = parquet_names(path) if parquet else csv_names(path, separator)
    sources, notes = find_sources(path.name, names, ("t", input, *channels), columns or {})
    wanted = sorted({s.column for s in sources.values()}, key=names.index)
    table = read_parquet(path, wanted) if parquet else read_csv(path, names, wanted, separator)
    numbers = {c: to_numbers(path.name, table[c]) for c in wanted}
    check_length(path.name, table.height)
    raw_t = numbers[sources["t"].column]
    check_time(path.name, raw_t)
    scaled = {name: numbers[s.column] * s.factor for name, s in sources.items() if name != "t"}
    for name in (input, *channels):
        check_values(path.name, name, scaled[name])
    check_moves(path.name, input, scaled[input])
    reference = scaled.get(REFERENCE, np.array([math.nan]))
    log = Log(
        name=path.name,
        t=(raw_t - raw_t[0]) * sources["t"].factor,  # subtract first: a clock's large offset would cost digits
        voltage=scaled[input],
        measured=np.column_stack([scaled[c] for c in channels]),
        channels=tuple(channels),
        reference=None if np.isnan(reference).all() else reference,
    )
    return replace(log, warnings=(*notes, *oddities(log, input, sources)))


def save_log(
    path: str | os.PathLike, log: Log, extra: Mapping[str, np.ndarray] | None = None, input: str = "v_in"
) -> None:
    """Write a log as Parquet (.parquet, .pq) or CSV (any other suffix); ``extra`` holds further (N,) columns.

    The file appears complete or not at all.
    """
    path = Path(path)
    data = {"t": log.t, input: log.voltage, **{c: log.measured[:, k] for k, c in enumerate(log.channels)}}
    if log.reference is not None:
        data[REFERENCE] = log.reference
    data.update({name: np.asarray(column) for name, column in (extra or {}).items()})
    for name, column in data.items():
        if len(column) != len(log):
            raise Failure(f"Every column must have {len(log)} values to be saved; {name} has {len(column)}.")
    table = pl.DataFrame(data).fill_nan(None)
    beside = path.with_name(f".{path.name}.{os.getpid()}.partial")
    try:
        if path.suffix in (".parquet", ".pq"):
            table.write_parquet(beside)
        else:
            table.write_csv(beside)
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
    following = np.searchsorted(log.t, log.t + (horizon_s - 0.49 * dt))
    np.maximum(following, np.arange(len(log)) + SHORTEST_SEGMENT, out=following)
    shortest = max(SHORTEST_SEGMENT, math.ceil(horizon_s / (5 * dt) - 1e-6))
    bounds = []
    for begin, end in stretches(log, start, len(log) if stop is None else stop):
        first = begin
        while end - first >= shortest:
            last = min(int(following[first]), end)
            bounds.append((first, last))
            first = last
    return np.array(bounds, dtype=np.int64).reshape(-1, 2)


def stretches(log: Log, start: int, stop: int) -> list[tuple[int, int]]:
    """Ranges of usable samples between start and stop, each without a gap."""
    usable = ~np.isnan(log.voltage[start:stop])
    if PITCH in log.channels:
        usable &= ~(np.abs(log.measured[start:stop, log.channels.index(PITCH)]) > math.pi / 2)
    if not usable.any():
        return []
    interval = np.diff(log.t[start:stop])
    joined = usable[1:] & usable[:-1] & (interval <= GAP * log.dt)
    begins = np.flatnonzero(usable & ~np.concatenate(([False], joined)))
    ends = np.flatnonzero(usable & ~np.concatenate((joined, [False]))) + 1
    return [(start + int(a), start + int(b)) for a, b in zip(begins, ends, strict=True)]


# ---- reading


def is_parquet(path: Path) -> bool:
    """Look into a file; raises Failure when it is not there, empty, or neither text nor Parquet."""
    try:
        with path.open("rb") as file:
            head = file.read(4096)
    except FileNotFoundError:
        raise Failure(f"A measurement file must exist; there is none at {path}.") from None
    except IsADirectoryError:
        raise Failure(f"A measurement file is a CSV or Parquet file; {path} is a folder.") from None
    except OSError as error:
        raise Failure(f"{path} cannot be read: {error.strerror or error}.") from error
    if not head.strip():
        raise Failure(f"{path.name}: the file is empty. It needs a header row and one row per sample.")
    if head[:4] != b"PAR1" and b"\0" in head:
        raise Failure(f"{path.name} is neither CSV (UTF-8 text) nor Parquet. Export it as one of them.")
    return head[:4] == b"PAR1"


def header_line(path: Path) -> str:
    """First line of a text file."""
    with path.open(encoding="utf-8-sig", errors="replace") as file:
        return file.readline()


def find_separator(path: Path) -> str:
    """The separator that the header uses: comma, semicolon or tab."""
    line = header_line(path)
    return max(",;\t", key=line.count)


def csv_names(path: Path, separator: str) -> list[str]:
    """Column names in a header row, without the spaces around them; unnamed ones are numbered."""
    row = next(csv.reader([header_line(path)], delimiter=separator, skipinitialspace=True), [])
    names = [name.strip() or f"column {k}" for k, name in enumerate(row, 1)]
    return check_unique(path.name, names)


def parquet_names(path: Path) -> list[str]:
    """Column names of a Parquet file."""
    try:
        return check_unique(path.name, list(pl.read_parquet_schema(path)))
    except (pl.exceptions.PolarsError, OSError) as error:
        raise Failure(f"{path.name} is damaged and cannot be read as Parquet: {first_line(error)}.") from error


def check_unique(log: str, names: list[str]) -> list[str]:
    """Return the names; raises Failure when one is there twice."""
    twice = sorted({n for n in names if names.count(n) > 1})
    if twice:
        raise Failure(f"{log}: column names must differ; {', '.join(twice)} is there more than once. Rename one.")
    return names


def read_csv(path: Path, names: list[str], wanted: list[str], separator: str) -> pl.DataFrame:
    """Read the wanted columns; as text where a cell is not a plain number, so that it can be looked at."""
    numeric = {n: pl.Float64() if n in wanted else pl.String() for n in names}
    for schema in (numeric, dict.fromkeys(names, pl.String())):
        try:
            table = pl.read_csv(
                path,
                has_header=False,
                skip_rows=1,  # the header, whose names may have spaces around them
                separator=separator,
                columns=[names.index(w) for w in wanted],
                schema=schema,
                null_values=list(MISSING),
                encoding="utf8-lossy",
            )
        except pl.exceptions.NoDataError:
            return pl.DataFrame(schema=dict.fromkeys(wanted, pl.Float64()))
        except (pl.exceptions.PolarsError, OSError) as error:
            failure = error
        else:
            return without_blank_end(table)
    reason = uneven_row(path, len(names), separator) or f"the CSV is malformed ({first_line(failure)})"
    raise Failure(f"{path.name}: every row must have as many cells as the header; {reason}.") from failure


def uneven_row(path: Path, width: int, separator: str) -> str:
    """Describe the first row that does not have as many cells as the header, if there is one."""
    with path.open(encoding="utf-8-sig", errors="replace", newline="") as file:
        try:
            for number, row in enumerate(csv.reader(file, delimiter=separator)):
                if row and len(row) != width:
                    return f"row {number} has {len(row)}, the header {width}"
        except csv.Error:  # a quotation mark that never closes, for instance
            pass
    return ""


def without_blank_end(table: pl.DataFrame) -> pl.DataFrame:
    """Leave out blank lines at the end of a file."""
    end = table.height
    while end and all(cell is None for cell in table.row(end - 1)):
        end -= 1
    return table.head(end)


def read_parquet(path: Path, wanted: list[str]) -> pl.DataFrame:
    """Read the wanted columns of a Parquet file."""
    try:
        return pl.read_parquet(path, columns=wanted)
    except (pl.exceptions.PolarsError, OSError) as error:
        raise Failure(f"{path.name} is damaged and cannot be read as Parquet: {first_line(error)}.") from error


def first_line(error: Exception) -> str:
    """The first line of another library's message, without its full stop."""
    return str(error).strip().partition("\n")[0].rstrip(".")


def to_numbers(log: str, column: pl.Series) -> np.ndarray:
    """Column as (N,) float64 with NaN for missing cells; raises Failure naming a cell that is no number."""
    if column.dtype == pl.String:
        text = column.str.strip_chars()
        text = pl.select(pl.when(text.is_in(list(MISSING))).then(None).otherwise(text)).to_series()
        numbers = text.cast(pl.Float64, strict=False)
        bad = (text.is_not_null() & numbers.is_null()).arg_true()
        if len(bad):
            row = int(bad[0])
            raise Failure(
                f"{log}: cells must be numbers or empty; row {row + 1} of column {column.name} has {text[row]!r}"
                + (f", and {len(bad) - 1} more like it." if len(bad) > 1 else ".")
            )
    elif column.dtype.is_numeric() or column.dtype == pl.Null:
        numbers = column.cast(pl.Float64)
    else:
        raise Failure(f"{log}: column {column.name} must hold numbers; it holds {column.dtype}. Convert it first.")
    return numbers.fill_null(math.nan).to_numpy()


# ---- finding columns


def find_sources(
    log: str, names: Sequence[str], needed: Sequence[str], columns: Mapping[str, ColumnMap]
) -> tuple[dict[str, Source], list[str]]:
    """Where each quantity is in a file, with remarks; raises Failure when one that is needed is not there."""
    sources, notes = {}, []
    for name in (*needed, REFERENCE):
        mapped = columns.get(name)
        if mapped and mapped.column in names:
            sources[name] = Source(mapped.column, mapped.sign * factor(name, mapped.unit))
        elif name in names:
            sources[name] = Source(name, 1.0)
            if mapped:
                notes.append(f"[columns] maps {name} to '{mapped.column}', which is not in the file; '{name}' is read.")
    absent = [n for n in needed if n not in sources]
    if absent:
        raise Failure(missing_columns(log, names, absent, {s.column for s in sources.values()}))
    return sources, notes


def factor(name: str, unit: str) -> float:
    """Factor from a unit to ours; raises Failure when the quantity cannot have that unit."""
    becomes, value = UNITS[unit] if unit else (own_unit(name), 1.0)
    own = own_unit(name)
    if own and own != becomes:
        fitting = ", ".join(u for u, (base, _) in UNITS.items() if base == own)
        raise Failure(f"[columns] {name} must have a unit that turns into {own} ({fitting}), not '{unit}'.")
    return value


def own_unit(name: str) -> str:
    """The unit of a quantity by its name, or nothing where the name does not say."""
    if name == "t":
        return "s"
    return next((unit for start, unit in OWN_UNITS.items() if name.startswith(start)), "")


def missing_columns(log: str, names: Sequence[str], absent: list[str], used: set[str]) -> str:
    """Message that says what is there and how to map it."""
    lines = []
    free = [n for n in names if n not in used]
    for name in sorted(absent, key=lambda n: -len(n)):  # dtheta_p before theta_p: a pitch rate is also called pitch
        guess = guess_column(name, free)
        free = [n for n in free if n != guess]
        lines.append(f'{name} = {{ column = "{guess or "..."}", unit = "{guess_unit(name, guess)}" }}')
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


def guess_unit(name: str, column: str) -> str:
    """The unit that a column's name ends with, or else the quantity's own."""
    own = own_unit(name)
    ending = column.lower().replace("_per_s", "/s").replace("dps", "deg/s")
    fitting = [u for u, (base, _) in UNITS.items() if base == own and ending.endswith(f"_{u.lower()}")]
    return max(fitting, key=len, default=own or "rad")


# ---- checks


def check_length(log: str, samples: int) -> None:
    """Raise Failure when there is too little to learn from."""
    if samples < SHORTEST_LOG:
        raise Failure(f"{log}: the log is too short. It must have at least {SHORTEST_LOG} samples; it has {samples}.")


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


def check_moves(log: str, input: str, voltage: np.ndarray) -> None:
    """Raise Failure when the input never changes: nothing can be learnt from it."""
    lowest = np.nanmin(voltage)
    if lowest == np.nanmax(voltage):
        raise Failure(
            f"{log}: {input} must vary for anything to be learnt, but it is {lowest:g} V throughout. "
            "Record a log in which the motors work."
        )


def oddities(log: Log, input: str, sources: Mapping[str, Source]) -> list[str]:
    """Sentences on what is unusual about a usable log."""
    return [*odd_times(log), *odd_pitch(log, sources), *odd_channels(log, input)]


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
    if PITCH not in log.channels:
        return []
    pitch = np.abs(log.measured[:, log.channels.index(PITCH)])
    fallen = np.flatnonzero(pitch > math.pi / 2)
    found = []
    if np.nanmax(pitch) > 3.2:
        found.append(
            f"{PITCH} reaches {np.nanmax(pitch):.3g} rad and looks like degrees; if it is, map it in model.toml: "
            f'{PITCH} = {{ column = "{sources[PITCH].column}", unit = "deg" }}.'
        )
    if len(fallen):
        share = 100 * len(fallen) / len(pitch)
        found.append(
            f"{PITCH} is beyond ±π/2 from t = {log.t[fallen[0]]:.6g} s: the robot fell over. "
            f"Those samples ({share:.2g} %) are left out."
        )
    return found


def odd_channels(log: Log, input: str) -> list[str]:
    """Missing cells and channels that never change."""
    found = []
    for name, values in ((input, log.voltage), *zip(log.channels, log.measured.T, strict=True)):
        missing = int(np.isnan(values).sum())
        if missing:
            share = 100 * missing / len(values)
            found.append(f"{name} is missing in {missing} of {len(values)} samples ({share:.2g} %).")
        if np.nanmin(values) == np.nanmax(values):
            found.append(f"{name} is {np.nanmin(values):g} throughout: this sensor says nothing.")
    return found
