"""``python -m wheelpend.benchmarks.pushed``: diagnose logs of a robot that is pushed at random, and count."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from wheelpend.benchmarks.pushed.cases import DEFAULT_COUNT, plan
from wheelpend.benchmarks.pushed.page import section_text, write
from wheelpend.benchmarks.pushed.runner import run
from wheelpend.reports.console import err, exit_on_failure, print_line


def main(
    logs: Annotated[int, typer.Option(min=1, help="Logs, of all kinds in turn.")] = DEFAULT_COUNT,
    folder: Annotated[Path, typer.Option(help="Where outcomes are kept.")] = Path("benchmark/pushed"),
    jobs: Annotated[int | None, typer.Option(min=1, help="Processes; as many as cores without.")] = None,
    minutes: Annotated[float | None, typer.Option(min=0, help="Begin no log later; 0 tells what is known.")] = None,
    out: Annotated[Path | None, typer.Option(help="Write the tables into this page, docs/statistics.md.")] = None,
) -> None:
    """Measure what is named beside a random force; goes on where it was interrupted."""
    with exit_on_failure():
        cases = plan(logs)
        found = run(folder, cases, minutes=minutes, jobs=jobs, progress=lambda line: err.print(line, markup=False))
        print_line(section_text(found))
        if out:
            write(out, found)


if __name__ == "__main__":
    typer.run(main)
