"""``python -m wheelpend.benchmarks.random_force``: run the studies, print their tables, write them into a page."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from wheelpend.benchmarks.random_force.page import section_text, write
from wheelpend.benchmarks.random_force.runner import STUDY_NAMES, plan, run
from wheelpend.errors import Failure
from wheelpend.reports.console import err, exit_on_failure, print_line


def main(
    only: Annotated[list[str] | None, typer.Option(help="complete, forces or lawful; repeat for several.")] = None,
    seeds: Annotated[int | None, typer.Option(min=1, help="Logs of each; 400 complete and 12 others without.")] = None,
    folder: Annotated[Path, typer.Option(help="Where answers are kept.")] = Path("benchmark/random_force"),
    jobs: Annotated[int | None, typer.Option(min=1, help="Processes; as many as cores without.")] = None,
    minutes: Annotated[float | None, typer.Option(min=0, help="Begin no log later; 0 tells what is known.")] = None,
    out: Annotated[Path | None, typer.Option(help="Write the tables into this page, docs/statistics.md.")] = None,
) -> None:
    """Measure precision, coverage and random forces of the filter-error method; goes on where it was interrupted."""
    with exit_on_failure():
        if wrong := sorted(set(only or []) - set(STUDY_NAMES)):
            raise Failure(f"A study must be one of {', '.join(STUDY_NAMES)}, not {', '.join(wrong)}.")
        cases = plan(only or STUDY_NAMES, seeds)
        answers = run(folder, cases, jobs=jobs, minutes=minutes, progress=lambda line: err.print(line, markup=False))
        print_line(section_text(answers))
        if out:
            write(out, answers)


if __name__ == "__main__":
    typer.run(main)
