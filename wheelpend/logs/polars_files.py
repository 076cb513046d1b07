"""CSV and Parquet files of any size and any cells, through Polars."""

from __future__ import annotations

import csv
import math
from pathlib import Path

import numpy as np
import polars as pl

from wheelpend.errors import Failure
from wheelpend.logs.csv_text import MISSING_CELLS, check_unique, first_line


def csv_columns(path: Path, names: list[str], separator: str, wanted: list[str]) -> dict[str, np.ndarray]:
    """Columns (N,) of a CSV file, NaN for missing cells; raises Failure naming a cell that is no number."""
    return numeric_columns(path.name, read_csv(path, names, wanted, separator), wanted)


def parquet_columns(path: Path, wanted: list[str]) -> dict[str, np.ndarray]:
    """Columns (N,) of a Parquet file, NaN for missing cells; raises Failure on a column that holds no numbers."""
    return numeric_columns(path.name, read_parquet(path, wanted), wanted)


def numeric_columns(log: str, table: pl.DataFrame, wanted: list[str]) -> dict[str, np.ndarray]:
    """Columns (N,) as float64; each is dropped from the table once it is converted, to save memory."""
    return {name: numeric_column(log, table.drop_in_place(name)) for name in wanted}


def parquet_names(path: Path) -> list[str]:
    """Column names of a Parquet file."""
    try:
        return check_unique(path.name, list(pl.read_parquet_schema(path)))
    except (pl.exceptions.PolarsError, OSError) as error:
        raise Failure(f"{path.name} is damaged and cannot be read as Parquet: {first_line(error)}.") from error


def read_csv(path: Path, names: list[str], wanted: list[str], separator: str) -> pl.DataFrame:
    """Read the wanted columns as numbers, or all as text where a cell is not a plain number."""
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
                null_values=list(MISSING_CELLS),
                encoding="utf8-lossy",
                low_memory=True,
            )
        except pl.exceptions.NoDataError:
            return pl.DataFrame(schema=dict.fromkeys(wanted, pl.Float64()))
        except (pl.exceptions.PolarsError, OSError) as error:
            failure = error
        else:
            return without_trailing_blank_rows(table)
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


def without_trailing_blank_rows(table: pl.DataFrame) -> pl.DataFrame:
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


def numeric_column(log: str, column: pl.Series) -> np.ndarray:
    """Column as (N,) float64 with NaN for missing cells; raises Failure naming a cell that is no number."""
    if column.dtype == pl.String:
        text = column.str.strip_chars()
        text = pl.select(pl.when(text.is_in(list(MISSING_CELLS))).then(None).otherwise(text)).to_series()
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
