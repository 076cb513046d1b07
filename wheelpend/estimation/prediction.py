"""Prediction errors of a model at given parameters over segments, with only the initial states fitted."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from wheelpend.estimation.parameters import kernel_parameters
from wheelpend.estimation.segments import Segments
from wheelpend.estimation.shooting import ShootingLinearisation, Simulator
from wheelpend.estimation.states import fit_states, initial_states
from wheelpend.logs.log import segment_bounds

RUNAWAY_RESIDUAL_SIGMAS = 1e30  # σ, at which a prediction has run away; squares of its sum of squares are still numbers


def prediction_error(
    simulator: Simulator, segments: Segments, values: Mapping[str, float], lead: int = 0
) -> tuple[float, np.ndarray]:
    """Error of a model on segments [σ] and its residual (N, channels) [σ]; only the initial states are fitted.

    The residual of a prediction that runs away, or becomes no number, ends at RUNAWAY_RESIDUAL_SIGMAS.
    A coupled model is simulated from up to ``lead`` segments before the first.
    """
    longer, before = with_lead_in(segments, lead)
    states = initial_states(simulator.module, longer)
    parameters = kernel_parameters(simulator.module, values, segments.log)
    states, linearisation = fit_states(simulator, longer, states, parameters)
    residual = np.clip(linearisation.residual, -RUNAWAY_RESIDUAL_SIGMAS, RUNAWAY_RESIDUAL_SIGMAS)
    residual[: segments.bounds[0, 0]] = np.nan
    lost = lost_predictions(segments, residual)
    residual[lost] = RUNAWAY_RESIDUAL_SIGMAS
    error = segments_rms_error(segments, ShootingLinearisation(linearisation.gram[before:], residual))
    return float("inf") if len(lost) else error, residual


def lost_predictions(segments: Segments, residual: np.ndarray) -> np.ndarray:
    """First samples of the segments of which less than half of what was measured is predicted by a number at all.

    A prediction that is no number must not pass for a value that was not measured.
    """
    measured, predicted = (np.isfinite(v).sum(axis=1) for v in (segments.log.measured, residual))
    edges = segments.bounds.T
    known, found = (np.concatenate([[0], np.cumsum(n)])[edges] for n in (measured, predicted))
    return segments.bounds[2 * (found[1] - found[0]) < known[1] - known[0], 0]


def sum_of_squares(residual: np.ndarray) -> float:
    """Sum of the squares of a residual (N, channels) [σ]; infinite of a prediction that ran away, or gave nothing."""
    if not np.isfinite(residual).any() or (np.abs(residual) >= RUNAWAY_RESIDUAL_SIGMAS).any():
        return float("inf")
    return float(np.nansum(residual**2))


def with_lead_in(segments: Segments, lead: int) -> tuple[Segments, int]:
    """Segments with up to ``lead`` more before the first, as many as the log has, and their number."""
    first, length = int(segments.bounds[0, 0]), int(segments.bounds[0, 1] - segments.bounds[0, 0])
    if not (lead and first):
        return segments, 0
    log = segments.log
    horizon = float(log.t[first + length - 1] - log.t[first]) + log.dt
    before = segment_bounds(log, horizon, max(first - lead * length, 0), first)
    return replace(segments, bounds=np.vstack([*before, segments.bounds])), len(before)


def segments_rms_error(segments: Segments, linearisation: ShootingLinearisation) -> float:
    """Root mean square of the residual over segments [σ], the degrees of freedom of the fitted states discounted."""
    states = len(segments.bounds) * (linearisation.gram.shape[1] - 1)
    return float(np.sqrt(linearisation.cost / max(segments.values - states, 1)))
