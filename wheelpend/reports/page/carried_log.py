"""A log as the page carries it: its segments, with what was commanded and measured as whole numbers."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from wheelpend.errors import Failure
from wheelpend.export.replay import ReplayLog
from wheelpend.numerics import last_true
from wheelpend.reports.page.thinning import segment_samples
from wheelpend.reports.page.whole_numbers import held_series, smooth_series, whole_numbers_text

MAX_CARRIED_TEXT = 100_000  # of samples
QUANTA_PER_SIGMA = 16  # of what is measured: rounding adds two ten-thousandths to an error of 1 σ
QUANTA_PER_RANGE = 1 << 14  # of a command, whose sums are right to one of them
QUANTA_PER_INTERVAL = 1 << 16  # of times
MAX_EVEN_SPREAD = 1e-6  # of an interval, up to which samples are evenly spaced
MAX_DRAWN_POINTS = 800  # of each line


@dataclass(frozen=True)
class CarriedLog:
    """Segments of a log as a page carries them; the first ``lead`` of them are not judged."""

    replay: ReplayLog
    states: int  # that are fitted in each segment
    lead: int
    residual: np.ndarray  # (samples, channels) [σ] of the identified model, NaN where it is not judged

    @classmethod
    def cut_to_size(cls, replay: ReplayLog, lead: int) -> CarriedLog:
        """As many segments as fit into the page; raises Failure where the prediction of one is no number."""
        count = len(replay.segments)
        while True:
            kept = replay.first_segments(count)
            begin = sum(len(s.intervals) + 1 for s in kept.segments[:lead])
            if (np.isfinite(kept.measured) & ~kept.judged)[begin:].any():
                raise Failure("The model's own prediction runs away on this log.")
            residual = np.where(kept.judged, kept.residual, np.nan)
            residual[:begin] = np.nan
            made = cls(kept, len(kept.segments[0].state), lead, residual)
            size = made.samples_size
            if size <= MAX_CARRIED_TEXT or count <= lead + 1:
                return made
            count = max(lead + 1, min(count - 1, int(count * MAX_CARRIED_TEXT / size)))

    @property
    def freedom(self) -> int:
        """Number of values less that of fitted states."""
        return int(np.isfinite(self.residual).sum()) - self.states * (len(self.replay.segments) - self.lead)

    @property
    def error(self) -> float:
        """Error of the identified model [σ]."""
        return math.sqrt(float(np.nansum(self.residual**2)) / max(self.freedom, 1))

    @property
    def samples_size(self) -> int:
        """Length of the samples as text."""
        return len(json.dumps(self.samples))

    @cached_property
    def samples(self) -> dict[str, Any]:
        """Everything that there is of each sample."""
        log = self.replay
        commands = np.concatenate([s.commands for s in log.segments])
        ranges = np.max(np.abs(commands), axis=0, initial=0.0)
        intervals = np.concatenate([s.intervals for s in log.segments])
        mean = float(intervals.mean())
        even = float(np.ptp(intervals)) <= MAX_EVEN_SPREAD * mean
        counted = np.isfinite(self.residual)
        return {
            "commands": [
                held_series(c, 2.0 * r / QUANTA_PER_RANGE or 1.0) for c, r in zip(commands.T, ranges, strict=True)
            ],
            "interval": mean,
            "intervals": None if even else held_series(intervals, mean / QUANTA_PER_INTERVAL),
            "measured": [
                smooth_series(_without_gaps(m), s / QUANTA_PER_SIGMA)
                for m, s in zip(log.measured.T, log.sigma, strict=True)
            ],
            "counted": [whole_numbers_text(_run_lengths(c)) for c in counted.T],
        }

    def numbers(self) -> dict[str, Any]:
        """What the page's script reads."""
        log = self.replay
        lengths = np.array([len(s.intervals) + 1 for s in log.segments])
        ends = np.cumsum(lengths)
        series = [_without_gaps(m) for m in log.measured.T] + [np.nan_to_num(r) for r in self.residual.T]
        drawn = segment_samples(np.stack([ends - lengths, ends], axis=1), series, MAX_DRAWN_POINTS)
        return self.samples | {
            "parameters": log.parameters.tolist(),
            "sigma": log.sigma.tolist(),
            "freedom": self.freedom,
            "drawn": whole_numbers_text(np.diff(drawn, prepend=0)),
            "segments": [
                {
                    "state": s.state.tolist(),
                    "acting": s.acting,
                    "carriesOn": s.carries_on,
                    "time": s.time,
                    "before": s.before.ravel().tolist(),
                    "steps": len(s.intervals),
                }
                for s in log.segments
            ],
        }


def _without_gaps(values: np.ndarray) -> np.ndarray:
    """A series whose missing values are those before them, at first 0."""
    last = last_true(np.isfinite(values))
    return np.where(last >= 0, values[last], 0.0)


def _run_lengths(flags: np.ndarray) -> np.ndarray:
    """Lengths of the runs of equal flags, the first of them true, if of length 0."""
    edges = np.flatnonzero(np.diff(flags)) + 1
    lengths = np.diff([0, *edges, len(flags)])
    return lengths if flags[0] else np.array([0, *lengths])
