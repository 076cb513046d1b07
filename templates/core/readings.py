"""Readings: their derivatives by the chain rule, and their rounding."""

import numpy as np

from templates.core.frame import NR, NX, NY, inlined


@inlined
def _reading_jacobian(sens, by_state, by_parameter, columns, rows):
    """Derivatives of the readings, one row each, from those of the state."""
    for y in range(NY):
        for c in range(sens.shape[1]):
            rows[y, c] = by_parameter[y, columns[c - NX]] if c >= NX else 0.0
        for i in range(NR):
            by = by_state[y, i]
            for c in range(sens.shape[1] if by != 0.0 else 0):
                rows[y, c] += by * sens[i, c]


@inlined
def _rounded(reading, quantum):
    """A reading in whole steps of a quantum, or as it is where that is not positive."""
    return np.round(reading / quantum) * quantum if quantum > 0.0 else reading
