"""The table, as text and in Markdown."""

from __future__ import annotations

import platform
import subprocess
from collections.abc import Sequence
from importlib.metadata import version
from pathlib import Path

import llvmlite.binding as llvm

from wheelpend.benchmarks.markdown import replace_between
from wheelpend.benchmarks.speed.record import Measured, NotMeasurableError
from wheelpend.benchmarks.speed.reference import compiler
from wheelpend.benchmarks.speed.rows import wide_vectors
from wheelpend.files import write_text
from wheelpend.reports.numbers import time_text, whole_digits_text

TABLE_HEADER = ("work", "ours", "reference", "ratio", "goal", "met")
BEGIN_MARK, END_MARK = "<!-- written by make bench -->", "<!-- end -->"
RATIO_EXPLANATION = (
    "The ratio says how many times as fast as the reference ours is; where the goal is an 'at most', how many times as "
    "long it takes."
)


def row_cells(found: Measured) -> tuple[str, ...]:
    """Cells of a row: work, both times, ratio, goal, and whether it is met."""
    row, met = found.row, {True: "yes", False: "no", None: "absent"}[found.met]
    if found.times is None:
        return row.work, "", row.reference, "", str(row.goal), met
    ours, theirs = (time_text(x, row.piece) for x in found.times)
    return (
        row.work,
        ours,
        f"{theirs}, {row.reference}",
        whole_digits_text(row.goal.ratio(found.times)),
        str(row.goal),
        met,
    )


def notes(results: Sequence[Measured]) -> list[str]:
    """Notes below the table: the meaning of its ratio, the machine, and the absent rows with their reasons."""
    absent = [f"Absent: {r.row.name}, because {r.absent}." for r in results if r.times is None]
    return [RATIO_EXPLANATION, machine_text(), *absent]


def machine_text() -> str:
    """Processor, compiler and versions."""
    versions = [f"{name} {version(name)}" for name in ("numba", "numpy", "sympy")]
    return (
        f"Measured on {llvm.get_host_cpu_name()} with {512 if wide_vectors() else 256}-bit vectors; {c_version()}; "
        f"Python {platform.python_version()}, {', '.join(versions)}; one thread for linear algebra."
    )


def c_version() -> str:
    """The C compiler's name and version."""
    try:
        command = [compiler(), "--version"]
    except NotMeasurableError as reason:
        return str(reason)
    return subprocess.run(command, capture_output=True, text=True, check=False).stdout.partition("\n")[0]


def table_text(results: Sequence[Measured]) -> str:
    """The table in Markdown with aligned columns, and its notes."""
    lines = [TABLE_HEADER, *map(row_cells, results)]
    widths = [max(map(len, column)) for column in zip(*lines, strict=True)]
    rows = [[cell.ljust(width) for cell, width in zip(line, widths, strict=True)] for line in lines]
    rows.insert(1, ["-" * width for width in widths])
    return "\n\n".join(["\n".join(f"| {' | '.join(row)} |" for row in rows), *notes(results)]) + "\n"


def write(path: Path, results: Sequence[Measured]) -> None:
    """Write the table: into a page that has a place for it, between its two marks, else as a page of its own."""
    before = path.read_text(encoding="utf-8") if path.exists() else ""
    if BEGIN_MARK not in before or END_MARK not in before:
        before = f"# Speed beside peers\n\n{BEGIN_MARK}{END_MARK}\n"
    write_text(path, replace_between(before, BEGIN_MARK, END_MARK, f"\n\n{table_text(results)}\n"))
