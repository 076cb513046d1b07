"""A table of strings, before anybody prints it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple


class Table(NamedTuple):
    """Cells as text; every row has a cell per column."""

    title: str
    columns: Sequence[str]
    rows: Sequence[Sequence[str]]
    holds_text: bool = False  # in its columns, which then begin on the left; numbers end on the right


TextBlocks = Iterator[str | Table]  # lines and tables of a result, in the order in which they are read
