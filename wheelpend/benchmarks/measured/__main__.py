"""Write the pages of the case studies: python -m wheelpend.benchmarks.measured [--only NAME] [--data FOLDER]."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, NamedTuple

import typer

from wheelpend.benchmarks.measured.arm import ARM_LOG, arm_page_text
from wheelpend.benchmarks.measured.emps import BALANCING_LOG, ESTIMATION_LOG, PULSES_LOG, emps_page_text
from wheelpend.benchmarks.measured.pairs import PAIRS_FOLDER
from wheelpend.benchmarks.measured.pendulum import DECAY_LOG, pendulum_page_text
from wheelpend.benchmarks.measured.robot import robot_page_text
from wheelpend.benchmarks.measured.servo import servo_page_text
from wheelpend.benchmarks.measured.servo_logs import LOG_NAMES, SERVO_FOLDER
from wheelpend.errors import Failure, did_you_mean
from wheelpend.files import write_text
from wheelpend.reports.console import exit_on_failure, progress

app = typer.Typer(add_completion=False)
PageWriter = Callable[[Path, Path, Callable[[str], None]], str]


class Story(NamedTuple):
    """A page: the logs that it needs, and the text that it gets from their folder, for the folder of its pictures."""

    logs: tuple[str, ...]
    page_text: PageWriter


CASE_STUDIES = {
    "emps": Story(
        (ESTIMATION_LOG, PULSES_LOG),
        lambda data, out, update: emps_page_text(data / ESTIMATION_LOG, data / PULSES_LOG, out, update),
    ),
    "robot": Story((BALANCING_LOG,), lambda data, out, update: robot_page_text(data / BALANCING_LOG, out, update)),
    "pendulum": Story((DECAY_LOG,), lambda data, out, update: pendulum_page_text(data / DECAY_LOG, out, update)),
    "servo": Story(
        tuple(f"{SERVO_FOLDER}/{name}.csv" for name in LOG_NAMES),
        lambda data, out, update: servo_page_text(data / SERVO_FOLDER, PAIRS_FOLDER, out, update),
    ),
    "arm": Story((ARM_LOG,), lambda data, out, update: arm_page_text(data / ARM_LOG, out, update)),
}


@app.command()
def main(
    only: Annotated[list[str] | None, typer.Option(help=f"{', '.join(CASE_STUDIES)}; repeat for several.")] = None,
    data: Annotated[Path | None, typer.Option(help="Folder of the logs; $WHEELPEND_DATA, or ../shared/data.")] = None,
    out: Annotated[Path, typer.Option(help="Folder of the pages and their pictures.")] = Path("docs"),
) -> None:
    """Write the pages of the case studies with their pictures, all or some, from the measured logs."""
    folder = data or Path(os.environ.get("WHEELPEND_DATA", "../shared/data"))
    with exit_on_failure(), progress("reading") as update:
        wanted = list(dict.fromkeys(only or CASE_STUDIES))
        for name in wanted:
            require_story(name, folder)
        out.mkdir(parents=True, exist_ok=True)
        for name in wanted:
            write_text(out / f"{name}.md", CASE_STUDIES[name].page_text(folder, out, update))


def require_story(name: str, folder: Path) -> None:
    """Raise Failure where there is no story of a name, or not all of its logs are in the folder."""
    if name not in CASE_STUDIES:
        raise Failure(
            f"A story must be one of {', '.join(CASE_STUDIES)}, not {name}.{did_you_mean(name, list(CASE_STUDIES))}"
        )
    for log in CASE_STUDIES[name].logs:
        if not (folder / log).exists():
            raise Failure(
                f"The logs must be in {folder}, but {log} is not there. See docs/{name}.md for where to find it."
            )


if __name__ == "__main__":
    app()
