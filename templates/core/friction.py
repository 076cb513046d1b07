"""Dry friction: slip of the surfaces, the directions they slip in, and the events between slipping and sticking."""

from templates.core.frame import (
    AT_REST,
    BEFORE,
    DIRECTION,
    FORCE,
    LOWER,
    NA,
    RATE,
    RATES,
    SLIP_MATRIX,
    SURFACES,
    UPPER,
    _friction_limits,
    _rate,
    inlined,
    internal,
)


@inlined
def _slip(state, surface):
    """Slip speed of a surface."""
    speed = 0.0
    for k in range(NA):
        speed += SLIP_MATRIX[surface, k] * state[RATES[k]]
    return speed


@inlined
def _slip_directions(state, dry):
    """Directions of slip by the sign of the slip speeds, into dry[DIRECTION]."""
    for i in range(SURFACES):
        dry[DIRECTION, i] = 1.0 if _slip(state, i) >= 0.0 else -1.0


@inlined
def _store_rate(dry):
    """Copy the accelerations dry[RATE] to dry[BEFORE]."""
    for k in range(NA):
        dry[BEFORE, k] = dry[RATE, k]


@internal
def _stick_slip_rate(t, state, voltage, parameters, dry):
    """Accelerations with the surfaces sticking or slipping as _stick_or_slip finds, into dry[RATE]."""
    _stick_or_slip(t, state, voltage, parameters, dry)
    _rate(t, state, voltage, parameters, dry)


@inlined
def _slip_rate(dry, row, surface):
    """Slip acceleration of a surface under the accelerations dry[row]."""
    total = 0.0
    for k in range(NA):
        total += SLIP_MATRIX[surface, k] * dry[row, k]
    return total


@internal
def _zero_crossing(h, start, start_rate, end, end_rate):
    """Time within h at which a slip speed crosses zero, by bisection of its cubic Hermite interpolant."""
    low, high = 0.0, 1.0
    for _ in range(50):
        u = 0.5 * (low + high)
        value = (
            start * (1.0 + 2.0 * u) * (1.0 - u) ** 2
            + h * start_rate * u * (1.0 - u) ** 2
            + end * u * u * (3.0 - 2.0 * u)
            + h * end_rate * u * u * (u - 1.0)
        )
        if value * start > 0.0:
            low = u
        else:
            high = u
    return h * high


@internal
def _saltation(sens, dry, surface):
    """Saltation of the sensitivities at a stick-slip event, from accelerations dry[BEFORE] to dry[RATE]."""
    approach = _slip_rate(dry, BEFORE, surface)
    if approach == 0.0:
        return
    for c in range(sens.shape[1]):
        slip = 0.0
        for k in range(NA):
            slip += SLIP_MATRIX[surface, k] * sens[RATES[k], c]
        for k in range(NA):
            sens[RATES[k], c] -= (dry[BEFORE, k] - dry[RATE, k]) * slip / approach


@internal
def _stick_or_slip(t, state, voltage, parameters, dry):
    """Set the direction of slip of each surface, 0 where it sticks, in dry[DIRECTION], and its limits in dry[UPPER] and dry[LOWER].

    A surface at rest sticks while the force that holds it lies between its limits. One without friction never sticks.
    """
    _slip_directions(state, dry)
    _friction_limits(t, state, voltage, parameters, dry)
    stuck = False
    for i in range(SURFACES):
        if dry[UPPER, i] > dry[LOWER, i] and abs(_slip(state, i)) <= AT_REST:
            dry[DIRECTION, i] = 0.0
            stuck = True
    for _ in range(SURFACES + 1):
        if not stuck:
            return
        stuck = False
        _rate(t, state, voltage, parameters, dry)
        for i in range(SURFACES):
            if dry[DIRECTION, i] == 0.0 and dry[FORCE, i] > dry[UPPER, i]:
                dry[DIRECTION, i] = 1.0
                stuck = True
            elif dry[DIRECTION, i] == 0.0 and dry[FORCE, i] < dry[LOWER, i]:
                dry[DIRECTION, i] = -1.0
                stuck = True
