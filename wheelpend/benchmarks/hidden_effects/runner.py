"""All cases on all cores; every outcome is written down as it comes, so that an interrupted run goes on."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path

from wheelpend.benchmarks.code_state import code_fingerprint
from wheelpend.benchmarks.hidden_effects.cases import Case, plan
from wheelpend.benchmarks.hidden_effects.trial import Outcome, try_case
from wheelpend.benchmarks.recording import from_journal, record_answers
from wheelpend.campaigns.journal import Journal
from wheelpend.model.precompile import compile_all
from wheelpend.model.record import Model
from wheelpend.parallel import cores

Progress = Callable[[str], None]


def run(
    folder: Path, *, minutes: float | None = None, cases: Sequence[Case] | None = None, progress: Progress = print
) -> list[Outcome]:
    """Try the cases that have no outcome yet, for so many minutes or all of them; returns every outcome there is.

    When the minutes are over no further case is begun, and those under way are finished and kept.
    Outcomes are kept per state of the code, so that none of another state is mixed in.
    """
    wanted = list(plan() if cases is None else cases)
    folder.mkdir(parents=True, exist_ok=True)
    code = fingerprint()
    journal = Journal(folder / f"outcomes-{code}.jsonl", code)
    known = {key: from_journal(Outcome, data) for key, data in journal.results.items()}
    left = [c for c in wanted if c.key not in known]
    if left:
        compile_all(Model.default(), progress)  # once, before every process wants it
    progress(f"{len(wanted)} cases, {len(wanted) - len(left)} of them known from before; {cores()} processes")
    journal.begin()
    seconds, trials = float("inf") if minutes is None else 60 * minutes, [partial(try_case, c) for c in left]
    for outcome in record_answers(journal, trials, _told, seconds=seconds, jobs=None, progress=progress):
        known[outcome.key] = outcome
    return [known[c.key] for c in wanted if c.key in known]


def _told(outcome: Outcome) -> tuple[str, str]:
    return outcome.key, ", ".join(outcome.named) or outcome.failure or outcome.verdict


def fingerprint() -> str:
    """Hash of all code that an outcome depends on."""
    return code_fingerprint(["benchmarks/random_force", "benchmarks/probabilities"])
