"""The input that acts where the actuator follows its command at once."""

from templates.core.frame import NV, NX, compiled, inlined, internal


@inlined
def _acting(t, h, state, voltage, parameters):
    """The input that acts in the mean over the next h."""
    return voltage


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


@compiled
def acting_voltage(t, voltage, parameters):
    """The input (N,) that acts at each sample just before its command: the commanded one unless the input lags."""
    return voltage.copy()
