"""Commands on the paper: verify, reproduce."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from wheelpend.cli.app import app
from wheelpend.cli.next_step import Asked
from wheelpend.cli.options import MAX_SEEDS, Json
from wheelpend.files import write_text
from wheelpend.reports.console import exit_on_failure, print_result, progress


@app.command()
def verify(
    page: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Also write the findings as a Markdown page.")
    ] = None,
    json: Json = None,
) -> None:
    """Derived equations against every numbered equation of the paper: match, misprint or assumption."""
    # imported late, as in every command: the list of commands needs no SymPy
    from wheelpend.paper.page import page_text as page_of
    from wheelpend.paper.verification import verify as run
    from wheelpend.paper.verification_text import print_verification

    with exit_on_failure(json, page):
        with progress("deriving and comparing 43 equations"):
            result = run()
        print_result(result, json, lambda: print_verification(result))
        if page is not None:
            write_text(page, page_of(result))
        Asked((), json=json).say_next("the paper's tables and figures, half a minute", "reproduce")


@app.command()
def reproduce(
    what: Annotated[str, typer.Argument(help="table1, table2, table3, figures or all.")] = "all",
    out: Annotated[Path, typer.Option(help="Folder for the tables, the pictures and gallery.html.")] = Path(
        "reproduction"
    ),
    seeds: Annotated[int, typer.Option(help="Draws of the sensor noise.", max=MAX_SEEDS)] = 100,
    json: Json = None,
) -> None:
    """The paper's tables and figures, its numbers beside ours over many seeds; writes CSV, PNG and one page."""
    from wheelpend.reproduction import print_reproduction, run  # imported late: loads Numba

    with exit_on_failure(json):
        with progress("preparing the kernels") as update:
            result = run(what, out, seeds, progress=update)
        print_result(result, json, lambda: print_reproduction(result))
        Asked((), json=json).say_next("what such a model may be missing, on a shipped log", "demo")
