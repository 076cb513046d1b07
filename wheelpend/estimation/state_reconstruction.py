"""State reconstruction: coordinates and rates from the channels of the sensors.

Every sensor reads a constant combination of coordinates, or of rates (OUTPUT_MATRIX of the generated module). A rate
comes from the rate sensors where these determine it, else from the slope of the position sensors' readings.
"""

from __future__ import annotations

import numpy as np

from derive.plant_signature import combination_text
from wheelpend.kernels.kernel_module import KernelModule
from wheelpend.logs.log import Log
from wheelpend.numerics import null_space


def states_from(module: KernelModule, values: np.ndarray, slopes: np.ndarray) -> np.ndarray:
    """States (N, NX) from readings (N, NY), NaN where missing, and their slopes (N, NY); 0 where not determined."""
    states, known = np.zeros((len(values), module.NX)), np.isfinite(values)
    bits = 1 << np.arange(module.NY)
    patterns = known @ bits
    for number in np.flatnonzero(np.bincount(patterns)):
        pattern, rows = number & bits > 0, patterns == number
        by_value, by_slope = reconstruction_matrices(module, pattern)
        states[rows] = np.nan_to_num(values[rows]) @ by_value.T + np.nan_to_num(slopes[rows]) @ by_slope.T
    return states


def reconstruction_matrices(module: KernelModule, known: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Matrices (NX, NY) from readings, and from their slopes, to states, where only the known channels have a value."""
    weights = np.where(known[:, None], module.OUTPUT_MATRIX, 0.0)
    positions, rates = weights[:, : module.NQ], weights[:, module.NQ :]
    from_rates = np.linalg.pinv(rates)
    unseen = null_space(rates) if rates.any() else np.eye(module.NQ)  # rates that no rate sensor determines
    by_slope = unseen @ np.linalg.pinv(positions @ unseen)
    by_value = np.vstack([np.linalg.pinv(positions), from_rates - by_slope @ positions @ from_rates])
    return _without_rounding_noise(by_value), _without_rounding_noise(np.vstack([np.zeros_like(by_slope), by_slope]))


def _without_rounding_noise(matrix: np.ndarray) -> np.ndarray:
    """A matrix whose rounding errors are set to zero."""
    return np.where(np.abs(matrix) < 1e-12, 0.0, np.round(matrix, 14))


def measured_states(module: KernelModule, log: Log) -> np.ndarray:
    """Coordinates and rates (N, NX) at the samples; a rate that no sensor reads is a central difference.

    A coordinate of which only the rate is read, such as the yaw, is the integral of that from 0.
    """
    filled = np.column_stack([fill_gaps(log.t, signal) for signal in log.measured.T])
    states = states_from(module, filled, np.gradient(filled, log.t, axis=0, edge_order=2))
    for q in np.flatnonzero(~module.OUTPUT_MATRIX[:, : module.NQ].any(axis=0)):
        rate = states[:, module.NQ + q]
        states[1:, q] = np.cumsum(0.5 * (rate[1:] + rate[:-1]) * np.diff(log.t))
    return states


def fill_gaps(t: np.ndarray, signal: np.ndarray) -> np.ndarray:
    """Missing values, interpolated linearly; a signal without any value stays as it is."""
    good = np.isfinite(signal)
    return signal if good.all() or not good.any() else np.interp(t, t[good], signal[good])


def port_motion(module: KernelModule) -> dict[str, np.ndarray]:
    """Angles and speeds of the ports that are no coordinate's own, by their text, as weights (NX,) on the states."""
    found = {}
    for weights in module.PORTS.values():
        for first, rest in ((0, module.NQ), (module.NQ, 0)):  # the angle, the speed
            names = module.STATES[first : first + module.NQ]
            text = combination_text(names, weights)
            if text not in names:
                found[text] = np.concatenate([np.zeros(first), weights, np.zeros(rest)])
    return found


def input_table(module: KernelModule, voltage: np.ndarray) -> dict[str, np.ndarray]:
    """Inputs (N,) by their columns, of a log's voltage (N,) or (N, inputs)."""
    return dict(zip(module.INPUTS, voltage.reshape(len(voltage), -1).T, strict=False))
