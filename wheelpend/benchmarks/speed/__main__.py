"""``python -m wheelpend.benchmarks.speed``: measure, print and write the table."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Annotated

import typer

from wheelpend.parallel import THREADS


def main(
    only: Annotated[list[str] | None, typer.Option(help="Only this row, such as loop; repeat.")] = None,
    out: Annotated[Path | None, typer.Option(help="Write the table here, in Markdown.")] = None,
    peers: Annotated[Path, typer.Option(help="Environment with other packages.")] = Path(".venv-peers"),
) -> None:
    """Measure how fast things are beside C and other packages."""
    os.environ.update(dict.fromkeys(THREADS, "1"))  # before NumPy is imported, here and in every process from here
    from wheelpend.benchmarks.speed.page import text, write
    from wheelpend.benchmarks.speed.rows import measure, named
    from wheelpend.benchmarks.speed.setting import Setting
    from wheelpend.reports.console import err, failures, say

    with failures():
        results = measure(named(only or []), Setting(peers), lambda line: err.print(line, markup=False))
        say(text(results))
        if out:
            write(out, results)


if __name__ == "__main__":
    typer.run(main)
