"""What is hidden in which log: kinds in stated shares, sizes around what a log just shows, sensors behind filters."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np

import derive
from derive.effects import Effect
from wheelpend.benchmarks.hidden_effects.cases import benchmark_plant, can_be_hidden, is_supported_by_engine
from wheelpend.benchmarks.random_force.forces import FORCE_KINDS

CASE_KINDS = ("complete", "left_out", "single", "pair")
KIND_SHARES = {  # of a set's logs; the second has other base rates than the first
    "first": (0.2, 0.2, 0.4, 0.2),
    "second": (0.5, 0.1, 0.3, 0.1),
}
EFFECT_COUNT = {"complete": 0, "left_out": 1, "single": 1, "pair": 2}
SIZE_RANGE = (0.3, 3.0)  # of the size that a log just shows, drawn evenly on a logarithmic scale
FORCE_SHARE, FILTERED_SHARE, MID_ACTION_SHARE = 0.05, 0.05, 0.2  # of logs: a random force, a slow gyro, a late start
SET_SEEDS = {"first": 21, "second": 22}  # not those on which the unseen share was first missed
DEFAULT_COUNTS = {"first": 300, "second": 100}


@dataclass(frozen=True)
class Case:
    """One log and what is hidden in it."""

    of: str  # the set
    number: int  # in the set; its random numbers follow from it
    kind: str  # complete, left_out, single or pair
    effects: tuple[str, ...] = ()
    sizes: tuple[float, ...] = ()  # of each, times the size that such a log just shows
    force: str = ""  # kind of random force that the engine plays beside; "" for a log of the simulator
    filtered: bool = False  # the gyro behind a low-pass filter
    late: bool = False  # the log begins while the machine is moving

    @property
    def key(self) -> str:
        """Unique name, under which the outcome is stored."""
        hidden = " ".join(f"{e}×{s:.2f}" for e, s in zip(self.effects, self.sizes, strict=True))
        extras = " ".join(n for n, on in ((self.force, True), ("filtered", self.filtered), ("late", self.late)) if on)
        return " ".join(filter(None, (self.of, str(self.number), self.kind, hidden, extras)))

    @property
    def without(self) -> tuple[str, ...]:
        """Effects that the library does not have."""
        return self.effects if self.kind == "left_out" else ()


def plan(of: str, count: int | None = None) -> list[Case]:
    """The cases of a set, the first so many of them a sample of all."""
    return [_case(of, number) for number in range(count or DEFAULT_COUNTS[of])]


@cache
def _known_effects(rough: bool) -> tuple[Effect, ...]:
    """Effects that a log can have in it; on rough ground those that the engine offers."""
    known = (e for e in derive.effects.applicable_to(benchmark_plant()) if can_be_hidden(e))
    return tuple(e for e in known if not rough or is_supported_by_engine([(n, 0.0) for n in e.full_names]))


def _case(of: str, number: int) -> Case:
    random = np.random.default_rng((SET_SEEDS[of], number))
    kind = str(random.choice(CASE_KINDS, p=KIND_SHARES[of]))
    rough = bool(random.random() < FORCE_SHARE)
    known = _known_effects(rough)
    chosen = random.choice(len(known), size=EFFECT_COUNT[kind], replace=False)
    low, high = np.log(SIZE_RANGE)
    return Case(
        of=of,
        number=number,
        kind=kind,
        effects=tuple(known[k].name for k in chosen),
        sizes=tuple(round(float(np.exp(random.uniform(low, high))), 3) for _ in chosen),
        force=str(random.choice(list(FORCE_KINDS))) if rough else "",
        filtered=bool(random.random() < FILTERED_SHARE),
        late=bool(random.random() < MID_ACTION_SHARE),
    )
