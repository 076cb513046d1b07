"""How much wider intervals are because the random force's correlation time is an assumption."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from wheelpend.identification.filter_error_method import FilterErrorFit


@dataclass(frozen=True)
class Widening:
    """Factors by which the standard errors grow because parameters move with the force's correlation time."""

    factors: dict[str, float]  # by the names of the covariance
    shortest_s: float  # s, correlation times that the logs do not exclude: from
    longest_s: float  # s, to

    def to_json(self) -> dict[str, Any]:
        """The factors under the keys of JSON."""
        return {"factors": self.factors, "correlation_times_s": [self.shortest_s, self.longest_s]}


def widening_of(found: FilterErrorFit) -> Widening | None:
    """The widening of a fit's standard errors; None where no force is left whose correlation time could differ."""
    if not found.remainder.force:
        return None
    total, moved = np.diag(found.covariance), found.movement.widening**2
    own = np.maximum(total - moved, 1e-12 * total)
    factors = np.sqrt(np.divide(total, own, out=np.ones(len(total)), where=own > 0.0))
    return Widening(dict(zip(found.names, map(float, factors), strict=True)), *found.movement.times)
