"""Prediction error over the horizon: how far ahead a model predicts, from a few samples to the whole log."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from wheelpend.estimation.parameters import kernel_parameters
from wheelpend.estimation.prediction import segments_rms_error
from wheelpend.estimation.problem import EstimationProblem
from wheelpend.estimation.segments import Segments
from wheelpend.estimation.shooting import ShootingLinearisation
from wheelpend.estimation.states import fit_states, initial_states
from wheelpend.kernels.kernel_module import KernelModule
from wheelpend.logs.log import MIN_SEGMENT_SAMPLES, Log, segment_bounds
from wheelpend.simulation.closed_loop import RANGE_LIMIT_RAD

PREDICTION_HORIZONS_S = (0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 30.0)  # s
MAX_FITTED_START_HORIZON_S = 2.0  # s, beyond which initial states are fitted to the beginning of a segment alone
START_DURATION_S = 0.5  # s, that beginning
MIN_START_SAMPLES = 6


@dataclass(frozen=True)
class HorizonError:
    """Error of predictions over one length of time."""

    seconds: float
    error: float | None  # [σ]; None where the prediction diverges
    diverged: bool
    segments: int = 0  # of the logs, each predicted once from its own start

    def to_json(self) -> dict[str, Any]:
        """The error under the keys of JSON."""
        return {"seconds": self.seconds, "error": self.error, "diverged": self.diverged}


def horizons_of(log: Log) -> tuple[float, ...]:
    """Horizons that a log offers, from five samples to its longest stretch without a gap [s]."""
    whole = max((float(log.t[s.end - 1] - log.t[s.begin]) for s in log.stretches), default=log.duration)
    usual = [h for h in PREDICTION_HORIZONS_S if h < 0.8 * whole]
    longer = [h for h in usual if round(h / log.dt) > MIN_SEGMENT_SAMPLES]  # another number of samples, not digits
    return (MIN_SEGMENT_SAMPLES * log.dt, *longer, whole)


def errors_at(
    problem: EstimationProblem,
    log_segments: Sequence[Segments],
    log_values: Sequence[dict[str, float]],
    horizon: float,
    motion: Sequence[np.ndarray | None] | None = None,
) -> HorizonError:
    """Error of predictions over a horizon [s] in the segments of all logs, each with values of its own."""
    rows = zip(log_segments, log_values, motion or [None] * len(log_segments), strict=True)
    found = [(error_at(problem, s, v, horizon, m), s.values) for s, v, m in rows]
    segments = sum(h.segments for h, _ in found)
    found = [(h, values) for h, values in found if h.segments or not segments]  # a log with gaps may offer none
    if any(h.error is None for h, _ in found):
        return HorizonError(horizon, None, True, segments)
    squares = np.average([(h.error or 0.0) ** 2 for h, _ in found], weights=[float(count) for _, count in found])
    return HorizonError(horizon, float(np.sqrt(squares)), False, segments)


def errors_over(
    problem: EstimationProblem,
    log_segments: Sequence[Segments],
    log_values: Sequence[dict[str, float]],
    horizons: Sequence[float],
) -> tuple[HorizonError, ...]:
    """Errors over growing horizons [s]; none diverges where predictions over a longer one do not.

    Where it seems to, initial states were not found: they are then sought from the motion over the longer horizon.
    Where states are fitted to beginnings alone, a prediction that was lost over a shorter horizon from one of its many
    starts is lost over a longer one too, which has few of these starts. What no segment is long enough for is left out.
    """
    found = [errors_at(problem, log_segments, log_values, h) for h in horizons]
    found = [error for error in found if error.segments]
    for k, short in enumerate(found):
        fitted = (h for h in found[k + 1 :] if not h.diverged and h.seconds <= MAX_FITTED_START_HORIZON_S)
        longer = next(fitted, None) if short.diverged else None
        if longer is not None:
            motion = [_motion_over(problem, *row, longer.seconds) for row in zip(log_segments, log_values, strict=True)]
            found[k] = errors_at(problem, log_segments, log_values, short.seconds, motion)
    for k in range(1, len(found)):
        if found[k - 1].diverged and found[k].seconds > MAX_FITTED_START_HORIZON_S:
            found[k] = replace(found[k], error=None, diverged=True)
    return tuple(found)


def _motion_over(
    problem: EstimationProblem, segments: Segments, values: dict[str, float], horizon: float
) -> np.ndarray:
    """States (N, NX) as predictions over a horizon [s] have them; NaN where there is none."""
    module, log, parameters = problem.module, segments.log, kernel_parameters(problem.module, values, segments.log)
    cut = _cut_at(segments, horizon)
    states, _ = fit_states(problem.simulator, cut, initial_states(module, cut), parameters)
    motion = np.full((len(log), module.NX), np.nan)
    for (a, b), start in zip(cut.bounds, states, strict=True):
        run = module.simulate(log.t[a:b], log.voltage[a:b], start, parameters, problem.max_step)
        motion[a:b] = run[:, : module.NX]
    return motion


def _cut_at(segments: Segments, horizon: float) -> Segments:
    """The span of a log's segments, cut into segments of a horizon [s]."""
    first, last = int(segments.bounds[0, 0]), int(segments.bounds[-1, 1])
    return replace(segments, bounds=np.ascontiguousarray(segment_bounds(segments.log, horizon, first, last)))


