"""Tables of numbers in files: CSV, Parquet and MATLAB files by what is in them, named columns, no physics.

Rows are counted from 1, the header not included.
"""

from __future__ import annotations

import io
from collections.abc import Callable, Iterator, Mapping
from functools import partial
from pathlib import Path
from typing import NamedTuple

import numpy as np

from wheelpend.errors import Failure
from wheelpend.files import read_errors, refuse_special_file
from wheelpend.logs.columns import ROW_NUMBER
from wheelpend.logs.csv_text import SNIFFED_BYTES, CsvLayout, csv_layout, find_encoding, first_line

MIN_LOG_SAMPLES = 20  # rows
MAX_PLAIN_CSV_BYTES = 8_000_000  # bytes up to which a CSV file of plain numbers is read without Polars
PLAIN_CSV_CHARACTERS = b"0123456789+-.eE,\n"
MAX_MATRIX_COLUMNS = 64  # columns of a matrix that is taken for as many quantities
MATLAB_FILE_HEADS = (b"MATLAB 5.0 MAT-file", b"MATLAB 7.3 MAT-file")
FILE_KINDS = "CSV (text), Parquet, MATLAB (.mat) or MCAP"


class Table(NamedTuple):
    """The named columns of a file, read on demand."""

    names: list[str]
    read: Callable[[list[str]], dict[str, np.ndarray]]  # columns by name, (N,) each; NaN where a cell is missing
    # The same of a file with several clocks; the second list names columns with zero-order hold.
    read_on_one_clock: Callable[[list[str], list[str]], dict[str, np.ndarray]] | None = None
    units: Mapping[str, str] = {}  # by name, where the file has a row of units
    kind: str = "file"  # of source, as sentences call it


def with_row_numbers(file: Table) -> Table:
    """A table with the numbers of its rows as a column more; as it is where it has one of that name."""
    if ROW_NUMBER in file.names or file.read_on_one_clock:
        return file

    def read(wanted: list[str]) -> dict[str, np.ndarray]:
        own = file.read([n for n in wanted if n != ROW_NUMBER] or file.names[:1])
        counted = np.arange(1.0, len(next(iter(own.values()))) + 1.0)
        return {n: counted if n == ROW_NUMBER else own[n] for n in wanted}

    return file._replace(names=[*file.names, ROW_NUMBER], read=read)


def open_table(path: Path) -> Table:
    """The columns of a file, by its kind; raises Failure when it is missing, empty, damaged or of another kind."""
    head = read_file_head(path)
    if head[:4] == b"PAR1":
        from wheelpend.logs import polars_files  # imported late: Polars is slow to load

        return Table(polars_files.parquet_names(path), partial(polars_files.parquet_columns, path))
    if head.startswith(MATLAB_FILE_HEADS):
        return matlab_table(path)
    if b"\0" in head and find_encoding(head) == "utf-8":
        raise Failure(f"{path.name} is neither {FILE_KINDS}. Export it as one of them.")
    layout = csv_layout(path)
    return Table(layout.names, partial(csv_columns, path, layout), units=layout.units)


def read_file_head(path: Path) -> bytes:
    """The first bytes of a file; raises Failure when there are none."""
    refuse_special_file(path)
    if path.is_dir():
        raise Failure(f"A measurement file is a {FILE_KINDS} file; {path} is a folder.")
    try:
        with read_errors(str(path)), path.open("rb") as file:
            head = file.read(SNIFFED_BYTES)
    except FileNotFoundError:
        raise Failure(f"A measurement file must exist; there is none at {path}.") from None
    if not head.strip():
        raise Failure(f"{path.name}: the file is empty. It needs a header row and one row per sample.")
    return head


def check_length(log: str, samples: int) -> None:
    """Raise Failure when a log has too few samples."""
    if samples < MIN_LOG_SAMPLES:
        raise Failure(
            f"{log}: the log is too short. It must have at least {MIN_LOG_SAMPLES} samples; it has {samples}."
        )


def csv_columns(path: Path, layout: CsvLayout, wanted: list[str]) -> dict[str, np.ndarray]:
    """Columns of a CSV file."""
    columns = plain_columns(path, layout.names) if layout.is_plain else None
    if columns is not None:
        return {name: columns[layout.names.index(name)] for name in wanted}
    from wheelpend.logs import polars_files  # imported late: loading Polars takes longer than reading a short log

    return polars_files.csv_columns(path, layout, wanted)


