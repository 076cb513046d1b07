"""One log: made, explained, and the truth beside what is named."""

from __future__ import annotations

from dataclasses import dataclass, field
from time import monotonic
from typing import Any

from wheelpend.benchmarks.benches.cases import Case, made
from wheelpend.diagnosis.explain import explain
from wheelpend.errors import Failure

MAX_SIGMAS = 3.0  # of a size from the truth


@dataclass(frozen=True)
class Outcome:
    """What was named on a log, and what was true."""

    key: str
    hidden: dict[str, float] = field(default_factory=dict)  # parameters by full name
    verdict: str = ""
    steps: tuple[tuple[str, tuple[str, ...]], ...] = ()  # effects, each with what data do not tell from it
    sizes: dict[str, tuple[float, float]] = field(default_factory=dict)  # of hidden parameters, and standard errors
    error_ratio: float = 0.0  # of the error after the last step to the noise floor
    failure: str | None = None
    seconds: float = 0.0

    def to_json(self) -> dict[str, Any]:
        """The outcome under the keys of its journal."""
        return dict(vars(self))

    @property
    def truth(self) -> set[str]:
        """The hidden effects."""
        return {name.split(".")[0] for name in self.hidden}

    @property
    def missed(self) -> set[str]:
        """Hidden effects that are neither a step nor said to be hard to tell from one."""
        return self.truth - {e for effect, others in self.steps for e in (effect, *others)}

    @property
    def wrong(self) -> list[str]:
        """Steps that are not hidden, nor said to be hard to tell from one that is."""
        return [effect for effect, others in self.steps if self.truth.isdisjoint((effect, *others))]

    @property
    def far_off(self) -> list[str]:
        """Hidden parameters whose size was found, more than three standard errors from the truth."""
        return [n for n, (value, sigma) in self.sizes.items() if abs(value - self.hidden[n]) > MAX_SIGMAS * sigma]


def try_case(case: Case) -> Outcome:
    """The outcome of a case; a failure is one too."""
    begin, bench = monotonic(), made(case)
    try:
        ladder = explain(case.model, [bench.log])
    except Failure as failure:
        return Outcome(case.key, bench.hidden, failure=str(failure), seconds=monotonic() - begin)
    found = {n: ladder.parameters[n] for n in bench.hidden if n in ladder.parameters}
    return Outcome(
        case.key,
        bench.hidden,
        ladder.verdict,
        tuple((s.effect, s.equivalent_to) for s in ladder.steps),
        {n: (e.value, e.sigma) for n, e in found.items() if e.sigma is not None},
        ladder.error / ladder.noise_floor,
        seconds=monotonic() - begin,
    )
