"""Two first-order filters in a row, exact between samples, and the regression behind them."""

import math

import numpy as np

from templates.core.frame import (
    DERIVATIVES,
    HELD_INPUT,
    LINEAR,
    NEW,
    NQ,
    NX,
    OLD,
    SIGNALS,
    STATE,
    UNMEASURED,
    Z1,
    Z2,
    _assemble,
    _signal_rates,
    _signals_at,
    compiled,
    internal,
)


@compiled
def filter_weights(h, tau1, tau2):
    """Exact step of z1' = (u − z1)/τ1, z2' = (z1 − z2)/τ2 over h [s] for u linear between samples, (9,).

    Decay of z1 and of z2, coupling of z1 into z2, weights of the old and the new input in z1 and in z2, τ1, τ2. Equal
    time constants are set a thousandth apart: any pair will do as long as both sides of the equation share it.
    """
    if abs(tau1 - tau2) < 1e-3 * tau1:
        tau2 = tau1 * 1.001
    e1, e2 = math.exp(-h / tau1), math.exp(-h / tau2)
    coupling = tau1 / (tau1 - tau2) * (e1 - e2)
    ramp1, ramp2 = 1.0 - tau1 / h * (1.0 - e1), 1.0 - tau2 / h * (1.0 - e2)
    step1, step2 = 1.0 - e1, (tau1 * (1.0 - e1) - tau2 * (1.0 - e2)) / (tau1 - tau2)
    both = (tau1 * ramp1 - tau2 * ramp2) / (tau1 - tau2)
    return np.array([e1, e2, coupling, step1 - ramp1, ramp1, step2 - both, both, tau1, tau2])


@compiled
def filter_memory():
    """Zeroed memory of the filters between two samples, (5, max(SIGNALS, NX))."""
    return np.zeros((5, max(SIGNALS, NX)))


@compiled
def filter_start(t, state, voltage, parameters, weights, memory):
    """Set the filters' memory at the first sample, from the state (NX,) believed there (the paper's eq. 42)."""
    tau1, tau2 = weights[7], weights[8]
    value, speed = memory[OLD], memory[NEW]
    _signals_at(t, state, voltage, parameters, value)
    _signal_rates(t, state, voltage, parameters, speed)
    for s in range(SIGNALS):
        memory[Z1, s] = memory[Z2, s] = 0.0
        if DERIVATIVES[s] == 1:
            memory[Z1, s] = memory[Z2, s] = value[s]
        elif DERIVATIVES[s] == 2:
            memory[Z1, s] = value[s] - speed[s] * tau1
            memory[Z2, s] = value[s] - speed[s] * (tau1 + tau2)


@compiled
def filter_advance(t, h, old_state, state, old_voltage, voltage, parameters, weights, first_order_hold, memory):
    """Take the filters' memory from a sample to the next one, h [s] later, where ``state`` and ``voltage`` were measured.

    Between samples a signal is linear (first_order_hold) or constant, the voltage always constant. A rate that no
    sensor reads is the increment of its angle over the interval, which is what the filters integrate.
    """
    now = memory[STATE]
    for x in range(NX):
        now[x] = old_state[x]
    for x in UNMEASURED:
        now[x] = (state[x - NQ] - old_state[x - NQ]) / h
    _signals_at(t, now, old_voltage, parameters, memory[OLD])
    for x in range(NX):
        now[x] = state[x]
    for x in UNMEASURED:
        now[x] = (state[x - NQ] - old_state[x - NQ]) / h
    _signals_at(t + h, now, voltage, parameters, memory[NEW])
    for s in range(SIGNALS):
        old = memory[OLD, s]
        end = old if HELD_INPUT[s] or not first_order_hold else memory[NEW, s]
        memory[Z2, s] = weights[1] * memory[Z2, s] + weights[2] * memory[Z1, s] + weights[5] * old + weights[6] * end
        memory[Z1, s] = weights[0] * memory[Z1, s] + weights[3] * old + weights[4] * end


@compiled
def filter_output(t, state, voltage, parameters, weights, memory, tau, phi):
    """Filtered left side, into tau (NQ,), and regressor, into phi (NQ, len(LINEAR)), at a sample.

    No acceleration is formed: a derivative is taken of the filter's output instead.
    """
    tau1, tau2 = weights[7], weights[8]
    value = memory[NEW]
    _signals_at(t, state, voltage, parameters, value)
    for s in range(SIGNALS):
        slope = (memory[Z1, s] - memory[Z2, s]) / tau2
        if DERIVATIVES[s] == 0:
            value[s] = memory[Z2, s]
        elif DERIVATIVES[s] == 1:
            value[s] = slope
        else:
            value[s] = ((value[s] - memory[Z1, s]) / tau1 - slope) / tau2
    _assemble(value, tau, phi)


@internal
def _filter_sample(k, t, states, voltage, parameters, taus, first_order_hold, start, weights, memory, tau, phi):
    """Bring the filters from sample k - 1 to sample k of a log and read them; weights[9] is the interval they are for."""
    h = t[k] - t[k - 1] if k else t[1] - t[0]
    if h != weights[9]:
        weights[:9], weights[9] = filter_weights(h, taus[0], taus[1]), h
    if k:
        filter_advance(
            t[k - 1], h, states[k - 1], states[k], voltage[k - 1], voltage[k], parameters, weights, first_order_hold, memory
        )
    else:
        filter_start(t[0], start, voltage[0], parameters, weights, memory)
    filter_output(t[k], states[k], voltage[k], parameters, weights, memory, tau, phi)


@compiled
def filter_regressor(t, states, voltage, parameters, tau1, tau2, first_order_hold, start):
    """Left side (N, NQ) and regressor (N, NQ, len(LINEAR)) behind 1/((τ1 s + 1)(τ2 s + 1)) (paper eqs. 30-42).

    states (N, NX) hold the measured angles and rates; see filter_advance for what is assumed between samples. The
    initial conditions are the paper's (42), formed from the state ``start`` (NX,), usually the first of the states.
    """
    taus, phis = np.zeros((t.size, NQ)), np.zeros((t.size, NQ, len(LINEAR)))
    weights, memory, times = np.zeros(10), filter_memory(), (tau1, tau2)
    for k in range(t.size):
        _filter_sample(
            k, t, states, voltage, parameters, times, first_order_hold, start, weights, memory, taus[k], phis[k]
        )
    return taus, phis


@compiled
def filter_onward(t, states, voltage, parameters, tau1, tau2, first_order_hold, memory):
    """filter_regressor for samples 1 to N - 1 from the filters' memory at sample 0, which ends at the last: (N - 1, ...)."""
    taus, phis = np.zeros((t.size - 1, NQ)), np.zeros((t.size - 1, NQ, len(LINEAR)))
    weights, times = np.zeros(10), (tau1, tau2)
    for k in range(1, t.size):
        _filter_sample(
            k, t, states, voltage, parameters, times, first_order_hold, states[0], weights, memory, taus[k - 1], phis[k - 1]
        )
    return taus, phis
