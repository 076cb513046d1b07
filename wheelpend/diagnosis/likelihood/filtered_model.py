"""A model with the parameters and the random forces that make its estimation logs likeliest."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import chain

import numpy as np

from wheelpend.diagnosis.missing_force.estimate import MissingForce
from wheelpend.diagnosis.missing_force.smoothed_force import NOTHING_FREE, force_along
from wheelpend.estimation.continuation import fit_segments
from wheelpend.estimation.data import shortened_segments
from wheelpend.estimation.filter_fit import Effort, FilterEstimator, FilterPoint
from wheelpend.estimation.fit import Fit
from wheelpend.estimation.free_parameters import free_names
from wheelpend.estimation.normal_equations import covariance_of
from wheelpend.estimation.problem import EstimationProblem
from wheelpend.estimation.random_source import Sources, possible_errors, possible_forces
from wheelpend.estimation.source_search import Progress, likeliest_sources
from wheelpend.estimation.starts import start_candidates
from wheelpend.identification.filter_error_method import estimator_at, remainder_at_point
from wheelpend.identification.remainder import Remainder, modelled_forces
from wheelpend.kernels.load import free_force_module

MAX_SAMPLES = 10_000  # of all logs together, to which a model is fitted: half from the beginning, half from the middle
MAX_LAST_SAMPLES = 60_000  # the same of the model that a search ends with
BLOCK_HORIZON_SHARE = 0.2  # of the horizon: length of the pieces of whose sums the blocks of a short log are made
SETTLED_EFFORT = Effort(10, 0.5, True)  # of the fit that ends a search
STATE_ROUNDS = 5  # of the fit of the segments' initial states, over which the error is taken

LogValues = Sequence[Mapping[str, float]]  # values of all parameters in each log


@dataclass(frozen=True)
class FilteredModel:
    """The model of a problem at a likely point: parameters, and random sources in each log."""

    problem: EstimationProblem
    estimator: FilterEstimator
    point: FilterPoint

    @property
    def names(self) -> list[str]:
        """Names of the free parameters, per-log ones once."""
        return free_names(self.problem, self.problem.model.effects)

    @property
    def log_values(self) -> list[dict[str, float]]:
        """Values of all parameters in each log."""
        space = self.estimator.problem.space
        return [space.values_of_log(self.point.theta, k) for k in range(len(self.problem.logs))]

    @property
    def deviance(self) -> float:
        """−2 log-likelihood of the estimation logs, with what its free numbers are worth by chance."""
        return self.point.deviance + self.freedom * float(np.log(max(self.estimator.problem.count, 2)))

    @property
    def freedom(self) -> int:
        """Number of free values: parameters, and sizes and correlation times of the sources."""
        return len(self.point.theta) + len(self.point.kinds) * (len(self.point.sources) + 1)

    @property
    def row_forces_squared(self) -> np.ndarray:
        """Mean square of the random forces on each row (rows,), averaged over logs, in the rows' own unit squared."""
        squares = [[(s.rms * np.array(s.rows)) ** 2 for s in own] for own in self.point.sources]
        return np.mean([np.sum([np.zeros(self.problem.module.NQ), *own], axis=0) for own in squares], axis=0)

    @property
    def force_squared(self) -> float:
        """The same, summed over rows."""
        return float(self.row_forces_squared.sum())

    @cached_property
    def row_drives(self) -> np.ndarray:
        """Size of the modelled forces on each row (rows,), in its own unit; the largest of all where it has none."""
        drives = modelled_forces(self.problem.module, self.problem.logs, self.log_values[0]).together
        return np.where(drives > 0.0, drives, drives.max() or 1.0)

    def remainder(self) -> Remainder:
        """What the model leaves to chance."""
        return remainder_at_point(self.problem, self.estimator, self.point)

    def smoothed_forces(self) -> tuple[MissingForce, ...]:
        """The random force along each log, as the smoother finds it."""
        values = self.log_values
        whole = estimator_at(self.problem, self.problem.module, (), values, lambda: values)
        return tuple(force_along(whole, NOTHING_FREE, own, k) for k, own in enumerate(self.point.sources))

    def fitted(self) -> Fit:
        """The point as a fit: errors of the parameters from the whitened innovations, states of the segments as likely.

        Its cost is that of the innovations, so that its error is 1 where the filter expects just what it sees.
        """
        filters, theta = self.estimator.problem, self.point.theta
        values = self.log_values
        per_log = [filters.space.per_log_values(theta, k) for k in range(len(values))]
        states = fit_segments(
            self.problem, self.problem.data.estimation, values[0], (), rounds=STATE_ROUNDS, start_per_log=per_log
        ).states
        equations = filters.equations(self.point.runs).finite()
        covariance, condition, lost = covariance_of(equations.sum().information, filters.space.layout.elements)
        return Fit(
            values={**filters.space.shared, **filters.space.shared_values(theta)},
            per_log=tuple(per_log),
            free=filters.space.layout.elements,
            covariance=covariance,
            robust=self.estimator.jackknife(self.point, covariance),
            states=states,
            cost=float(equations.cost.sum()),
            count=filters.count + sum(s.size for s in states),
            condition=condition,
            unidentifiable=lost,
            converged=True,
            blocks=len(np.unique(self.point.blocks)),
            coloured=True,
        )


