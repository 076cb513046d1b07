"""A campaign as a table for other programs: CSV, one line per log."""

from __future__ import annotations

import csv
import io
from pathlib import Path
from typing import Any, TextIO

from wheelpend.campaigns.one_log import LogResult
from wheelpend.campaigns.runner import Campaign
from wheelpend.files import refuse_special_file, replacing

TABLE_PREFIXES = (b"log,failure", b"seed,failure")  # of the first line of a campaign's table
LISTED_COLUMNS = ("unit", "date")
VERDICT_COLUMNS = ("verdict", "named", "equivalent_to", "error", "error_after", "noise_floor")


def write_csv(path: Path, result: Campaign) -> None:
    """Write the table, complete or not at all; raises Failure where it cannot be written."""
    with replacing(path) as partial, partial.open("w", encoding="utf-8", errors="backslashreplace", newline="") as file:
        write_table(file, result)


def csv_text(result: Campaign) -> str:
    """The table as a text."""
    text = io.StringIO()
    write_table(text, result)
    return text.getvalue()


def write_table(file: TextIO, result: Campaign) -> None:
    """One line per log; empty columns are left out, and what a log does not identify is blank."""
    channels, parameters, filled = dict[str, None](), dict[str, None](), set[str]()
    for one in result.logs:
        channels.update(dict.fromkeys(f"fit_percent.{c}" for c in one.fit_percent))
        parameters.update(dict.fromkeys(one.parameters))
        filled.update(c for c, v in table_row(one).items() if v not in (None, ""))
    columns = [
        *LISTED_COLUMNS,
        *VERDICT_COLUMNS,
        *channels,
        *(c for n in parameters for c in (n, f"{n}_sigma")),
        "warnings",
    ]
    head = ["seed" if result.simulated else "log", "failure", *(c for c in columns if c in filled)]
    writer = csv.DictWriter(file, head, extrasaction="ignore", lineterminator="\n")
    writer.writeheader()
    writer.writerows({c: _cell_value(v) for c, v in table_row(one).items()} for one in result.logs)


def _cell_value(value: Any) -> Any:
    """A number with nine digits; a text on one line."""
    if isinstance(value, float):
        return f"{value:.9g}"
    return " ".join(value.split()) if isinstance(value, str) else value


def table_row(result: LogResult) -> dict[str, Any]:
    """One log's line, by column."""
    return {
        "log": result.log,
        "seed": result.seed,
        "unit": result.unit,
        "date": result.date,
        "failure": result.failure,
        "verdict": result.verdict,
        "named": " ".join(n.effect for n in result.named),
        "equivalent_to": " ".join(e for n in result.named for e in n.equivalent_to),
        "error": result.error,
        "error_after": result.error_after,
        "noise_floor": result.noise_floor,
        **{f"fit_percent.{c}": v for c, v in result.fit_percent.items()},
        **{n: e.value for n, e in result.parameters.items()},
        **{f"{n}_sigma": e.sigma for n, e in result.parameters.items()},
        "warnings": " ".join(result.warnings),
    }


def is_campaign_table(path: Path) -> bool:
    """True where a file is the table of a campaign."""
    refuse_special_file(path)
    try:
        with path.open("rb") as file:
            return file.read(20).startswith(TABLE_PREFIXES)
    except OSError:
        return False
