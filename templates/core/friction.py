"""Dry friction: slip of the surfaces, the directions they slip in, and the events between slipping and sticking."""

from templates.core.frame import BEFORE, DIRECTION, DRY, NA, RATE, RATES, SLIPS, _rate, _settle, inlined, internal


@inlined
def _slip(state, surface):
    """Slip speed of a surface."""
    speed = 0.0
    for k in range(NA):
        speed += SLIPS[surface, k] * state[RATES[k]]
    return speed


@inlined
def _follow(state, dry):
    """Let every surface slip the way it moves, into dry[DIRECTION]."""
    for i in range(DRY):
        dry[DIRECTION, i] = 1.0 if _slip(state, i) >= 0.0 else -1.0


@inlined
def _keep(dry):
    """Keep the accelerations dry[RATE] in dry[BEFORE]."""
    for k in range(NA):
        dry[BEFORE, k] = dry[RATE, k]


@internal
def _settled_rate(t, state, voltage, parameters, dry):
    """Accelerations once it is decided what sticks, into dry[RATE]."""
    _settle(t, state, voltage, parameters, dry)
    _rate(t, state, voltage, parameters, dry)


@inlined
def _slip_rate(dry, row, surface):
    """Slip acceleration of a surface under the accelerations dry[row]."""
    total = 0.0
    for k in range(NA):
        total += SLIPS[surface, k] * dry[row, k]
    return total


@internal
def _landing(h, start, start_rate, end, end_rate):
    """When a slip speed that changes its sign within h crosses zero, by bisection of its cubic interpolant."""
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
def _jump(sens, dry, surface):
    """Change the sensitivities at a stick-slip event, from dry[BEFORE] to dry[RATE]: its time depends on them (saltation)."""
    approach = _slip_rate(dry, BEFORE, surface)
    if approach == 0.0:
        return
    for c in range(sens.shape[1]):
        slip = 0.0
        for k in range(NA):
            slip += SLIPS[surface, k] * sens[RATES[k], c]
        for k in range(NA):
            sens[RATES[k], c] -= (dry[BEFORE, k] - dry[RATE, k]) * slip / approach
