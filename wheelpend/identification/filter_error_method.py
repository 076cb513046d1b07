"""Identification by the filter-error method: parameters and random forces that make the measurements likeliest."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from wheelpend.errors import Failure
from wheelpend.estimation.continuation import fit_model, fit_segments
from wheelpend.estimation.correlation_time import Movement, movement_with_time
from wheelpend.estimation.covariance import is_autocorrelated
from wheelpend.estimation.data import prepare
from wheelpend.estimation.estimate import Estimate, LogValue
from wheelpend.estimation.filter_error import FilterProblem, filtered_segments
from wheelpend.estimation.filter_fit import FilterEstimator, FilterPoint
from wheelpend.estimation.free_parameters import free_names, free_parameters, per_log_names
from wheelpend.estimation.normal_equations import covariance_of
from wheelpend.estimation.parameter_space import ParameterSpace
from wheelpend.estimation.parameter_table import MAX_WHITE_NOISE_ERROR_RATIO
from wheelpend.estimation.parameters import FreeParameter, ParameterLayout, kernel_parameters
from wheelpend.estimation.problem import EstimationProblem
from wheelpend.estimation.random_source import possible_errors, possible_forces
from wheelpend.estimation.restrictions import NO_RESTRICTIONS, Restrictions
from wheelpend.estimation.source_search import as_mixture, likeliest_sources
from wheelpend.estimation.starts import best_start, start_candidates
from wheelpend.estimation.step_size import fastest_state, resolving_step
from wheelpend.identification.remainder import Remainder, modelled_forces, remainder_of
from wheelpend.kernels.kernel_module import KernelModule
from wheelpend.kernels.load import free_force_module
from wheelpend.logs.log import Log
from wheelpend.logs.sources import LogsLike
from wheelpend.model.record import Model

Progress = Callable[[str], None]

MAX_SHORTER_STEPS = 4  # of the integrator, that a fit is made with because what it found is too fast for longer ones
SHORTEST_STEP_S = 2e-4  # of these: what is faster no log shows


class FilterErrorFit(NamedTuple):
    """Parameters as the filter-error method finds them, and what they leave to chance."""

    problem: EstimationProblem
    estimator: FilterEstimator
    point: FilterPoint
    table: dict[str, Estimate]  # by name
    names: tuple[str, ...]  # of the rows of the covariance; of a parameter that a log has for itself with the log
    covariance: np.ndarray
    condition: float
    remainder: Remainder
    movement: Movement  # of the parameters with the force's correlation time
    error: float  # over segments [σ], as every error is judged


def filter_error_fit(
    model: Model, logs: LogsLike, progress: Progress, restrictions: Restrictions = NO_RESTRICTIONS
) -> FilterErrorFit:
    """Fit a model and the random sources that it needs to all samples of some logs.

    Parameters that are fixed have their values in the model. Raises Failure where no start can be simulated.
    """
    problem = replace(prepare(model, logs, use_all=True, lean=True), restrictions=restrictions)
    progress("finding a start")
    problem, best = best_start(problem)
    estimator, names = filter_estimator(problem, best)
    module = estimator.problem.module
    forces, errors = possible_forces(problem.plant, module.NY), possible_errors(module.OUTPUTS, module.NQ)
    layout = estimator.problem.space.layout
    thetas = (ParameterSpace.of(layout, start, ()).start() for start in _starts(problem, best, names))
    point = likeliest_sources(estimator, thetas, forces, errors, progress)
    problem, estimator, point = _with_step_that_resolves(problem, estimator, point, progress)
    return _as_fit(problem, estimator, point, names, progress)


def _with_step_that_resolves(
    problem: EstimationProblem, estimator: FilterEstimator, point: FilterPoint, progress: Progress
) -> tuple[EstimationProblem, FilterEstimator, FilterPoint]:
    """A problem, its estimator and a point, fitted again with a shorter step while motion is too fast there for one.

    An inertia that data between two samples do not know, or a friction, runs to where the integrator becomes unstable,
    and seems to be known well there. What is then faster than any step resolves stays where it was.
    """
    for _ in range(MAX_SHORTER_STEPS):
        step = max(_resolving_step(estimator, point), SHORTEST_STEP_S)
        if step >= problem.max_step:
            break
        progress(f"once more in steps of {1e3 * step:.2g} ms, for the motion found is too fast for longer ones")
        problem = replace(problem, max_step=step)
        estimator = replace(estimator, problem=replace(estimator.problem, max_step=step))
        again = estimator.fit(point.theta, point.sources)
        known = _resolving_step(estimator, again) >= SHORTEST_STEP_S
        point = again if known else estimator.point(point.theta, point.sources)
    return problem, estimator, point


def _resolving_step(estimator: FilterEstimator, point: FilterPoint) -> float:
    """The longest step [s], up to the estimator's own, that resolves motion at a point in every log."""
    filters = estimator.problem
    return min(
        resolving_step(
            filters.module,
            kernel_parameters(filters.module, filters.space.values_of_log(point.theta, k), s.log),
            fastest_state(filters.module, s.log),
            filters.max_step,
        )
        for k, s in enumerate(filters.segments)
    )


