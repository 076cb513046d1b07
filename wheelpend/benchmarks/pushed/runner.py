"""All cases on all cores; every outcome is written down as it comes, so that an interrupted run goes on."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from time import monotonic

from wheelpend.benchmarks.pushed.cases import Case, Sizes
from wheelpend.benchmarks.pushed.trial import Outcome, pilot_sizes, try_case
from wheelpend.benchmarks.recording import from_journal, record_answers, study_journal
from wheelpend.parallel import cores
from wheelpend.serialise import plain_data

Progress = Callable[[str], None]
NOT_ASKED = ("benchmarks/probabilities", "benchmarks/pushed/page.py", "benchmarks/pushed/__main__.py")


def run(
    folder: Path,
    cases: Sequence[Case],
    *,
    minutes: float | None = None,
    jobs: int | None = None,
    progress: Progress = print,
    attempt: Callable[[Case, Sizes], Outcome] = try_case,
    pilot: Callable[[Case], Sizes] = pilot_sizes,
) -> list[Outcome]:
    """Try the cases that have no outcome yet, for so many minutes or all; returns the outcomes of these cases.

    When the minutes are over no further case is begun, and those under way are finished and kept. Outcomes are kept
    per state of the code.
    """
    journal = study_journal(folder, "outcomes", NOT_ASKED)
    end = monotonic() + (float("inf") if minutes is None else 60.0 * minutes)
    left, known = [c for c in cases if c.key not in journal.results], journal.results
    for key, case in {c.pilot_key: c for c in left if c.pilot_key not in known}.items():
        if monotonic() < end:
            progress(f"finding the sizes that a log just shows: {case.force}, {case.place}")
            journal.add(key, plain_data(pilot(case)))
    progress(f"{len(cases)} logs, {len(cases) - len(left)} of them known; {jobs or cores()} processes")
    trials = [partial(attempt, c, known[c.pilot_key]) for c in left if c.pilot_key in known]
    seconds = max(end - monotonic(), 0.0)
    for _ in record_answers(journal, trials, _told, seconds=seconds, jobs=jobs, progress=progress):
        pass
    return [from_journal(Outcome, known[c.key]) for c in cases if c.key in known]


def _told(outcome: Outcome) -> tuple[str, str]:
    return outcome.key, outcome.failure or f"{outcome.verdict} {', '.join(outcome.named)}"
