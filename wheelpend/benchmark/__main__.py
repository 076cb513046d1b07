"""``python -m wheelpend.benchmark``: try, print and write the page."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from wheelpend.benchmark.cases import plan
from wheelpend.benchmark.page import page
from wheelpend.benchmark.study import run
from wheelpend.benchmark.summary import summarise
from wheelpend.console import err, failures, say, write_text


def main(
    folder: Annotated[Path, typer.Option(help="Where outcomes are kept.")] = Path("benchmark"),
    minutes: Annotated[float | None, typer.Option(help="Stop after so long; all of it without.")] = None,
    out: Annotated[Path | None, typer.Option(help="Write the page here.")] = None,
) -> None:
    """Hide effects in logs and see how often they are found."""
    with failures():
        text = page(
            summarise(run(folder, minutes=minutes, progress=lambda line: err.print(line, markup=False))), len(plan())
        )
        say(text)
        if out:
            write_text(out, text)


if __name__ == "__main__":
    typer.run(main)