def plain_columns(path: Path, names: list[str]) -> np.ndarray | None:
    """All columns (names, N) of a short CSV file of nothing but numbers, one in every cell; None of any other."""
    if path.stat().st_size > MAX_PLAIN_CSV_BYTES:
        return None
    header, _, rows = path.read_bytes().partition(b"\n")
    if not rows or b'"' in header or b"\r" in header or rows.translate(None, PLAIN_CSV_CHARACTERS):
        return None
    if rows.startswith(b"\n") or b"\n\n" in rows:  # blank lines
        return None
    try:
        table = np.loadtxt(io.StringIO(rows.decode("ascii")), delimiter=",", comments=None, ndmin=2)
    except ValueError:  # an empty cell, for instance
        return None
    return np.ascontiguousarray(table.T) if table.shape[1] == len(names) else None


def matlab_table(path: Path) -> Table:
    """The numeric vectors of a MATLAB file that are as long as most of them are; nothing in it is executed."""
    from scipy.io import loadmat  # imported late: it is slow to load, and only such files need it

    try:
        found = loadmat(path, squeeze_me=True, struct_as_record=True)
    except NotImplementedError:
        raise Failure(f"{path.name} is a MATLAB 7.3 file, which is HDF5. Save it with save(..., '-v7').") from None
    except Exception as error:  # whatever the reader stumbles over: it has no one error for damage
        raise Failure(f"{path.name} is damaged and cannot be read as a MATLAB file: {first_line(error)}.") from error
    vectors = dict(numeric_vectors(found))
    if not vectors:
        present = ", ".join(n for n in found if not n.startswith("__")) or "nothing"
        raise Failure(f"{path.name} must hold numeric vectors, one for each quantity; it holds {present}.")
    lengths = [v.size for v in vectors.values()]
    log_length = max(set(lengths), key=lambda n: (n * lengths.count(n), n))
    columns = {name: v for name, v in vectors.items() if v.size == log_length}
    return Table(list(columns), lambda wanted: {name: real_values(path.name, name, columns[name]) for name in wanted})


def real_values(log: str, name: str, values: np.ndarray) -> np.ndarray:
    """The values (N,) as real numbers; raises Failure where they have imaginary parts."""
    if np.imag(values).any():
        raise Failure(f"{log}: {name} must hold real numbers, but it is complex. Save its real part.")
    return np.real(values).astype(float)


def numeric_vectors(found: dict, prefix: str = "") -> Iterator[tuple[str, np.ndarray]]:
    """Names and values of the numeric vectors in a MATLAB file's variables, also in its structures: data.theta."""
    for name, value in found.items():
        if name.startswith("__") or not isinstance(value, np.ndarray | np.void):
            continue
        if value.dtype.names and value.size == 1:
            yield from numeric_vectors({n: np.asarray(value[n].item() if value[n].dtype == object else value[n])
                                   for n in value.dtype.names}, f"{prefix}{name}.")  # fmt: skip
        elif value.dtype.kind in "biufc" and value.ndim == 1 and value.size > 1:
            yield f"{prefix}{name}", np.asarray(value)
        elif value.dtype.kind in "biufc" and value.ndim == 2:
            matrix = np.asarray(value)
            rows = matrix if matrix.shape[0] > matrix.shape[1] else matrix.T
            if rows.shape[1] <= MAX_MATRIX_COLUMNS < rows.shape[0]:
                yield from ((f"{prefix}{name}[{k}]", rows[:, k - 1]) for k in range(1, rows.shape[1] + 1))


def scalars_of(path: Path) -> dict[str, float]:
    """Single numbers in a MATLAB file, which are no columns: constants of the machine or of its controller."""
    if not read_file_head(path).startswith(MATLAB_FILE_HEADS[:1]):
        return {}
    from scipy.io import loadmat  # imported late: as above

    found = loadmat(path, squeeze_me=True, struct_as_record=True)
    return {
        name: float(v)
        for name, v in found.items()
        if isinstance(v, int | float | np.number)
        or (isinstance(v, np.ndarray) and v.ndim == 0 and v.dtype.kind in "iuf")
    }
