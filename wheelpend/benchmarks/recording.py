"""Answers of a study on all cores, each written down as it comes, so that an interrupted run goes on."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from time import monotonic
from typing import Any, TypeVar

from wheelpend.benchmarks.code_state import code_fingerprint
from wheelpend.campaigns.journal import Journal, with_tuples
from wheelpend.parallel import results_as_completed
from wheelpend.serialise import plain_data

AnyAnswer = TypeVar("AnyAnswer")


def study_journal(folder: Path, name: str, aside: Sequence[str]) -> Journal:
    """The journal of a study's answers in its folder, which is made, for the code that is not ``aside``."""
    folder.mkdir(parents=True, exist_ok=True)
    code = code_fingerprint(aside)
    journal = Journal(folder / f"{name}-{code}.jsonl", code)
    journal.begin()
    return journal


def record_answers(
    journal: Journal,
    trials: Sequence[Callable[[], AnyAnswer]],
    told: Callable[[AnyAnswer], tuple[str, str]],
    *,
    seconds: float,
    jobs: int | None,
    progress: Callable[[str], None],
) -> Iterator[AnyAnswer]:
    """Answers of trials, each in the journal before it is given; after so many seconds none is begun.

    ``told`` is an answer's key and what is said of it on its line of progress.
    """
    begin = monotonic()
    for number, (_, answer) in enumerate(results_as_completed(trials, seconds, jobs), 1):
        key, text = told(answer)
        journal.add(key, plain_data(answer))
        spent = (monotonic() - begin) / 60.0
        whole = spent / number * len(trials)
        progress(f"{number} of {len(trials)}, {spent:.1f} min, all in {whole:.0f} min: {key}: {text}")
        yield answer


def from_journal(kind: Callable[..., AnyAnswer], data: dict[str, Any]) -> AnyAnswer:
    """An answer from its JSON, whose lists become tuples again."""
    return kind(**{name: with_tuples(value) for name, value in data.items()})
