"""The history of a workspace as text."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from wheelpend.reports.numbers import number_text
from wheelpend.reports.text.table import Table

HISTORY_COLUMNS = ("date", "change", "error before", "error after", "logs")


def history_block(entries: Sequence[Mapping[str, Any]]) -> Table | str:
    """Every change with the errors before and after it, or that there is none."""
    rows = [
        (
            str(e.get("date", "")),
            e["change"],
            number_text(e.get("error_before")),
            number_text(e.get("error_after")),
            ", ".join(e.get("logs", [])),
        )
        for e in entries
    ]
    return Table("History", HISTORY_COLUMNS, rows) if rows else "No change has been recorded yet."
