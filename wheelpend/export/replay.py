"""A log replayed where a model was exported to: the error there beside ours, from the same states."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from wheelpend.diagnosis.compare import model_to_compare, predict_segments
from wheelpend.estimation.parameters import kernel_parameters
from wheelpend.estimation.prediction import RUNAWAY_RESIDUAL_SIGMAS
from wheelpend.estimation.segments import Segments
from wheelpend.estimation.shooting import Simulator
from wheelpend.estimation.states import fit_states, initial_states
from wheelpend.export.exported_model import ExportedModel
from wheelpend.logs.sources import LogsLike
from wheelpend.model.record import Model
from wheelpend.parallel import with_one_blas_thread


@dataclass(frozen=True)
class ReplaySegment:
    """A segment of a log: where it begins, what was commanded, what was measured."""

    state: np.ndarray  # (NX,) coordinates and rates
    acting: float  # the input that acts as it begins, behind the actuator's lag
    carries_on: bool  # True where what effects remember is that of the segment before
    before: np.ndarray  # (k, inputs) commands before, the newest first
    commands: np.ndarray  # (N - 1, inputs) held from each sample to the next
    intervals: np.ndarray  # (N - 1,) s
    time: float  # s since the log's first sample


@dataclass(frozen=True)
class ReplayLog:
    """The segments of a log with the parameters that it has."""

    parameters: np.ndarray  # (NP,) of the exported module
    segments: tuple[ReplaySegment, ...]
    measured: np.ndarray  # (samples of all segments, NY)
    sigma: np.ndarray  # (NY,)
    judged: np.ndarray  # (samples, NY) True where our own prediction was judged
    residual: np.ndarray  # (samples, NY) of our own prediction [σ]

    def first_segments(self, count: int) -> ReplayLog:
        """The first segments alone."""
        segments = self.segments[:count]
        samples = sum(len(s.intervals) + 1 for s in segments)
        rows = {n: getattr(self, n)[:samples] for n in ("measured", "judged", "residual")}
        return replace(self, segments=segments, **rows)


@dataclass(frozen=True)
class Replay:
    """Logs to be replayed, and our own error on them."""

    logs: tuple[ReplayLog, ...]
    error: float  # ours [σ]
    freedom: int  # number of values less that of fitted states

    def error_of(self, predicted: Sequence[np.ndarray]) -> float | None:
        """Error [σ] of predictions (samples, NY) of each log; None where one is no number."""
        squares = 0.0
        for log, own in zip(self.logs, predicted, strict=True):
            residual = np.where(log.judged, (log.measured - own) / log.sigma, 0.0)
            squares += float((residual**2).sum())
        return math.sqrt(squares / max(self.freedom, 1)) if math.isfinite(squares) else None


@with_one_blas_thread
def replay_of(
    exported: ExportedModel, model: Model, logs: LogsLike, holdout: LogsLike, progress: Callable[[str], None]
) -> Replay:
    """The logs, or the hold-out logs where there are some, as they are to be replayed."""
    compared = model_to_compare(model, logs, holdout, progress)
    progress("predicting segments")
    error, _ = predict_segments(compared)
    pairs = zip(compared.log_segments, compared.log_values, strict=True)
    made = [replayed_log(exported, compared.problem.simulator, segments, values) for segments, values in pairs]
    states = compared.problem.module.NX * sum(len(s.bounds) for s in compared.log_segments)
    return Replay(tuple(made), error, int(sum(log.judged.sum() for log in made)) - states)


def replayed_log(
    exported: ExportedModel, simulator: Simulator, segments: Segments, values: Mapping[str, float]
) -> ReplayLog:
    """Segments of a log with their initial states fitted, as they are to be replayed at these values."""
    log, module = segments.log, simulator.module
    parameters = kernel_parameters(module, values, log)
    states, linearised = fit_states(simulator, segments, initial_states(module, segments), parameters)
    acting = module.acting_voltage(log.t, log.voltage, parameters)
    commands = log.inputs.T if exported.inputs else np.zeros((len(log), 0))
    found, ended = [], -1
    for (begin, end), state in zip(segments.bounds.tolist(), states, strict=True):
        before = commands[[max(begin - 1 - j, 0) for j in range(exported.commands)]]
        found.append(
            ReplaySegment(
                state,
                float(np.atleast_1d(acting[begin])[0]) if exported.inputs else 0.0,
                begin == ended,
                before,
                commands[begin : end - 1],
                np.diff(log.t[begin:end]),
                float(log.t[begin] - log.t[0]),
            )
        )
        ended = end
    rows = np.concatenate([np.arange(a, b) for a, b in segments.bounds.tolist()])
    residual = linearised.residual[rows]
    judged = np.isfinite(residual) & (np.abs(residual) < RUNAWAY_RESIDUAL_SIGMAS)
    own = {n: float(v) for n, v in values.items()}
    return ReplayLog(
        kernel_parameters(exported.module, own, log),
        tuple(found),
        log.measured[rows],
        np.asarray(segments.sigma, dtype=float),
        judged,
        residual,
    )


def as_numbers(exported: ExportedModel, replay: Replay) -> list[float]:
    """A replay as the numbers that a program reads: each log's parameters and segments, each segment's samples."""
    numbers: list[Any] = [len(replay.logs)]
    for log in replay.logs:
        numbers += [*log.parameters, len(log.segments)]
        for s in log.segments:
            numbers += [*s.state, s.acting, int(s.carries_on), s.time, *s.before.ravel(), len(s.intervals)]
            for interval, command in zip(s.intervals, s.commands, strict=True):
                numbers += [interval, *command]
    return [float(n) for n in numbers]


def from_numbers(replay: Replay, numbers: np.ndarray) -> list[np.ndarray]:
    """Predictions of each log (samples, NY) from the readings that a program printed one after the other."""
    found, start = [], 0
    for log in replay.logs:
        size = log.measured.size
        found.append(numbers[start : start + size].reshape(log.measured.shape))
        start += size
    return found
