"""The multiple-shooting problem of several logs, as functions of the free parameters θ and the initial states."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from derive.effects import EFFECT_LIBRARY, USER_EFFECTS, DryForce
from wheelpend.estimation.normal_equations import ReducedEquations, reduced_equations
from wheelpend.estimation.parameter_space import ParameterSpace
from wheelpend.estimation.parameters import kernel_parameters
from wheelpend.estimation.scaled_inverse import ScaledInverse
from wheelpend.estimation.segments import Segments
from wheelpend.estimation.shooting import ShootingLinearisation, Simulator, has_coupled_segments
from wheelpend.estimation.states import fit_states, initial_states, sequential_states
from wheelpend.kernels.kernel_module import KernelModule

MAX_GOOD_MEAN_SQUARE = 4.0  # of a segment's residuals [σ²], up to which it begins well enough
STATE_UPDATE_ROUNDS = 2  # rounds in which initial states are brought up to date with other parameters


def sticks(module: KernelModule, parameters: np.ndarray) -> bool:
    """True of a machine with dry friction, which may hold it, at these parameters (NP,)."""
    values = dict(zip(module.PARAMETERS, parameters, strict=True))
    dry = [row for row in (EFFECT_LIBRARY | USER_EFFECTS).values() if isinstance(row.enters, DryForce)]
    return any(values.get(row.name_of(size), 0.0) != 0.0 for row in dry for size in row.linear)


class LinearisedPoint(NamedTuple):
    """A point of the iteration, and the least-squares problem linearised there."""

    theta: np.ndarray  # (free,)
    states: list[np.ndarray]  # per log: initial states (segments, NX)
    linearisations: list[ShootingLinearisation]  # per log

    @property
    def cost(self) -> float:
        """Sum of squared residuals [σ²] of all logs."""
        return sum(s.cost for s in self.linearisations)


@dataclass(frozen=True)
class ShootingProblem:
    """A kernel module's residuals on the segments of several logs."""

    simulator: Simulator
    segments: Sequence[Segments]  # of each log
    space: ParameterSpace

    @property
    def module(self) -> KernelModule:
        """Its kernels."""
        return self.simulator.module

    @cached_property
    def columns(self) -> list[int]:
        """Places of the free parameters in the kernels' parameter vector."""
        return [self.module.PARAMETERS.index(p.name) for p in self.space.layout.columns]

    @cached_property
    def count(self) -> int:
        """Number of measured values."""
        return sum(s.values for s in self.segments)

    def parameters_at(self, theta: np.ndarray) -> list[np.ndarray]:
        """Each log's parameter vector (NP,)."""
        return [
            kernel_parameters(self.module, self.space.values_of_log(theta, k), s.log)
            for k, s in enumerate(self.segments)
        ]

    def linearise(self, theta: np.ndarray, states: list[np.ndarray]) -> LinearisedPoint:
        """Simulate all segments and linearise their residuals."""
        rows = zip(self.segments, states, self.parameters_at(theta), strict=True)
        return LinearisedPoint(
            theta,
            states,
            [self.simulator.shoot(s, x, p, self.columns, keep_residual=False) for s, x, p in rows],
        )

    def start_states(self, theta: np.ndarray) -> list[np.ndarray]:
        """Initial states from the measured channels, fitted in a few rounds."""
        return [
            fit_states(
                self.simulator, s, initial_states(self.module, s), p, STATE_UPDATE_ROUNDS, keep_residual=False,
            )[0]
            for s, p in zip(self.segments, self.parameters_at(theta), strict=True)
        ]  # fmt: skip

    def consistent_states(self, theta: np.ndarray, states: list[np.ndarray]) -> list[np.ndarray]:
        """Initial states in which each segment of a coupled model takes over from the one before.

        What a segment hands on to the next is not in the linearisation.
        """
        parameters = self.parameters_at(theta)
        if not any(has_coupled_segments(self.module, p) for p in parameters):
            return states
        rows = zip(self.segments, states, parameters, strict=True)
        return [sequential_states(self.simulator, s, x, p, STATE_UPDATE_ROUNDS) for s, x, p in rows]

    def with_settled_states(self, trial: LinearisedPoint, before: LinearisedPoint) -> LinearisedPoint:
        """A trial in which segments that fit worse than before, or badly, begin where they fit best.

        Fitted from where they began before, or from what was measured. Where dry friction holds a segment says next to
        nothing of the speed with which it begins, and its linear step leads anywhere; that of the parameters is not
        the worse for it. Segments without dry friction, and those of a coupled model, stay as they are.
        """
        parameters = self.parameters_at(trial.theta)
        settled = [self._settled_log(k, trial, before, p) for k, p in enumerate(parameters)]
        return LinearisedPoint(trial.theta, [states for states, _ in settled], [found for _, found in settled])

    def _settled_log(
        self, number: int, trial: LinearisedPoint, before: LinearisedPoint, parameters: np.ndarray
    ) -> tuple[np.ndarray, ShootingLinearisation]:
        """Initial states (segments, NX) and linearisation of one log of a trial."""
        segments, found, best = self.segments[number], trial.states[number].copy(), trial.linearisations[number]
        worse = ~(best.costs <= before.linearisations[number].costs)
        poor = np.flatnonzero(worse | (best.costs > MAX_GOOD_MEAN_SQUARE * segments.counts))
        if not len(poor) or not sticks(self.module, parameters) or has_coupled_segments(self.module, parameters):
            return found, best
        part = segments.chosen(poor)
        for begin in (before.states[number][poor], initial_states(self.module, part)):
            begin, _ = fit_states(self.simulator, part, begin, parameters, STATE_UPDATE_ROUNDS, keep_residual=False)
            again = self.simulator.shoot(part, begin, parameters, self.columns, keep_residual=False)
            better = again.costs < np.nan_to_num(best.costs[poor], nan=np.inf)
            found[poor[better]] = begin[better]
            best = best.with_segments(again, poor[better], better)
        return found, best

    def reduce(self, point: LinearisedPoint, damping: float = 0.0) -> ReducedEquations:
        """Normal equations of θ alone, the initial states eliminated."""
        return reduced_equations(point.linearisations, self.module.NX, self.space.layout, damping)

    def predicted_decrease(self, reduced: ReducedEquations) -> float:
        """Decrease of the sum of squares in an undamped step, were the residual linear."""
        information, score = reduced.total.information, reduced.total.score
        return reduced.states_gain + (float(score @ ScaledInverse.of(information).solve(score)) if score.size else 0.0)
