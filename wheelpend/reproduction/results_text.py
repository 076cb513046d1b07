"""A reproduction on the terminal: tables, choices and findings."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import groupby
from pathlib import Path
from typing import TYPE_CHECKING

from wheelpend.reports.console import print_line, print_table
from wheelpend.reproduction.sentences import bound_sentence, effect_sentences, finding_sentences
from wheelpend.reproduction.table_text import (
    case_title,
    condition_table,
    deviation_table,
    error_table,
    prediction_tables,
)

if TYPE_CHECKING:
    from wheelpend.reproduction.record import Reproduction

METHOD_GROUPS = (  # each fits in a line of a terminal
    ("differentiation",),
    ("filtered_zoh", "filtered_foh"),
    ("iv", "shooting", "cramer_rao"),
)


def tables_of(result: Reproduction) -> Iterator[tuple[str, list[str], list[list[str]]]]:
    """Title, head and rows of every table that there is, narrow enough for a terminal."""
    for name, cells in (("Table 1", result.table1), ("Table 2", result.table2)):
        for command in dict.fromkeys(c.command for c in cells):
            for group in METHOD_GROUPS:
                own = [c for c in cells if c.command == command and c.method in group]
                if own:
                    yield f"{name}, {command} command: error [%], median (10–90 %)", *error_table(own)
    if result.conditions:
        yield "Condition numbers", *condition_table(result)
    for _, own_rows in groupby(result.table3, key=lambda r: r.case):
        rows = list(own_rows)
        yield f"Table 3, {case_title(rows[0])}: error [%]", *deviation_table(rows)
    for caption, grid in prediction_tables(result.predictions):
        yield f"Figure 5, RMSE of the predictions. {caption}", *grid


def print_reproduction(result: Reproduction) -> None:
    """Print the tables, the choices and the findings."""
    for title, head, rows in tables_of(result):
        print_table(title, head, rows)
    if result.table1 or result.table2:
        print_line("Rank: the share of our draws whose error is smaller than that of the paper's single draw.")
        print_line(bound_sentence(result))
    print_line("What the paper leaves open, and the factors by which the tables change with another choice:")
    for choice in result.choices:
        print_line(f"- {choice.name}: {choice.made}")
        for sentence in effect_sentences(choice):
            print_line(f"    {sentence}")
    for sentence in finding_sentences(result):
        print_line(sentence)
    paths = [Path(p) for p in result.written]
    print_line(f"Wrote {', '.join(p.name for p in paths)} to {paths[0].parent}/." if paths else "Nothing was written.")
