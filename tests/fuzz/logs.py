"""Hostile logs: tables with odd rows, headers, cells and times; files of other kinds, damaged."""

from __future__ import annotations

import gzip
import io
import random

import numpy as np
import polars as pl
from hypothesis import strategies as st

from tests.fuzz import hostile
from tests.fuzz.cases import Case
from tests.fuzz.invariants import fresh_files

HEADS = (b"PAR1", b"MATLAB 5.0 MAT-file", b"MATLAB 7.3 MAT-file", b"SQLite format 3\0", b"\x89MCAP0\r\n", b"\x1f\x8b", b"PK\x03\x04",
         b"\xff\xfe", b"\xfe\xff", b"\xef\xbb\xbf", b"#ROSBAG V2.0\n", b"\x80\x04", b"\x93NUMPY", b"%PDF", b"")  # fmt: skip
ENCODINGS = ("utf-8", "utf-8-sig", "utf-16", "utf-16-be", "utf-32", "latin-1", "cp1252")
SEPARATORS = (",", ";", "\t", " ", "|", ", ", ":", "\x00")
LINE_ENDS = ("\n", "\r\n", "\r", "\n\n", "\x0b")


def sound_rows() -> list[list[str]]:
    """Header and rows of the log that every workspace has."""
    return [line.split(",") for line in fresh_files()["log.csv"].decode().splitlines()]


indices = st.integers(0, 10_000)


@st.composite
def row_changes(draw):
    """A change of rows of cells, header first."""
    kind = draw(st.sampled_from(sorted(ROW_CHANGES)))
    where, column, cell, name = draw(indices), draw(indices), draw(hostile.cells), draw(hostile.names)

    def change(rows):
        rows = [list(r) for r in rows]
        if len(rows) > 1 and rows[0]:
            ROW_CHANGES[kind](rows, 1 + where % (len(rows) - 1), column % len(rows[0]), cell, name)
        return rows

    return kind, change


def set_column(rows, column, value_of):
    for k, row in enumerate(rows[1:]):
        if column < len(row):
            row[column] = str(value_of(k, row[column]))


def scaled(factor, offset=0.0):
    def value(k, cell):
        try:
            return float(cell) * factor + offset
        except ValueError:
            return cell

    return value


