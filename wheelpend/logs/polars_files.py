"""CSV and Parquet files of any size and any cells, through Polars."""

from __future__ import annotations

import io
import math
import os
import re
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl

from wheelpend.errors import BadCell, Failure
from wheelpend.logs.csv_text import (
    MISSING_CELLS,
    NAMELESS_PREFIX,
    WHITESPACE,
    CsvLayout,
    check_unique,
    comment_among_rows,
    first_line,
    uneven_row,
)

NO_SEPARATOR = "\x1f"  # stands in no table
STAMP_PATTERN = (  # date, hours, minutes, seconds, half of the day; the zone is not looked at
    r"^(?:([0-9]{4}[-/.][0-9]{1,2}[-/.][0-9]{1,2}|[0-9]{1,2}[-/.][0-9]{1,2}[-/.][0-9]{4}),?[ T])?"
    r"([0-9]{1,2}):([0-5][0-9]):([0-5][0-9](?:[.,][0-9]+)?) ?([AaPp][Mm])?(?:Z|[+-][0-9]{2}(?::?[0-9]{2})?)?$"
)
MAX_BAD_SHARE = 0.1  # of a column's cells, that are no numbers where it is a column of numbers
DAY_S = 86_400.0
MAX_RECODED_BYTES = 300_000_000  # bytes that are held a second time to be read: as UTF-8, without what ends rows


def csv_columns(path: Path, layout: CsvLayout, wanted: list[str]) -> dict[str, np.ndarray]:
    """Columns (N,) of a text table, NaN for missing cells; raises Failure naming a cell that is no number."""
    with no_panic(path.name):
        table = read_spaced(path, layout, wanted) if layout.separator == WHITESPACE else read_csv(path, layout, wanted)
    return numeric_columns(path.name, table, wanted, layout.decimal_comma)


def parquet_columns(path: Path, wanted: list[str]) -> dict[str, np.ndarray]:
    """Columns (N,) of a Parquet file, NaN for missing cells; raises Failure on a column that holds no numbers."""
    with no_panic(path.name):
        table = read_parquet(path, wanted)
    return numeric_columns(path.name, table, wanted)


def numeric_columns(
    log: str, table: pl.DataFrame, wanted: list[str], decimal_comma: bool = False
) -> dict[str, np.ndarray]:
    """Columns (N,) as float64; each is dropped from the table once it is converted, to save memory."""
    return {name: numeric_column(log, table.drop_in_place(name), decimal_comma) for name in wanted}


def parquet_names(path: Path) -> list[str]:
    """Column names of a Parquet file."""
    try:
        with no_panic(path.name):
            names = list(pl.read_parquet_schema(path))
        return check_unique(path.name, names)
    except (pl.exceptions.PolarsError, OSError) as error:
        raise Failure(f"{path.name} is damaged and cannot be read as Parquet: {first_line(error)}.") from error


@contextmanager
def no_panic(name: str) -> Iterator[None]:
    """Raise Failure where Polars panics over a file, which is no Exception, and hold its own words on that back."""
    sys.stderr.flush()
    with tempfile.TemporaryFile() as held:
        kept = os.dup(2)
        os.dup2(held.fileno(), 2)
        try:
            yield
        except pl.exceptions.PanicException as panic:
            held.truncate(0)
            raise Failure(f"{name} cannot be read as a table: the reader gives up on it ({first_line(panic)}). "
                          "Write it anew, with a header and a row of numbers per sample.") from panic  # fmt: skip
        finally:
            sys.stderr.flush()
            os.dup2(kept, 2)
            os.close(kept)
            held.seek(0)
            if said := held.read():
                os.write(2, said)


def read_csv(path: Path, layout: CsvLayout, wanted: list[str]) -> pl.DataFrame:
    """Read the wanted columns as numbers, or all as text where a cell is not a plain number."""
    numeric = {n: pl.Float64() if n in wanted else pl.String() for n in layout.names}
    for schema in (numeric, dict.fromkeys(layout.names, pl.String())):
        try:
            table = pl.read_csv(
                text_source(path, layout),
                columns=[layout.names.index(w) for w in wanted],
                separator=layout.separator,
                schema=schema,
                null_values=list(MISSING_CELLS),
                decimal_comma=layout.decimal_comma and layout.separator != ",",
                low_memory=True,
                **common_options(layout),
            )
        except pl.exceptions.NoDataError:
            return pl.DataFrame(schema=dict.fromkeys(wanted, pl.Float64()))
        except (pl.exceptions.PolarsError, OSError) as error:
            failure = error
        else:
            return without_trailing_blank_rows(table)
        if not layout.comment and (comment := comment_among_rows(path, layout)):
            return read_csv(path, layout._replace(comment=comment), wanted)
    reason = uneven_row(path, layout) or f"the CSV is malformed ({first_line(failure)})"
    raise Failure(f"{path.name}: every row must have as many cells as the header; {reason}.") from failure