def error_at(
    problem: EstimationProblem,
    segments: Segments,
    values: dict[str, float],
    horizon: float,
    motion: np.ndarray | None = None,
) -> HorizonError:
    """Error of predictions over a horizon [s] in the span of a log's segments, states sought from a motion (N, NX)."""
    cut = _cut_at(segments, horizon)
    if not len(cut.bounds):
        return HorizonError(horizon, None, True)
    predicted = _predict(problem, cut, kernel_parameters(problem.module, values, segments.log), horizon, motion)
    error = segments_rms_error(cut, predicted)
    lost = horizon > problem.horizon and is_out_of_range(problem.module, cut, predicted.residual)
    diverged = lost or not np.isfinite(error)  # over the horizon of every score, an error is one however large
    return HorizonError(horizon, None if diverged else error, diverged, len(cut.bounds))


def _predict(
    problem: EstimationProblem,
    segments: Segments,
    parameters: np.ndarray,
    horizon: float,
    motion: np.ndarray | None = None,
) -> ShootingLinearisation:
    """Predict segments from fitted initial states: over a long horizon fitted to the beginnings alone.

    The plant is unstable, so a fit of the state to a long segment would be one of its end.
    """
    states = initial_states(problem.module, segments)
    if motion is not None:
        states = _found_states(problem, segments, states, parameters, motion[segments.bounds[:, 0]])
    if not horizon > MAX_FITTED_START_HORIZON_S:
        return fit_states(problem.simulator, segments, states, parameters)[1]
    length = max(MIN_START_SAMPLES, round(START_DURATION_S / segments.log.dt))
    bounds = np.ascontiguousarray([[a, min(b, a + length)] for a, b in segments.bounds])
    states, _ = fit_states(problem.simulator, replace(segments, bounds=bounds), states, parameters)
    return problem.simulator.shoot(segments, states, parameters)


def _found_states(
    problem: EstimationProblem, segments: Segments, states: np.ndarray, parameters: np.ndarray, moving: np.ndarray
) -> np.ndarray:
    """States (segments, NX), those of a motion where a fit from the given ones fails; of all where none fails."""
    cost = fit_states(problem.simulator, segments, states, parameters)[1].gram[:, -1, -1]
    failed = ~np.isfinite(cost) if not np.isfinite(cost).all() else np.ones(len(cost), dtype=bool)
    return np.where((failed & np.isfinite(moving).all(axis=1))[:, None], moving, states)


def is_out_of_range(module: KernelModule, segments: Segments, residual: np.ndarray) -> bool:
    """A prediction that left the plant's range in some segment, by its residual (N, channels) [σ].

    Where the machine may be at any angle, one that is lost.
    """
    channel = module.RANGE_OUTPUT
    if channel < 0:
        return segments.are_lost(residual)
    angle = segments.log.measured[:, channel] - residual[:, channel] * segments.sigma[channel]
    return bool(np.nanmax(np.abs(np.concatenate([angle[a:b] for a, b in segments.bounds]))) > RANGE_LIMIT_RAD)
