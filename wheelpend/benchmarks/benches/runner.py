"""All cases on all cores; every outcome is written down as it comes, so that an interrupted run goes on."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path

from wheelpend.benchmarks.benches.cases import Case
from wheelpend.benchmarks.benches.trial import Outcome, try_case
from wheelpend.benchmarks.recording import from_journal, record_answers, study_journal
from wheelpend.parallel import cores

NOT_ASKED = (
    "benchmarks/probabilities",
    "benchmarks/pushed",
    "benchmarks/benches/page.py",
    "benchmarks/benches/__main__.py",
)


def run(
    folder: Path,
    cases: Sequence[Case],
    *,
    minutes: float | None = None,
    jobs: int | None = None,
    progress: Callable[[str], None] = print,
    attempt: Callable[[Case], Outcome] = try_case,
) -> list[Outcome]:
    """Try the cases that have no outcome yet, for so many minutes or all; returns the outcomes of these cases.

    When the minutes are over no further case is begun. Outcomes are kept per state of the code.
    """
    journal = study_journal(folder, "outcomes", NOT_ASKED)
    left = [c for c in cases if c.key not in journal.results]
    progress(f"{len(cases)} logs, {len(cases) - len(left)} of them known; {jobs or cores()} processes")
    seconds = float("inf") if minutes is None else 60.0 * minutes
    trials = [partial(attempt, c) for c in left]
    for _ in record_answers(journal, trials, _told, seconds=seconds, jobs=jobs, progress=progress):
        pass
    return [from_journal(Outcome, journal.results[c.key]) for c in cases if c.key in journal.results]


def _told(outcome: Outcome) -> tuple[str, str]:
    return outcome.key, outcome.failure or f"{outcome.verdict} {', '.join(e for e, _ in outcome.steps)}"
