"""The filter of filter_error in a real-time loop: where it begins, and what one sample's readings tell of state and parameters."""

import math

import numpy as np

from templates.core.frame import (
    FITTED,
    NR,
    NS,
    NY,
    SURFACES,
    _sensor_jacobian,
    compiled,
    internal,
    read_sensors,
)
from templates.core.kalman import _assimilate, _reading_direction, _start_filter
from templates.core.learning import _learn_parameters
from templates.core.real_time import _begin


@compiled
def start_filter(
    state, spread, voltage, parameters, reads, noise, now, commands, sens, force, force_by, covariance, rubbing
):
    """Begin in a state (NX,) of standard deviations spread (NS,), every command until now having been this voltage.

    Sources (m of them: rms, correlation time, 1 or 0 in noise (m, 3)) and reads (NY, m) are those of filter_error. Written: now (NS,), commands
    (k,), the newest first, sens (NS, NS + rows + n), force (m,), force_by (m, n), covariance (NS + m, NS + m) and rubbing (SURFACES,).
    """
    by_state, reading_by = np.zeros((NY, NR)), np.zeros((NY, FITTED + 1))
    transition = np.zeros((NS + force.size, NS + force.size))
    _begin(state, voltage, parameters, now, commands)
    for i in range(SURFACES):
        rubbing[i] = 0.0
    _sensor_jacobian(0.0, now, parameters, by_state, reading_by)
    _start_filter(sens, spread, by_state, reads, noise, force, force_by, covariance, transition)


@compiled
def filter_readings(
    t, measured, weight, parameters, columns, reads, now, sens, force, force_by, covariance, learnt, least, innovation,
    gate, taken,
):  # fmt: skip
    """Readings measured (NY,) at the time t, not finite where there is none: the update, of the parameters in columns (n,) too.

    weight (NY,) is 1/σ. learnt (n, n) is the covariance of these parameters, which moves on; no parameter falls below least (n,).
    innovation (NY,) receives what was unexpected, in standard deviations; past gate (NY,), where that is above 0, a reading is refused;
    taken (NY,) receives 1 where one was not, else 0. The parameters by recursive prediction errors (Ljung and Söderström 1983), whose
    gradient is that of the filter itself.
    """
    n, m, first = columns.size, force.size, sens.shape[1] - columns.size
    by_state, reading_by, reading, row = np.zeros((NY, NR)), np.zeros((NY, FITTED + 1)), np.zeros(NY), np.zeros(n)
    before, gain, crossed, by = np.zeros(NR), np.zeros(NS + m), np.zeros(NS + m), np.zeros(NS + m)
    product, crossed_learnt = np.zeros((1, NS + m)), np.zeros(n)
    read_sensors(t, now, parameters, reading)
    _sensor_jacobian(t, now, parameters, by_state, reading_by)
    for i in range(NR):
        before[i] = now[i]  # about which the readings are linear
    for y in range(NY):
        innovation[y], taken[y] = 0.0, 0.0
        if measured[y] - measured[y] != 0.0:  # neither NaN nor infinite
            continue
        error = measured[y] - reading[y]
        for i in range(NR):
            error -= by_state[y, i] * (now[i] - before[i])
        for j in range(m):
            error -= reads[y, j] * force[j]
        for c in range(n):
            row[c] = reading_by[y, columns[c]]
            for i in range(NR):
                row[c] += by_state[y, i] * sens[i, first + c]
            for j in range(m):
                row[c] += reads[y, j] * force_by[j, c]
        _reading_direction(y, by_state, reads, by)
        if gate[y] > 0.0:
            innovation[y] = error / _expected_error(1.0 / weight[y] ** 2, by, row, covariance, learnt)
            if not abs(innovation[y]) <= gate[y]:
                continue
        taken[y] = 1.0
        root = _assimilate(
            error, 1.0 / weight[y] ** 2, by, row, now, sens, force, force_by, covariance, product, gain, crossed
        )
        innovation[y] = error / root
        _learn_parameters(
            error, root, row, columns, learnt, least, parameters, now, sens, force, force_by, crossed_learnt
        )


@internal
def _expected_error(variance, by, row, covariance, learnt):
    """Standard deviation of a reading's error: of its noise, of variables in the direction by, of parameters in that of row."""
    for i in range(by.size):
        for j in range(by.size):
            variance += by[i] * covariance[i, j] * by[j]
    for a in range(row.size):
        for b in range(row.size):
            variance += row[a] * learnt[a, b] * row[b]
    return math.sqrt(variance)
