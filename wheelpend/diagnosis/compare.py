"""The model as it stands against measurements: how well it predicts, how far ahead, and where it fails."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from types import ModuleType

import numpy as np

import derive
from wheelpend.diagnosis.missing_force.estimate import (
    ForceConcentration,
    MissingForce,
    concentrations,
    estimate_missing_force,
)
from wheelpend.estimation.continuation import fit_model
from wheelpend.estimation.criteria import MAX_NOISE_LEVEL_ERROR_RATIO
from wheelpend.estimation.data import prepare
from wheelpend.estimation.fit import Fit
from wheelpend.estimation.free_parameters import free_names, known_values, per_log_names
from wheelpend.estimation.parameters import kernel_parameters
from wheelpend.estimation.prediction import prediction_error, segments_rms_error
from wheelpend.estimation.problem import EstimationProblem
from wheelpend.estimation.segments import Segments, ValidationData
from wheelpend.estimation.shooting import shoot
from wheelpend.estimation.starts import best_start
from wheelpend.estimation.states import fit_states, initial_states
from wheelpend.estimation.step_size import stable_step
from wheelpend.estimation.validation import calibrated_values, fit_percent
from wheelpend.identification.inverse_dynamics import force_error_and_bursts
from wheelpend.logs.log import Log, segment_bounds
from wheelpend.model.record import Model

PREDICTION_HORIZONS_S = (0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 30.0)  # s
MAX_PREDICTED_ANGLE_RAD = np.pi / 2  # rad, beyond which a prediction has left the plant's range


@dataclass(frozen=True)
class HorizonError:
    """Error of predictions over one length of time."""

    seconds: float
    error: float | None
    diverged: bool


@dataclass(frozen=True)
class ClosedLoop:
    """The closed loop replayed with the model: root mean square difference from the log."""

    rmse: dict[str, float]  # per channel [its unit]
    rmse_input: float  # V
    diverged: bool


@dataclass(frozen=True)
class Comparison:
    """A model against logs."""

    error: float
    noise_floor: float
    horizon_s: float
    fit_percent: dict[str, float]
    rmse: dict[str, float]
    horizons: tuple[HorizonError, ...]
    closed_loop: ClosedLoop | None
    where: tuple[ForceConcentration, ...]
    fitted_first: bool  # whether the model had no values and was fitted to the log
    warnings: tuple[str, ...]
    force_error: dict[str, float | None] = field(default_factory=dict)  # by log: what the equations leave [%]
    bursts: list[dict] = field(default_factory=list)  # where in time the equations miss far more force than usual
    missing: MissingForce | None = field(repr=False, default=None)
    problem: EstimationProblem | None = field(repr=False, default=None)
    per_log: list[dict] = field(default_factory=list)  # parameters that each log has for itself, as estimated on it


def compare(
    model: Model,
    logs: Sequence[str | Path | Log],
    holdout: Sequence[str | Path | Log] = (),
    *,
    progress: Callable[[str], None] = lambda text: None,
) -> Comparison:
    """Compare the model with every sample of the logs, or with the hold-out logs where some are given.

    Parameters that each log has for itself are estimated on that log, on a hold-out log on its first third, which is
    then not judged. A model with neither identified nor nominal values is fitted to the logs first.
    """
    problem = prepare(model, logs, use_all=True)
    values = known_values(model)
    fitted_first = not all(n in values for n in problem.base)
    if fitted_first:
        progress("the model has no values yet: fitting it first")
        problem, start = best_start(problem)
        values = fit_model(problem, start, free_names(problem, model.effects)).of_log(0)
    step = stable_step(problem.module, values, problem.training[0].log)
    problem = replace(problem, max_step=step)
    judged, own = values_per_log(problem, prepare(model, logs, holdout).validation if holdout else (), values)
    progress("predicting segments")
    residuals, squares, count = [], 0.0, 0
    for part, mine in zip(judged, own, strict=True):
        _, residual = prediction_error(problem.module, part, mine, step)
        residuals.append(residual)
        squares += float(np.nansum(residual**2))
        count += part.values - problem.module.NX * len(part.bounds)
    error = float(np.sqrt(squares / max(count, 1)))
    seen = replace(problem, training=judged)
    progress("predicting further ahead")
    shortest = min((p.log for p in judged), key=lambda log: log.duration)
    horizons = tuple(errors_at(problem, judged, own, h) for h in horizons_of(shortest))
    missed = {p.log.name: force_error_and_bursts(problem.module, p.log, v) for p, v in zip(judged, own, strict=True)}
    progress("estimating the missing force")
    missing = (
        estimate_missing_force(seen, _as_fit(seen, own))
        if error > MAX_NOISE_LEVEL_ERROR_RATIO * problem.floor
        else None
    )
    return Comparison(
        error=error,
        noise_floor=problem.floor,
        horizon_s=problem.horizon,
        fit_percent=fit_percent(seen, residuals),
        rmse=rmse_of(judged, residuals),
        horizons=horizons,
        closed_loop=replay_closed_loop(problem, judged[0], own[0]),
        where=concentrations(seen, missing) if missing else (),
        fitted_first=fitted_first,
        warnings=problem.warnings,
        missing=missing,
        problem=problem,
        per_log=per_log_table(model, judged, own),
        force_error={name: left for name, (left, _) in missed.items()},
        bursts=[
            {"log": name, "from": b.low, "to": b.high, "row": b.row, "peak": b.peak, "at_reversal": b.at_reversal}
            for name, (_, bursts) in missed.items() for b in bursts
        ],
    )  # fmt: skip


def values_per_log(
    problem: EstimationProblem, validation: Sequence[ValidationData], values: dict[str, float]
) -> tuple[tuple[Segments, ...], list[dict]]:
    """The parts that are judged, and the values of each log: of the hold-out logs where there are some."""
    names = free_names(problem, problem.model.effects)
    if not validation:
        return problem.training, [calibrated_values(problem, part, values, names) for part in problem.training]
    parts = tuple(h.part for h in validation)
    return parts, [calibrated_values(problem, h.calibration or h.part, values, names) for h in validation]


def per_log_table(model: Model, parts: Sequence[Segments], own: Sequence[dict]) -> list[dict]:
    """Parameters that each log has for itself, as estimated on it."""
    names = per_log_names([n for e in model.effects for n in derive.effects.find(e).full_names])
    return [{"log": p.log.name, **{n: v[n] for n in names}} for p, v in zip(parts, own, strict=True)] if names else []


def _as_fit(problem: EstimationProblem, own: Sequence[dict[str, float]]) -> Fit:
    states = []
    for part, values in zip(problem.training, own, strict=True):
        first = initial_states(problem.module, part)
        states.append(
            fit_states(
                problem.module, part, first, kernel_parameters(problem.module, values, part.log), problem.max_step
            )[0]
        )
    empty = np.zeros((0, 0))
    return Fit(own[0], tuple(own), (), empty, empty, tuple(states), 0.0, 0, 1.0, (), True)


def horizons_of(log: Log) -> tuple[float, ...]:
    """Horizons that a log offers, from five samples to the whole of it [s]."""
    inner = [h for h in PREDICTION_HORIZONS_S if 5 * log.dt < h < 0.8 * log.duration]
    return (5 * log.dt, *inner, log.duration)


def errors_at(
    problem: EstimationProblem, parts: Sequence[Segments], own: Sequence[dict[str, float]], horizon: float
) -> HorizonError:
    """Error of the model over all parts when it predicts so far ahead."""
    found = [(error_at(problem, p, v, horizon), p.values) for p, v in zip(parts, own, strict=True)]
    if any(h.error is None for h, _ in found):
        return HorizonError(horizon, None, True)
    squares = np.average([(h.error or 0.0) ** 2 for h, _ in found], weights=[float(count) for _, count in found])
    return HorizonError(horizon, float(np.sqrt(squares)), False)


def error_at(problem: EstimationProblem, part: Segments, values: dict[str, float], horizon: float) -> HorizonError:
    """Error of the model when it predicts so far ahead in one part."""
    first, last = int(part.bounds[0, 0]), int(part.bounds[-1, 1])
    bounds = np.ascontiguousarray(segment_bounds(part.log, horizon, first, last))
    if not len(bounds):
        return HorizonError(horizon, None, True)
    cut = replace(part, bounds=bounds)
    parameters = kernel_parameters(problem.module, values, part.log)
    states = initial_states(problem.module, cut)
    if horizon > 2.0:  # an unstable plant: start long predictions from states fitted over the first half second
        head = replace(
            cut, bounds=np.ascontiguousarray([[a, min(b, a + max(6, round(0.5 / part.log.dt)))] for a, b in bounds])
        )
        states, _ = fit_states(problem.module, head, states, parameters, problem.max_step)
        shot = shoot(problem.module, cut, states, parameters, max_step=problem.max_step)
    else:
        states, shot = fit_states(problem.module, cut, states, parameters, problem.max_step)
    error = segments_rms_error(cut, shot)
    diverged = not np.isfinite(error) or is_out_of_range(problem.module, cut, shot.residual)
    return HorizonError(horizon, None if diverged else error, diverged)


def is_out_of_range(module: ModuleType, part: Segments, residual: np.ndarray) -> bool:
    """Whether a prediction left the plant's range in some segment."""
    if module.RANGE_OUTPUT < 0:
        return False
    angle = part.log.measured[:, module.RANGE_OUTPUT] - residual[:, module.RANGE_OUTPUT] * part.sigma[module.RANGE_OUTPUT]
    return bool(np.nanmax(np.abs(np.concatenate([angle[a:b] for a, b in part.bounds]))) > MAX_PREDICTED_ANGLE_RAD)


