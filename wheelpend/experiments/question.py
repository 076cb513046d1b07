"""The question of a design: which of some effects it is, or the parameters; and the information of the logs at hand."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

import derive
from derive.parameter_name import full_name
from derive.plant_signature import PlantSignature
from wheelpend.diagnosis.evidence import CandidateFit
from wheelpend.diagnosis.score_test import size_names
from wheelpend.estimation.free_parameters import effect_parameter, free_names, free_parameters
from wheelpend.estimation.normal_equations import NormalEquations
from wheelpend.estimation.parameters import kernel_parameters
from wheelpend.estimation.problem import EstimationProblem
from wheelpend.estimation.segments import Segments
from wheelpend.experiments.information import (
    SignTies,
    SimulatedSegments,
    add_information,
    information_of_segments,
    separation,
    standard_errors,
)
from wheelpend.experiments.simulated_experiment import ExperimentLoop, SimulatedExperiment, balancing_gains
from wheelpend.logs.log import segment_bounds
from wheelpend.simulation.closed_loop import ClosedLoop

MAX_SAMPLE_INTERVAL_S = 0.02  # s between samples of a simulated experiment, beyond which no controller balances
MIN_SAMPLE_INTERVAL_S = 5e-4  # s, below which the simulation is not worth its time
ADVICE_DURATION_S = 20.0  # s of an experiment that is advised


@dataclass(frozen=True)
class Question:
    """Effects to be distinguished, or none: then the model's parameters are to be estimated better."""

    problem: EstimationProblem
    loop: ExperimentLoop
    base: tuple[str, ...]  # names of the parameters that every rival has: of the plant and of the model's effects
    first: str  # the effect of the simulated machine; empty where no effects are to be distinguished
    others: tuple[str, ...]  # effects that may be it instead
    sizes: tuple[Mapping[str, float], ...]  # parameter values in each log at hand, the first effect's among them
    pieces: tuple[np.ndarray, ...]  # information (names, names) of each log at hand
    density: float = 1.0  # samples of the log to be recorded, per sample of its simulation

    @property
    def names(self) -> tuple[str, ...]:
        """Parameters in which everything is linearised."""
        return (*self.base, *rival_parameters(self.first, self.others))

    @property
    def has_own_controller(self) -> bool:
        """The simulations use the machine's own controller."""
        return self.problem.model.controller is not None

    def information_of(
        self,
        played: SimulatedExperiment,
        sigma_factors: Mapping[str, float] | None = None,
        fault_free_sigma: Mapping[str, float] | None = None,
    ) -> np.ndarray:
        """Information (names, names) of a simulated log.

        ``sigma_factors`` multiplies the σ of channels, ``fault_free_sigma`` adds sensors without faults: channel to σ.
        """
        problem = self.problem
        sigma = problem.noise[0].sigma * np.array([(sigma_factors or {}).get(c, 1.0) for c in played.log.channels])
        bounds = np.ascontiguousarray(segment_bounds(played.log, problem.horizon))
        segments, states = Segments(played.log, sigma, bounds), played.states[bounds[:, 0]]
        point = SimulatedSegments(problem.simulator, segments, states, played.parameters)
        return self.density * information_of_segments(point, self.names, fault_free_sigma)

    def information_with(self, piece: np.ndarray | None, ties: SignTies | None = None) -> NormalEquations:
        """Information of the logs at hand, and of one more log where it is given."""
        pieces = self.pieces if piece is None else (*self.pieces, piece)
        return add_information(pieces, free_parameters(self.problem, self.names), ties if self.pieces else None)

    def separation(self, piece: np.ndarray | None, ties: SignTies | None = None) -> float:
        """Standard errors between the first effect and the closest of the others."""
        joint = self.information_with(piece, ties)
        own = rival_parameters(self.first, ())
        separations = [separation(joint, self.sizes, own, rival_parameters("", [o]), self.base) for o in self.others]
        return min(separations, default=np.inf)

    def gap(self, separation: float, played: SimulatedExperiment) -> float:
        """Relative difference of the rivals' errors over all logs: √(1 + separation²/values) − 1."""
        values = self.problem.data.values + self.density * played.log.measured.size
        return float(np.sqrt(1.0 + separation**2 / values) - 1.0)

    def errors(self, piece: np.ndarray | None) -> dict[str, float]:
        """Standard errors of the parameters of the simulated model."""
        return standard_errors(self.information_with(piece), (*self.base, *rival_parameters(self.first, ())))


def rival_parameters(first: str, others: Sequence[str]) -> tuple[str, ...]:
    """Parameters in which effects are linearised: the size of the first, everything of the others."""
    lead = size_names(derive.effects.find(first)) if first else []
    return (*lead, *(n for o in others for n in derive.effects.find(o).full_names))


def question_of_fit(problem: EstimationProblem, first: CandidateFit, others: Sequence[CandidateFit] = ()) -> Question:
    """The question that a diagnosis leaves: is it the first candidate, or one of its equivalents?"""
    fitted, rivals = first.fit, first.equivalent_to
    kept = [e for e in problem.model.effects if e not in problem.replaced(first.effect)]
    base = tuple(free_names(problem, kept))
    profiled = profiled_values_of(
        problem.plant, rivals, {full_name(t.effect, p): v for t in others for p, v in t.coefficients.items()}
    )
    sizes = tuple({**fitted.of_log(k), **profiled} for k in range(len(problem.data.estimation)))
    names = (*base, *rival_parameters(first.effect, rivals))
    pieces = tuple(
        information_at(problem, segments, states, own, names)
        for segments, states, own in zip(problem.data.estimation, fitted.states, sizes, strict=True)
    )
    log = problem.data.estimation[-1].log
    t = sample_times(ADVICE_DURATION_S, log.dt)
    loop = experiment_loop(problem, sizes[-1], t)
    return Question(problem, loop, base, first.effect, rivals, sizes, pieces, (t[1] - t[0]) / log.dt)


def information_at(
    problem: EstimationProblem,
    segments: Segments,
    states: np.ndarray,
    values: Mapping[str, float],
    names: Sequence[str],
) -> np.ndarray:
    """Information (names, names) of one log at hand at some values, with its initial states (segments, NX)."""
    parameters = kernel_parameters(problem.module, values, segments.log)
    return information_of_segments(SimulatedSegments(problem.simulator, segments, states, parameters), names)


def profiled_values_of(plant: PlantSignature, effects: Sequence[str], known: Mapping[str, float]) -> dict[str, float]:
    """Values that rivals need to have any influence: shapes, and limits that are absent at infinity."""
    names = [n for e in effects for n in derive.effects.find(e).full_names]
    needed = {n: p for n in names if (p := effect_parameter(n, plant)) and p.absent != 0.0}
    return {n: known.get(n, p.typical) for n, p in needed.items()}


def sample_times(duration: float, sample: float) -> np.ndarray:
    """Sample times (N,) of a simulated experiment [s], from the sample interval of a log [s]."""
    step = round(float(np.clip(sample, MIN_SAMPLE_INTERVAL_S, MAX_SAMPLE_INTERVAL_S)), 9)
    return np.arange(round(duration / step) + 1) * step


def experiment_loop(problem: EstimationProblem, values: Mapping[str, float], t: np.ndarray) -> ExperimentLoop:
    """The machine under its own controller, or under one that balances the model."""
    loop = ClosedLoop.of(problem.model, problem.module, problem.max_step)
    if problem.model.controller is None:
        loop = replace(loop, gains=balancing_gains(problem.module, values, float(t[1] - t[0])))
    return ExperimentLoop.of(loop, values, t, problem.noise[0])
