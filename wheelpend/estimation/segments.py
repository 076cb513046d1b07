"""Segments of a log on which a model is fitted or validated."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from wheelpend.logs.log import Log, segments_of_ranges

DIVERGED_RANGES = 10.0  # measured ranges of a channel, beyond which an error says no more than that it is lost


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
        return int(self.counts.sum())

    @cached_property
    def counts(self) -> np.ndarray:
        """Number of measured values in each segment (segments,)."""
        return np.array([np.isfinite(self.log.measured[a:b]).sum() for a, b in self.bounds], dtype=np.int64)

    def chosen(self, places: np.ndarray) -> Segments:
        """The segments at these places among them."""
        weights = None if self.weights is None else self.weights[places]
        return replace(self, bounds=np.ascontiguousarray(self.bounds[places]), weights=weights)

    def are_lost(self, residual: np.ndarray) -> bool:
        """A prediction that is off by many times all that a channel did, by its residual (N, channels) [σ]."""
        did = np.nanmax(self.log.measured, axis=0) - np.nanmin(self.log.measured, axis=0)
        off = np.concatenate([np.abs(residual[a:b]) for a, b in self.bounds]) * self.sigma
        return bool(np.any(off > DIVERGED_RANGES * did))  # NaN, where a sensor gave no value, is not

    @cached_property
    def warm_up(self) -> np.ndarray:
        """The log's warm-ups before those segments that begin where one ends, cut as long as these: (n, 2).

        They have no weight. What carries over from segment to segment is simulated through them.
        """
        if not len(self.bounds):
            return self.bounds
        first, last = self.bounds[0, 0], self.bounds[0, 1] - 1
        length = float(self.log.t[last] - self.log.t[first]) + self.log.dt
        begun, ended = (set(x.tolist()) for x in self.bounds.T)
        ranges = [(s.begin, s.settled) for s in self.log.stretches if s.settled in begun - ended]
        return segments_of_ranges(self.log, length, ranges)


@dataclass(frozen=True)
class ValidationData:
    """Validation segments: of an estimation log, or of a log of its own that begins with segments for calibration."""

    part: Segments  # on which the error is computed
    estimation_log: int | None  # index of the estimation log they belong to
    calibration: Segments | None  # of a log of its own: where its per-log parameters are estimated


@dataclass(frozen=True)
class DataSplit:
    """The segments that a model is fitted to, and those that no fit sees."""

    estimation: tuple[Segments, ...]  # of each estimation log
    validation: tuple[ValidationData, ...]

    @property
    def logs(self) -> tuple[Log, ...]:
        """Estimation logs."""
        return tuple(s.log for s in self.estimation)

    @property
    def held_out(self) -> tuple[Segments, ...]:
        """The segments on which errors are computed."""
        return tuple(v.part for v in self.validation)

    @property
    def values(self) -> int:
        """Number of measured values that a model is fitted to."""
        return sum(s.values for s in self.estimation)

    @property
    def validation_values(self) -> int:
        """Number of measured values that no fit sees."""
        return sum(v.part.values for v in self.validation)

    def with_estimation(self, estimation: Sequence[Segments]) -> DataSplit:
        """The same validation data with other estimation segments."""
        return replace(self, estimation=tuple(estimation))


def contiguous_ranges(bounds: np.ndarray) -> list[tuple[int, int]]:
    """Half-open ranges of samples that consecutive segments (n, 2) cover without a gap."""
    breaks = np.flatnonzero(bounds[1:, 0] != bounds[:-1, 1])
    begins, ends = bounds[np.r_[0, breaks + 1], 0], bounds[np.r_[breaks, len(bounds) - 1], 1]
    return [(int(a), int(b)) for a, b in zip(begins, ends, strict=True)]
