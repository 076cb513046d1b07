"""``python -m wheelpend.benchmarks.probabilities``: diagnose logs whose truth is known, and count."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from wheelpend.benchmarks.probabilities.cases import KIND_SHARES, plan
from wheelpend.benchmarks.probabilities.page import section_text, write
from wheelpend.benchmarks.probabilities.runner import run
from wheelpend.errors import Failure
from wheelpend.reports.console import err, exit_on_failure, print_line


def main(
    only: Annotated[list[str] | None, typer.Option(help="first or second set; repeat for both.")] = None,
    logs: Annotated[int | None, typer.Option(min=1, help="Logs of each set; 300 and 100 without.")] = None,
    folder: Annotated[Path, typer.Option(help="Where outcomes are kept.")] = Path("benchmark/probabilities"),
    jobs: Annotated[int | None, typer.Option(min=1, help="Processes; as many as cores without.")] = None,
    minutes: Annotated[float | None, typer.Option(min=0, help="Begin no log later; 0 tells what is known.")] = None,
    out: Annotated[Path | None, typer.Option(help="Write the tables into this page, docs/trust.md.")] = None,
) -> None:
    """Measure whether probabilities of a diagnosis mean what they say; goes on where it was interrupted."""
    with exit_on_failure():
        if wrong := sorted(set(only or []) - set(KIND_SHARES)):
            raise Failure(f"A set must be one of {', '.join(KIND_SHARES)}, not {', '.join(wrong)}.")
        cases = [c for of in only or KIND_SHARES for c in plan(of, logs)]
        found = run(folder, cases, minutes=minutes, jobs=jobs, progress=lambda line: err.print(line, markup=False))
        outcomes = {of: [o for o in found if o.key.startswith(f"{of} ")] for of in KIND_SHARES}
        print_line(section_text(outcomes))
        if out:
            write(out, outcomes)


if __name__ == "__main__":
    typer.run(main)
