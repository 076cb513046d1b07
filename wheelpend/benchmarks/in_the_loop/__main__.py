"""``python -m wheelpend.benchmarks.in_the_loop``: run both studies, print their tables, write them into a page."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from wheelpend.benchmarks.in_the_loop.page import section_text, write
from wheelpend.benchmarks.in_the_loop.runner import DEFAULT_SEEDS, STUDY_NAMES, plan, run
from wheelpend.errors import Failure
from wheelpend.reports.console import err, exit_on_failure, print_line


def main(
    only: Annotated[list[str] | None, typer.Option(help="compensate or learn; repeat for both.")] = None,
    seeds: Annotated[int, typer.Option(min=1, help="Draws, and records.")] = DEFAULT_SEEDS,
    folder: Annotated[Path, typer.Option(help="Where answers are kept.")] = Path("benchmark/in_the_loop"),
    jobs: Annotated[int | None, typer.Option(min=1, help="Processes; as many as cores without.")] = None,
    minutes: Annotated[float | None, typer.Option(min=0, help="Begin no trial later; 0 tells what is known.")] = None,
    out: Annotated[Path | None, typer.Option(help="Write tables and picture into this page, docs/export_c.md.")] = None,
) -> None:
    """Measure what an exported compensator and identifier do in a loop; goes on where it was interrupted."""
    with exit_on_failure():
        if wrong := sorted(set(only or []) - set(STUDY_NAMES)):
            raise Failure(f"A study must be one of {', '.join(STUDY_NAMES)}, not {', '.join(wrong)}.")
        keys = plan(only or STUDY_NAMES, seeds)
        answers = run(folder, keys, jobs=jobs, minutes=minutes, progress=lambda line: err.print(line, markup=False))
        print_line(section_text(answers))
        if out:
            write(out, answers)


if __name__ == "__main__":
    typer.run(main)
