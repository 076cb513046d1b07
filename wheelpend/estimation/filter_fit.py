"""Maximum likelihood by the filter-error method: parameters, and sizes and times of random sources, together.

Parameters move by Gauss-Newton on the whitened innovations, the filter's gains held within a step; sizes and times, as
logarithms, by Fisher scoring with derivatives by differences. Every step is judged by the likelihood itself; where none
at held gains raises it, what the gains change is taken in, by differences too.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from wheelpend.estimation.covariance import block_numbers, jackknife_covariance
from wheelpend.estimation.filter_error import FilterProblem, FilterRun, total_deviance
from wheelpend.estimation.normal_equations import NormalEquations, bounded_step
from wheelpend.estimation.parameters import FreeParameter
from wheelpend.estimation.random_source import RandomSource, Sources, correlation_bounds
from wheelpend.estimation.scoring import noise_equations, parameter_equations

HOPELESS_SHARE = 0.1  # of what a deviance is above its goal: a round that gains less will not lead there
MIN_FORCE_SHARE = 1e-5  # of the modelled forces: a random force below it is none
MIN_ERROR_SIGMAS = 1e-2  # of a sensor: a random error below it is none
MAX_DAMPING, FIRST_DAMPING, DAMPING_FACTOR = 1e4, 1e-6, 100.0  # of the unit diagonal, and from one trial to the next
NO_NOISE = (np.zeros((0, 0)), np.zeros(0))  # information and score where no size or time is free
MAX_NOISE_STEP = 1.5  # of the logarithm of a size or time in a round
SLOWER_FACTOR = 10.0  # times the longest correlation time, that a source has which may be slower: half of a short log


class Effort(NamedTuple):
    """How long a fit goes on."""

    rounds: int
    settled: float  # fall of the deviance in a round, below which it ends
    with_gains: bool  # takes in what the gains change, where nothing is gained at held ones
    holds_times: bool = False  # keeps when events begin and end: a large force would carry them off
    holds_sensors: bool = False  # keeps the errors of sensors as they are
    holds_parameters: bool = False  # keeps θ, and moves the sources alone

    def holds(self, parameter: FreeParameter) -> bool:
        """True of a parameter that it does not move."""
        return self.holds_parameters or (self.holds_times and parameter.role == "event time")


THOROUGH = Effort(25, 0.1, True)
TRIAL = Effort(10, 1.0, False, holds_times=True)  # of fits that decide between sources


class Gradient(NamedTuple):
    """Where the likelihood grows: normal equations of θ, and information and score of the noise."""

    parameters: NormalEquations
    noise_information: np.ndarray  # over logarithms of all sizes of each log, then of the times that logs share
    noise_score: np.ndarray


class FilterPoint(NamedTuple):
    """Parameters and random sources with the filters' innovations there."""

    theta: np.ndarray  # (free,)
    sources: tuple[Sources, ...]  # of each log, the same ones of other sizes
    runs: tuple[FilterRun, ...]  # linearised in θ
    deviance: float  # −2 log-likelihood

    @property
    def blocks(self) -> np.ndarray:
        """Number (all segments,) of the block of consecutive segments that each belongs to."""
        return block_numbers([len(run.gram) for run in self.runs])

    @property
    def kinds(self) -> Sources:
        """Which sources there are; sizes and times are those of the first log."""
        return self.sources[0]

    def rises_over(self, other: FilterPoint) -> np.ndarray:
        """Rise of log-likelihood over another point of the same segments, in blocks of them (blocks,) [nats]."""
        before, after = (np.concatenate([run.deviance for run in point.runs]) for point in (other, self))
        return 0.5 * np.bincount(self.blocks, before - after)


