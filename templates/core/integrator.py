"""What the steps of the integrator share: the method's weights and the scratch arrays."""

import numpy as np

from templates.core.frame import DRY, EXCESS, FITTED, GIVEN, LANES, MEMORY, NA, NS, REMEMBERED, inlined


@inlined
def _weights(stage, h):
    """How far ahead a stage's slope carries to the next stage, and its weight in the step."""
    return (0.5 * h if stage < 2 else h), (h / 6.0 if stage in (0, 3) else h / 3.0)


@inlined
def _workspace():
    """Scratch arrays of the integrator.

    The next state; coefficients by stage; derivatives of the residual by stage, row and parameter, the
    last of the driven input; sensitivities side by side; rows for dry friction.
    """
    return (
        np.zeros(NS), np.zeros((5, MEMORY + 2 * REMEMBERED)), np.zeros((5, GIVEN, FITTED + 1)),
        np.zeros(EXCESS + LANES), np.zeros((6, max(NA, DRY))),
    )  # fmt: skip
