"""What is found in every two of the servo's logs: python -m wheelpend.benchmarks.measured.pairs [--minutes M].

All twelve logs are of one machine, so that every pair should tell the same. Every answer is a file of its own; a run
that was interrupted goes on, and answers of another state of the code are made anew.
"""

from __future__ import annotations

import json
import os
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from time import monotonic
from typing import Annotated, Any

import typer

from wheelpend.api import explain
from wheelpend.benchmarks.code_state import code_fingerprint
from wheelpend.benchmarks.markdown import markdown_table
from wheelpend.benchmarks.measured.servo_logs import SERVO_FOLDER, SERVO_MODEL, log_pairs
from wheelpend.errors import Failure
from wheelpend.files import write_text
from wheelpend.model.record import Model
from wheelpend.reports.console import err, exit_on_failure, print_line
from wheelpend.serialise import dumps

PAIRS_FOLDER = Path("benchmark/servo_pairs")
SOUGHT_EFFECT = "load_friction"
Explain = Callable[[Sequence[Path]], dict[str, Any]]


@dataclass(frozen=True)
class PairAnswer:
    """What was found in a pair of logs."""

    logs: tuple[str, str]
    steps: tuple[str, ...]  # effects, in the order in which they were added
    verdict: str
    base_error: float | None  # held out [σ], before and after the steps
    error: float | None
    seconds: float
    failure: str = ""

    def to_json(self) -> dict[str, Any]:
        """The answer under the keys of JSON."""
        return dict(vars(self))


def study_pairs(
    data: Path, folder: Path, *, minutes: float | None = None, limit: int | None = None,
    progress: Callable[[str], None] = print,
) -> list[PairAnswer]:  # fmt: skip
    """Explain the pairs that have no answer in the folder yet, for so many minutes or so many pairs; every answer."""
    folder.mkdir(parents=True, exist_ok=True)
    end, code = monotonic() + (float("inf") if minutes is None else 60.0 * minutes), code_fingerprint()
    answers, made = [], 0
    for pair in log_pairs():
        path = folder / f"{pair[0]}-{pair[1]}.json"
        known = read_answer(path, code)
        if known is None and monotonic() < end and (limit is None or made < limit):
            known, made = explained_pair(data, pair), made + 1
            write_text(path, dumps({"code": code, **known.to_json()}) + "\n")
            found = known.failure or ", ".join(known.steps) or "nothing"
            progress(f"{pair[0]}, {pair[1]}: {found}, {known.seconds:.0f} s")
        answers += [known] if known else []
    return answers


def read_answer(path: Path, code: str | None = None) -> PairAnswer | None:
    """The answer in a file; None where there is none, or one of another state of the code than this."""
    if not path.exists():
        return None
    data = json.loads(path.read_text(encoding="utf-8"))
    if data.pop("code") != code and code is not None:
        return None
    return PairAnswer(**{**data, "logs": tuple(data["logs"]), "steps": tuple(data["steps"])})


def explained_pair(data: Path, pair: tuple[str, str]) -> PairAnswer:
    """Explain a pair of logs from the bare model; a failure is an answer too."""
    begin = monotonic()
    try:
        found = explain(Model.parse(SERVO_MODEL), [data / SERVO_FOLDER / f"{name}.csv" for name in pair])
    except Failure as failure:
        return PairAnswer(pair, (), "", None, None, monotonic() - begin, str(failure))
    steps = tuple(step.effect for step in found.steps)
    return PairAnswer(pair, steps, found.verdict, found.base_error, found.error, monotonic() - begin)


def pair_table(answers: Sequence[PairAnswer]) -> str:
    """Table of the effects that were added: in how many pairs, and in how many of these first."""
    among = Counter(effect for answer in answers for effect in answer.steps)
    first = Counter(answer.steps[0] for answer in answers if answer.steps)
    rows = [(f"`{effect}`", f"{count}", f"{first[effect]}") for effect, count in sorted(among.items(), key=_most_first)]
    rows.append(("nothing", f"{sum(not answer.steps for answer in answers)}", "–"))
    return markdown_table(("added", "pairs", "of these first"), rows)


def _most_first(row: tuple[str, int]) -> tuple[int, str]:
    return -row[1], row[0]


def pair_texts(folder: Path) -> dict[str, str]:
    """What a page says of the pairs whose answers are in a folder, of whatever state of the code."""
    answers = [a for path in sorted(folder.glob("*.json")) if (a := read_answer(path)) is not None]
    whole = len(log_pairs())
    if not answers:
        return {"pairs": f"None of the {whole} pairs has been tried yet."}
    among = sum(SOUGHT_EFFECT in a.steps for a in answers)
    first = sum(a.steps[:1] == (SOUGHT_EFFECT,) for a in answers)
    sentence = (
        f"Of {whole} pairs {len(answers)} were tried: `{SOUGHT_EFFECT}` is among the steps in {among}, "
        f"and the first of them in {first}."
    )
    return {"pairs": f"{sentence}{_missed_text(answers)}\n\n{pair_table(answers)}"}


def _missed_text(answers: Sequence[PairAnswer]) -> str:
    """In which pairs the effect was not found, by what was said of them instead."""
    missed: dict[str, list[str]] = {}
    for answer in answers:
        if SOUGHT_EFFECT not in answer.steps:
            said = answer.failure or f"`{answer.verdict}`"
            missed.setdefault(said, []).append(" and ".join(f"`{log}`" for log in answer.logs))
    return "".join(f" {said} was said of {'; '.join(pairs)}." for said, pairs in missed.items())


def main(
    data: Annotated[Path | None, typer.Option(help="Folder of the logs; $WHEELPEND_DATA, or ../shared/data.")] = None,
    folder: Annotated[Path, typer.Option(help="Where answers are kept, a file for each pair.")] = PAIRS_FOLDER,
    minutes: Annotated[float | None, typer.Option(min=0, help="Begin no pair later; 0 tells what is known.")] = None,
    limit: Annotated[int | None, typer.Option(min=0, help="Try no more pairs than these.")] = None,
) -> None:
    """Explain every two of the servo's logs that are of different trajectories; goes on where it was interrupted."""
    logs = data or Path(os.environ.get("WHEELPEND_DATA", "../shared/data"))
    with exit_on_failure():
        study_pairs(logs, folder, minutes=minutes, limit=limit, progress=lambda line: err.print(line, markup=False))
        print_line(pair_texts(folder)["pairs"])


if __name__ == "__main__":
    typer.run(main)