def filter_estimator(problem: EstimationProblem, values: Mapping[str, float]) -> tuple[FilterEstimator, list[str]]:
    """The estimator of a model's free parameters on a problem's logs, at or near some values, and their names."""
    model, names = problem.model, free_names(problem, problem.model.effects)
    module = free_force_module(model.plant, model.assumptions, model.effects)
    log_values = [values] * len(problem.logs)
    return estimator_at(problem, module, names, log_values, lambda: [values, *start_candidates(problem)]), names


def estimator_at(
    problem: EstimationProblem,
    module: KernelModule,
    free: Sequence[str],
    log_values: Sequence[Mapping[str, float]],
    starts: Callable[[], Iterable[Mapping[str, float]]],
) -> FilterEstimator:
    """The estimator of some free parameters, at values of all parameters in each log.

    ``starts`` tell the size of the modelled forces where nothing drives the machine.
    """
    shared = set(free) - set(per_log_names(free))
    layout = ParameterLayout.of(free_parameters(replace(problem, module=module), free), len(problem.logs))
    own = [{n: v for n, v in values.items() if n not in shared} for values in log_values]
    space = ParameterSpace.of(layout, log_values[0], own)
    filters = FilterProblem(module, filtered_segments(problem), space, problem.max_step)
    return FilterEstimator(filters, force_scale(module, problem.logs, starts))


def _starts(
    problem: EstimationProblem, best: Mapping[str, float], names: Sequence[str]
) -> Iterator[Mapping[str, float]]:
    """Values to start from, none computed sooner than asked: first ones that have a model's effects as well."""
    if problem.model.effects:
        with suppress(Failure):
            yield fit_model(problem, best, names).of_log(0)
    yield best
    yield from start_candidates(problem)


def force_scale(
    module: KernelModule, logs: Sequence[Log], starts: Callable[[], Iterable[Mapping[str, float]]]
) -> float:
    """Size of the input's forces, or where none acts the least of what several starts call the modelled ones."""
    driven = float(np.max(modelled_forces(module, logs, dict.fromkeys(module.LINEAR, 0.0)).together))
    return driven or max(min(float(np.max(modelled_forces(module, logs, s).together)) for s in starts()), 1e-12)


