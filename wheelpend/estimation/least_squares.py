"""Least squares on the regressor by the paper's two methods: with differentiated rates, and filtered."""

from __future__ import annotations

import numpy as np

from wheelpend.estimation import long_logs
from wheelpend.estimation.linear_fit import LinearFit, solve_least_squares
from wheelpend.estimation.regressor import acting_input, equations_at, free_decay
from wheelpend.estimation.restrictions import NO_RESTRICTIONS, Restrictions
from wheelpend.estimation.state_reconstruction import measured_states
from wheelpend.kernels.kernel_module import KernelModule
from wheelpend.logs.log import Log


def differentiation_least_squares(
    module: KernelModule, log: Log, parameters: np.ndarray, restrictions: Restrictions = NO_RESTRICTIONS
) -> LinearFit:
    """Least squares with accelerations from numerical differences (paper eqs. 16, 17, 24)."""
    states = measured_states(module, log)
    rates = np.gradient(states[:, module.NQ :], log.t, axis=0)
    voltage = acting_input(module, log, parameters)
    sides, regressors = equations_at(module, log.t, states, rates, voltage, parameters)
    return solve_least_squares(module, sides, regressors, restrictions=restrictions)


def filtered_least_squares(
    module: KernelModule,
    log: Log,
    parameters: np.ndarray,
    tau: tuple[float, float],
    *,
    first_order_hold: bool = True,
    start: np.ndarray | None = None,
    restrictions: Restrictions = NO_RESTRICTIONS,
) -> LinearFit:
    """Least squares on the filtered, acceleration-free regressor (paper eqs. 39-43).

    ``start`` (NX,) is the state from which the filters' initial conditions (42) are made. Without it their free decay,
    the error of a wrong start, is projected out: half a degree there can cost 90 % of X1.
    """
    if len(log) > long_logs.CHUNK_SAMPLES:
        return long_logs.chunked_least_squares(module, log, parameters, tau, first_order_hold, start, restrictions)
    states, voltage = measured_states(module, log), acting_input(module, log, parameters)
    begin = states[0] if start is None else start
    sides, regressors = module.filter_regressor(log.t, states, voltage, parameters, *tau, first_order_hold, begin)
    decay = None if start is not None else free_decay(log.t, tau, module.NQ)
    return solve_least_squares(module, sides, regressors, decay, restrictions)
