"""``python -m wheelpend.benchmarks.fleets``: simulated fleets, some of whose units aged, and what is said of them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from time import monotonic
from typing import Annotated, TypeVar

import typer

from wheelpend.benchmarks.fleets.cases import ALL_FLEETS, Unit, plan
from wheelpend.benchmarks.fleets.made_up import count_made_up
from wheelpend.benchmarks.fleets.page import section_text, write
from wheelpend.benchmarks.fleets.summary import count_fleets, count_lacks, standing_out
from wheelpend.benchmarks.fleets.trial import Answer, Lack, diagnose_unit, try_unit
from wheelpend.benchmarks.recording import from_journal, record_answers, study_journal
from wheelpend.campaigns.journal import Journal
from wheelpend.reports.console import err, exit_on_failure, print_line

AnyAnswer = TypeVar("AnyAnswer", Answer, Lack)
NOT_ASKED = ("benchmarks/fleets/page.py", "benchmarks/fleets/summary.py", "benchmarks/fleets/__main__.py",
             "benchmarks/fleets/made_up.py")  # fmt: skip


def main(
    fleets: Annotated[int, typer.Option(min=1, max=ALL_FLEETS, help="How many of aged units.")] = ALL_FLEETS,
    folder: Annotated[Path, typer.Option(help="Where answers are kept.")] = Path("benchmark/fleets"),
    jobs: Annotated[int | None, typer.Option(min=1, help="Processes; as many as cores without.")] = None,
    minutes: Annotated[float | None, typer.Option(min=0, help="Begin no log later; 0 tells what is known.")] = None,
    out: Annotated[Path | None, typer.Option(help="Write the table into this page, docs/fleets.md.")] = None,
) -> None:
    """Measure which units of fleets are found and what they are said to lack; goes on where it stopped."""
    with exit_on_failure():
        units, limit = plan(fleets), _Limit(float("inf") if minutes is None else 60.0 * minutes)
        answers = _answers(study_journal(folder, "answers", NOT_ASKED), units, try_unit, Answer, limit, jobs)
        odd = standing_out(units, answers)
        lacks = _answers(study_journal(folder, "diagnoses", NOT_ASKED), odd, diagnose_unit, Lack, limit, jobs)
        found, lacking, made_up = count_fleets(units, answers), count_lacks(units, odd, lacks), count_made_up()
        print_line(section_text(found, lacking, made_up))
        if out:
            write(out, found, lacking, made_up)


class _Limit:
    """Seconds in which trials may begin, all stages together."""

    def __init__(self, seconds: float) -> None:
        self._seconds, self._begin = seconds, monotonic()

    def left(self) -> float:
        """Seconds that are left."""
        return max(0.0, self._seconds - (monotonic() - self._begin))


def _answers(
    journal: Journal,
    units: Sequence[Unit],
    ask: Callable[[Unit], AnyAnswer],
    kind: Callable[..., AnyAnswer],
    limit: _Limit,
    jobs: int | None,
) -> dict[str, AnyAnswer]:
    """Answers of units by their keys, those of the journal and, while there is time, the rest."""
    left = [partial(ask, u) for u in units if u.key not in journal.results] if limit.left() else []
    for _ in record_answers(journal, left, _told, seconds=limit.left(), jobs=jobs,
                            progress=lambda line: err.print(line, markup=False)):  # fmt: skip
        pass
    return {key: from_journal(kind, row) for key, row in journal.results.items()}


def _told(answer: Answer | Lack) -> tuple[str, str]:
    said = answer.verdict if isinstance(answer, Lack) else "identified"
    return answer.key, answer.failure or said


if __name__ == "__main__":
    typer.run(main)
