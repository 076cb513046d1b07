"""``python -m wheelpend.benchmarks.benches``: explain logs that no code of the tool simulated, and count."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from wheelpend.benchmarks.benches.cases import DEFAULT_COUNT, plan
from wheelpend.benchmarks.benches.page import page_text, write
from wheelpend.benchmarks.benches.runner import run
from wheelpend.reports.console import err, exit_on_failure, print_line


def main(
    logs: Annotated[int, typer.Option(min=1, help="Logs, of all kinds in turn.")] = DEFAULT_COUNT,
    folder: Annotated[Path, typer.Option(help="Where outcomes are kept.")] = Path("benchmark/benches"),
    jobs: Annotated[int | None, typer.Option(min=1, help="Processes; as many as cores without.")] = None,
    minutes: Annotated[float | None, typer.Option(min=0, help="Begin no log later; 0 tells what is known.")] = None,
    out: Annotated[Path | None, typer.Option(help="Write the page, docs/benches.md.")] = None,
) -> None:
    """Measure how often all that is missing is named; goes on where it was interrupted."""
    with exit_on_failure():
        found = run(folder, plan(logs), minutes=minutes, jobs=jobs, progress=lambda line: err.print(line, markup=False))
        print_line(page_text(found))
        if out:
            write(out, found)


if __name__ == "__main__":
    typer.run(main)
