"""Results of logs as rows of a Parquet table, with all that they hold, and back."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from derive.files import replacing
from wheelpend.campaigns.journal import with_tuples
from wheelpend.campaigns.one_log import ErrorCovariance, Estimate, LogResult, NamedEffect
from wheelpend.errors import Failure
from wheelpend.files import refuse_special_file, write_errors
from wheelpend.serialise import plain_data

VERSION_COLUMN = "version"  # of the log's file: what tells that it has changed
BY_NAME_COLUMNS = ("fit_percent", "conditions")  # dictionaries: lists of name and value
NEVER_NULL = ("log", VERSION_COLUMN, "unit", "date", "named", "effects", "parameters", *BY_NAME_COLUMNS, "warnings")
Row = dict[str, Any]


def row_of(key: str, version: str, result: LogResult) -> Row:
    """A result as a row of plain data, in which what is by name is a list; ``key`` names its log."""
    data = plain_data(result)
    named = [{"name": name, **estimate} for name, estimate in data.pop("parameters").items()]
    by_name = {c: [{"name": n, "value": v} for n, v in data.pop(c).items()] for c in BY_NAME_COLUMNS}
    row = {VERSION_COLUMN: version, **data, "log": key, "parameters": named, **by_name}
    return {name: _with_plain_text(value) for name, value in row.items()}


def plain_text(text: str) -> str:
    """A text that can be written as UTF-8: what of a file's name cannot is escaped."""
    return text.encode(errors="backslashreplace").decode()


def _with_plain_text(value: Any) -> Any:
    if isinstance(value, str):
        return plain_text(value)
    if isinstance(value, list):
        return [_with_plain_text(v) for v in value]
    return {n: _with_plain_text(v) for n, v in value.items()} if isinstance(value, dict) else value


def holds_result(row: Any, key: str) -> bool:
    """True of a row, found in a journal, that can be a result of this log."""
    try:
        return bool(row["log"] == key and isinstance(row[VERSION_COLUMN], str) and result_of(row))
    except (AttributeError, KeyError, TypeError, ValueError):
        return False


def result_of(row: Mapping[str, Any]) -> LogResult:
    """The result that a row holds."""
    fields = {name: with_tuples(value) for name, value in row.items() if name != VERSION_COLUMN}
    fields["parameters"] = {p["name"]: Estimate(p["value"], p["sigma"]) for p in row["parameters"]}
    fields["named"] = tuple(NamedEffect(n["effect"], tuple(n["equivalent_to"])) for n in row["named"])
    for column in BY_NAME_COLUMNS:
        fields[column] = {pair["name"]: pair["value"] for pair in row[column]}
    if row["covariance"] is not None:
        fields["covariance"] = ErrorCovariance(**{k: with_tuples(v) for k, v in row["covariance"].items()})
    return LogResult(**fields)


def schema() -> dict[str, Any]:
    """Types of the table's columns."""
    import polars as pl  # imported late: loading Polars takes longer than reading a journal

    texts = pl.List(pl.String)
    return {
        "log": pl.String,
        VERSION_COLUMN: pl.String,
        "unit": pl.String,
        "date": pl.String,
        "seed": pl.Int64,
        "failure": pl.String,
        "verdict": pl.String,
        "named": pl.List(pl.Struct({"effect": pl.String, "equivalent_to": texts})),
        "effects": texts,
        "error": pl.Float64,
        "error_after": pl.Float64,
        "noise_floor": pl.Float64,
        "parameters": pl.List(pl.Struct({"name": pl.String, "value": pl.Float64, "sigma": pl.Float64})),
        "covariance": pl.Struct({"names": texts, "matrix": pl.List(pl.List(pl.Float64))}),
        "fit_percent": pl.List(pl.Struct({"name": pl.String, "value": pl.Float64})),
        "conditions": pl.List(pl.Struct({"name": pl.String, "value": pl.String})),
        "warnings": texts,
    }


def write_rows(path: Path, rows: Iterable[Row]) -> None:
    """Write rows as Parquet, complete or not at all; raises Failure where the file cannot be written."""
    import polars as pl  # imported late, as above

    with write_errors(str(path)), replacing([path]) as (partial,):
        pl.DataFrame(list(rows), schema=schema()).write_parquet(partial)


def read_rows(path: Path, columns: list[str] | None = None) -> list[Row]:
    """Rows of a Parquet file, or some of their columns; raises Failure where it holds no results."""
    import polars as pl  # imported late, as above

    from wheelpend.logs.polars_files import no_panic

    refuse_special_file(path)
    expected = schema()
    try:
        with no_panic(str(path)):
            found = pl.read_parquet(path, columns=columns, hive_partitioning=False)
    except (pl.exceptions.PolarsError, OSError, Failure) as error:
        raise Failure(_no_results(path, f"it cannot be read ({error})")) from None
    if dict(found.schema) != {name: expected[name] for name in columns or expected}:
        raise Failure(_no_results(path, f"its columns are others: {', '.join(found.columns)}"))
    whole = [name for name in NEVER_NULL if name in found.columns]
    if any(found.select(whole).null_count().row(0)):
        raise Failure(_no_results(path, f"there are gaps in {', '.join(whole)}"))
    return found.rows(named=True)


def _no_results(path: Path, why: str) -> str:
    return f"{path} must hold results of a campaign, but {why}. Delete it: its logs are analysed again."
