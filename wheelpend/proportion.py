"""A proportion of trials with its confidence interval."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, NamedTuple

from scipy.stats import binomtest

CONFIDENCE_LEVEL = 0.95


class Proportion(NamedTuple):
    """Number of hits among trials."""

    hits: int
    of: int  # trials

    def to_json(self) -> dict[str, Any]:
        """The counts under the keys of JSON."""
        return {"hits": self.hits, "of": self.of}

    @property
    def share(self) -> float:
        """Hits as a fraction of the trials; NaN without any."""
        return self.hits / self.of if self.of else float("nan")

    @property
    def interval(self) -> tuple[float, float]:
        """95 % confidence interval (Clopper and Pearson) of the probability of a hit; NaN without trials."""
        if not self.of:
            return float("nan"), float("nan")
        interval = binomtest(self.hits, self.of).proportion_ci(CONFIDENCE_LEVEL, method="exact")
        return float(interval.low), float(interval.high)


def proportion_of(hits: Iterable[bool]) -> Proportion:
    """The proportion of trials that are hits."""
    trials = [bool(h) for h in hits]
    return Proportion(sum(trials), len(trials))