ROW_CHANGES = {
    "odd cell": lambda rows, i, j, cell, name: rows[i].__setitem__(slice(j, j + 1), [cell]),
    "odd cells in a column": lambda rows, i, j, cell, name: set_column(rows, j, lambda k, old: cell if k % 7 == 0 else old),
    "column of one value": lambda rows, i, j, cell, name: set_column(rows, j, lambda k, old: rows[i][j] if j < len(rows[i]) else cell),
    "column of one odd cell": lambda rows, i, j, cell, name: set_column(rows, j, lambda k, old: cell),
    "odd name": lambda rows, i, j, cell, name: rows[0].__setitem__(j, name),
    "further column": lambda rows, i, j, cell, name: [r.append(name if r is rows[0] else cell) for r in rows],
    "missing column": lambda rows, i, j, cell, name: [r.__delitem__(slice(j, j + 1)) for r in rows],
    "name twice": lambda rows, i, j, cell, name: rows[0].__setitem__(j, rows[0][0]),
    "no header": lambda rows, i, j, cell, name: rows.__delitem__(0),
    "short row": lambda rows, i, j, cell, name: rows[i].__delitem__(slice(j, None)),
    "long row": lambda rows, i, j, cell, name: rows[i].extend([cell] * 5),
    "empty row": lambda rows, i, j, cell, name: rows.insert(i, []),
    "row of units": lambda rows, i, j, cell, name: rows.insert(1, ["s", "V", "deg", "m", "?", cell][: len(rows[0])]),
    "times of day": lambda rows, i, j, cell, name: set_column(
        rows, j, lambda k, old: cell if k == i else f"{(i + k // 3600) % 24:02d}:{k // 60 % 60:02d}:{k % 60 + 0.01 * j:05.2f}"
    ),
    "a speed alone": lambda rows, i, j, cell, name: [
        rows[0].__setitem__(k, "speed_rpm" if k == j else f"setting {k}") for k in range(2, len(rows[0]))
    ],
    "a clock that goes back": lambda rows, i, j, cell, name: set_column(
        rows, 0, lambda k, old: 0.01 * k - (0.5 if k >= i else 0.0)
    ),
    "comment": lambda rows, i, j, cell, name: rows.insert(i, ["# " + name]),
    "preamble": lambda rows, i, j, cell, name: rows.insert(0, [name]),
    "header again": lambda rows, i, j, cell, name: rows.insert(i, list(rows[0])),
    "row twice": lambda rows, i, j, cell, name: rows.insert(i, list(rows[i])),
    "backwards": lambda rows, i, j, cell, name: rows.__setitem__(slice(1, None), rows[:0:-1]),
    "few rows": lambda rows, i, j, cell, name: rows.__delitem__(slice(1 + i % 30, None)),
    "gap": lambda rows, i, j, cell, name: rows.__delitem__(slice(i, i + 40)),
    "times twice": lambda rows, i, j, cell, name: set_column(rows, 0, lambda k, old: rows[1 + k // 2][0] if rows[1 + k // 2] else old),
    "times huge": lambda rows, i, j, cell, name: set_column(rows, 0, scaled(1.0, 10.0 ** (i % 300))),
    "times scaled": lambda rows, i, j, cell, name: set_column(rows, 0, scaled(10.0 ** (i % 40 - 20))),
    "times uneven": lambda rows, i, j, cell, name: set_column(rows, 0, lambda k, old: k**1.5 / 50),
    "column scaled": lambda rows, i, j, cell, name: set_column(rows, j, scaled(10.0 ** (i % 620 - 310))),
    "columns swapped": lambda rows, i, j, cell, name: [r.reverse() for r in rows],
    "everything in one cell": lambda rows, i, j, cell, name: rows.__setitem__(slice(None), [[" ".join(map(" ".join, rows))]]),
    "noise": lambda rows, i, j, cell, name: set_column(rows, j, lambda k, old: random.Random(i * 1000 + k).gauss(0, 1)),
}  # fmt: skip


@st.composite
def byte_changes(draw):
    """A change of bytes."""
    kind, where, data = draw(st.sampled_from(sorted(BYTE_CHANGES))), draw(indices), draw(st.binary(max_size=8))
    return lambda old: BYTE_CHANGES[kind](old, where % (len(old) + 1), data)


BYTE_CHANGES = {
    "nothing": lambda old, i, data: old,
    "cut": lambda old, i, data: old[:i],
    "insert": lambda old, i, data: old[:i] + data + old[i:],
    "replace": lambda old, i, data: old[:i] + data + old[i + len(data) :],
    "nul": lambda old, i, data: old[:i] + b"\0" + old[i:],
    "twice": lambda old, i, data: old + old,
    "front": lambda old, i, data: data + old,
    "no last line end": lambda old, i, data: old.rstrip(b"\r\n"),
}


@st.composite
def csv_logs(draw):
    """A CSV file of odd rows in an odd dress, its bytes damaged now and then."""
    changes = draw(hostile.steps(row_changes()))
    rows = hostile.apply_all([change for _, change in changes], sound_rows())
    dress = draw(st.integers(0, 3))
    separator = draw(st.sampled_from(SEPARATORS)) if dress == 1 else ","
    end = draw(st.sampled_from(LINE_ENDS)) if dress == 2 else "\n"
    encoding = draw(st.sampled_from(ENCODINGS)) if dress == 3 else "utf-8"
    data = end.join(separator.join(r) for r in rows).encode(encoding, "replace")
    if draw(st.integers(0, 4)) == 0:
        data = draw(byte_changes())(data)
    return f"csv {changes[0][0]}", data


@st.composite
def other_bytes(draw):
    """Bytes that are no log, some of which begin as one."""
    return "bytes", draw(st.sampled_from(HEADS)) + draw(st.binary(max_size=200))


def frame() -> pl.DataFrame:
    """The log that every workspace has."""
    return pl.read_csv(io.BytesIO(fresh_files()["log.csv"]))


FRAME_CHANGES = {
    "sound": lambda f, c, name: f,
    "text": lambda f, c, name: f.with_columns(pl.col(c).cast(pl.String)),
    "truth": lambda f, c, name: f.with_columns(pl.col(c) > 0),
    "whole": lambda f, c, name: f.with_columns((pl.col(c) * 1000).cast(pl.Int64)),
    "bytes": lambda f, c, name: f.with_columns((pl.col(c) * 10).cast(pl.Int8, strict=False)),
    "dates": lambda f, c, name: f.with_columns((pl.col(c) * 1e6).cast(pl.Int64).cast(pl.Datetime("us"))),
    "spans": lambda f, c, name: f.with_columns((pl.col(c) * 1e6).cast(pl.Int64).cast(pl.Duration("us"))),
    "lists": lambda f, c, name: f.with_columns(pl.concat_list(c, c)),
    "struct": lambda f, c, name: f.with_columns(pl.struct(c).alias(c)),
    "nothing": lambda f, c, name: f.with_columns(pl.lit(None).alias(c)),
    "nan": lambda f, c, name: f.with_columns(pl.lit(float("nan")).alias(c)),
    "infinite": lambda f, c, name: f.with_columns(pl.col(c) / 0.0),
    "decimal": lambda f, c, name: f.with_columns(pl.col(c).cast(pl.Decimal(20, 6))),
    "category": lambda f, c, name: f.with_columns(pl.col(c).cast(pl.String).cast(pl.Categorical)),
    "object name": lambda f, c, name: f.rename({c: name}) if name not in f.columns else f,
    "no rows": lambda f, c, name: f.head(0),
    "no columns": lambda f, c, name: f.select([]),
    "shuffled": lambda f, c, name: f.reverse(),
}  # fmt: skip


@st.composite
def parquet_logs(draw):
    """A Parquet file of odd types, damaged now and then."""
    kind, table = draw(st.sampled_from(sorted(FRAME_CHANGES))), frame()
    changed = FRAME_CHANGES[kind](table, draw(st.sampled_from(table.columns)), draw(hostile.names))
    stream = io.BytesIO()
    changed.write_parquet(stream)
    data = stream.getvalue()
    return f"parquet {kind}", draw(byte_changes())(data) if draw(st.booleans()) else data


MATLAB_VALUES = {
    "sound": lambda v: v,
    "column": lambda v: v.reshape(-1, 1),
    "complex": lambda v: v + 1j,
    "text": lambda v: "text",
    "empty": lambda v: np.zeros((0, 0)),
    "cell": lambda v: np.array([v, "a"], dtype=object),
    "struct": lambda v: {"a": v, "b": {"c": "x"}},
    "whole": lambda v: v.astype(np.int8),
    "truth": lambda v: v > 0,
    "nan": lambda v: v * np.nan,
    "cube": lambda v: np.zeros((3, 4, 5)),
    "matrix": lambda v: np.zeros((v.size, 70)),
    "one": lambda v: 1.0,
}


@st.composite
def matlab_logs(draw):
    """A MATLAB v5 file of odd values, damaged now and then."""
    from scipy.io import savemat

    kind, table = draw(st.sampled_from(sorted(MATLAB_VALUES))), frame()
    which, values = draw(st.sampled_from(table.columns)), {c: table[c].to_numpy() for c in table.columns}
    values[which] = MATLAB_VALUES[kind](values[which])
    stream = io.BytesIO()
    savemat(stream, values, do_compression=draw(st.booleans()))
    data = stream.getvalue()
    return f"matlab {kind}", draw(byte_changes())(data) if draw(st.booleans()) else data


@st.composite
def packed_logs(draw):
    """A sound log, packed."""
    return "gzip", draw(byte_changes())(gzip.compress(fresh_files()["log.csv"], mtime=0))


log_data = st.one_of(csv_logs(), csv_logs(), csv_logs(), other_bytes(), parquet_logs(), matlab_logs(), packed_logs())
suffixes = st.sampled_from([".csv", ".csv", ".csv", ".parquet", ".mat", ".txt", ".mcap", ".db3", ".bag", "", ".CSV"])
READING = (
    ("inspect", "LOG"), ("inspect", "LOG", "--json", "-"), ("compare", "LOG", "--json", "-"), ("compare", "log.csv", "--holdout", "LOG"),
    ("inspect", "LOG", "--model", "elsewhere/model.toml"), ("new", "started", "--from", "LOG"),
    ("identify", "LOG", "--method", "filtered", "--tau", "0.1,0.1", "--json", "-"), ("identify", "LOG", "--method", "inverse"),
    ("identify", "LOG", "--method", "energy", "--json", "-"), ("add", "slope", "--data", "missing.csv"),
)  # fmt: skip
LENGTHY = (
    ("diagnose", "LOG", "--json", "-"), ("identify", "LOG", "--json", "-"), ("explain", "LOG", "--save"), ("report", "LOG"),
    ("campaign", "LOG", "log.csv", "--do", "compare"), ("residuals", "LOG"), ("design", "LOG", "--duration", "2"),
    ("add", "slope", "--data", "LOG"),
)  # fmt: skip


@st.composite
def log_cases(draw, commands=READING):
    """A hostile log and a command that reads it."""
    kind, data = draw(log_data)
    name = "hostile" + draw(suffixes)
    command = draw(st.sampled_from(commands))
    return Case(kind, (tuple(name if part == "LOG" else part for part in command),), {name: data})