def _as_fit(
    problem: EstimationProblem,
    estimator: FilterEstimator,
    point: FilterPoint,
    names: Sequence[str],
    progress: Progress,
) -> FilterErrorFit:
    """The result that a point stands for, and where friction may stick one of several Gaussian parts near it."""
    progress("moving the force's correlation time")
    movement = movement_with_time(estimator, point, _covariance(estimator, point)[0])
    progress("fitting all samples as a mixture")
    estimator, point = as_mixture(estimator, point)
    filters = estimator.problem
    elements = filters.space.layout.elements
    covariance, condition, lost = _covariance(estimator, point)
    covariance = covariance + np.diag(movement.widening**2)
    progress("predicting segments")
    sigma = np.sqrt(np.diag(covariance))
    return FilterErrorFit(
        problem,
        estimator,
        point,
        _table(problem, filters.space, point.theta, sigma, {p.name for p in lost}, names),
        tuple(p.name if p.log is None else f"{p.name} in {problem.logs[p.log].name}" for p in elements),
        covariance,
        condition,
        remainder_at_point(problem, estimator, point),
        movement,
        _segments_error(problem, filters.space, point.theta),
    )


def _covariance(estimator: FilterEstimator, point: FilterPoint) -> tuple[np.ndarray, float, tuple[FreeParameter, ...]]:
    """Covariance, condition and unidentifiable parameters: of the information where the innovations are white."""
    filters = estimator.problem
    information = filters.equations(point.runs).sum().finite().information
    covariance, condition, lost = covariance_of(information, filters.space.layout.elements)
    if not _is_white(estimator, point):
        covariance = _conservative_covariance(estimator, point, covariance)
    return covariance, condition, lost


def _is_white(estimator: FilterEstimator, point: FilterPoint) -> bool:
    """True where the innovations are white and of the size that the filter expects: the information says all."""
    filters = estimator.problem
    squares = sum(float(run.gram[:, -1, -1].sum()) for run in point.runs)
    if squares > MAX_WHITE_NOISE_ERROR_RATIO**2 * filters.count:
        return False
    innovations = filters.innovations(point.theta, point.sources)
    return not any(is_autocorrelated(i[..., 0], s.bounds) for i, s in zip(innovations, filters.segments, strict=True))


def _conservative_covariance(estimator: FilterEstimator, point: FilterPoint, covariance: np.ndarray) -> np.ndarray:
    """The covariance of the information with the standard errors of the block jackknife where these are larger."""
    robust = estimator.jackknife(point, covariance)
    wider = np.sqrt(np.maximum(np.diag(robust) / np.maximum(np.diag(covariance), 1e-300), 1.0))
    return covariance * np.outer(wider, wider)


def _segments_error(problem: EstimationProblem, space: ParameterSpace, theta: np.ndarray) -> float:
    """Error of the values over segments [σ], only the initial states fitted."""
    per_log = [space.per_log_values(theta, k) for k in range(len(problem.logs))]
    return fit_segments(
        problem, problem.data.estimation, space.values_of_log(theta, 0), (), rounds=5, start_per_log=per_log
    ).error


def _table(
    problem: EstimationProblem,
    space: ParameterSpace,
    theta: np.ndarray,
    sigma: np.ndarray,
    lost: set[str],
    names: Sequence[str],
) -> dict[str, Estimate]:
    """Estimate of every free parameter, by name."""
    elements = space.layout.elements
    found = {}
    for name in names:
        own = [k for k, p in enumerate(elements) if p.name == name]
        logs = [problem.logs[elements[k].log or 0].name for k in own]
        rows = zip(logs, theta[own], sigma[own], strict=True)
        several = tuple(LogValue(log, float(v), float(s)) for log, v, s in rows) if len(own) > 1 else ()
        first = own[0]
        value, error, unit = float(theta[first]), float(sigma[first]), elements[first].unit
        found[name] = Estimate(value, error, unit, name not in lost, several)
    return found


def remainder_at_point(problem: EstimationProblem, estimator: FilterEstimator, point: FilterPoint) -> Remainder:
    """What a point leaves to chance."""
    filters = estimator.problem
    acting = modelled_forces(filters.module, problem.logs, filters.space.values_of_log(point.theta, 0))
    sigma = np.sqrt(np.mean([s.sigma**2 for s in filters.segments], axis=0))
    deviation = np.sqrt(np.mean([np.nanvar(log.measured, axis=0) for log in problem.logs], axis=0))
    return remainder_of(problem.model, point.sources, acting, sigma, deviation, estimator.correlation_bounds[1])
