"""The missing force on each row at every sample of every log, with its band, by a smoother.

The model stands at its values; all that it does not say is a random force, whose size and correlation time are the
likeliest for these logs. So nothing that the sensors show is shrunk away: a force is followed as fast as the
noise allows, and what a law makes jump is seen to jump. Where no filter can run along a log, the piecewise constant
force stands in.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np

from wheelpend.diagnosis.missing_force.estimate import (
    ForceConcentration,
    MissingForce,
    concentrations,
    estimate_missing_force,
)
from wheelpend.estimation.filter_error import FilterProblem
from wheelpend.estimation.filter_fit import FilterEstimator, FilterPoint
from wheelpend.estimation.fit import Fit
from wheelpend.estimation.problem import EstimationProblem
from wheelpend.estimation.random_source import RandomSource, Sources, possible_forces
from wheelpend.estimation.segments import Segments
from wheelpend.estimation.smoother import SmoothedForce, smoothed_force
from wheelpend.estimation.state_reconstruction import input_table, port_motion
from wheelpend.identification.filter_error_method import estimator_at
from wheelpend.kernels.load import free_force_module
from wheelpend.logs.log import Log

MAX_FITTED_SAMPLES = 20_000  # of all logs together, on which sizes and correlation times are found
PART_SAMPLES = 30_000  # of a log, smoothed at a time: a filter's steps fill a memory
FIRST_SHARES, FIRST_TIMES_S = (0.3, 0.03, 0.003), (0.01, 0.1, 1.0)  # of the forces that drive the machine, s: starts
NOTHING_FREE = np.zeros(0)  # θ of a model at its values


def missing_forces(problem: EstimationProblem, fitted: Fit) -> tuple[MissingForce, ...]:
    """The missing force along each of the problem's logs, of the model at a fit to them."""
    return forces_by_filter(problem, fitted) or (estimate_missing_force(problem, fitted),)


def forces_by_filter(problem: EstimationProblem, fitted: Fit) -> tuple[MissingForce, ...]:
    """The same by the smoother alone; none where no filter can follow the model along the logs."""
    estimator = estimator_of_forces(problem, fitted)
    point = likeliest_forces(estimator, problem)
    if not np.isfinite(point.deviance):
        return ()
    found = tuple(force_along(estimator, point.theta, own, number) for number, own in enumerate(point.sources))
    return found if all(np.isfinite(f.force).all() and np.isfinite(f.sigma).all() for f in found) else ()


def estimator_of_forces(problem: EstimationProblem, fitted: Fit) -> FilterEstimator:
    """Filters along a problem's logs with a model at a fit, in which nothing is free but random sources."""
    model = problem.model
    module = free_force_module(model.plant, model.assumptions, model.effects)
    values = [fitted.of_log(number) for number in range(len(problem.logs))]
    return estimator_at(problem, module, (), values, lambda: values)


def likeliest_forces(estimator: FilterEstimator, problem: EstimationProblem) -> FilterPoint:
    """A force on every row, of the likeliest sizes and times: on each by itself, or equal and opposite along a port.

    What is fewer counts as likelier by Schwarz's criterion.
    """
    part = estimator.on_part(MAX_FITTED_SAMPLES)
    forces = possible_forces(problem.plant, estimator.problem.module.NY)
    points = [_fitted(part, kinds) for kinds in _sets_of_forces(forces)]
    best = min(points, key=lambda p: p.deviance + len(p.kinds) * (len(p.sources) + 1) * np.log(part.problem.count))
    return estimator.point(best.theta, best.sources)


def _sets_of_forces(forces: Sources) -> Iterable[Sources]:
    """Forces on every row by itself; then one along each port, with those on the rows that it leaves out."""
    alone = tuple(f for f in forces if np.count_nonzero(f.rows) == 1)
    yield alone
    for port in (f for f in forces if f not in alone):
        yield (port, *(f for f in alone if not np.any(np.array(f.rows) * np.array(port.rows))))


def _fitted(estimator: FilterEstimator, kinds: Sequence[RandomSource]) -> FilterPoint:
    """Sizes and correlation times of forces, from the likeliest of some starts."""
    starts = dict.fromkeys(
        tuple(estimator.sized(k, share, time) for k in kinds) for share in FIRST_SHARES for time in FIRST_TIMES_S
    )
    deviances = [
        float(estimator.problem.deviances(NOTHING_FREE, estimator.in_all_logs(start)).sum()) for start in starts
    ]
    return estimator.fit(NOTHING_FREE, estimator.in_all_logs(list(starts)[int(np.argmin(deviances))]))


def force_along(estimator: FilterEstimator, theta: np.ndarray, sources: Sources, number: int) -> MissingForce:
    """The smoothed force along a log, with these parameters and random sources; zero on a row that none acts on."""
    problem, segments = estimator.problem, estimator.problem.segments[number]
    parts = [_part_along(problem, theta, sources, number, bounds) for bounds in _bounds_of_parts(segments)]
    samples, force, sigma, states = (np.concatenate(column) for column in zip(*parts, strict=True))
    variables = variables_of(problem, segments.log, samples, states)
    return MissingForce(segments.log.t[samples], force, sigma, variables, segments.log.name)


def _part_along(
    problem: FilterProblem, theta: np.ndarray, sources: Sources, number: int, bounds: np.ndarray
) -> SmoothedForce:
    segments = list(problem.segments)
    segments[number] = replace(segments[number], bounds=bounds, weights=None)
    module = problem.module
    track = replace(problem, segments=segments).track(number, theta, sources)
    return smoothed_force(track, bounds, sources, (module.NX, module.NQ))


def _bounds_of_parts(segments: Segments) -> list[np.ndarray]:
    """Sample ranges (S, 2) of a log's segments, in parts of not too many samples."""
    ends = np.cumsum(np.diff(segments.bounds, axis=1)[:, 0])
    part = (ends - 1) // PART_SAMPLES
    return [segments.bounds[part == k] for k in np.unique(part)]


def variables_of(problem: FilterProblem, log: Log, samples: np.ndarray, states: np.ndarray) -> dict[str, np.ndarray]:
    """States, slip speed, input and time at the samples."""
    module = problem.module
    table = {name: states[:, k] for k, name in enumerate(module.STATES)}
    ports = {n: w for n, w in port_motion(module).items() if not w[: module.NQ].any()}
    return table | {n: states @ w for n, w in ports.items()} | input_table(module, log.voltage[samples]) | {
        "t": log.t[samples]
    }  # fmt: skip


def pooled(forces: Sequence[MissingForce]) -> MissingForce:
    """The missing force of several logs in one, without the time, which means another thing in each."""
    if len(forces) == 1:
        return forces[0]
    names = [n for n in forces[0].variables if n != "t"]
    return MissingForce(
        t=np.concatenate([f.t for f in forces]),
        force=np.concatenate([f.force for f in forces]),
        sigma=np.concatenate([f.sigma for f in forces]),
        variables={n: np.concatenate([f.variables[n] for f in forces]) for n in names},
        log=", ".join(f.log for f in forces),
    )


def where_it_shows(
    problem: EstimationProblem, forces: Sequence[MissingForce], fitted: Fit
) -> tuple[ForceConcentration, ...]:
    """The ranges in which the missing force of all logs together is most concentrated, strongest first.

    Where it is so smooth that none stands out, those of the force in pieces, which is less certain and less smooth.
    """
    if not forces:
        return ()
    return concentrations(problem, pooled(forces)) or concentrations(problem, estimate_missing_force(problem, fitted))
