"""Recursive least squares in constant memory, as a microcontroller would run it beside its controller."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from wheelpend.estimation.linear_fit import LinearFit, solve_least_squares
from wheelpend.estimation.regressor import acting_input
from wheelpend.estimation.restrictions import NO_RESTRICTIONS, Restrictions
from wheelpend.estimation.state_reconstruction import measured_states
from wheelpend.kernels.kernel_module import KernelModule
from wheelpend.logs.log import Log

INITIAL_VARIANCE_RATIO = 1e12  # variance of a parameter before the first sample, over that after the whole log
TRACK_POINT_COUNT = 20  # times at which the estimate is noted


@dataclass(frozen=True)
class TrackPoint:
    """The recursive estimate at a time."""

    t: float  # s
    parameters: dict[str, float]

    def to_json(self) -> dict[str, Any]:
        """The estimate under the keys of JSON."""
        return {"t": self.t, "parameters": self.parameters}


@dataclass(frozen=True)
class RecursiveFit:
    """The final estimate, and the estimates on the way to it."""

    fit: LinearFit
    track: tuple[TrackPoint, ...]


def recursive_least_squares(
    module: KernelModule,
    log: Log,
    parameters: np.ndarray,
    tau: tuple[float, float],
    *,
    first_order_hold: bool = False,
    forgetting: float = 1.0,
    restrictions: Restrictions = NO_RESTRICTIONS,
) -> RecursiveFit:
    """Filtered least squares sample by sample, from the first one on.

    With ``forgetting`` 1 it ends where least squares over the whole log from the same start of the filters does. Below
    1 the weight of a sample falls by that factor with every later one: the memory is dt/(1 - forgetting) seconds. A
    fixed parameter begins at its value, without variance, and so stays there.
    """
    states, voltage = measured_states(module, log), acting_input(module, log, parameters)
    common = (log.t, states, voltage, parameters, *tau, first_order_hold, states[0])
    sides, regressors = module.filter_regressor(*common)
    batch = solve_least_squares(module, sides, regressors, restrictions=restrictions)
    power = (regressors**2).sum(axis=(0, 1))
    power = np.where(power > 0.0, power, 1.0)
    free, estimate = restrictions.is_free(module.LINEAR), restrictions.fixed_values(module.LINEAR)
    covariance = np.diag(np.where(free, INITIAL_VARIANCE_RATIO / power, 0.0))
    track = np.zeros((TRACK_POINT_COUNT, len(power)))
    variance = module.recursive_identification(*common, 0, forgetting, estimate, covariance, track)
    sigma = np.sqrt(np.maximum(variance * np.diag(covariance), 0.0))
    fit = replace(batch, estimate=estimate, sigma=sigma, covariance=variance * covariance, undefined=())
    return RecursiveFit(fit, _track_points(module, log, track))


def _track_points(module: KernelModule, log: Log, track: np.ndarray) -> tuple[TrackPoint, ...]:
    """Estimates (points, n), noted at equal distances over a log, with their times."""
    samples = -(-np.arange(1, TRACK_POINT_COUNT + 1) * len(log) // TRACK_POINT_COUNT) - 1
    rows = zip(samples, track, strict=True)
    return tuple(TrackPoint(float(log.t[k]), dict(zip(module.LINEAR, map(float, x), strict=True))) for k, x in rows)
