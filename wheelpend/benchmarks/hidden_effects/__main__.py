"""``python -m wheelpend.benchmarks.hidden_effects``: run the benchmark, print its findings and write the page."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from wheelpend.benchmarks.hidden_effects.cases import plan
from wheelpend.benchmarks.hidden_effects.page import page_text
from wheelpend.benchmarks.hidden_effects.runner import run
from wheelpend.benchmarks.hidden_effects.summary import summarise
from wheelpend.errors import Failure
from wheelpend.files import write_text
from wheelpend.reports.console import err, exit_on_failure, print_line


def main(
    folder: Annotated[Path, typer.Option(help="Where outcomes are kept.")] = Path("benchmark"),
    minutes: Annotated[float | None, typer.Option(help="Stop after so long; all of it without.")] = None,
    only: Annotated[list[str] | None, typer.Option(help="Only cases of this kind, such as complete; repeat.")] = None,
    out: Annotated[Path | None, typer.Option(help="Write the page here.")] = None,
) -> None:
    """Hide effects in logs and see how often they are found."""
    with exit_on_failure():
        known = {c.kind for c in plan()}
        if wrong := sorted(set(only or []) - known):
            raise Failure(f"A kind must be one of {', '.join(sorted(known))}, not {', '.join(wrong)}.")
        cases = [c for c in plan() if not only or c.kind in only]
        found = run(folder, minutes=minutes, cases=cases, progress=lambda line: err.print(line, markup=False))
        text = page_text(summarise(found), len(cases))
        print_line(text)
        if out:
            write_text(out, text)


if __name__ == "__main__":
    typer.run(main)
