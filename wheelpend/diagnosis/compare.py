"""The model as it stands against measurements: how well it predicts, how far ahead, and where it fails."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from types import ModuleType

import numpy as np

import derive
from wheelpend.diagnosis.missing_force.estimate import MissingForce, Place, concentrations, find_missing_force
from wheelpend.estimation.continuation import fit_model
from wheelpend.estimation.criteria import VISIBLE
from wheelpend.estimation.data import prepare
from wheelpend.estimation.fit import Fit
from wheelpend.estimation.free_parameters import free_names, known_values, per_log_names
from wheelpend.estimation.parameters import vector
from wheelpend.estimation.prediction import part_error, prediction_error
from wheelpend.estimation.problem import Study
from wheelpend.estimation.segments import Held, Part
from wheelpend.estimation.shooting import shoot
from wheelpend.estimation.starts import best_start
from wheelpend.estimation.states import fit_states, initial_states
from wheelpend.estimation.step_size import stable_step
from wheelpend.estimation.validation import calibrated, fit_percent
from wheelpend.identification.inverse_dynamics import forces
from wheelpend.logs.log import Log, segment_bounds
from wheelpend.model.record import Model

HORIZONS = (0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 30.0)  # s
FALLEN = np.pi / 2  # rad, beyond which a prediction has left the plant's range


@dataclass(frozen=True)
class Horizon:
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
    horizons: tuple[Horizon, ...]
    closed_loop: ClosedLoop | None
    where: tuple[Place, ...]
    fitted_first: bool  # whether the model had no values and was fitted to the log
    warnings: tuple[str, ...]
    force_error: dict[str, float | None] = field(default_factory=dict)  # by log: what the equations leave [%]
    bursts: list[dict] = field(default_factory=list)  # where in time the equations miss far more force than usual
    missing: MissingForce | None = field(repr=False, default=None)
    study: Study | None = field(repr=False, default=None)
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
    study = prepare(model, logs, use_all=True)
    values = known_values(model)
    fitted_first = not all(n in values for n in study.base)
    if fitted_first:
        progress("the model has no values yet: fitting it first")
        study, start = best_start(study)
        values = fit_model(study, start, free_names(study, model.effects)).of_log(0)
    step = stable_step(study.module, values, study.training[0].log)
    study = replace(study, max_step=step)
    judged, own = own_values(study, prepare(model, logs, holdout).held if holdout else (), values)
    progress("predicting segments")
    residuals, squares, count = [], 0.0, 0
    for part, mine in zip(judged, own, strict=True):
        _, residual = prediction_error(study.module, part, mine, step)
        residuals.append(residual)
        squares += float(np.nansum(residual**2))
        count += part.values - study.module.NX * len(part.bounds)
    error = float(np.sqrt(squares / max(count, 1)))
    seen = replace(study, training=judged)
    progress("predicting further ahead")
    shortest = min((p.log for p in judged), key=lambda log: log.duration)
    horizons = tuple(errors_at(study, judged, own, h) for h in horizons_of(shortest))
    missed = {p.log.name: forces(study.module, p.log, v) for p, v in zip(judged, own, strict=True)}
    progress("estimating the missing force")
    missing = find_missing_force(seen, _as_fit(seen, own)) if error > VISIBLE * study.floor else None
    return Comparison(
        error=error,
        noise_floor=study.floor,
        horizon_s=study.horizon,
        fit_percent=fit_percent(seen, residuals),
        rmse=rmse_of(judged, residuals),
        horizons=horizons,
        closed_loop=replay(study, judged[0], own[0]),
        where=concentrations(seen, missing) if missing else (),
        fitted_first=fitted_first,
        warnings=study.warnings,
        missing=missing,
        study=study,
        per_log=per_log_table(model, judged, own),
        force_error={name: left for name, (left, _) in missed.items()},
        bursts=[
            {"log": name, "from": b.low, "to": b.high, "row": b.row, "peak": b.peak, "at_reversal": b.at_reversal}
            for name, (_, bursts) in missed.items() for b in bursts
        ],
    )  # fmt: skip


def own_values(study: Study, held: Sequence[Held], values: dict[str, float]) -> tuple[tuple[Part, ...], list[dict]]:
    """The parts that are judged, and the values of each log: of the hold-out logs where there are some."""
    names = free_names(study, study.model.effects)
    if not held:
        return study.training, [calibrated(study, part, values, names) for part in study.training]
    parts = tuple(h.part for h in held)
    return parts, [calibrated(study, h.calibration or h.part, values, names) for h in held]


def per_log_table(model: Model, parts: Sequence[Part], own: Sequence[dict]) -> list[dict]:
    """Parameters that each log has for itself, as estimated on it."""
    names = per_log_names([n for e in model.effects for n in derive.effects.find(e).full_names])
    return [{"log": p.log.name, **{n: v[n] for n in names}} for p, v in zip(parts, own, strict=True)] if names else []


def _as_fit(study: Study, own: Sequence[dict[str, float]]) -> Fit:
    states = []
    for part, values in zip(study.training, own, strict=True):
        first = initial_states(study.module, part)
        states.append(fit_states(study.module, part, first, vector(study.module, values, part.log), study.max_step)[0])
    empty = np.zeros((0, 0))
    return Fit(own[0], tuple(own), (), empty, empty, tuple(states), 0.0, 0, 1.0, (), True)


def horizons_of(log: Log) -> tuple[float, ...]:
    """Horizons that a log offers, from five samples to the whole of it [s]."""
    inner = [h for h in HORIZONS if 5 * log.dt < h < 0.8 * log.duration]
    return (5 * log.dt, *inner, log.duration)


def errors_at(study: Study, parts: Sequence[Part], own: Sequence[dict[str, float]], horizon: float) -> Horizon:
    """Error of the model over all parts when it predicts so far ahead."""
    found = [(error_at(study, p, v, horizon), p.values) for p, v in zip(parts, own, strict=True)]
    if any(h.error is None for h, _ in found):
        return Horizon(horizon, None, True)
    squares = np.average([(h.error or 0.0) ** 2 for h, _ in found], weights=[float(count) for _, count in found])
    return Horizon(horizon, float(np.sqrt(squares)), False)


def error_at(study: Study, part: Part, values: dict[str, float], horizon: float) -> Horizon:
    """Error of the model when it predicts so far ahead in one part."""
    first, last = int(part.bounds[0, 0]), int(part.bounds[-1, 1])
    bounds = np.ascontiguousarray(segment_bounds(part.log, horizon, first, last))
    if not len(bounds):
        return Horizon(horizon, None, True)
    cut = replace(part, bounds=bounds)
    parameters = vector(study.module, values, part.log)
    states = initial_states(study.module, cut)
    if horizon > 2.0:  # an unstable plant: start long predictions from states fitted over the first half second
        head = replace(
            cut, bounds=np.ascontiguousarray([[a, min(b, a + max(6, round(0.5 / part.log.dt)))] for a, b in bounds])
        )
        states, _ = fit_states(study.module, head, states, parameters, study.max_step)
        shot = shoot(study.module, cut, states, parameters, max_step=study.max_step)
    else:
        states, shot = fit_states(study.module, cut, states, parameters, study.max_step)
    error = part_error(cut, shot)
    diverged = not np.isfinite(error) or fallen(study.module, cut, shot.residual)
    return Horizon(horizon, None if diverged else error, diverged)


def fallen(module: ModuleType, part: Part, residual: np.ndarray) -> bool:
    """Whether a prediction left the plant's range in some segment."""
    if module.FALLS < 0:
        return False
    angle = part.log.measured[:, module.FALLS] - residual[:, module.FALLS] * part.sigma[module.FALLS]
    return bool(np.nanmax(np.abs(np.concatenate([angle[a:b] for a, b in part.bounds]))) > FALLEN)


