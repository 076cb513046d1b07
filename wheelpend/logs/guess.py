"""A guess of how a file's columns map onto those of a plant: by names, units and clock."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

from wheelpend.logs.columns import ColumnMap, ColumnTable, guess_columns, guess_unit
from wheelpend.logs.read import find_time_column, numbered, open_file
from wheelpend.logs.tables import Table
from wheelpend.logs.units import UNIT_CONVERSIONS


def guess_column_maps(path: Path, columns: Mapping[str, ColumnMap], table: ColumnTable) -> dict[str, ColumnMap]:
    """Column maps of the quantities that a file has under no known name; raises Failure where it cannot be read.

    Guessed by name, with the unit that a name ends with; time also as the first column that grows from row to row, in
    the unit that gives a plausible sample interval.
    """
    path = Path(path)
    file = numbered(open_file(path), columns)
    known = {n: columns[n].column if n in columns else n for n in table.names}
    absent = [n for n in table.required if known[n] not in file.names and n not in file.names]
    free = [n for n in file.names if n not in known.values()]
    guessed = guess_columns(free, absent, table)
    found = {n: ColumnMap(c, unit_of_column(file, c, table.units[n])) for n, c in guessed.items() if c}
    if "t" in absent and (clock := find_time_column(file, found["t"].column if "t" in found else "", free)):
        found["t"] = clock
    return {n: c if c.unit != table.units[n] else replace(c, unit="") for n, c in found.items()}


def unit_of_column(file: Table, column: str, own: str) -> str:
    """The unit of a column by the file's row of units, or else by the column's name."""
    stated = file.units.get(column, "")
    return stated if UNIT_CONVERSIONS.get(stated, ("", 1.0))[0] == own else guess_unit(own, column)
