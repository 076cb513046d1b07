"""One log: made by the engine, diagnosed, and the truth beside what is named."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from time import monotonic
from typing import Any

import numpy as np

from wheelpend.api import diagnose
from wheelpend.benchmarks.pushed.cases import Case, Sizes, alike, hidden_values
from wheelpend.benchmarks.random_force.machine import rough_log
from wheelpend.diagnosis.likelihood.filtered_model import filtered_model
from wheelpend.diagnosis.likelihood.whitened_scores import detectable_sizes
from wheelpend.errors import Failure
from wheelpend.estimation.data import prepare
from wheelpend.estimation.starts import best_start
from wheelpend.model.record import Model

DURATION_S = 10.0
PILOT_SEED = 999_999  # of the logs that say which sizes a log just shows


@dataclass(frozen=True)
class Outcome:
    """What was named on a log, and what was true."""

    key: str
    kind: str
    truth: tuple[str, ...]  # the hidden effect and those that the equations cannot tell from it; none without one
    hidden: dict[str, float] = field(default_factory=dict)
    verdict: str = ""
    named: tuple[str, ...] = ()  # best first
    equivalent: tuple[str, ...] = ()  # to the first
    size: float | None = None  # of the first named's first parameter
    sigma: float | None = None
    structures: tuple[tuple[tuple[str, ...], float], ...] = ()  # effects and probability
    failure: str | None = None
    seconds: float = 0.0

    def to_json(self) -> dict[str, Any]:
        """The outcome under the keys of its journal."""
        return dict(vars(self))

    @property
    def is_right(self) -> bool:
        """The hidden effect is named first, or nothing is named where nothing is hidden or the library lacks it."""
        if self.kind != "single":
            return not self.named
        return bool(self.named) and self.named[0] in self.truth

    @property
    def is_told(self) -> bool:
        """The hidden effect is named first, or said to predict as well as the first."""
        return not {*self.named[:1], *self.equivalent}.isdisjoint(self.truth)

    @property
    def is_confidently_wrong(self) -> bool:
        """An effect that is not there is named, and none beside it."""
        return bool(self.named) and not self.equivalent and not self.is_right


def pilot_sizes(case: Case) -> dict[str, dict[str, float]]:
    """Sizes of effects that a log with a case's force would just have shown."""
    log = rough_log(case.force, case.place, PILOT_SEED, {}, DURATION_S).log
    problem, start = best_start(prepare(Model.default(), [log]))
    return detectable_sizes(filtered_model(problem, [start], lambda text: None))


def try_case(case: Case, shown: Sizes) -> Outcome:
    """Make a case's log and diagnose it."""
    begin = monotonic()
    outcome = Outcome(case.key, case.kind, alike(case.effect) if case.effect else ())
    try:
        hidden = hidden_values(case, shown)
        outcome = diagnosed(replace(outcome, hidden=hidden), case, hidden)
    except (Failure, np.linalg.LinAlgError) as failure:
        outcome = replace(outcome, failure=str(failure))
    return replace(outcome, seconds=monotonic() - begin)


def diagnosed(outcome: Outcome, case: Case, hidden: Mapping[str, float]) -> Outcome:
    """The outcome with what a diagnosis of the log says."""
    log = rough_log(case.force, case.place, case.number, hidden, DURATION_S).log
    found = diagnose(Model.default(), [log], without=case.without)
    outcome = replace(
        outcome,
        verdict=found.verdict,
        named=tuple(c.effect for c in found.named),
        structures=tuple((s.effects, s.probability) for s in found.structures),
    )
    if not found.named:
        return outcome
    first = found.named[0]
    size = next(iter(first.estimates.values()))
    return replace(outcome, equivalent=first.equivalent_to, size=size.value, sigma=size.sigma)
