"""Normal equations: a sum of squares near a point, as a quadratic in changes of parameters, without initial states."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from wheelpend.estimation.parameters import FreeParameter, ParameterLayout
from wheelpend.estimation.scaled_inverse import (
    MIN_EXPLAINING_RATIO,
    SILENT_ROOT,
    ScaledInverse,
    solve_damped,
    unit_diagonal,
)
from wheelpend.estimation.shooting import ShootingLinearisation

MAX_LOST_SHARE = 1e-3  # of a parameter in directions that are not identifiable, from which its value means nothing


@dataclass(frozen=True)
class NormalEquations:
    """A sum of squares after a change δ of n parameters: cost − 2 scoreᵀ δ + δᵀ information δ.

    Leading axes are of parts of the data, as segments or folds are, which add up.
    """

    layout: ParameterLayout  # whose elements the parameters are
    information: np.ndarray  # (..., n, n)
    score: np.ndarray  # (..., n)
    cost: np.ndarray  # (...)

    @classmethod
    def zeros(cls, layout: ParameterLayout, parts: int) -> NormalEquations:
        """Those of parts without any data."""
        size = len(layout.elements)
        return cls(layout, np.zeros((parts, size, size)), np.zeros((parts, size)), np.zeros(parts))

    @classmethod
    def of_logs(cls, layout: ParameterLayout, logs: Sequence[NormalEquations]) -> NormalEquations:
        """Those of the parts of all logs, of which each has its own columns."""
        found, first = cls.zeros(layout, sum(len(e.score) for e in logs)), 0
        for equations, places in zip(logs, layout.places, strict=True):
            rows = np.arange(first, first + len(equations.score))
            found.information[rows[:, None, None], places[:, None], places] = symmetric(equations.information)
            found.score[rows[:, None], places] = equations.score
            found.cost[rows] = equations.cost
            first += len(rows)
        return found

    def part(self, number: int) -> NormalEquations:
        """Those of one part."""
        return NormalEquations(self.layout, self.information[number], self.score[number], self.cost[number])

    def sum(self) -> NormalEquations:
        """Those of all parts together."""
        information = symmetric(self.information.sum(axis=0))
        return replace(self, information=information, score=self.score.sum(axis=0), cost=self.cost.sum(axis=0))

    def fold(self, numbers: np.ndarray) -> NormalEquations:
        """Those of folds, from the number of the fold of each part (parts,)."""
        folds = [numbers == k for k in range(int(numbers.max(initial=-1)) + 1)]
        sums = (np.array([x[f].sum(axis=0) for f in folds]) for x in (self.information, self.score, self.cost))
        return NormalEquations(self.layout, *sums)

    def add(self, other: NormalEquations) -> NormalEquations:
        """Those of two sets of data, in the same parameters."""
        return NormalEquations(
            self.layout, self.information + other.information, self.score + other.score, self.cost + other.cost
        )

    def finite(self) -> NormalEquations:
        """The same with zeros in place of what is not finite."""
        found = (np.nan_to_num(x, posinf=0.0, neginf=0.0) for x in (self.information, self.score, self.cost))
        return NormalEquations(self.layout, *found)

    def project(self, base: Sequence[int]) -> NormalEquations:
        """Those without what the base columns explain, and without the squares that they explain."""
        scaled, scale = unit_diagonal(self.information)
        right = self.score / scale
        known = ScaledInverse.of(scaled[np.ix_(base, base)], MIN_EXPLAINING_RATIO)
        answers = known.solve(np.column_stack([scaled[base], right[base]]))
        rest = scaled - scaled[:, base] @ answers[:, :-1]
        back = np.where(np.isfinite(scale), scale, 0.0)
        return replace(
            self,
            information=rest * np.outer(back, back),
            score=(right - scaled[:, base] @ answers[:, -1]) * back,
            cost=self.cost - right[base] @ answers[:, -1],
        )

    def solve(self, chosen: Sequence[int]) -> tuple[np.ndarray, np.ndarray]:
        """Change (chosen,) of some parameters alone, and its covariance; flat directions do not move."""
        covariance = ScaledInverse.of(self.information[np.ix_(chosen, chosen)]).matrix
        return covariance @ self.score[list(chosen)], covariance

    def gain(self, chosen: Sequence[int], change: np.ndarray) -> float:
        """Fall of the sum of squares with a change (chosen,) of some parameters."""
        own = self.information[np.ix_(chosen, chosen)]
        return float(2.0 * change @ self.score[list(chosen)] - change @ own @ change)


def symmetric(matrix: np.ndarray) -> np.ndarray:
    """Matrices (..., n, n) without the asymmetry that rounding leaves."""
    return 0.5 * (matrix + matrix.swapaxes(-2, -1))


class StateResponse(NamedTuple):
    """The step of the initial states of a log's segments in which they are eliminated."""

    step: np.ndarray  # (segments, NX) the states' own
    response: np.ndarray  # (segments, columns, NX) to the parameters
    gain: np.ndarray  # (segments,) fall of the sum of squares with the states' own step


