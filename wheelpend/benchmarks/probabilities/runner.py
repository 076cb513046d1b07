"""All cases on all cores; every outcome is written down as it comes, so that an interrupted run goes on."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from time import monotonic

from wheelpend.benchmarks.probabilities.cases import Case
from wheelpend.benchmarks.probabilities.trial import Outcome, Sizes, shown_sizes, try_case
from wheelpend.benchmarks.recording import from_journal, record_answers, study_journal
from wheelpend.parallel import cores
from wheelpend.serialise import plain_data

Progress = Callable[[str], None]
Try = Callable[[Case, Sizes], Outcome]
NOT_ASKED = ("benchmarks/probabilities/page.py", "benchmarks/probabilities/summary.py",
             "benchmarks/probabilities/__main__.py")  # fmt: skip
PILOT_KEYS = {False: "pilot smooth", True: "pilot rough"}


def run(
    folder: Path,
    cases: Sequence[Case],
    *,
    minutes: float | None = None,
    jobs: int | None = None,
    progress: Progress = print,
    attempt: Try = try_case,
    pilot: Callable[[bool], Sizes] = shown_sizes,
) -> list[Outcome]:
    """Try the cases that have no outcome yet, for so many minutes or all; returns the outcomes of these cases.

    When the minutes are over no further case is begun, and those under way are finished and kept. Outcomes are kept
    per state of the code.
    """
    journal = study_journal(folder, "outcomes", NOT_ASKED)
    left = [c for c in cases if c.key not in journal.results]
    begin, seconds = monotonic(), float("inf") if minutes is None else 60.0 * minutes
    for rough in sorted({bool(c.force) for c in left}) if seconds > 0.0 else ():
        if PILOT_KEYS[rough] not in journal.results:
            progress("finding the sizes that such a log just shows")
            journal.add(PILOT_KEYS[rough], plain_data(pilot(rough)))
    progress(f"{len(cases)} logs, {len(cases) - len(left)} of them known; {jobs or cores()} processes")
    known = journal.results
    trials = [partial(attempt, c, known[PILOT_KEYS[bool(c.force)]]) for c in left if PILOT_KEYS[bool(c.force)] in known]
    rest = max(seconds - (monotonic() - begin), 0.0)
    for _ in record_answers(journal, trials, _told, seconds=rest, jobs=jobs, progress=progress):
        pass
    return [from_journal(Outcome, known[c.key]) for c in cases if c.key in known]


def _told(outcome: Outcome) -> tuple[str, str]:
    likely = ", ".join(f"{'+'.join(e) or 'nothing'} {p:.2f}" for e, p in outcome.structures[:3])
    return outcome.key, outcome.failure or likely
