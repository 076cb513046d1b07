"""Write docs/emps.md and docs/robot.md: python -m wheelpend.benchmarks.measured [--data FOLDER] [--out docs]."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Annotated

import typer

from wheelpend.benchmarks.measured.emps import BALANCING_LOG, ESTIMATION_LOG, PULSES_LOG, emps_page_text
from wheelpend.benchmarks.measured.robot import robot_page_text
from wheelpend.errors import Failure
from wheelpend.files import write_text
from wheelpend.reports.console import exit_on_failure, progress

app = typer.Typer(add_completion=False)


@app.command()
def main(
    data: Annotated[Path | None, typer.Option(help="Folder of the logs; $WHEELPEND_DATA, or ../shared/data.")] = None,
    out: Annotated[Path, typer.Option(help="Folder of the pages and their pictures.")] = Path("docs"),
) -> None:
    """Write docs/emps.md and docs/robot.md with their pictures, from the measured logs."""
    folder = data or Path(os.environ.get("WHEELPEND_DATA", "../shared/data"))
    with exit_on_failure(), progress("reading") as update:
        for name in (ESTIMATION_LOG, PULSES_LOG, BALANCING_LOG):
            if not (folder / name).exists():
                raise Failure(f"The logs must be in {folder}, but {name} is not there. See docs/emps.md and "
                              "docs/robot.md for where to find them.")  # fmt: skip
        out.mkdir(parents=True, exist_ok=True)
        write_text(out / "emps.md", emps_page_text(folder / ESTIMATION_LOG, folder / PULSES_LOG, out, update))
        write_text(out / "robot.md", robot_page_text(folder / BALANCING_LOG, out, update))


if __name__ == "__main__":
    app()
