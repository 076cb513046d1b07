"""All cases on all cores; every outcome is written down as it comes, so that an interrupted run goes on."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from time import monotonic

from wheelpend.benchmarks.code_state import code_fingerprint
from wheelpend.benchmarks.hidden_effects.cases import Case, plan
from wheelpend.benchmarks.hidden_effects.trial import Outcome, try_case
from wheelpend.campaigns.journal import Journal, with_tuples
from wheelpend.model.precompile import compile_all
from wheelpend.model.record import Model
from wheelpend.parallel import cores, results_as_completed
from wheelpend.serialise import plain_data

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
    known = {key: outcome_of(data) for key, data in journal.results.items()}
    left = [c for c in wanted if c.key not in known]
    if left:
        compile_all(Model.default(), progress)  # once, before every process wants it
    progress(f"{len(wanted)} cases, {len(wanted) - len(left)} of them known from before; {cores()} processes")
    journal.begin()
    begin, seconds = monotonic(), float("inf") if minutes is None else 60 * minutes
    for number, (_, outcome) in enumerate(results_as_completed([partial(try_case, c) for c in left], seconds), 1):
        journal.add(outcome.key, plain_data(outcome))
        known[outcome.key] = outcome
        spent = monotonic() - begin
        whole = spent / number * len(left) / 60
        progress(f"{number} of {len(left)}, {spent / 60:.1f} min, all in {whole:.0f} min: "
                 f"{outcome.key}: {', '.join(outcome.named) or outcome.failure or outcome.verdict}")  # fmt: skip
    return [known[c.key] for c in wanted if c.key in known]


def outcome_of(data: dict) -> Outcome:
    """An outcome from JSON, whose lists become tuples again."""
    return Outcome(**{name: with_tuples(value) for name, value in data.items()})


def fingerprint() -> str:
    """Hash of all code that an outcome depends on."""
    return code_fingerprint(["benchmarks/random_force", "benchmarks/probabilities"])
