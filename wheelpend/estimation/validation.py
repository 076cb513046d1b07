"""Validation: the error of a fit on segments that were held out of it."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from wheelpend.estimation.continuation import kernels_for, shooting_problem
from wheelpend.estimation.fit import Fit
from wheelpend.estimation.free_parameters import free_names, per_log_names, tied_pairs
from wheelpend.estimation.gauss_newton import fit
from wheelpend.estimation.prediction import prediction_error, sum_of_squares
from wheelpend.estimation.problem import EstimationProblem
from wheelpend.estimation.segments import Segments, ValidationData
from wheelpend.estimation.shooting import Simulator

LEAD_IN_SEGMENTS = 10  # segments before the first that is judged, through which a coupled model is simulated
CALIBRATION_ROUNDS = 10  # of the fit of a log's own parameters


def calibrated_values(
    problem: EstimationProblem, segments: Segments, values: Mapping[str, float], names: Sequence[str]
) -> dict[str, float]:
    """Values with the per-log parameters among the names estimated on segments of a log, all others fixed.

    Of a ripple the phase is the log's own, the amplitude the machine's.
    """
    own = per_log_names(list(dict.fromkeys(names)))
    if not own:
        return dict(values)
    calibrated = fit(shooting_problem(problem, [segments], values, own), rounds=CALIBRATION_ROUNDS).of_log(0)
    pairs = tied_pairs(own)
    if not pairs:
        return calibrated
    shooting = shooting_problem(problem, [segments], with_amplitude(calibrated, values, pairs), own)
    known = replace(shooting, space=shooting.space.with_tied_amplitudes(pairs, amplitude_known=True))
    return fit(known, rounds=CALIBRATION_ROUNDS).of_log(0)


def with_amplitude(
    phases: Mapping[str, float], amplitudes: Mapping[str, float], pairs: Sequence[tuple[str, str]]
) -> dict[str, float]:
    """Values with the phases of some pairs of sine and cosine and the amplitudes of others."""
    found = dict(phases)
    for pair in pairs:
        length = math.hypot(phases[pair[0]], phases[pair[1]])
        wanted = math.hypot(amplitudes[pair[0]], amplitudes[pair[1]])
        found |= {n: float(phases[n] * wanted / length) if length else amplitudes[n] for n in pair}
    return found


def validation_residuals(problem: EstimationProblem, fitted: Fit) -> tuple[float, list[np.ndarray]]:
    """Error of a fitted model on the validation segments [σ], and their residuals (N, channels) [σ].

    A validation log's own parameters are estimated on its first third.
    """
    squares, count, residuals = 0.0, 0, []
    lead = LEAD_IN_SEGMENTS if problem.carries else 0
    for validation in problem.data.validation:
        segments, values = validation.part, validation_values(problem, fitted, validation)
        simulator = Simulator(kernels_for(problem, (), values), problem.max_step)
        _, residual = prediction_error(simulator, segments, values, lead)
        squares += sum_of_squares(residual)
        count += segments.values - problem.module.NX * len(segments.bounds)
        residuals.append(residual)
    if not problem.data.validation:
        return fitted.error, residuals
    return float(np.sqrt(squares / max(count, 1))), residuals


def validation_values(problem: EstimationProblem, fitted: Fit, validation: ValidationData) -> dict[str, float]:
    """Values with which a fit predicts a validation part; a log's own ones are estimated on its first third."""
    if validation.estimation_log is not None:
        return fitted.of_log(validation.estimation_log)
    if validation.calibration is None:
        return dict(fitted.values)
    names = [*fitted.names, *free_names(problem, problem.model.effects)]
    return calibrated_values(problem, validation.calibration, fitted.of_log(0), names)


def unpredicted_share(parts: Sequence[Segments], residuals: Sequence[np.ndarray]) -> float | None:
    """Share of the motion's mean square in segments of logs that a model misses, by its residuals (N, channels).

    The motion is what a segment does besides moving on as fast as it begins, which needs no model: what a straight line
    leaves of a place, and a constant of a rate [σ]. None without any.
    """
    missed, moved = 0.0, 0.0
    for part, residual in zip(parts, residuals, strict=True):
        log = part.log
        for begin, end in part.bounds:
            missed += sum_of_squares(residual[begin:end])
            for number, channel in enumerate(log.channels):
                known = np.flatnonzero(np.isfinite(log.measured[begin:end, number])) + begin
                degree = 0 if channel in log.rates else 1
                if len(known) > degree + 1:
                    t, values = log.t[known] - log.t[begin], log.measured[known, number] / part.sigma[number]
                    moved += float(((values - np.polyval(np.polyfit(t, values, degree), t)) ** 2).sum())
    return missed / moved if moved > 0.0 else None


def fit_percent(problem: EstimationProblem, residuals: list[np.ndarray]) -> dict[str, float]:
    """100 (1 − NRMSE) of each channel over the validation segments, the training segments where there are none."""
    found = {}
    segments = problem.data.held_out or problem.data.estimation
    for c, channel in enumerate(segments[0].log.channels):
        pairs = list(zip(residuals, segments, strict=False))
        error = np.concatenate([r[:, c] * s.sigma[c] for r, s in pairs] or [np.zeros(1)])
        known = [s.log.measured[np.isfinite(r[:, c]), c] for r, s in pairs]
        squares = [float(np.sum((v - v.mean()) ** 2)) for v in known if v.size]  # of each log about its own mean
        spread = np.sqrt(sum(squares))
        found[channel] = float(100.0 * (1.0 - np.sqrt(np.nansum(error**2)) / spread)) if spread > 0 else 0.0
    return found
