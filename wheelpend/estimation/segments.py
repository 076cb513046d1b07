"""Segments of a log on which a model is fitted or validated."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from wheelpend.logs.log import Log


@dataclass(frozen=True)
class Segments:
    """Segments of a log on which a model is fitted or judged."""

    log: Log
    sigma: np.ndarray  # (channels,)
    bounds: np.ndarray  # (segments, 2) half-open sample ranges
    weights: np.ndarray | None = None  # (segments,) how much the squares of each count; all alike without

    @property
    def values(self) -> int:
        """Number of measured values in the segments."""
        return int(sum(np.isfinite(self.log.measured[a:b]).sum() for a, b in self.bounds))


@dataclass(frozen=True)
class ValidationData:
    """Held-out segments: of a training log, or of a log of its own with a first third for its per-log parameters."""

    part: Segments
    training: int | None  # index of the training log it belongs to
    calibration: Segments | None


def contiguous_ranges(bounds: np.ndarray) -> list[tuple[int, int]]:
    """Ranges of samples that consecutive segments cover without a gap."""
    breaks = np.flatnonzero(bounds[1:, 0] != bounds[:-1, 1])
    begins, ends = bounds[np.r_[0, breaks + 1], 0], bounds[np.r_[breaks, len(bounds) - 1], 1]
    return [(int(a), int(b)) for a, b in zip(begins, ends, strict=True)]