def rmse_of(parts: Sequence[Segments], residuals: list[np.ndarray]) -> dict[str, float]:
    """Root mean square prediction error per channel, in its unit."""
    return {
        channel: float(np.sqrt(np.nanmean(np.concatenate(
            [(r[:, c] * p.sigma[c]) ** 2 for p, r in zip(parts, residuals, strict=True)]))))
        for c, channel in enumerate(parts[0].log.channels)
    }  # fmt: skip


def replay_closed_loop(problem: EstimationProblem, part: Segments, values: dict[str, float]) -> ClosedLoop | None:
    """Run the model in closed loop with the log's reference; None where controller or reference is unknown."""
    log, controller = part.log, problem.model.controller
    if controller is None or log.reference is None or not np.isfinite(log.reference).all():
        return None
    module = problem.module
    state = initial_states(module, replace(part, bounds=part.bounds[:1]))[0]
    state, _ = fit_states(
        module, replace(part, bounds=part.bounds[:1]), state[None], kernel_parameters(module, values, log)
    )
    zeros = np.zeros((len(log), module.NY))
    _, outputs, voltage = module.closed_loop(
        log.t, log.reference, np.gradient(log.reference, log.t), np.array(controller.gains, dtype=float), state[0],
        kernel_parameters(module, values, log), zeros, np.zeros(module.NY), problem.max_step,
    )  # fmt: skip
    diverged = not np.isfinite(outputs).all()
    diverged |= module.RANGE_OUTPUT >= 0 and bool(np.max(np.abs(outputs[:, module.RANGE_OUTPUT])) > MAX_PREDICTED_ANGLE_RAD)
    difference = np.sqrt(np.nanmean((outputs - log.measured) ** 2, axis=0))
    return ClosedLoop(
        {} if diverged else dict(zip(log.channels, map(float, difference), strict=True)),
        float("nan") if diverged else float(np.sqrt(np.nanmean((voltage - log.voltage) ** 2))),
        diverged,
    )
