"""Validation: the error of a fit on segments that it has not seen."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from wheelpend.estimation.continuation import _fit_with_scopes, kernels_for
from wheelpend.estimation.fit import Fit
from wheelpend.estimation.free_parameters import free_names, per_log_names, tied_pairs
from wheelpend.estimation.prediction import prediction_error
from wheelpend.estimation.problem import EstimationProblem
from wheelpend.estimation.segments import Segments, ValidationData

LEAD_IN_SEGMENTS = 10  # segments before the first that is judged, through which what carries on is followed


def calibrated_values(
    problem: EstimationProblem, part: Segments, values: Mapping[str, float], names: Sequence[str]
) -> dict[str, float]:
    """Values with a log's own parameters among the names estimated on a part of it, the machine's as they are.

    Of a ripple the phase is the log's own, the amplitude the machine's.
    """
    own = per_log_names(list(dict.fromkeys(names)))
    if not own:
        return dict(values)
    found = _fit_with_scopes(problem, [part], values, own, (), 10)
    turned = found.of_log(0)
    if pairs := tied_pairs(own):
        turned = with_amplitude(turned, values, pairs)
        turned = _fit_with_scopes(problem, [part], turned, own, (), 10, phased=pairs, amplitude_known=True).of_log(0)
    return turned


def with_amplitude(turned: Mapping[str, float], values: Mapping[str, float], pairs) -> dict[str, float]:
    """The phases of some values with the amplitudes of others."""
    found = dict(turned)
    for pair in pairs:
        length = math.hypot(turned[pair[0]], turned[pair[1]])
        wanted = math.hypot(values[pair[0]], values[pair[1]])
        found |= {n: float(turned[n] * wanted / length) if length else values[n] for n in pair}
    return found


def validation_residuals(problem: EstimationProblem, fitted: Fit) -> tuple[float, list[np.ndarray]]:
    """Error of a fitted model on the held-out segments, and their residuals [σ].

    A hold-out log's own parameters are estimated on its first third.
    """
    squares, count, residuals = 0.0, 0, []
    for held in problem.validation:
        values = _validation_values(problem, fitted, held)
        lead = LEAD_IN_SEGMENTS if problem.carries else 0
        module = kernels_for(problem, (), values)
        _, residual = prediction_error(module, held.part, values, problem.max_step, lead)
        squares += (
            float(np.nansum(residual**2))
            if np.isfinite(residual[np.isfinite(held.part.log.measured)]).any()
            else np.inf
        )
        count += held.part.values - 2 * problem.module.NQ * len(held.part.bounds)
        residuals.append(residual)
    if not problem.validation:
        return fitted.error, residuals
    error = float(np.sqrt(squares / max(count, 1)))
    return (error if np.isfinite(error) else float("inf")), residuals


def _validation_values(problem: EstimationProblem, fitted: Fit, held: ValidationData) -> dict[str, float]:
    if held.training is not None:
        return fitted.of_log(held.training)
    if held.calibration is None:
        return dict(fitted.values)
    names = [*fitted.names, *free_names(problem, problem.model.effects)]
    return calibrated_values(problem, held.calibration, fitted.of_log(0), names)


def fit_percent(problem: EstimationProblem, residuals: list[np.ndarray]) -> dict[str, float]:
    """100 (1 − NRMSE) of each channel over the held-out segments."""
    found = {}
    parts = [h.part for h in problem.validation] or list(problem.training)
    for c, channel in enumerate(parts[0].log.channels):
        error = np.concatenate([r[:, c] * p.sigma[c] for r, p in zip(residuals, parts, strict=False)] or [np.zeros(1)])
        values = np.concatenate([np.where(np.isfinite(r[:, c]), p.log.measured[:, c], np.nan)
                                 for r, p in zip(residuals, parts, strict=False)] or [np.zeros(1)])  # fmt: skip
        spread = np.nanstd(values) * np.sqrt(np.isfinite(values).sum())
        found[channel] = float(100.0 * (1.0 - np.sqrt(np.nansum(error**2)) / spread)) if spread > 0 else 0.0
    return found
