"""All logs of the studies on all cores; every answer is written down as it comes, and an interrupted run goes on."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from time import monotonic

from wheelpend.benchmarks.random_force.forces import FORCE_KINDS
from wheelpend.benchmarks.random_force.machine import PLACE_WEIGHTS
from wheelpend.benchmarks.random_force.trial import SIZE_IN_STANDARD_ERRORS, Answer, Case, try_case
from wheelpend.benchmarks.recording import record_answers, study_journal
from wheelpend.campaigns.journal import Journal
from wheelpend.parallel import cores

Progress = Callable[[str], None]
Try = Callable[[Case], Answer]

STUDY_NAMES = ("complete", "forces", "lawful")
DEFAULT_SEEDS = {"complete": 400, "forces": 12, "lawful": 12}  # logs of a study; of each force, of each effect
LAWFUL_EFFECTS = (
    "slope", "voltage_offset", "com_offset", "imu_bias", "tether_spring", "voltage_sag", "payload_step",
    "external_push",
)  # fmt: skip
LAWFUL_KIND, LAWFUL_PLACE = "first_order", "wheel"  # of the random force beside a lawful effect
PILOT_SEED = 1000  # of the log that says how large ten standard errors are
NOT_ASKED = (
    "api.py", "diagnosis", "experiments", "inspection", "benchmarks/hidden_effects/alarms.py",
    "benchmarks/hidden_effects/nonideal_sensors.py", "benchmarks/hidden_effects/runner.py",
    "benchmarks/hidden_effects/trial.py", "benchmarks/probabilities", "benchmarks/random_force/page.py",
    "benchmarks/random_force/summary.py",
    "benchmarks/random_force/__main__.py",
)  # fmt: skip


def plan(studies: Sequence[str] = STUDY_NAMES, seeds: int | None = None) -> list[Case]:
    """All cases of some studies but the pilots; one after the other, each in rounds over what it compares."""
    cases = []
    for study in studies:
        wanted = range(1, (seeds or DEFAULT_SEEDS[study]) + 1)
        cases += [case for seed in wanted for case in _round(study, seed)]
    return cases


def _round(study: str, seed: int) -> list[Case]:
    """The cases of a study with one seed."""
    if study == "complete":
        return [Case(study, seed)]
    if study == "forces":
        return [Case(study, seed, kind, place) for kind in FORCE_KINDS for place in PLACE_WEIGHTS]
    return [Case(study, seed, LAWFUL_KIND, LAWFUL_PLACE, effect) for effect in LAWFUL_EFFECTS]


def run(
    folder: Path,
    cases: Sequence[Case],
    *,
    jobs: int | None = None,
    minutes: float | None = None,
    progress: Progress = print,
    attempt: Try = try_case,
) -> list[Answer]:
    """Try the cases that have no answer yet, for so many minutes or all; returns every answer in the folder.

    Killed, it loses no more than the logs under way. Answers are kept per state of the code that they depend on.
    """
    journal = study_journal(folder, "answers", NOT_ASKED)
    end = monotonic() + (float("inf") if minutes is None else 60.0 * minutes)

    def try_all(wanted: Sequence[Case]) -> None:
        left = [c for c in wanted if c.key not in journal.results]
        if wanted:
            progress(f"{len(wanted)} logs, {len(wanted) - len(left)} of them known; {jobs or cores()} processes")
        _try_each(journal, [partial(attempt, c) for c in left], jobs, end, progress)

    try_all(list(dict.fromkeys(pilot_of(c) for c in cases if c.study == "lawful")))
    try_all([sized for c in cases if (sized := _with_size(c, journal))])
    return [Answer.from_json(found) for found in journal.results.values()]


def pilot_of(case: Case) -> Case:
    """The case that tells how large a lawful effect of ten standard errors is."""
    return replace(case, study="pilot", seed=PILOT_SEED)


def _with_size(case: Case, journal: Journal) -> Case | None:
    """The case with the size that its pilot tells; None while there is no pilot's answer, or none that tells it."""
    if case.study != "lawful":
        return case
    told = journal.results.get(pilot_of(case).key)
    size = ten_standard_errors(Answer.from_json(told)) if told else None
    return replace(case, size=size) if size else None


def ten_standard_errors(pilot: Answer) -> float | None:
    """Size of a lawful effect that is ten of its standard errors beside the random force; None where it has none."""
    return SIZE_IN_STANDARD_ERRORS * pilot.size.sigma if pilot.size else None


def _try_each(
    journal: Journal, trials: Sequence[Callable[[], Answer]], jobs: int | None, end: float, progress: Progress
) -> None:
    """Add the answer of every trial to the journal as it comes; after the moment ``end`` none is begun."""
    seconds = max(end - monotonic(), 0.0)
    for _ in record_answers(journal, trials, _told, seconds=seconds, jobs=jobs, progress=progress):
        pass


def _told(answer: Answer) -> tuple[str, str]:
    return answer.case.key, answer.failure or ", ".join(answer.places) or "no force"
