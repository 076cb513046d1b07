"""The integrator's weights and scratch arrays."""

import numpy as np

from templates.core.frame import DERIVATIVE_ROWS, EXCESS, FITTED, HYSTERESES, LANES, MEMORY, NA, NS, SURFACES, inlined


@inlined
def _weights(stage, h):
    """Step from a Runge-Kutta stage to the next one, and the stage's weight in the whole step."""
    return (0.5 * h if stage < 2 else h), (h / 6.0 if stage in (0, 3) else h / 3.0)


@inlined
def _workspace():
    """Scratch arrays of the integrator.

    The next state; coefficients by stage; derivatives of the residual by stage, row and parameter, the
    last of the driven input; sensitivities side by side; rows for dry friction.
    """
    return (
        np.zeros(NS), np.zeros((5, MEMORY + 2 * HYSTERESES)), np.zeros((5, DERIVATIVE_ROWS, FITTED + 1)),
        np.zeros(EXCESS + LANES), np.zeros((6, max(NA, SURFACES))),
    )  # fmt: skip
