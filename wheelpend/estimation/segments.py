"""Segments of a log on which a model is fitted or validated."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from wheelpend.logs.log import Log


@dataclass(frozen=True)
class Segments:
    """Segments of a log, each simulated from an initial state of its own."""

    log: Log
    sigma: np.ndarray  # (channels,) standard deviations of the sensor noise
    bounds: np.ndarray  # (segments, 2) half-open sample ranges
    weights: np.ndarray | None = None  # (segments,) weights of their squares; 1 each where None

    @property
    def values(self) -> int:
        """Number of measured values in the segments."""
        return int(sum(np.isfinite(self.log.measured[a:b]).sum() for a, b in self.bounds))


@dataclass(frozen=True)
class ValidationData:
    """Validation segments: of a training log, or of a log of its own with a first third for its per-log parameters."""

    part: Segments  # on which the error is computed
    training: int | None  # index of the training log they belong to
    calibration: Segments | None  # of a log of its own: where its per-log parameters are estimated


def contiguous_ranges(bounds: np.ndarray) -> list[tuple[int, int]]:
    """Half-open ranges of samples that consecutive segments (n, 2) cover without a gap."""
    breaks = np.flatnonzero(bounds[1:, 0] != bounds[:-1, 1])
    begins, ends = bounds[np.r_[0, breaks + 1], 0], bounds[np.r_[breaks, len(bounds) - 1], 1]
    return [(int(a), int(b)) for a, b in zip(begins, ends, strict=True)]
