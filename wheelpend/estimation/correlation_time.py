"""How far parameters move with the correlation time that is assumed of the random force.

Where a law is missing, a slow force takes over what is lawful and slow, and a fast one what is fast: the estimates
then depend on which, and their intervals must say so. Correlation times count that the logs do not exclude, judged by
how the likelihood's loss scatters from block to block, since the noise model is never exact; a move counts in so far as
it is more than chance between two estimators of one truth.
Sources: Vuong, Econometrica 57 (1989) 307; Hausman, Econometrica 46 (1978) 1251.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from wheelpend.estimation.filter_fit import TRIAL, FilterEstimator, FilterPoint
from wheelpend.estimation.normal_equations import covariance_of

TIMES_PER_DECADE = 2  # correlation times that are tried
MIN_TIME_SAMPLES = 2.0  # sample intervals, the shortest of them
MAX_LOSS_SIGMAS = 4.0  # standard errors of a likelihood's loss, beyond which the logs exclude a correlation time


class Movement(NamedTuple):
    """How far parameters move, beyond chance, over the correlation times that the logs allow."""

    widening: np.ndarray  # (free,) as a standard deviation
    times: tuple[float, float]  # s, shortest and longest that the logs do not exclude


def movement_with_time(estimator: FilterEstimator, point: FilterPoint, covariance: np.ndarray) -> Movement:
    """The movement of a fit's parameters; none where no force acts."""
    forces = [s for s in point.kinds if s.is_force]
    widest = np.zeros(len(point.theta))
    if not forces or not len(point.theta):
        return Movement(widest, (0.0, 0.0))
    allowed = [forces[0].correlation_time]
    own = _block_deviances(point)
    for time in _trial_times(estimator):
        trial = _at_time(estimator, point, time)
        if not np.isfinite(trial.deviance) or _is_excluded(_block_deviances(trial) - own):
            continue
        allowed.append(time)
        chance = np.maximum(robust_variances(estimator, trial) - np.diag(covariance), 0.0)
        widest = np.maximum(widest, np.maximum((trial.theta - point.theta) ** 2 - chance, 0.0))
    return Movement(np.sqrt(widest), (min(allowed), max(allowed)))


def _trial_times(estimator: FilterEstimator) -> np.ndarray:
    dt = min(s.log.dt for s in estimator.problem.segments)
    shortest, longest = max(MIN_TIME_SAMPLES * dt, estimator.correlation_bounds[0]), estimator.correlation_bounds[1]
    count = max(2, 1 + round(TIMES_PER_DECADE * np.log10(longest / shortest)))
    return np.geomspace(shortest, longest, count)


def _at_time(estimator: FilterEstimator, point: FilterPoint, time: float) -> FilterPoint:
    """The fit with every force of one correlation time, its sizes free."""
    sources = tuple(
        tuple(s.with_noise(s.rms, time) if s.is_force else s for s in own) for own in point.sources
    )  # fmt: skip
    return replace(estimator, force_time=time).fit(point.theta, sources, TRIAL)


def _block_deviances(point: FilterPoint) -> np.ndarray:
    """−2 log-likelihood of each block of consecutive segments (blocks,)."""
    return np.bincount(point.blocks, np.concatenate([run.deviance for run in point.runs]))


def _is_excluded(losses: np.ndarray) -> bool:
    """True where blocks (blocks,) lose more than their scatter explains."""
    error = np.std(losses, ddof=1) * np.sqrt(len(losses)) if len(losses) > 1 else np.inf
    return float(losses.sum()) > MAX_LOSS_SIGMAS * error


def robust_variances(estimator: FilterEstimator, point: FilterPoint) -> np.ndarray:
    """Variances (free,) of a fit from the block jackknife, or the information where they are less."""
    information = estimator.problem.equations(point.runs).finite().sum().information
    covariance, _, _ = covariance_of(information, estimator.problem.space.layout.elements)
    return np.maximum(np.diag(estimator.jackknife(point, covariance)), np.diag(covariance))
