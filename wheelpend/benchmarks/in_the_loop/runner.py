"""All draws and records on all cores; every answer is written down as it comes, and an interrupted run goes on."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from wheelpend.benchmarks.in_the_loop import compensate, learn
from wheelpend.benchmarks.recording import record_answers, study_journal
from wheelpend.errors import Failure
from wheelpend.parallel import cores

Progress = Callable[[str], None]
Answer = compensate.Answer | learn.Answer
Answers = Mapping[str, Mapping[str, Any]]  # as they are kept, by key

STUDY_NAMES = ("compensate", "learn")
DEFAULT_SEEDS = 100  # draws, and records
NOT_ASKED = (
    "diagnosis", "experiments", "inspection", "benchmarks/hidden_effects/alarms.py",
    "benchmarks/hidden_effects/cases.py", "benchmarks/hidden_effects/nonideal_sensors.py",
    "benchmarks/hidden_effects/runner.py",
    "benchmarks/hidden_effects/trial.py", "benchmarks/probabilities", "benchmarks/pushed",
    "benchmarks/in_the_loop/page.py", "benchmarks/in_the_loop/__main__.py", "benchmarks/random_force/runner.py",
    "benchmarks/random_force/page.py", "benchmarks/random_force/summary.py", "benchmarks/random_force/trial.py",
    "export/mujoco_target.py", "export/mujoco_replay.py", "export/javascript_target.py", "export/javascript_replay.py",
    "export/json_target.py", "export/c_replay.py", "export/c_target.py", "export/ledger.py", "export/export.py",
    "export/replay.py", "export/running.py", "export/translate",
)  # fmt: skip


def plan(studies: Sequence[str] = STUDY_NAMES, seeds: int = DEFAULT_SEEDS) -> list[str]:
    """Keys of all trials, the studies one after the other."""
    return [f"{study} {seed}" for study in studies for seed in range(1, seeds + 1)]


def run(
    folder: Path,
    keys: Sequence[str],
    *,
    jobs: int | None = None,
    minutes: float | None = None,
    progress: Progress = print,
    attempt: Callable[[str], Answer] | None = None,
) -> Answers:
    """Try what has no answer yet, for so many minutes or all; returns every answer in the folder as it is kept.

    Killed, it loses no more than the trials under way. Answers are kept per state of the code that they depend on.
    """
    journal = study_journal(folder, "answers", NOT_ASKED)
    left = [key for key in keys if key not in journal.results]
    progress(f"{len(keys)} trials, {len(keys) - len(left)} of them known; {jobs or cores()} processes")
    trials = [partial(attempt or try_trial, key) for key in left]
    seconds = float("inf") if minutes is None else 60.0 * minutes
    for _ in record_answers(journal, trials, _told, seconds=seconds, jobs=jobs, progress=progress):
        pass
    return dict(journal.results)


def try_trial(key: str) -> Answer:
    """The answer to a key; what cannot be used says why."""
    study, seed = key.split()
    try:
        return compensate.try_draw(int(seed)) if study == "compensate" else learn.try_record(int(seed))
    except Failure as failure:
        return (compensate.Answer if study == "compensate" else learn.Answer)(key, str(failure))


def pitches_of(answers: Answers) -> list[compensate.Pitch]:
    """What every draw showed."""
    kept = [a for key, a in answers.items() if key.startswith("compensate") and not a["failure"]]
    return [compensate.Pitch(*p) for a in kept for p in a["pitches"]]


def records_of(answers: Answers) -> list[dict[str, learn.Learnt]]:
    """What every record showed, by parameter."""
    kept = [a for key, a in answers.items() if key.startswith("learn") and not a["failure"]]
    return [{n: learn.Learnt(*p) for n, p in a["parameters"].items()} for a in kept]


def failures_of(answers: Answers) -> list[str]:
    """What could not be used and why, a sentence each."""
    return [f"{key}: {a['failure']}" for key, a in answers.items() if a["failure"]]


def _told(answer: Answer) -> tuple[str, str]:
    return answer.key, answer.failure or "done"
