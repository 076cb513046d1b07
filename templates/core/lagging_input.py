"""The input behind a first-order actuator lag: a state of its own, which follows from the commands before."""

import numpy as np

from templates.core.delays import _acting_sample, _input_delay
from templates.core.frame import (
    DELAY,
    FITTED,
    LAG,
    LAG_MEMORY,
    NS,
    NV,
    NX,
    _drive_jacobian,
    _driven,
    compiled,
    inlined,
    internal,
)
from templates.core.lag import _lag, _lagged


@inlined
def _acting(t, h, state, voltage, parameters):
    """The input that acts in the mean over the next h."""
    begin, slope = _lag(h, parameters[LAG])[:2]
    driven = _driven(t, voltage, parameters)
    return driven + (begin + 0.5 * slope * h) * (state[NV] - driven)


@internal
def _initial_state(when, t, voltage, acting, start, parameters, columns, state, sens):
    """State (NS,) and sensitivities (NS, n) at a time when command ``acting`` acts, from coordinates and rates (NX,).

    Added states stay as they are, or are given after those, and do not depend on them. A lagging input follows from the
    commands before; the first command of a log, or the first after missing ones, counts as one that has acted for long.
    """
    for i in range(start.size):
        state[i] = start[i]
    for i in range(NV):
        for c in range(sens.shape[1] if i < NX else min(NX, sens.shape[1])):
            sens[i, c] = 1.0 if c == i else 0.0
    time_constant, delay = parameters[LAG], _input_delay(parameters)
    first = acting
    while first > 0 and when - t[first] - delay < LAG_MEMORY * time_constant and np.isfinite(voltage[first - 1]):
        first -= 1
    driven_by = np.zeros(FITTED + 1)
    _drive_jacobian(when, voltage[first], parameters, driven_by)
    state[NV] = _driven(when, voltage[first], parameters)
    for c in range(sens.shape[1]):
        sens[NV, c] = driven_by[columns[c - NX]] if c >= NX else 0.0
    for j in range(first + 1, acting + 1):
        until = when if j == acting else t[j + 1] + delay
        _, _, left, _, _, left_by = _lag(max(until - t[j] - delay, 1e-12), time_constant)
        _drive_jacobian(until, voltage[j], parameters, driven_by)
        driven = _driven(until, voltage[j], parameters)
        excess = state[NV] - driven
        state[NV] = driven + left * excess
        for c in range(sens.shape[1]):
            column = columns[c - NX] if c >= NX else FITTED
            sens[NV, c] = _lagged(left, left_by, sens[NV, c], excess if column == LAG else 0.0, driven_by[column])
    for c in range(NX, sens.shape[1]):
        if columns[c - NX] == DELAY and time_constant > 0.0:
            sens[NV, c] = (state[NV] - _driven(when, voltage[acting], parameters)) / time_constant


@compiled
def acting_voltage(t, voltage, parameters):
    """The input (N,) that acts at each sample just before its command: the commanded one unless the input lags."""
    acting, sens, columns = np.empty(t.size), np.zeros((NS, 0)), np.empty(0, np.int64)
    state, start = np.zeros(NS), np.zeros(NX)
    for k in range(t.size):
        _initial_state(t[k], t, voltage, _acting_sample(t, k, t[k], parameters), start, parameters, columns, state, sens)
        acting[k] = state[NV]
    return acting
