"""How often something is so, with what that says of how often it will be."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

from scipy.stats import binomtest


class Proportion(NamedTuple):
    """So many of so many."""

    hits: int
    of: int

    @property
    def share(self) -> float:
        """As a fraction; NaN of nothing."""
        return self.hits / self.of if self.of else float("nan")

    @property
    def interval(self) -> tuple[float, float]:
        """95 % confidence interval (Clopper and Pearson)."""
        if not self.of:
            return float("nan"), float("nan")
        found = binomtest(self.hits, self.of).proportion_ci(0.95, method="exact")
        return float(found.low), float(found.high)


def proportion_of(hits: Iterable[bool]) -> Proportion:
    """Count."""
    found = [bool(h) for h in hits]
    return Proportion(sum(found), len(found))
