"""Recursive least squares in constant memory: what a microcontroller would run beside its controller."""

from __future__ import annotations

from dataclasses import dataclass
from types import ModuleType

import numpy as np

from wheelpend.estimation import least_squares
from wheelpend.estimation.least_squares import LinearFit
from wheelpend.logs.log import Log

INITIAL_VARIANCE_RATIO = 1e12  # variance of a parameter before the first sample, against what the whole log would leave
TRACK_POINT_COUNT = 20  # how often the estimate is noted


@dataclass(frozen=True)
class TrackPoint:
    """The recursive estimate at a time."""

    t: float  # s
    parameters: dict[str, float]


@dataclass(frozen=True)
class RecursiveFit:
    """The final estimate and the way to it."""

    fit: LinearFit
    track: tuple[TrackPoint, ...]


def recursive_least_squares(
    module: ModuleType,
    log: Log,
    parameters: np.ndarray,
    tau: tuple[float, float],
    *,
    first_order_hold: bool = False,
    forgetting: float = 1.0,
) -> RecursiveFit:
    """Filtered least squares sample by sample, from the first one on.

    With ``forgetting`` 1 it ends where least squares over the whole log from the same start of the filters does. Below
    1 the weight of a sample falls by that factor with every later one: the memory is dt/(1 - forgetting) seconds.
    """
    states, voltage = least_squares.measured_states(module, log), least_squares.acting_input(module, log, parameters)
    common = (log.t, states, voltage, parameters, *tau, first_order_hold, states[0])
    sides, regressors = module.filter_regressor(*common)
    batch = least_squares.solve_least_squares(module, sides, regressors)
    power = (regressors**2).sum(axis=(0, 1))
    power = np.where(power > 0.0, power, 1.0)
    estimate, covariance, track = (
        np.zeros(len(power)),
        np.diag(INITIAL_VARIANCE_RATIO / power),
        np.zeros((TRACK_POINT_COUNT, len(power))),
    )
    variance = module.recursive_identification(*common, 0, forgetting, estimate, covariance, track)
    sigma = np.sqrt(np.maximum(variance * np.diag(covariance), 0.0))
    samples = -(-np.arange(1, TRACK_POINT_COUNT + 1) * len(log) // TRACK_POINT_COUNT) - 1
    moments = tuple(TrackPoint(float(log.t[k]), dict(zip(module.LINEAR, map(float, x), strict=True)))
                    for k, x in zip(samples, track, strict=True))  # fmt: skip
    fit = LinearFit(batch.names, estimate, sigma, batch.condition, batch.rows, batch.unidentifiable)
    return RecursiveFit(fit, moments)
