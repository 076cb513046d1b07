"""Filtered least squares with nonnegative parameters: a start for shooting, robust to effects missing in the model."""

from __future__ import annotations

import numpy as np

from wheelpend.estimation.linear_fit import triangular_factor
from wheelpend.estimation.regressor import acting_input, free_decay
from wheelpend.estimation.state_reconstruction import measured_states
from wheelpend.kernels.kernel_module import KernelModule
from wheelpend.logs.log import Log

SLIP_SMOOTHING_RATIO = 0.05  # of the slip's standard deviation, over which the sign of dry friction changes
SMALLEST_NORM = 1e-300  # added to norms that may be zero
MIN_PARAMETER_RATIO = 1e-3  # of the largest share, given to a parameter that comes out at zero


def nonnegative_least_squares(
    module: KernelModule, log: Log, parameters: np.ndarray, tau: tuple[float, float]
) -> dict[str, float]:
    """Linear parameters by filtered least squares, none negative but the signed ones.

    Nuisance parameters take up a slope, an offset or a sticking gearbox: a constant on each row and the filters' free
    decay of either sign, and dry friction in the slip of the first port. A parameter that comes out at zero gets a
    thousandth of the largest share; or each all of the input, where none has any (a mass that runs at constant speed).
    """
    states, voltage = measured_states(module, log), acting_input(module, log, parameters)
    sides, regressors = module.filter_regressor(log.t, states, voltage, parameters, *tau, True, states[0])
    count, signed = len(module.LINEAR), np.isin(module.LINEAR, module.SIGNED)
    decay, drags = free_decay(log.t, tau, module.NQ), np.zeros((*sides.shape, 0))
    constants = np.zeros((*sides.shape, 0))
    if module.INPUTS and np.ptp(voltage, axis=0).any():  # beside a constant input a constant force explains all of it
        drags, constants = _input_nuisances(module, log, states, voltage, parameters, tau)
    matrix = np.concatenate([regressors, drags, decay, constants, sides[:, :, None]], axis=2)
    root = triangular_factor(matrix.reshape(-1, matrix.shape[2]))
    either_sign = np.ones(root.shape[1] - 1, dtype=bool)
    either_sign[: count + drags.shape[2]] = False
    either_sign[:count] = signed
    scale = np.linalg.norm(root[:, :count], axis=0) + SMALLEST_NORM
    shares = scale * nonnegative_solution(root[:, :-1], root[:, -1], either_sign)[0][:count]
    least = MIN_PARAMETER_RATIO * shares.max() or float(np.linalg.norm(root[:, -1]))
    shares = np.where(signed, shares, np.maximum(shares, least))
    return dict(zip(module.LINEAR, map(float, shares / scale), strict=True))


def nonnegative_solution(columns: np.ndarray, right: np.ndarray, signed: np.ndarray) -> tuple[np.ndarray, float]:
    """Least squares of columns (rows, n) to a right side (rows,), none negative but the ``signed`` (n,) of them.

    Returns the solution (n,), and the norm of what it leaves.
    """
    from scipy.optimize import nnls  # imported late: it takes long to load, and known values need no such start

    if not columns.shape[1]:  # of which SciPy makes an abort
        return np.zeros(0), float(np.linalg.norm(right))
    scale = np.linalg.norm(columns, axis=0) + SMALLEST_NORM
    scaled = columns / scale
    weights, rest = nnls(np.concatenate([scaled, -scaled[:, signed]], axis=1), right)
    solution = weights[: len(scale)].copy()
    solution[signed] -= weights[len(scale) :]
    return solution / scale, float(rest)


def _input_nuisances(
    module: KernelModule,
    log: Log,
    states: np.ndarray,
    voltage: np.ndarray,
    parameters: np.ndarray,
    tau: tuple[float, float],
) -> tuple[np.ndarray, np.ndarray]:
    """Forces in the input's place, filtered: dry friction (N, rows, 1), and a constant on each row (N, rows, NQ)."""
    slip = states[:, module.NQ :] @ np.array(next(iter(module.PORTS.values())))
    sign = np.tanh(slip / (SLIP_SMOOTHING_RATIO * slip.std() + 1e-300))
    dry, constant = (
        module.filter_regressor(log.t, states, force, parameters, *tau, True, states[0])[0]
        for force in ((np.ones_like(voltage).T * sign).T, np.ones_like(voltage))
    )
    constants = np.stack([constant * (np.arange(module.NQ) == k) for k in range(module.NQ)], axis=2)
    return dry[:, :, None], constants
