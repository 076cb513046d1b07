"""A manifest: which logs are of which unit, of which day, under which conditions; a table with a row for each log."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from datetime import datetime
from pathlib import Path
from typing import Any, NamedTuple

from wheelpend.errors import Failure
from wheelpend.files import refuse_special_file
from wheelpend.logs.tables import read_file_head

LOG_COLUMN, UNIT_COLUMN, DATE_COLUMN = "log", "unit", "date"
PARQUET_BEGINNING = b"PAR1"
MAX_HEADER_BYTES = 20_000


class Listed(NamedTuple):
    """A log of a fleet."""

    log: Any  # a path; from Python also what else is turned into a log
    unit: str = ""  # empty where it is not stated
    date: str = ""  # as ISO 8601 writes it; empty where it is not stated
    conditions: Mapping[str, str] = {}  # further columns


def is_manifest(path: Path) -> bool:
    """True where a file is a table that lists logs: it has a column log, and unit or date beside it."""
    refuse_special_file(path)
    try:
        with path.open("rb") as file:
            head = file.read(MAX_HEADER_BYTES)
    except OSError:
        return False
    if head.startswith(PARQUET_BEGINNING):
        import polars as pl  # imported late: loading Polars takes longer than reading a line

        try:
            names = set(pl.read_parquet_schema(path))
        except (pl.exceptions.PolarsError, OSError):
            return False
    else:
        first = head.decode("utf-8-sig", errors="replace").partition("\n")[0]
        names = {cell.strip().strip('"') for cell in first.split(",")}
    return LOG_COLUMN in names and bool(names & {UNIT_COLUMN, DATE_COLUMN})


def read_manifest(path: Path) -> list[Listed]:
    """The logs that a manifest (CSV or Parquet) lists, their paths from its folder on.

    Raises Failure where it cannot be read, a row names no log, or a date is none.
    """
    import polars as pl  # imported late, as above

    try:
        is_parquet = read_file_head(path).startswith(PARQUET_BEGINNING)
        table = pl.read_parquet(path) if is_parquet else pl.read_csv(path, infer_schema=False)
    except (pl.exceptions.PolarsError, OSError) as error:
        raise Failure(f"{path}: a manifest must be a CSV or Parquet table, but it cannot be read: {error}") from None
    return [_listed(path, number, row) for number, row in enumerate(table.iter_rows(named=True), 1)]


def _listed(path: Path, number: int, row: dict[str, Any]) -> Listed:
    cells = {name.strip(): "" if value is None else str(value).strip() for name, value in row.items()}
    log = cells.pop(LOG_COLUMN)
    if not log:
        raise Failure(f"{path}: every row must name its log, but row {number} names none. Fill in the column log.")
    date = cells.pop(DATE_COLUMN, "")
    if date:
        day_of(date, f"{path}: row {number}")
    return Listed(path.parent / log, cells.pop(UNIT_COLUMN, ""), date, cells)


def day_of(date: str, place: str = "A manifest") -> float:
    """Days [d] since 1970 of a date or a time; raises Failure where it is none."""
    try:
        found = datetime.fromisoformat(date)
    except ValueError:
        raise Failure(f"{place}: a date must be like 2026-03-31 or 2026-03-31T14:05, not '{date}'.") from None
    return (found.replace(tzinfo=None) - datetime(1970, 1, 1)).total_seconds() / 86400.0


def listed_logs(given: Sequence[Path]) -> list[Listed]:
    """Logs, and those that manifests among them list; a pattern stands for the files that fit it.

    Raises Failure for a manifest that cannot be used, and for a pattern that no file fits.
    """
    return [listed for path in given for listed in _listed_by(path)]


def _listed_by(path: Path) -> Iterator[Listed]:
    if any(c in path.name for c in "*?[") and not path.exists():
        found = sorted(path.parent.glob(path.name))
        if not found:
            raise Failure(f"A pattern must fit some file, but none fits {path}.")
        for one in found:
            yield from _listed_by(one)
    elif is_manifest(path):
        yield from read_manifest(path)
    else:
        yield Listed(path)
