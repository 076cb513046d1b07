"""A fitted model: estimates, covariances, initial states and the remaining cost."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Fit:
    """A fitted model; ``free`` orders the rows and columns of its covariances."""

    values: dict[str, float]  # shared parameters
    per_log: tuple[dict[str, float], ...]  # parameters of each log alone
    free: tuple[str, ...]  # names of the fitted parameters, per-log ones as name@log
    covariance: np.ndarray  # (free, free) from the information matrix
    robust: np.ndarray  # (free, free) from the block jackknife
    states: tuple[np.ndarray, ...]  # per log: initial states (segments, NX)
    cost: float  # sum of squared residuals [σ²]
    count: int  # measured values
    condition: float  # of the scaled information matrix
    unidentifiable: tuple[str, ...]
    converged: bool
    blocks: int = 0  # number of the jackknife's blocks
    coloured: bool = False  # True where the residual is correlated from sample to sample

    @property
    def error(self) -> float:
        """Root mean square of the residual [σ], the degrees of freedom of the fitted states discounted."""
        states = sum(s.size for s in self.states)
        return float(np.sqrt(self.cost / max(self.count - states, 1)))

    def sigma(self, name: str, robust: bool = False, log: int = 0) -> float:
        """Standard error of a parameter, from the information or the jackknife; of a per-log one in one log."""
        key = name if name in self.free else f"{name}@{log}"
        matrix = self.robust if robust else self.covariance
        return float(np.sqrt(max(matrix[self.free.index(key), self.free.index(key)], 0.0)))

    @property
    def names(self) -> list[str]:
        """Names of the fitted parameters, per-log ones once."""
        return list(dict.fromkeys(label.split("@")[0] for label in self.free))

    def of_log(self, number: int) -> dict[str, float]:
        """All parameter values of one log."""
        return {**self.values, **(self.per_log[number] if number < len(self.per_log) else {})}