def read_spaced(path: Path, layout: CsvLayout, wanted: list[str]) -> pl.DataFrame:
    """Read the wanted columns, as text, of a table with any number of spaces and tabs between its cells."""
    lines = pl.scan_csv(
        text_source(path, layout), separator=NO_SEPARATOR, quote_char=None, schema={"line": pl.String()},
        **common_options(layout),
    ).filter(pl.col("line").str.contains(r"\S") & ~pl.col("line").str.contains(r"^\s*(#|%|//)"))  # fmt: skip
    cells = lines.select(pl.col("line").str.extract_all(r"\S+").alias("cells"))
    columns = [pl.col("cells").list.get(layout.names.index(w), null_on_oob=True).alias(w) for w in wanted]
    table = cells.select(*columns, pl.col("cells").list.len().alias(NO_SEPARATOR)).collect()
    uneven = (table[NO_SEPARATOR] != len(layout.names)).arg_true()
    if len(uneven):
        row, width = int(uneven[0]), len(layout.names)
        raise Failure(
            f"{path.name}: every row must have as many cells as the header; row {row + 1} has "
            f"{table[NO_SEPARATOR][row]}, the header {width}. Write nan where a sensor gave no value."
        )
    return table.drop(NO_SEPARATOR)


def common_options(layout: CsvLayout) -> dict[str, Any]:
    """What Polars is told of every text table."""
    return {
        "has_header": False,  # its names may have spaces around them
        "skip_lines": layout.skipped,
        "comment_prefix": layout.comment or None,
        "encoding": "utf8-lossy",
    }


def text_source(path: Path, layout: CsvLayout) -> Path | io.BytesIO:
    """The file itself where Polars can read it, else its text as UTF-8; raises Failure where that is too large."""
    if layout.encoding == "utf-8" and not layout.row_end:
        return path
    if path.stat().st_size > MAX_RECODED_BYTES:
        raise Failure(f"{path.name} is too large to be read as it is: {recoding_cure(path.name, layout)}")
    text = path.read_bytes().decode(layout.encoding, errors="replace")
    if layout.row_end:
        text = re.sub(rf"{re.escape(layout.row_end)}[ \t\r]*$", "", text, flags=re.MULTILINE)
    return io.BytesIO(text.encode())


def recoding_cure(name: str, layout: CsvLayout) -> str:
    """What to do with a file that Polars cannot read as it is."""
    if layout.encoding != "utf-8":
        return f"it must be UTF-8 text, but is UTF-16. Convert it: iconv -f UTF-16 -t UTF-8 {name} > utf8.csv"
    end = layout.row_end
    return f"nothing may stand behind its rows, but a {end} does. Remove it: sed 's/{end}\\s*$//' {name} > rows.csv"


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


def numeric_column(log: str, column: pl.Series, decimal_comma: bool = False) -> np.ndarray:
    """Column as (N,) float64 with NaN for missing cells; raises Failure naming a cell that is no number."""
    called = column.name if column.name.startswith(NAMELESS_PREFIX) else f"column {column.name}"
    if column.dtype == pl.String:
        text = column.str.strip_chars()
        text = pl.select(pl.when(text.is_in(list(MISSING_CELLS))).then(None).otherwise(text)).to_series()
        if (stamps := seconds_of_stamps(text)) is not None:
            return stamps
        decimal = text.str.replace(",", ".", literal=True) if decimal_comma else text
        numbers = decimal.cast(pl.Float64, strict=False)
        bad = (text.is_not_null() & numbers.is_null()).arg_true()
        if len(bad):
            row, few = int(bad[0]), len(bad) <= MAX_BAD_SHARE * (len(text) - text.null_count())
            raise (BadCell if few else Failure)(
                f"{log}: cells must be numbers or empty; row {row + 1} of {called} has {text[row]!r}"
                + (f", and {len(bad) - 1} more like it." if len(bad) > 1 else ".")
            )
    elif column.dtype.is_numeric() or column.dtype == pl.Null:
        numbers = column.cast(pl.Float64)
    else:
        raise Failure(f"{log}: column {column.name} must hold numbers; it holds {column.dtype}. Convert it first.")
    return numbers.fill_null(math.nan).to_numpy()


def seconds_of_stamps(text: pl.Series) -> np.ndarray | None:
    """Seconds (N,) of times of day, or of dates with times, NaN for missing ones; None where other text stands.

    Times without a date go on past midnight; so do those with a date that begins with the day or the month, for which
    of both comes first is not looked at.
    """
    if text.is_null().all() or not text.str.contains(STAMP_PATTERN).all():
        return None
    days, *parts = (text.str.extract(STAMP_PATTERN, k) for k in range(1, 5))
    decimal = [part.str.replace(",", ".", literal=True).cast(pl.Float64).to_numpy() for part in parts]
    halves = text.str.extract(STAMP_PATTERN, 5).str.to_lowercase()
    if halves.is_not_null().any():
        decimal[0] = decimal[0] % 12.0 + 12.0 * (halves == "pm").fill_null(value=False).to_numpy()
    clock = np.array([3600.0, 60.0, 1.0]) @ np.array(decimal)
    dates = days.str.replace_all("[/.]", "-").str.to_date("%Y-%m-%d", strict=False).to_numpy()
    if not np.isnat(dates).all():
        return np.where(np.isnat(dates), np.nan, dates.astype("datetime64[D]").astype(np.int64) * DAY_S + clock)
    known = np.flatnonzero(np.isfinite(clock))
    clock[known[1:]] += DAY_S * np.cumsum(np.diff(clock[known]) < -0.5 * DAY_S)
    return clock
