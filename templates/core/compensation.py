"""Feedforward of what the model knows of friction and actuator: the command that gives the input that a controller wants."""

import numpy as np

from templates.core.frame import (
    BISECTIONS,
    DOUBLINGS,
    HYSTERESES,
    LOWER,
    NA,
    NS,
    NV,
    SLIP_MATRIX,
    SURFACES,
    UPPER,
    _driven,
    _first_row,
    _friction_limits,
    compiled,
    internal,
)
from templates.core.friction import _slip


@compiled
def compensate(t, wanted, now, forces, absent, maps, shares, least_slip, least_input):
    """The command under which the machine moves as one without these effects would under the input that is wanted.

    now (NS,) is the state as it is known. forces, absent and maps (NP,) are parameters: with the forces that are compensated
    and no others, with none, with what the actuator makes of a command and nothing else; shares (HYSTERESES,) say how much of
    each force with a memory is. What acts along the input is taken away;
    of what acts elsewhere, what it does to the first row. Below least_slip [rad/s or m/s] dry friction is held against
    the wanted input rather than against the slip, and it fades below least_input, as the actuator's dead zone does.
    """
    wanted += _lost_to_forces(t, wanted, now, forces, absent, shares, least_slip, least_input)
    if abs(wanted) >= least_input:
        return _command_for(t, wanted, maps)
    low, high = _command_for(t, -least_input, maps), _command_for(t, least_input, maps)
    return low + (high - low) * (wanted + least_input) / (2.0 * least_input)


@internal
def _lost_to_forces(t, wanted, now, forces, absent, shares, least_slip, least_input):
    """The input that dry friction and smooth forces take from the first row."""
    dry, without = np.zeros((6, max(NA, SURFACES))), np.zeros(NS)
    weight = _first_row(t, now, 0.0, absent) - _first_row(t, now, 1.0, absent)  # not at wanted, which may be too large
    lost = _first_row(t, now, wanted, forces) - _first_row(t, now, wanted, absent)
    for i in range(HYSTERESES):
        for j in range(NS):
            without[j] = now[j]
        without[NV - HYSTERESES + i] = 0.0
        lost += shares[i] * (_first_row(t, now, wanted, absent) - _first_row(t, without, wanted, absent))
    _friction_limits(t, now, wanted, forces, dry)
    for i in range(SURFACES):
        along, slip = SLIP_MATRIX[i, 0], _slip(now, i) / least_slip
        towards = slip + along * wanted / least_input * max(1.0 - abs(slip), 0.0)
        towards = min(max(towards, -1.0), 1.0)
        lost += along * (dry[UPPER, i] if towards > 0.0 else -dry[LOWER, i]) * towards
    return lost / weight


@internal
def _command_for(t, wanted, maps):
    """The command of which the actuator makes the input that is wanted; that itself where there is none."""
    reach = abs(wanted) + 1e-3
    for _ in range(DOUBLINGS):
        if _driven(t, -reach, maps) <= wanted <= _driven(t, reach, maps):
            break
        reach *= 2.0
    if not _driven(t, -reach, maps) <= wanted <= _driven(t, reach, maps):
        return wanted
    low, high = -reach, reach
    for _ in range(BISECTIONS):
        middle = 0.5 * (low + high)
        if _driven(t, middle, maps) < wanted:
            low = middle
        else:
            high = middle
    return 0.5 * (low + high)
