"""A manifest: which logs are of which unit, of which day, under which conditions; a table with a row for each log."""

from __future__ import annotations

import csv
from collections.abc import Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, NamedTuple

from wheelpend.campaigns.addresses import fetched, folder_of, head_of, is_address, matching
from wheelpend.errors import Failure
from wheelpend.files import refuse_special_file
from wheelpend.logs.tables import read_file_head

LOG_COLUMN, UNIT_COLUMN, DATE_COLUMN = "log", "unit", "date"
PARQUET_BEGINNING = b"PAR1"
MAX_HEADER_BYTES = 20_000
PATTERN_MARKS, ADDRESS_PATTERN_MARKS = "*?[", "*["  # in an address a question mark begins what is asked of a server


class Listed(NamedTuple):
    """A log of a fleet."""

    log: Any  # a path or an address; from Python also what else is turned into a log
    unit: str = ""  # empty where it is not stated
    date: str = ""  # as ISO 8601 writes it; empty where it is not stated
    conditions: Mapping[str, str] = {}  # further columns


def is_manifest(source: Path | str) -> bool:
    """True where a file is a table that lists logs: it has a column log, and unit or date beside it."""
    if not isinstance(source, str):
        refuse_special_file(source)
    try:
        head = head_of(source, MAX_HEADER_BYTES) if isinstance(source, str) else _head_of(source)
    except (OSError, ValueError, Failure):
        return False  # what is wrong with it its analysis says
    if head.startswith(PARQUET_BEGINNING):
        with _local(source) as path:
            names = _parquet_names(path)
    else:
        first = head.decode("utf-8-sig", errors="replace").partition("\n")[0]
        names = {cell.strip() for row in csv.reader([first.replace("\0", "")]) for cell in row}
    return LOG_COLUMN in names and bool(names & {UNIT_COLUMN, DATE_COLUMN})


def _head_of(path: Path) -> bytes:
    with path.open("rb") as file:
        return file.read(MAX_HEADER_BYTES)


def _local(source: Path | str) -> AbstractContextManager[Path]:
    """A path at which a file can be read."""
    return fetched(source) if isinstance(source, str) else nullcontext(source)


def _parquet_names(path: Path) -> set[str]:
    """Columns of a Parquet file; none of one that cannot be read."""
    from wheelpend.logs.polars_files import parquet_names  # imported late: loading Polars takes long

    try:
        return set(parquet_names(path))
    except Failure:
        return set()


def read_manifest(source: Path | str) -> list[Listed]:
    """The logs that a manifest (CSV or Parquet) lists, their paths from its folder on, addresses as they are.

    Raises Failure where it cannot be read, a row names no log, or a date is none.
    """
    import polars as pl  # imported late, as above

    from wheelpend.logs.polars_files import no_panic

    try:
        with _local(source) as path, no_panic(str(source)):
            is_parquet = read_file_head(path).startswith(PARQUET_BEGINNING)
            table = pl.read_parquet(path) if is_parquet else pl.read_csv(path, infer_schema=False)
    except (pl.exceptions.PolarsError, OSError) as error:
        raise Failure(f"{source}: a manifest must be a CSV or Parquet table, but it cannot be read: {error}") from None
    if LOG_COLUMN not in map(str.strip, table.columns):
        raise Failure(f"{source}: a manifest must have the column {LOG_COLUMN}, but it has {', '.join(table.columns)}.")
    return [_listed(source, number, row) for number, row in enumerate(table.iter_rows(named=True), 1)]


def _listed(manifest: Path | str, number: int, row: dict[str, Any]) -> Listed:
    cells = {name.strip(): "" if value is None else str(value).strip() for name, value in row.items()}
    log = cells.pop(LOG_COLUMN)
    if not log or "\0" in log:
        raise Failure(f"{manifest}: every row must name its log, but row {number} names none. Fill in the column log.")
    date = cells.pop(DATE_COLUMN, "")
    if date:
        day_of(date, f"{manifest}: row {number}")
    return Listed(_log_of(manifest, log), cells.pop(UNIT_COLUMN, ""), date, cells)


def _log_of(manifest: Path | str, log: str) -> Path | str:
    """A log as a manifest names it: an address, or a path from its folder on."""
    if is_address(log):
        return log
    return manifest.parent / log if isinstance(manifest, Path) else f"{folder_of(manifest)}/{log}"


def day_of(date: str, place: str = "A manifest") -> float:
    """Days [d] since 1970 of a date or a time, of UTC where it says its offset; raises Failure where it is none."""
    try:
        found = datetime.fromisoformat(date)
        moment = found.astimezone(UTC) if found.tzinfo else found
    except (ValueError, OverflowError):
        raise Failure(f"{place}: a date must be like 2026-03-31 or 2026-03-31T14:05, not '{date}'.") from None
    return (moment.replace(tzinfo=None) - datetime(1970, 1, 1)).total_seconds() / 86400.0


def listed_logs(given: Sequence[Path | str]) -> list[Listed]:
    """Logs, and those that manifests among them list; a pattern stands for the files that fit it.

    Raises Failure for a manifest that cannot be used, and for a pattern that no file fits.
    """
    return [listed for source in given for listed in _listed_by(source if is_address(source) else Path(source))]


def _listed_by(source: Path | str) -> Iterator[Listed]:
    if isinstance(source, str):
        if any(c in source.partition("://")[2].partition("/")[2] for c in ADDRESS_PATTERN_MARKS):
            yield from map(Listed, matching(source))
        else:
            yield from read_manifest(source) if is_manifest(source) else [Listed(source)]
    elif any(c in source.name for c in PATTERN_MARKS) and not source.exists():
        found = sorted(source.parent.glob(source.name))
        if not found:
            raise Failure(f"A pattern must fit some file, but none fits {source}.")
        for one in found:
            yield from _listed_by(one)
    elif is_manifest(source):
        yield from read_manifest(source)
    else:
        yield Listed(source)
