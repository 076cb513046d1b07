"""Time and memory of a kind of work over its sizes."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

FITTED_POINT_COUNT = 3  # the largest sizes, from which an exponent is taken


class ScalingPoint(NamedTuple):
    """Time and memory of one size."""

    size: int
    seconds: float
    megabytes: float  # peak beyond what was there before


class ScalingCurve(NamedTuple):
    """A kind of work over increasing sizes."""

    name: str
    over: str  # what the size counts
    found: tuple[ScalingPoint, ...]

    def exponent(self, of: str) -> float:
        """Exponent of the growth of "seconds" or "megabytes" over the largest sizes whose value is above zero."""
        rows = [(g.size, getattr(g, of)) for g in self.found if getattr(g, of) > 0.0][-FITTED_POINT_COUNT:]
        sizes, values = np.log(np.array(rows, dtype=float)).T
        return float(np.polyfit(sizes, values, 1)[0])
