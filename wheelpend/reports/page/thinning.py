"""Which samples of a long series a chart draws: the least and the greatest of each part, so that no peak is lost."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

MIN_SEGMENT_POINTS = 4  # points of a segment, below which the breaks between segments are not drawn


def extreme_samples(series: Sequence[np.ndarray], begin: int, end: int, points: int) -> np.ndarray:
    """Indices from ``begin`` to ``end`` of the extremes of every series (samples,) in each of equal parts, in order.

    They are some ``points`` at most, and all of the samples where these are no more.
    """
    if end - begin <= points:
        return np.arange(begin, end)
    edges = np.linspace(begin, end, max(1, points // (2 * len(series))) + 1).astype(int)
    found = []
    for values in series:
        least, greatest = (np.where(np.isnan(values), away, values) for away in (np.inf, -np.inf))
        for a, b in pairwise(edges):
            found += [a + int(np.argmin(least[a:b])), a + int(np.argmax(greatest[a:b]))]
    return np.unique(found)


def segment_samples(bounds: np.ndarray, series: Sequence[np.ndarray], points: int) -> np.ndarray:
    """Indices of the samples of segments (segments, 2) to draw; −1 stands for the break after a segment.

    So many segments that a few points are left to each are drawn as one line.
    """
    share = points // max(len(bounds), 1) - 1
    if share < MIN_SEGMENT_POINTS:
        return np.append(extreme_samples(series, int(bounds[0, 0]), int(bounds[-1, 1]), points - 1), -1)
    total = max(int((bounds[:, 1] - bounds[:, 0]).sum()), 1)
    free = points - len(bounds) * (MIN_SEGMENT_POINTS + 1)  # is shared by length
    return np.concatenate([
        np.append(extreme_samples(series, a, b, MIN_SEGMENT_POINTS + free * (b - a) // total), -1)
        for a, b in bounds.astype(int).tolist()
    ])  # fmt: skip
