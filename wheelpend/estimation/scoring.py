"""Fisher scoring of a filter's likelihood, with all that its gains change, by differences.

The innovations of a filter are independent and Gaussian: their derivatives, and those of their variances, give score
and information.
Source: Åström, Maximum likelihood and prediction error methods, Automatica 16 (1980) 551.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from wheelpend.estimation.filter_error import FilterProblem
from wheelpend.estimation.normal_equations import NormalEquations
from wheelpend.estimation.random_source import Sources

STEP_SIGMA = 0.02  # standard errors of a parameter, others known, by which it is moved to differentiate
NOISE_STEP = 0.02  # of the logarithm of a size or time, the same


def parameter_equations(
    problem: FilterProblem,
    theta: np.ndarray,
    sources: Sequence[Sources],
    now: Sequence[np.ndarray],
    information: np.ndarray,
) -> NormalEquations:
    """Normal equations of θ at some sources, where the innovations of each log (samples, NY, 2) are ``now``.

    information (free, free) tells how small a step is.
    """
    layout = problem.space.layout
    step = STEP_SIGMA / np.sqrt(np.maximum(np.diag(information), 1e-300))
    found, changed = NormalEquations.zeros(layout, 1).sum(), []
    for column in range(len(layout.columns)):
        moved = theta.copy()
        elements = np.unique([places[column] for places in layout.places])  # of every log, all at once
        moved[elements] += step[elements]
        changed.append(problem.inside_innovations(moved, sources))
    for number, (here, places) in enumerate(zip(now, layout.places, strict=True)):
        own_information, own_score = scoring(here, [c[number] for c in changed], step[places])
        found.information[np.ix_(places, places)] += own_information
        found.score[places] += own_score
    return found


def noise_equations(
    problem: FilterProblem,
    theta: np.ndarray,
    sources: Sequence[Sources],
    now: Sequence[np.ndarray],
    held: Sequence[bool],
) -> tuple[np.ndarray, np.ndarray]:
    """Information and score in logarithms: of all sizes of each log, then of the correlation times that logs share.

    The innovations of each log (samples, NY, 2) are ``now``. Both are zero for the sources that are held.
    """
    count, logs = len(sources[0]), len(sources)
    information, score = np.zeros((count * (logs + 1),) * 2), np.zeros(count * (logs + 1))
    changed = [
        now
        if held[k % count]
        else problem.inside_innovations(theta, [_nudged(s, k % count, k >= count) for s in sources])
        for k in range(2 * count)
    ]
    for number, here in enumerate(now):
        places = np.r_[number * count + np.arange(count), logs * count + np.arange(count)]
        own = scoring(here, [c[number] for c in changed], np.full(2 * count, NOISE_STEP))
        information[np.ix_(places, places)] += own[0]
        score[places] += own[1]
    return information, score


def _nudged(sources: Sources, number: int, in_time: bool) -> Sources:
    """Sources of which one is a little larger, or slower."""
    factor = float(np.exp(NOISE_STEP))
    one = sources[number]
    moved = one.with_noise(one.rms * (1.0 if in_time else factor), one.correlation_time * (factor if in_time else 1.0))
    return (*sources[:number], moved, *sources[number + 1 :])


def scoring(here: np.ndarray, changed: Sequence[np.ndarray], steps: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Fisher information (n, n) and score (n,) of innovations, from those (N, NY, 2) after n small steps."""
    good = np.isfinite(here[..., 0])
    whitened, log_variance = here[good].T
    by_mean, by_variance, score = [], [], []
    for other, step in zip(changed, steps, strict=True):
        w, v = other[good].T
        by_variance.append((v - log_variance) / step)
        by_mean.append((w * np.exp(0.5 * (v - log_variance)) - whitened) / step)
        score.append(-0.5 * np.nansum(w**2 + v - whitened**2 - log_variance) / step)
    shape = (len(steps), len(whitened))  # of no steps too
    mean, variance = np.array(by_mean).reshape(shape), np.array(by_variance).reshape(shape)
    information = np.nan_to_num(mean @ mean.T + 0.5 * variance @ variance.T)
    centred = np.array(score) + 0.5 * steps * np.diag(information)  # forward differences fall short by that
    return information, np.nan_to_num(centred)
