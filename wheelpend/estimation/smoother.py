"""The smoother: what the whole log says of states and random sources at every step of a filter along it.

A filter knows the past alone; run back from its last step, each estimate is corrected by what came after it.
Source: Rauch, Tung and Striebel, Maximum likelihood estimates of linear dynamic systems, AIAA Journal 3 (1965) 1445.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from wheelpend.estimation.filter_error import FilterTrack
from wheelpend.estimation.random_source import Sources, mixing_matrix

PREDICTED, FILTERED = 0, 1  # of a track
CERTAIN_SHARE = 1e-30  # of a variable's largest variance: what rounding leaves of a speed that sticking makes zero
SINGULAR_RIDGE = 1e-13  # of the unit diagonal of a scaled covariance: what rounding leaves of perfectly known variables


class SmoothedTrack(NamedTuple):
    """Variables of a filter, states and then sources, at every step, from the whole log."""

    means: np.ndarray  # (E, variables)
    covariances: np.ndarray  # (E, variables, variables)
    samples: np.ndarray  # (E,) sample at or after which the step ends


class SmoothedForce(NamedTuple):
    """Random force on each row, and the states, at the samples that a filter passed."""

    samples: np.ndarray  # (n,) of the log
    mean: np.ndarray  # (n, NQ) in the unit of the row
    sigma: np.ndarray  # (n, NQ) one standard deviation
    states: np.ndarray  # (n, NX)


def smoothed(track: FilterTrack, beginnings: np.ndarray) -> SmoothedTrack:
    """Smooth a track whose stretches, of which none says anything of another, begin at these samples (stretches,)."""
    filtered, covariances = track.means[:, FILTERED], track.covariances[:, FILTERED]
    means, known = filtered.copy(), covariances.copy()
    gains = _gains(covariances[:-1], track.covariances[1:, PREDICTED], track.transitions[1:])
    alone = filtered[:-1] - np.einsum("eij,ej->ei", gains, track.means[1:, PREDICTED])  # were nothing to follow
    left = covariances[:-1] - gains @ track.covariances[1:, PREDICTED] @ gains.transpose(0, 2, 1)
    goes_on = ~_first_steps(track.samples, beginnings)[1:]
    back = gains.transpose(0, 2, 1).copy()
    for step in np.flatnonzero(goes_on)[::-1]:
        means[step] = alone[step] + gains[step] @ means[step + 1]
        known[step] = left[step] + gains[step] @ known[step + 1] @ back[step]
    return SmoothedTrack(means, 0.5 * (known + known.transpose(0, 2, 1)), track.samples)


def _gains(filtered: np.ndarray, predicted: np.ndarray, transitions: np.ndarray) -> np.ndarray:
    """Share (E, variables, variables) of what is learnt of the next step that is learnt of this one."""
    variances = np.diagonal(predicted, axis1=1, axis2=2)  # which differ by decades
    certain = variances <= CERTAIN_SHARE * variances.max(axis=0, initial=0.0)
    scale = np.where(certain, 0.0, 1.0 / np.sqrt(np.where(certain, 1.0, variances)))
    unit = scale[:, :, None] * predicted * scale[:, None, :] + SINGULAR_RIDGE * np.eye(predicted.shape[1])
    unit[:, np.arange(unit.shape[1]), np.arange(unit.shape[1])] += certain
    crossed = scale[:, :, None] * (transitions @ filtered)
    return (np.linalg.solve(unit, crossed) * scale[:, :, None]).transpose(0, 2, 1)


def _first_steps(samples: np.ndarray, beginnings: np.ndarray) -> np.ndarray:
    """True (E,) of the first step of each stretch, with which the filter starts anew."""
    changed = np.r_[True, np.diff(samples) != 0]
    return changed & np.isin(samples, beginnings)


def stretch_beginnings(bounds: np.ndarray) -> np.ndarray:
    """Samples at which segments (S, 2) do not go on where the one before ended."""
    return bounds[np.r_[True, bounds[1:, 0] != bounds[:-1, 1]], 0]


def smoothed_force(track: FilterTrack, bounds: np.ndarray, sources: Sources, sizes: tuple[int, int]) -> SmoothedForce:
    """The random force along a log cut into segments (S, 2), at the last step of each sample; sizes are NX and NQ."""
    found = smoothed(track, stretch_beginnings(bounds))
    last = np.r_[np.diff(found.samples) != 0, True] if len(found.samples) else np.zeros(0, dtype=bool)
    mixing = mixing_matrix([s.rows for s in sources], sizes[1])
    first = track.means.shape[2] - len(sources)
    mean = found.means[last, first:] @ mixing.T
    variance = np.einsum("ri,eij,rj->er", mixing, found.covariances[last, first:, first:], mixing)
    sigma = np.sqrt(np.maximum(variance, 0.0))
    return SmoothedForce(found.samples[last], mean, sigma, found.means[last, : sizes[0]])