@dataclass(frozen=True)
class ReducedEquations:
    """The normal equations of θ alone, the segments' initial states eliminated."""

    total: NormalEquations  # of all logs
    logs: tuple[NormalEquations, ...]  # of every log's segments, in its columns
    states: tuple[StateResponse, ...]  # per log

    @property
    def states_gain(self) -> float:
        """Fall of the sum of squares with the states' own steps."""
        return float(sum(float(s.gain.sum()) for s in self.states))

    @cached_property
    def segments(self) -> NormalEquations:
        """Those of every segment of all logs, in θ."""
        return NormalEquations.of_logs(self.total.layout, self.logs)


@np.errstate(over="ignore", invalid="ignore")  # what cannot be simulated gives infinities, and is rejected
def without_states(
    gram: np.ndarray, nx: int, layout: ParameterLayout, damping: float = 0.0
) -> tuple[NormalEquations, StateResponse]:
    """Normal equations of a log's segments without their initial states (Schur complement).

    gram (segments, nx + n + 1, nx + n + 1) has states first, the residual last.
    """
    normal, mixed = gram[:, :nx, :nx], gram[:, nx:-1, :nx]
    solved = solve_damped(normal, gram[:, :nx, nx:], damping)  # the states' response to θ, and their own step
    response, step = solved[:, :, :-1].transpose(0, 2, 1), solved[:, :, -1]
    gain = np.einsum("sx,sx->s", gram[:, :nx, -1], step)
    equations = NormalEquations(
        layout,
        information=gram[:, nx:-1, nx:-1] - np.einsum("skx,slx->skl", mixed, response),
        score=gram[:, nx:-1, -1] - np.einsum("skx,sx->sk", mixed, step),
        cost=gram[:, -1, -1] - gain,
    )
    return equations, StateResponse(step, response, gain)


def reduced_equations(
    linearisations: Sequence[ShootingLinearisation], nx: int, layout: ParameterLayout, damping: float = 0.0
) -> ReducedEquations:
    """Normal equations of θ from the linearised logs, the initial states (nx each) of every segment eliminated."""
    logs, states = zip(*(without_states(s.gram, nx, layout, damping) for s in linearisations), strict=True)
    size = len(layout.elements)
    information, scores, costs = np.zeros((size, size)), [], []
    for equations, places in zip(logs, layout.places, strict=True):
        information[np.ix_(places, places)] += equations.sum().information
        scores.append(np.zeros((len(equations.score), size)))
        scores[-1][:, places] = equations.score
        costs.append(equations.cost)
    total = NormalEquations(layout, information, np.concatenate(scores).sum(axis=0), np.concatenate(costs).sum())
    return ReducedEquations(total, logs, states)


def bounded_step(
    information: np.ndarray, score: np.ndarray, damping: float, lowest: np.ndarray, highest: np.ndarray
) -> np.ndarray:
    """Damped Gauss-Newton step within bounds on it, by an active set: elements beyond them are fixed there."""
    step = np.zeros(len(score))
    free = np.ones(len(score), dtype=bool)
    for _ in range(len(score) + 1):
        rest = score - information[:, ~free] @ step[~free]
        if free.any():
            step[free] = ScaledInverse.of(information[np.ix_(free, free)]).solve(rest[free], damping)
        outside = free & ((step < lowest) | (step > highest))
        if not outside.any():
            break
        step[outside] = np.clip(step[outside], lowest[outside], highest[outside])
        free &= ~outside
    return step


def covariance_of(
    information: np.ndarray, parameters: Sequence[FreeParameter]
) -> tuple[np.ndarray, float, tuple[FreeParameter, ...]]:
    """Inverse of an information matrix, its scaled condition number, and the parameters that are not identifiable."""
    if not len(parameters):
        return np.zeros((0, 0)), 1.0, ()
    silent = np.sqrt(np.maximum(np.diag(information), 0.0)) <= SILENT_ROOT
    inverse = ScaledInverse.of(information + np.diag(silent * 1.0))
    rows = zip(parameters, silent, inverse.lost, strict=True)
    return inverse.matrix, inverse.condition, tuple(p for p, s, w in rows if s or w > MAX_LOST_SHARE)