def estimator_of(
    problem: EstimationProblem, log_values: LogValues, more: Sequence[str] = (), samples: int = MAX_SAMPLES
) -> FilterEstimator:
    """The estimator of a problem's model at some values in each log, with further parameters free beside its own.

    Of long logs it sees so many samples.
    """
    names = [*free_names(problem, problem.model.effects), *more]
    short = shortened_segments(problem, BLOCK_HORIZON_SHARE * problem.horizon, max_segments=MAX_SAMPLES)
    finer = replace(problem, data=problem.data.with_estimation(short))
    estimator = estimator_at(finer, problem.module, names, log_values, lambda: log_values)
    return estimator.on_part(samples)


def filtered_model(
    problem: EstimationProblem, starts: Iterable[Mapping[str, float]], progress: Progress
) -> FilteredModel:
    """The likeliest parameters and random sources of a problem's model, from the likeliest of starts for all logs."""
    return filtered_from(problem, ([values] * len(problem.logs) for values in starts), progress)


def filtered_from(problem: EstimationProblem, starts: Iterable[LogValues], progress: Progress) -> FilteredModel:
    """The same, from starts that give each log values of its own, then from those that are sought for all."""
    everywhere = ([values] * len(problem.logs) for values in start_candidates(problem))
    candidates = chain(starts, everywhere)
    first = estimator_of(problem, next(candidates))
    others = (estimator_of(problem, values).problem.space.start() for values in candidates)
    thetas = chain([first.problem.space.start()], others)
    quick = with_quick_kernels(problem, first)
    found = likeliest_sources(quick, thetas, *possible_sources(problem), progress)
    return FilteredModel(problem, first, first.point(found.theta, found.sources))


def with_quick_kernels(problem: EstimationProblem, estimator: FilterEstimator) -> FilterEstimator:
    """An estimator with the kernels of the bare plant, several times faster, where its model has no effects."""
    model = problem.model
    if model.effects:
        return estimator
    module = free_force_module(model.plant, model.assumptions, ())
    return replace(estimator, problem=replace(estimator.problem, module=module))


def possible_sources(problem: EstimationProblem) -> tuple[Sources, Sources]:
    """Random forces that the plant may feel, and errors that its sensors may have."""
    module = problem.module
    return possible_forces(problem.plant, module.NY), possible_errors(module.OUTPUTS, module.NQ)


def moved_to(model: FilteredModel, point: FilterPoint) -> FilteredModel:
    """The same model at another point."""
    return replace(model, point=point)
