"""A fitted model: estimates, covariances, initial states and the remaining cost."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from wheelpend.estimation.parameters import FreeParameter


@dataclass(frozen=True)
class Fit:
    """A fitted model; ``free`` orders the rows and columns of its covariances."""

    values: dict[str, float]  # shared parameters
    per_log: tuple[dict[str, float], ...]  # parameters of each log alone
    free: tuple[FreeParameter, ...]  # the fitted elements of θ
    covariance: np.ndarray  # (free, free) from the information matrix
    robust: np.ndarray  # (free, free) from the block jackknife
    states: tuple[np.ndarray, ...]  # per log: initial states (segments, NX)
    cost: float  # sum of squared residuals [σ²]
    count: int  # measured values
    condition: float  # of the scaled information matrix
    unidentifiable: tuple[FreeParameter, ...]
    converged: bool
    blocks: int = 0  # number of the jackknife's blocks
    coloured: bool = False  # True where the residual is correlated from sample to sample
    promised_decrease: float = 0.0  # σ², by which the gradient at the end still promises to lower the cost

    @classmethod
    def at(
        cls,
        values: Mapping[str, float],
        per_log: Sequence[Mapping[str, float]] = (),
        states: Sequence[np.ndarray] = (),
    ) -> Fit:
        """A model at given values: nothing in it was fitted but, where they are given, the initial states."""
        nothing = np.zeros((0, 0))
        return cls(
            values=dict(values),
            per_log=tuple(dict(v) for v in per_log),
            free=(),
            covariance=nothing,
            robust=nothing,
            states=tuple(states),
            cost=0.0,
            count=0,
            condition=1.0,
            unidentifiable=(),
            converged=True,
        )

    @property
    def error(self) -> float:
        """Root mean square of the residual [σ], the degrees of freedom of the fitted states discounted."""
        states = sum(s.size for s in self.states)
        return float(np.sqrt(self.cost / max(self.count - states, 1)))

    def sigma(self, name: str, robust: bool = False, log: int = 0) -> float:
        """Standard error of a parameter, from the information or the jackknife; of a per-log one in one log."""
        matrix, place = self.robust if robust else self.covariance, self.place(name, log)
        return float(np.sqrt(max(matrix[place, place], 0.0)))

    def place(self, name: str, log: int = 0) -> int:
        """Place in θ of a parameter, of a per-log one in one log; raises KeyError for one that is not free."""
        return self.places[name, None] if (name, None) in self.places else self.places[name, log]

    @cached_property
    def places(self) -> dict[tuple[str, int | None], int]:
        """Place in θ by name and log."""
        return {(p.name, p.log): k for k, p in enumerate(self.free)}

    def element(self, name: str, log: int | None) -> FreeParameter:
        """The element of θ of a name in a log, or shared; raises KeyError for one that is not free."""
        return self.free[self.places[name, log]]

    @property
    def names(self) -> list[str]:
        """Names of the fitted parameters, per-log ones once."""
        return list(dict.fromkeys(p.name for p in self.free))

    def of_log(self, number: int) -> dict[str, float]:
        """All parameter values of one log."""
        return {**self.values, **(self.per_log[number] if number < len(self.per_log) else {})}
