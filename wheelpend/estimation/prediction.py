"""Prediction errors: how far a model is off over segments, with only the initial states fitted."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from types import ModuleType

import numpy as np

from wheelpend.estimation.parameters import kernel_parameters
from wheelpend.estimation.segments import Segments
from wheelpend.estimation.shooting import ShootingLinearisation
from wheelpend.estimation.states import fit_states, initial_states
from wheelpend.logs.log import segment_bounds


def prediction_error(
    module: ModuleType, part: Segments, values: Mapping[str, float], max_step: float = 0.002, lead: int = 0
) -> tuple[float, np.ndarray]:
    """The error of a model on a part: only the initial states are fitted. Also returns the residual (N, channels).

    What carries on from segment to segment is followed through ``lead`` segments before the first.
    """
    longer, before = with_lead_in(part, lead)
    states = initial_states(module, longer)
    states, shot = fit_states(module, longer, states, kernel_parameters(module, values, part.log), max_step)
    residual = shot.residual.copy()
    residual[: part.bounds[0, 0]] = np.nan
    return segments_rms_error(part, ShootingLinearisation(shot.gram[before:], residual)), residual


def with_lead_in(part: Segments, lead: int) -> tuple[Segments, int]:
    """A part with up to ``lead`` segments before its first, as many as the log has, and how many they are."""
    first, length = int(part.bounds[0, 0]), int(part.bounds[0, 1] - part.bounds[0, 0])
    if not (lead and first):
        return part, 0
    horizon = float(part.log.t[first + length - 1] - part.log.t[first]) + part.log.dt
    before = segment_bounds(part.log, horizon, max(first - lead * length, 0), first)
    return replace(part, bounds=np.vstack([*before, part.bounds])), len(before)


def segments_rms_error(part: Segments, shot: ShootingLinearisation) -> float:
    """Root mean square of a shot's residual in units of σ, the fitted states discounted."""
    states = len(part.bounds) * (shot.gram.shape[1] - 1)
    return float(np.sqrt(shot.cost / max(part.values - states, 1)))