def rmse_of(parts: Sequence[Part], residuals: list[np.ndarray]) -> dict[str, float]:
    """Root mean square prediction error per channel, in its unit."""
    return {
        channel: float(np.sqrt(np.nanmean(np.concatenate(
            [(r[:, c] * p.sigma[c]) ** 2 for p, r in zip(parts, residuals, strict=True)]))))
        for c, channel in enumerate(parts[0].log.channels)
    }  # fmt: skip


def replay(study: Study, part: Part, values: dict[str, float]) -> ClosedLoop | None:
    """Run the model in closed loop with the log's reference; None where controller or reference is unknown."""
    log, controller = part.log, study.model.controller
    if controller is None or log.reference is None or not np.isfinite(log.reference).all():
        return None
    module = study.module
    state = initial_states(module, replace(part, bounds=part.bounds[:1]))[0]
    state, _ = fit_states(module, replace(part, bounds=part.bounds[:1]), state[None], vector(module, values, log))
    zeros = np.zeros((len(log), module.NY))
    _, outputs, voltage = module.closed_loop(
        log.t, log.reference, np.gradient(log.reference, log.t), np.array(controller.gains, dtype=float), state[0],
        vector(module, values, log), zeros, np.zeros(module.NY), study.max_step,
    )  # fmt: skip
    diverged = not np.isfinite(outputs).all()
    diverged |= module.FALLS >= 0 and bool(np.max(np.abs(outputs[:, module.FALLS])) > FALLEN)
    difference = np.sqrt(np.nanmean((outputs - log.measured) ** 2, axis=0))
    return ClosedLoop(
        {} if diverged else dict(zip(log.channels, map(float, difference), strict=True)),
        float("nan") if diverged else float(np.sqrt(np.nanmean((voltage - log.voltage) ** 2))),
        diverged,
    )
