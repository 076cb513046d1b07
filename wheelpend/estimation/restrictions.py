"""What a user knows of single parameters before any fit: values that are fixed, and bounds."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

Bounds = tuple[float, float]  # lowest and highest value, infinite where there is none


class Restrictions(NamedTuple):
    """Values and bounds by the parameters' full names; no parameter has both."""

    fixed: Mapping[str, float] = {}
    bounds: Mapping[str, Bounds] = {}

    def free(self, names: Sequence[str]) -> list[str]:
        """Those of some parameters that are not fixed."""
        return [n for n in names if n not in self.fixed]

    def narrowed(self, name: str, bounds: Bounds) -> Bounds:
        """Bounds of a parameter as narrow as these and its own together."""
        low, high = self.bounds.get(name, (-np.inf, np.inf))
        return max(low, bounds[0]), min(high, bounds[1])

    def is_free(self, names: Sequence[str]) -> np.ndarray:
        """True (n,) for each parameter that is not fixed."""
        return np.array([n not in self.fixed for n in names], dtype=bool)

    def fixed_values(self, names: Sequence[str]) -> np.ndarray:
        """Values (n,) of the fixed parameters; zeros for the free ones."""
        return np.array([self.fixed.get(n, 0.0) for n in names])

    def bounds_of(self, names: Sequence[str]) -> tuple[np.ndarray, np.ndarray]:
        """Lowest and highest values (n,) of some parameters."""
        low, high = np.array([self.bounds.get(n, (-np.inf, np.inf)) for n in names]).reshape(-1, 2).T
        return low, high


NO_RESTRICTIONS = Restrictions()
