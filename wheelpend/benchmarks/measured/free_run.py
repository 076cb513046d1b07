"""Judge of a pendulum that swings freely: a free run over the whole record, in which only the start is refitted."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from scipy.optimize import least_squares

from wheelpend.estimation.parameters import kernel_parameters
from wheelpend.estimation.state_reconstruction import states_from
from wheelpend.kernels.kernel_module import KernelModule
from wheelpend.logs.log import Log

NO_COLUMNS = np.zeros(0, dtype=np.int64)
START_SAMPLES = 20  # through which a parabola gives the start of the search
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
    parameters, known = kernel_parameters(module, values, log), np.isfinite(log.measured[:, 0])

    def run(state: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Readings (N,) and their derivatives (N, NX) by the start state."""
        _, readings, slopes = module.sensitivities(
            log.t, log.known_voltage, state, parameters, NO_COLUMNS, float(np.diff(log.t).max())
        )
        return np.nan_to_num(readings[:, 0], nan=LOST_RAD), np.nan_to_num(slopes[:, 0, : module.NX])

    found = least_squares(
        lambda state: (run(state)[0] - log.measured[:, 0])[known],
        measured_start(module, log),
        jac=lambda state: run(state)[1][known],
        x_scale="jac",
    )
    return run(found.x)[0]


def measured_start(module: KernelModule, log: Log) -> np.ndarray:
    """State (NX,) at the first sample, from parabolas through the first samples of every channel."""
    early = slice(0, START_SAMPLES)
    curves = np.array([np.polyfit(log.t[early] - log.t[0], signal[early], 2) for signal in log.measured.T])
    return states_from(module, curves[None, :, 2], curves[None, :, 1])[0]
