"""Judge of a pendulum that swings freely: a free run over the whole record, in which only the start is refitted."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from scipy.optimize import least_squares

from wheelpend.estimation.parameters import kernel_parameters
from wheelpend.estimation.state_reconstruction import states_from
from wheelpend.kernels.kernel_module import KernelModule
from wheelpend.logs.log import Log

NO_COLUMNS = np.zeros(0, dtype=np.int64)
START_SAMPLES = 20  # through which a parabola gives the start of the search
LENGTH_SHARES = (0.03, 0.1, 0.3, 1.0)  # of the log, over which parameters are fitted one after the other
START_FACTORS = np.linspace(0.4, 1.2, 81)  # of the measured start, which are tried: the amplitude sets the period
LOST_RAD = 1e3  # in place of a reading that is no number


def free_run_error(module: KernelModule, values: Mapping[str, float], log: Log) -> float:
    """Root mean square difference [rad] of a log from a free run over all of it, its start state refitted.

    The readings (N,) of the first channel are compared; nothing is held out and nothing but the start is fitted, by
    SciPy's least squares on what the generated kernels simulate, so that the estimator has no part in it.
    """
    difference = log.measured[:, 0] - free_run(module, values, log)
    return float(np.sqrt(np.nanmean(difference**2)))


def free_run(module: KernelModule, values: Mapping[str, float], log: Log) -> np.ndarray:
    """Readings (N,) [rad] of the first channel in a free run from the start state that fits the log best."""
    return _fitted_run(module, values, log, []).readings


def best_free_run_values(module: KernelModule, values: Mapping[str, float], log: Log) -> dict[str, float]:
    """Values with which a free run over the whole log, from a start that is refitted, comes nearest to it.

    All of the module's parameters among the values are free and without bounds, sought from where they are: a term
    that comes out with the wrong sign is one that the log does not show.
    """
    names, found = [n for n in module.PARAMETERS[: module.FITTED] if n in values], dict(values)
    for share in LENGTH_SHARES:  # a run over all of the log, from values that are far off, is lost in its phase
        found = _fitted_run(module, found, log.part(0, round(share * len(log))), names).values
    return found


class _FittedRun(NamedTuple):
    """A free run whose start state, and perhaps parameters, were fitted to a log."""

    readings: np.ndarray  # (N,) rad
    values: dict[str, float]


def _fitted_run(module: KernelModule, values: Mapping[str, float], log: Log, names: Sequence[str]) -> _FittedRun:
    """The free run nearest to a log over its start state and the parameters of these names."""
    columns, step = np.array([module.PARAMETERS.index(n) for n in names], dtype=np.int64), float(np.diff(log.t).max())
    known = np.isfinite(log.measured[:, 0])

    def values_at(point: np.ndarray) -> dict[str, float]:
        return {**values, **dict(zip(names, map(float, point[module.NX :]), strict=True))}

    @lru_cache(maxsize=2)
    def run(point: tuple[float, ...]) -> tuple[np.ndarray, np.ndarray]:
        """Readings (N,) and their derivatives (N, NX + k) by start state and parameters."""
        state, parameters = np.array(point[: module.NX]), kernel_parameters(module, values_at(np.array(point)), log)
        found = module.sensitivities(log.t, log.known_voltage, state, parameters, columns, step)
        return np.nan_to_num(found[1][:, 0], nan=LOST_RAD), np.nan_to_num(found[2][:, 0])

    def difference(point: np.ndarray) -> np.ndarray:
        return (run(tuple(point))[0] - log.measured[:, 0])[known]

    own, start = np.array([values[n] for n in names]), measured_start(module, log)
    tried = [np.concatenate([factor * start, own]) for factor in START_FACTORS]
    nearest = min(tried, key=lambda point: float(np.sum(difference(point) ** 2)))
    fits = [
        least_squares(difference, point, jac=lambda point: run(tuple(point))[1][known], x_scale="jac")
        for point in (np.concatenate([start, own]), nearest)
    ]
    best = min(fits, key=lambda fit: float(fit.cost))
    return _FittedRun(run(tuple(best.x))[0], values_at(best.x))


def measured_start(module: KernelModule, log: Log) -> np.ndarray:
    """State (NX,) at the first sample, from parabolas through the first samples of every channel."""
    early = slice(0, START_SAMPLES)
    curves = np.array([np.polyfit(log.t[early] - log.t[0], signal[early], 2) for signal in log.measured.T])
    return states_from(module, curves[None, :, 2], curves[None, :, 1])[0]
