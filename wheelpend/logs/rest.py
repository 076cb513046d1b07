"""Rest: from where on a machine stands still until its log ends."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from wheelpend.logs.log import EXCERPT_SAMPLES, REST_SHARE, Log

REST_BAND_SIGMAS = 12.0  # of a channel's noise, that its readings spread at rest: a hundred million reach 11.5


def rest_begin(log: Log, sigma: Sequence[float] | np.ndarray) -> int:
    """The first sample after which no channel of noise sigma (channels,) moves until the log ends.

    A channel stands still within a hundredth of its range, or its noise. The number of samples where it moves to the
    end. Of a long log some 400 000 samples are looked at.
    """
    every = max(1, len(log) // EXCERPT_SAMPLES)
    begins = [_rest_begin(values[::every], own) for values, own in zip(log.measured.T, sigma, strict=True)]
    return min(every * max(begins), len(log))


def _rest_begin(channel: np.ndarray, sigma: float) -> int:
    """The first of a channel's values (n,) after which they stay in its band; n where the last is none."""
    backward = channel[::-1]
    spread = np.fmax.accumulate(backward) - np.fmin.accumulate(backward)
    band = max(REST_SHARE * float(np.nanmax(channel) - np.nanmin(channel)), REST_BAND_SIGMAS * sigma)
    still = int(np.count_nonzero(~(spread > band)))  # the spread only grows; nothing read is nothing moved
    return len(channel) - still if still > 1 else len(channel)
