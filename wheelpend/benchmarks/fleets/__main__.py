"""``python -m wheelpend.benchmarks.fleets``: simulated fleets, some of whose units aged, and what is said of them."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Annotated

import typer

from wheelpend.benchmarks.fleets.cases import ALL_FLEETS, plan
from wheelpend.benchmarks.fleets.made_up import count_made_up
from wheelpend.benchmarks.fleets.page import section_text, write
from wheelpend.benchmarks.fleets.summary import count_fleets
from wheelpend.benchmarks.fleets.trial import Answer, try_unit
from wheelpend.benchmarks.recording import from_journal, record_answers, study_journal
from wheelpend.reports.console import err, exit_on_failure, print_line

NOT_ASKED = ("benchmarks/fleets/page.py", "benchmarks/fleets/summary.py", "benchmarks/fleets/__main__.py",
             "benchmarks/fleets/made_up.py")  # fmt: skip


def main(
    fleets: Annotated[int, typer.Option(min=1, max=ALL_FLEETS, help="How many.")] = ALL_FLEETS,
    folder: Annotated[Path, typer.Option(help="Where answers are kept.")] = Path("benchmark/fleets"),
    jobs: Annotated[int | None, typer.Option(min=1, help="Processes; as many as cores without.")] = None,
    minutes: Annotated[float | None, typer.Option(min=0, help="Begin no log later; 0 tells what is known.")] = None,
    out: Annotated[Path | None, typer.Option(help="Write the table into this page, docs/fleets.md.")] = None,
) -> None:
    """Measure how many aged units of a fleet are found, and how many others are accused; goes on where it stopped."""
    with exit_on_failure():
        units, journal = plan(fleets), study_journal(folder, "answers", NOT_ASKED)
        left = [u for u in units if u.key not in journal.results]
        seconds = float("inf") if minutes is None else 60.0 * minutes
        trials = [partial(try_unit, u) for u in left] if seconds > 0.0 else []
        for _ in record_answers(journal, trials, _told, seconds=seconds, jobs=jobs,
                                progress=lambda line: err.print(line, markup=False)):  # fmt: skip
            pass
        answers = {key: from_journal(Answer, row) for key, row in journal.results.items()}
        found = count_fleets(units, answers)
        made_up = count_made_up()
        print_line(section_text(found, made_up))
        if out:
            write(out, found, made_up)


def _told(answer: Answer) -> tuple[str, str]:
    return answer.key, answer.failure or "identified"


if __name__ == "__main__":
    typer.run(main)
