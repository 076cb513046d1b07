"""Judge of a driven pendulum: its position over whole logs, predicted from their first state and the input."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from scipy.optimize import least_squares, minimize

from wheelpend.benchmarks.measured.free_run import LOST_RAD, NO_COLUMNS, measured_start
from wheelpend.benchmarks.measured.rungs import FittedModel
from wheelpend.estimation.free_parameters import limits_of
from wheelpend.estimation.parameters import kernel_parameters
from wheelpend.kernels.kernel_module import KernelModule
from wheelpend.logs.log import Log

MAX_STEP_S = 0.002  # s, of the integrator
ABSOLUTE_FROM_RAD = 1e-3  # rad, from which on the fit weighs an error by its size and no longer by its square
MAX_EVALUATIONS, MAX_POLISHING_EVALUATIONS = 60, 600  # of the fit by slopes, and of the simplex that follows it
ABSENT_SCALE = 1e-3  # in place of the size of a value that is 0


def roll_out_error(module: KernelModule, values: Mapping[str, float], logs: Sequence[Log]) -> float:
    """Mean absolute error [rad] of the position predicted over whole logs, the mean over the logs.

    Each log is predicted from its first state, read off its first samples, with the measured input; nothing is fitted.
    """
    return float(np.mean([np.nanmean(np.abs(_errors(module, values, log))) for log in logs]))


def roll_out(module: KernelModule, values: Mapping[str, float], log: Log) -> np.ndarray:
    """Readings (N,) [rad] of the first channel, predicted over the whole log from its first state."""
    parameters, start = kernel_parameters(module, values, log), measured_start(module, log)
    readings = module.sensitivities(log.t, log.known_voltage, start, parameters, NO_COLUMNS, MAX_STEP_S)[1]
    return np.clip(np.nan_to_num(readings[:, 0], nan=LOST_RAD), -LOST_RAD, LOST_RAD)


def _errors(module: KernelModule, values: Mapping[str, float], log: Log) -> np.ndarray:
    """Differences (N,) [rad] of a log from its roll-out; NaN where the sensor gave no value."""
    return log.measured[:, 0] - roll_out(module, values, log)


def best_roll_out_values(fitted: FittedModel, logs: Sequence[Log]) -> dict[str, float]:
    """Values of the same model that minimise its roll-out error on some logs, sought from those it has.

    SciPy's least squares, with a loss that grows with the error itself, leads near; the error itself is then minimised
    by a simplex, which needs no slopes: a machine that sticks has none everywhere. Constants stay as they are.
    """
    module = fitted.module
    names = [n for n in fitted.values if n in module.PARAMETERS[: module.FITTED]]
    start = np.array([fitted.values[n] for n in names])
    scale = np.where(start != 0.0, np.abs(start), ABSENT_SCALE)
    limits = np.array([*limits_of(names, fitted.model.plant_signature, module.SIGNED).values()]).T / scale

    def values_at(scaled: np.ndarray) -> dict[str, float]:
        return {**fitted.values, **dict(zip(names, map(float, scaled * scale), strict=True))}

    def errors_at(scaled: np.ndarray) -> np.ndarray:
        return np.nan_to_num(np.concatenate([_errors(module, values_at(scaled), log) for log in logs]))

    near = least_squares(
        errors_at, np.clip(start / scale, *limits), bounds=tuple(limits), loss="soft_l1", f_scale=ABSOLUTE_FROM_RAD,
        diff_step=1e-3, max_nfev=MAX_EVALUATIONS,
    )  # fmt: skip
    best = minimize(
        lambda scaled: roll_out_error(module, values_at(scaled), logs), near.x, method="Nelder-Mead",
        bounds=limits.T, options={"maxfev": MAX_POLISHING_EVALUATIONS},
    )  # fmt: skip
    return values_at(best.x)
