"""The energy regressor: power is integrated instead of differentiating rates (the paper's references [22, 23]).

Energy supplied since the start = (energy stored now − at the start + energy dissipated since) · X. Behind a low-pass
filter of time constant τ, times τ, both sides tend to this as τ grows: integration is the limit.
"""

from __future__ import annotations

import numpy as np

from wheelpend.estimation.linear_fit import LinearFit, solve_least_squares
from wheelpend.estimation.regressor import acting_input
from wheelpend.estimation.restrictions import NO_RESTRICTIONS, Restrictions
from wheelpend.estimation.state_reconstruction import measured_states
from wheelpend.kernels.kernel_module import KernelModule
from wheelpend.logs.log import Log


def energy_least_squares(
    module: KernelModule,
    log: Log,
    parameters: np.ndarray,
    tau: float = np.inf,
    restrictions: Restrictions = NO_RESTRICTIONS,
) -> LinearFit:
    """Least squares on the energy balance, integrated (τ infinite) or behind τ/(τs + 1).

    The energy at the start, which depends on a single noisy reading, is a nuisance parameter.
    """
    sides, regressors = energy_regressor(module, log, parameters, tau)
    decay = np.exp(-(log.t - log.t[0]) / tau)
    return solve_least_squares(module, sides, regressors, decay[:, None], restrictions)


def energy_limit(
    module: KernelModule, log: Log, parameters: np.ndarray, taus: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Estimates (len(taus), n) behind filters, and by integration (n,), to which they tend as τ grows."""
    behind = [energy_least_squares(module, log, parameters, float(tau)).estimate for tau in taus]
    return np.array(behind), energy_least_squares(module, log, parameters).estimate


def energy_regressor(
    module: KernelModule, log: Log, parameters: np.ndarray, tau: float
) -> tuple[np.ndarray, np.ndarray]:
    """Energy supplied (N,) [V rad] and regressor (N, n).

    The supply is the held voltage times the increment of the angle, which is exact; all else is linear between samples.
    """
    states, voltage = rates_by_spline(module, log), acting_input(module, log, parameters)
    stored, dissipated = np.zeros((2, len(log), len(module.LINEAR)))
    for k, (t, state, volts) in enumerate(zip(log.t, states, voltage, strict=True)):
        stored[k], dissipated[k], _ = module.energy_parts(t, state, volts, parameters)
    mean_states = states_with_mean_rates(states, log.t, module.NQ)
    rows = zip(log.t, mean_states, voltage, strict=False)
    power = np.array([module.energy_parts(*row, parameters)[2] for row in rows])
    loss = filtered_integral(log.t, dissipated[:-1], dissipated[1:], tau)
    gain = stored - stored[0]
    if np.isfinite(tau):
        gain = gain - filtered_integral(log.t, gain[:-1], gain[1:], tau) / tau
    return filtered_integral(log.t, power[:, None], power[:, None], tau)[:, 0], gain + loss


def rates_by_spline(module: KernelModule, log: Log) -> np.ndarray:
    """States (N, NX); rates that no sensor reads are those of a cubic spline through the measured positions.

    Central differences cost 2.1 % of X2 on ideal data of the paper's robot, the spline 1.0 %.
    """
    from scipy.interpolate import CubicSpline  # imported late: it is slow to load, and only this method needs it

    states = measured_states(module, log)
    for x in module.UNMEASURED:
        states[:, x] = CubicSpline(log.t, states[:, x - module.NQ])(log.t, 1)
    return states


def states_with_mean_rates(states: np.ndarray, t: np.ndarray, count: int) -> np.ndarray:
    """States (N - 1, NX) whose rates are the angles' increments over each interval."""
    mean_states = states[:-1].copy()
    mean_states[:, count:] = np.diff(states[:, :count], axis=0) / np.diff(t)[:, None]
    return mean_states


def filtered_integral(t: np.ndarray, begin: np.ndarray, end: np.ndarray, tau: float) -> np.ndarray:
    """τ/(τs + 1) of a signal linear within each interval, its values (N - 1, n) at begin and end; from zero, (N, n).

    For τ infinite the integral.
    """
    h = np.diff(t)[:, None]
    if np.isinf(tau):
        return np.concatenate([np.zeros((1, begin.shape[1])), np.cumsum(0.5 * h * (begin + end), axis=0)])
    x = h / tau
    decay, new = np.exp(-x), tau * (1.0 + np.expm1(-x) / x)
    old = -tau * np.expm1(-x) - new
    gain = np.concatenate([np.ones((1, 1)), decay])
    value = np.concatenate([np.zeros((1, begin.shape[1])), old * begin + new * end])
    return first_order_recurrence(gain, value)


def first_order_recurrence(gain: np.ndarray, value: np.ndarray) -> np.ndarray:
    """z[k] = gain[k] z[k-1] + value[k] by doubling strides, without a loop over samples."""
    stride = 1
    while stride < len(value):
        late, early = slice(stride, None), slice(None, -stride)
        value = np.concatenate([value[:stride], value[late] + gain[late] * value[early]])
        gain = np.concatenate([gain[:stride], gain[late] * gain[early]])
        stride *= 2
    return value
