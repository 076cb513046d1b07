"""Separator and column names of a CSV file, from its header row."""

from __future__ import annotations

import csv
from pathlib import Path

from wheelpend.errors import Failure

MISSING_CELLS = ("", "nan", "NaN", "NAN", "NA", "N/A", "null", "None", "-nan")


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


def check_unique(log: str, names: list[str]) -> list[str]:
    """Return the names; raises Failure when one is there twice."""
    twice = sorted({n for n in names if names.count(n) > 1})
    if twice:
        raise Failure(f"{log}: column names must differ; {', '.join(twice)} is there more than once. Rename one.")
    return names


def first_line(error: Exception) -> str:
    """The first line of another library's message, without its full stop."""
    return str(error).strip().partition("\n")[0].rstrip(".")
