"""What is to be found out: which of some effects it is, or the parameters themselves; and what the logs at hand say."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

import derive
from wheelpend.diagnosis.evidence import CandidateFit
from wheelpend.estimation.free_parameters import effect_parameter, free_names, per_log_names
from wheelpend.estimation.parameters import kernel_parameters
from wheelpend.estimation.problem import EstimationProblem
from wheelpend.estimation.segments import Segments
from wheelpend.experiments.closed_loop import ClosedLoop, SimulatedExperiment, balancing_gains
from wheelpend.experiments.information import (
    JointInformation,
    SignTies,
    add_information,
    information_of_segments,
    separation,
    standard_errors,
)
from wheelpend.logs.log import segment_bounds

MAX_EQUIVALENT_ERROR_DIFFERENCE = 0.01  # relative difference of two errors within which a diagnosis lists both effects
MAX_SAMPLE_INTERVAL_S, MIN_SAMPLE_INTERVAL_S = 0.02, 5e-4  # s between samples of a rehearsal, at most and at least


@dataclass(frozen=True)
class Question:
    """Effects to be told apart, or none: then the model's parameters are to be known better."""

    problem: EstimationProblem
    loop: ClosedLoop
    base: tuple[str, ...]  # names of the parameters that every rival has: of the plant and of the model's effects
    first: str  # the effect that the rehearsed machine has; empty where no effects are to be told apart
    others: tuple[str, ...]  # effects that may be it instead
    sizes: tuple[Mapping[str, float], ...]  # parameter values in each log at hand, the first effect's among them
    pieces: tuple[np.ndarray, ...]  # information (names, names) of each log at hand
    density: float = 1.0  # samples of the record to be made, per sample of its rehearsal

    @property
    def names(self) -> tuple[str, ...]:
        """Parameters in which everything is linearised."""
        return (*self.base, *rival_parameters(self.first, self.others))

    @property
    def has_own_controller(self) -> bool:
        """Whether the rehearsals use the robot's own controller."""
        return self.problem.model.controller is not None

    def information_of(
        self,
        played: SimulatedExperiment,
        sigma_factors: Mapping[str, float] | None = None,
        fault_free_sigma: Mapping[str, float] | None = None,
    ) -> np.ndarray:
        """Information (names, names) of a rehearsed log.

        ``finer`` multiplies the σ of channels, ``truth`` adds sensors without faults: channel to σ.
        """
        problem = self.problem
        sigma = problem.noise[0].sigma * np.array([(sigma_factors or {}).get(c, 1.0) for c in played.log.channels])
        part = Segments(played.log, sigma, np.ascontiguousarray(segment_bounds(played.log, problem.horizon)))
        states = played.states[part.bounds[:, 0]]
        told = information_of_segments(
            problem.module, part, states, played.parameters, self.names, problem.max_step, fault_free_sigma
        )
        return self.density * told

    def information_with(self, piece: np.ndarray | None, ties: SignTies | None = None) -> JointInformation:
        """What the logs at hand say, with one more log where it is given."""
        pieces = self.pieces if piece is None else (*self.pieces, piece)
        return add_information(pieces, self.names, per_log_names(self.names), ties if self.pieces else None)

    def separation(self, piece: np.ndarray | None, ties: SignTies | None = None) -> float:
        """Standard errors between the first effect and the closest of the others."""
        known = self.information_with(piece, ties)
        lead = rival_parameters(self.first, ())
        each = [separation(known, self.sizes, lead, rival_parameters("", [o]), self.base) for o in self.others]
        return min(each, default=np.inf)

    def gap(self, separation: float, played: SimulatedExperiment) -> float:
        """By which share the rivals' errors over all logs would differ: √(1 + separation²/values) − 1."""
        values = sum(p.values for p in self.problem.training) + self.density * played.log.measured.size
        return float(np.sqrt(1.0 + separation**2 / values) - 1.0)

    def errors(self, piece: np.ndarray | None) -> dict[str, float]:
        """Standard errors of the parameters of the model that was rehearsed."""
        return standard_errors(self.information_with(piece), (*self.base, *rival_parameters(self.first, ())))


def rival_parameters(first: str, others: Sequence[str]) -> tuple[str, ...]:
    """Parameters in which effects are linearised: the size of the first, everything of the others."""
    lead = [f"{first}.{p.name}" for p in derive.effects.find(first).sizes] if first else []
    return (*lead, *(n for o in others for n in derive.effects.find(o).full_names))


def question_of_fit(problem: EstimationProblem, first: CandidateFit, others: Sequence[CandidateFit] = ()) -> Question:
    """The question that a diagnosis leaves: is it the first candidate, or one of its equivalents?"""
    fitted, rivals = first.fit, first.equivalent_to
    kept = [e for e in problem.model.effects if e not in problem.replaced(first.effect)]
    base = tuple(free_names(problem, kept))
    shapes = profiled_values_of(rivals, {f"{t.effect}.{p}": v for t in others for p, v in t.coefficients.items()})
    sizes = tuple({**fitted.of_log(k), **shapes} for k in range(len(problem.training)))
    names = (*base, *rival_parameters(first.effect, rivals))
    pieces = tuple(
        information_of_segments(
            problem.module, part, states, kernel_parameters(problem.module, own, part.log), names, problem.max_step
        )
        for part, states, own in zip(problem.training, fitted.states, sizes, strict=True)
    )
    log = problem.training[-1].log
    t = sample_times(20.0, log.dt)
    loop = closed_loop_of(problem, sizes[-1], t)
    return Question(problem, loop, base, first.effect, rivals, sizes, pieces, (t[1] - t[0]) / log.dt)


def profiled_values_of(effects: Sequence[str], known: Mapping[str, float]) -> dict[str, float]:
    """Values that rivals need to have any influence: shapes, and limits that are absent at infinity."""
    names = [n for e in effects for n in derive.effects.find(e).full_names]
    needed = {n: p for n in names if (p := effect_parameter(n)) and p.absent != 0.0}
    return {n: known.get(n, p.typical) for n, p in needed.items()}


def sample_times(duration: float, sample: float) -> np.ndarray:
    """Sample times (N,) of a rehearsal [s]: within what a controller can balance with, and what is worth computing."""
    step = round(float(np.clip(sample, MIN_SAMPLE_INTERVAL_S, MAX_SAMPLE_INTERVAL_S)), 9)
    return np.arange(round(duration / step) + 1) * step


def closed_loop_of(problem: EstimationProblem, values: Mapping[str, float], t: np.ndarray) -> ClosedLoop:
    """The robot under its own controller, or under one that balances the model."""
    own = problem.model.controller
    gains = np.array(own.gains) if own else balancing_gains(problem.module, values, float(t[1] - t[0]))
    return ClosedLoop.of(problem.module, values, gains, t, problem.noise[0], problem.max_step)