@dataclass(frozen=True)
class FilterEstimator:
    """A filter problem with what its random sources are measured by."""

    problem: FilterProblem
    force_scale: float  # size of the forces that drive the machine, in the unit of its rows
    force_time: float = 0.0  # s, at which the correlation time of every force is held; 0 where it is free
    slow_kinds: tuple[tuple, ...] = ()  # of sources that may be slower than the bound of the others

    def point(self, theta: np.ndarray, sources: Sequence[Sources]) -> FilterPoint:
        """The point at given parameters and sources."""
        runs = tuple(self.problem.run(theta, sources))
        return FilterPoint(theta, tuple(sources), runs, total_deviance(runs))

    def jackknife(self, point: FilterPoint, covariance: np.ndarray) -> np.ndarray:
        """Covariance (free, free) of a fit by the block jackknife, from that of its information."""
        return jackknife_covariance(covariance, self.problem.equations(point.runs).finite(), point.blocks)

    def scale(self, source: RandomSource) -> float:
        """What the size of a source is measured by: forces that drive the machine, the σ of a sensor."""
        if source.is_force:
            return self.force_scale
        return float(self.problem.segments[0].sigma[np.abs(source.readings) > 0.0][0])

    def sized(self, source: RandomSource, share: float, time: float) -> RandomSource:
        """The source with a size as a share of its scale, and a correlation time [s], as near as the logs allow."""
        return source.with_noise(share * self.scale(source), float(np.clip(time, *self.correlation_bounds)))

    @property
    def correlation_bounds(self) -> tuple[float, float]:
        """Shortest and longest correlation time [s] that can be found on these logs."""
        logs = [s.log for s in self.problem.segments]
        return correlation_bounds([log.duration for log in logs], min(log.dt for log in logs))

    def times_of(self, source: RandomSource) -> tuple[float, float]:
        """Shortest and longest correlation time [s] that a source may have."""
        if source.is_force and self.force_time:
            return self.force_time, self.force_time
        shortest, longest = self.correlation_bounds
        return shortest, longest * (SLOWER_FACTOR if source.kind in self.slow_kinds else 1.0)

    def on_part(self, samples: int) -> FilterEstimator:
        """The same on as many samples of all logs together, or a few more."""
        return replace(self, problem=self.problem.on_part(samples))

    def in_all_logs(self, sources: Sources) -> tuple[Sources, ...]:
        """The same sources in every log."""
        return (sources,) * len(self.problem.segments)

    def fit(
        self,
        theta: np.ndarray,
        sources: Sequence[Sources],
        effort: Effort = THOROUGH,
        *,
        fixed_noise: bool = False,
        goal: float = np.inf,
    ) -> FilterPoint:
        """The likeliest parameters and, unless they are fixed, sizes and times of the sources, from a start.

        A fit that will hardly reach a deviance that is its goal is given up.
        """
        point, damping = self.point(theta, sources), FIRST_DAMPING
        free_noise = bool(point.kinds) and not fixed_noise
        for _ in range(effort.rounds if theta.size or free_noise else 0):
            if not np.isfinite(point.deviance):
                break
            gradient = self._equations_at_held_gains(point, free_noise, effort)
            trial, damping = self._descended(point, self._allowed(gradient, effort), damping)
            if effort.with_gains and point.kinds and theta.size and point.deviance - trial.deviance < effort.settled:
                stays = trial is point  # where the equations of the noise are known already
                noise = (gradient.noise_information, gradient.noise_score) if stays else None
                gradient = self._scoring_equations(trial, free_noise, effort, noise)
                trial, damping = self._descended(trial, self._allowed(gradient, effort), FIRST_DAMPING)
            gain, point = point.deviance - trial.deviance, trial
            if gain < max(effort.settled, HOPELESS_SHARE * (point.deviance - goal)):
                break
        return point

    def _descended(self, point: FilterPoint, gradient: Gradient, damping: float) -> tuple[FilterPoint, float]:
        """The first likelier point on the way from a whole step to none, and the damping to go on with."""
        while damping <= MAX_DAMPING:
            theta = self.problem.space.after_step(point.theta, gradient.parameters, damping)
            trial = self.point(theta, self._moved_noise(point.sources, gradient, damping))
            if trial.deviance <= point.deviance:
                return trial, max(damping / DAMPING_FACTOR, FIRST_DAMPING)
            damping *= DAMPING_FACTOR
        return point, damping

    def _allowed(self, gradient: Gradient, effort: Effort) -> Gradient:
        """The gradient without what an effort does not move."""
        elements = self.problem.space.layout.elements
        held = [k for k, p in enumerate(elements) if effort.holds(p)]
        gradient.parameters.information[held], gradient.parameters.information[:, held] = 0.0, 0.0
        gradient.parameters.score[held] = 0.0
        return gradient

    def _equations_at_held_gains(self, point: FilterPoint, free_noise: bool, effort: Effort) -> Gradient:
        parameters = self.problem.equations(point.runs).sum().finite()
        return Gradient(parameters, *self._noise_equations(point, free_noise, effort))

    def _scoring_equations(
        self, point: FilterPoint, free_noise: bool, effort: Effort, noise: tuple[np.ndarray, np.ndarray] | None
    ) -> Gradient:
        """The same with all that the gains change; noise are the equations of the noise there, where they are known."""
        held = self.problem.equations(point.runs).sum().finite()
        now = [run.innovation for run in point.runs]
        parameters = parameter_equations(self.problem, point.theta, point.sources, now, held.information)
        return Gradient(parameters, *(noise or self._noise_equations(point, free_noise, effort)))

    def _noise_equations(self, point: FilterPoint, free_noise: bool, effort: Effort) -> tuple[np.ndarray, np.ndarray]:
        held, now = [effort.holds_sensors and not s.is_force for s in point.kinds], [r.innovation for r in point.runs]
        return noise_equations(self.problem, point.theta, point.sources, now, held) if free_noise else NO_NOISE

    def _moved_noise(self, sources: tuple[Sources, ...], gradient: Gradient, damping: float) -> tuple[Sources, ...]:
        """Sources after a step of their sizes and times, within the bounds of both."""
        if not gradient.noise_score.size:
            return sources
        sizes = np.log([[s.rms for s in own] for own in sources])
        times = np.log([s.correlation_time for s in sources[0]])
        least = np.log([self.scale(s) * (MIN_FORCE_SHARE if s.is_force else MIN_ERROR_SIGMAS) for s in sources[0]])
        shortest, longest = np.log([self.times_of(s) for s in sources[0]]).T
        reach = MAX_NOISE_STEP / (1.0 + np.sqrt(damping))
        lowest = np.r_[np.maximum(least - sizes, -reach).ravel(), np.clip(shortest - times, -reach, 0.0)]
        highest = np.r_[np.full(sizes.size, reach), np.clip(longest - times, 0.0, reach)]
        step = bounded_step(
            gradient.noise_information, gradient.noise_score, damping, np.minimum(lowest, highest), highest
        )
        sizes, times = np.exp(sizes + step[: sizes.size].reshape(sizes.shape)), np.exp(times + step[sizes.size :])
        return tuple(
            tuple(s.with_noise(float(rms), float(time)) for s, rms, time in zip(own, row, times, strict=True))
            for own, row in zip(sources, sizes, strict=True)
        )
