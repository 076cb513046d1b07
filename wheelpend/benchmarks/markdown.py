"""Markdown that the benchmarks write: tables, and the marked place of a page that a command fills."""

from __future__ import annotations

from collections.abc import Iterable, Sequence


def markdown_table(header: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """A table without a line break at its end."""
    lines = ["| " + " | ".join(map(str, row)) + " |" for row in (header, ["---"] * len(header), *rows)]
    return "\n".join(lines)


def replace_between(page: str, begin: str, end: str, content: str) -> str:
    """The page with ``content`` in place of what stands between its first ``begin`` mark and the next ``end`` mark."""
    head, _, rest = page.partition(begin)
    return f"{head}{begin}{content}{end}{rest.partition(end)[2]}"
