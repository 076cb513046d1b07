"""Markdown that the benchmarks write: tables, and the marked place of a page that a command fills."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path

from wheelpend.errors import Failure
from wheelpend.files import write_text


def markdown_table(header: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """A table without a line break at its end."""
    lines = ["| " + " | ".join(map(str, row)) + " |" for row in (header, ["---"] * len(header), *rows)]
    return "\n".join(lines)


def replace_between(page: str, begin: str, end: str, content: str) -> str:
    """The page with ``content`` in place of what stands between its first ``begin`` mark and the next ``end`` mark."""
    head, _, rest = page.partition(begin)
    return f"{head}{begin}{content}{end}{rest.partition(end)[2]}"


def write_between(path: Path, page: str, begin: str, end: str, content: str) -> None:
    """Write a page with ``content`` between its marks; raises Failure where it has none."""
    if begin not in page or end not in page:
        raise Failure(f"{path} must have the lines {begin} and {end}, between which the section is written. Add them.")
    write_text(path, replace_between(page, begin, end, f"\n\n{content}\n\n"))
