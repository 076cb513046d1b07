"""Statistics of a fit at the point where the iteration ends: covariances, condition, colour of the residual."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from wheelpend.estimation.covariance import (
    block_numbers,
    correlated_samples,
    is_autocorrelated,
    jackknife_covariance,
)
from wheelpend.estimation.fit import Fit
from wheelpend.estimation.normal_equations import NormalEquations, covariance_of
from wheelpend.estimation.segments import Segments
from wheelpend.estimation.shooting_problem import LinearisedPoint, ShootingProblem

MAX_COLOUR_TEST_SEGMENTS = 400  # segments whose residual is tested for whiteness
MAX_COLOUR_TEST_SAMPLES = 400_000  # samples of a log that these may span


def fit_at(problem: ShootingProblem, point: LinearisedPoint, converged: bool) -> Fit:
    """The fit that a point stands for, with its covariances from the information and from the block jackknife."""
    space, theta = problem.space, point.theta
    reduced = problem.reduce(point)
    information, segments = reduced.total.finite().information, reduced.segments.finite()
    along, parameters = space.directions(theta)
    covariance, condition, unidentifiable = covariance_of(along.T @ information @ along, parameters)
    covariance = along @ covariance @ along.T
    block = block_numbers([len(s) for s in point.states])
    blocks = int(block.max(initial=-1)) + 1
    fitted = Fit(
        values={**{k: float(v) for k, v in space.shared.items()}, **space.shared_values(theta)},
        per_log=tuple(space.per_log_values(theta, k) for k in range(len(problem.segments))),
        free=space.layout.elements,
        covariance=covariance,
        robust=jackknife_covariance(covariance, segments, block) if len(theta) else covariance,
        states=tuple(point.states),
        cost=point.cost,
        count=problem.count,
        condition=condition,
        unidentifiable=unidentifiable,
        converged=converged,
        blocks=blocks,
        coloured=has_coloured_residual(problem, point),
        promised_decrease=promised_decrease(problem, theta, reduced.total.finite()),
    )
    if blocks != 1:
        return fitted
    return replace(fitted, robust=covariance * _growth_by_colour(problem, point, fitted))


def promised_decrease(problem: ShootingProblem, theta: np.ndarray, equations: NormalEquations) -> float:
    """Decrease of the sum of squares in the best step within the bounds, were the residual linear; 0 at an optimum."""
    if not len(theta):
        return 0.0
    step = problem.space.after_step(theta, equations, 0.0) - theta
    return max(float(2.0 * equations.score @ step - step @ equations.information @ step), 0.0)


def _growth_by_colour(problem: ShootingProblem, point: LinearisedPoint, fitted: Fit) -> float:
    """What the variances of a fit to a single segment are of those from its information.

    There is no scatter between blocks to tell. The residual is as large as it is, of the samples over which it is
    correlated one is independent, and of these as many as there are unknowns leave nothing.
    """
    rows = zip(problem.segments, point.states, problem.parameters_at(point.theta), strict=True)
    over = max(correlated_samples(problem.simulator.shoot(s, x, p).residual, s.bounds) for s, x, p in rows if len(x))
    independent, unknowns = fitted.count / over, len(fitted.free) + sum(s.size for s in fitted.states)
    return max(fitted.cost / fitted.count, 1.0) * over * independent / max(independent - unknowns, 1.0)


def has_coloured_residual(problem: ShootingProblem, point: LinearisedPoint) -> bool:
    """True where the residual of some log is correlated from sample to sample, over its first segments."""
    rows = zip(problem.segments, point.states, problem.parameters_at(point.theta), strict=True)
    return any(_is_log_coloured(problem, *row) for row in rows)


def _is_log_coloured(problem: ShootingProblem, segments: Segments, states: np.ndarray, parameters: np.ndarray) -> bool:
    near = segments.bounds[:, 1] <= segments.bounds[0, 1] + MAX_COLOUR_TEST_SAMPLES
    bounds = segments.bounds[near][:MAX_COLOUR_TEST_SEGMENTS]
    head = replace(segments, log=segments.log.part(0, int(bounds[-1, 1])), bounds=bounds, weights=None)
    linearisation = problem.simulator.shoot(head, states[: len(bounds)], parameters)
    return is_autocorrelated(linearisation.residual, bounds)
