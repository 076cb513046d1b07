"""The two sides of the regression on a measured log, and what the filters' unknown start adds to them."""

from __future__ import annotations

import numpy as np

from wheelpend.estimation.state_reconstruction import fill_gaps
from wheelpend.kernels.kernel_module import KernelModule
from wheelpend.logs.log import Log

EQUAL_TIME_CONSTANTS_RATIO = 1e-3  # relative difference of two time constants up to which they count as equal


def acting_input(module: KernelModule, log: Log, parameters: np.ndarray) -> np.ndarray:
    """Mean acting input (N,) from each sample to the next: the commanded one unless the motor lags."""
    inputs = [fill_gaps(log.t, c) for c in log.inputs]
    voltage = inputs[0] if log.voltage.ndim == 1 else np.column_stack(inputs)
    if module.LAG < 0:
        return voltage
    acting = _lagging_input(module, log, voltage, parameters)
    return np.append(0.5 * (acting[:-1] + acting[1:]), acting[-1:])


def _lagging_input(module: KernelModule, log: Log, voltage: np.ndarray, parameters: np.ndarray) -> np.ndarray:
    """The input (N,) behind the motor's lag at each sample, which remembers the commands before the log's first."""
    if log.earlier is None or not np.isfinite(log.earlier[1]).all():
        return module.acting_voltage(log.t, voltage, parameters)
    t, before = log.earlier
    whole = np.concatenate([t, log.t]), np.concatenate([before, voltage])
    return module.acting_voltage(*whole, parameters)[len(t) :]


def equations_at(
    module: KernelModule,
    t: np.ndarray,
    states: np.ndarray,
    rates: np.ndarray,
    voltage: np.ndarray,
    parameters: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
    """Left sides (N, NQ) and regressors (N, NQ, n) at states and accelerations (paper eqs. 21-23)."""
    pairs = [module.regressor(*row, parameters) for row in zip(t, states, rates, voltage, strict=True)]
    return np.array([p[0] for p in pairs]), np.array([p[1] for p in pairs])


def free_decay(t: np.ndarray, tau: tuple[float, float], rows: int) -> np.ndarray:
    """Both free responses of the filters on each row, (N, rows, 2 rows)."""
    slow, elapsed = np.exp(-(t - t[0]) / tau[1]), t - t[0]
    if abs(tau[0] - tau[1]) > EQUAL_TIME_CONSTANTS_RATIO * tau[0]:
        coupled = (np.exp(-elapsed / tau[0]) - slow) * tau[0] / (tau[0] - tau[1])
    else:
        coupled = slow * elapsed / tau[1]
    pair = np.column_stack([slow, coupled])
    return np.einsum("kc,rs->krsc", pair, np.eye(rows)).reshape(len(t), rows, 2 * rows)
