"""Dry friction in the filter: implicit time stepping of what is only known as a distribution."""

import math

from templates.core.frame import (
    BY_VARIABLE,
    DIRECTION,
    IN_DRY_LAW,
    LOWER,
    MIN_PART,
    NA,
    NS,
    PUSH,
    RARE,
    RATE,
    RATES,
    REST_ATTEMPTS,
    REST_MARGIN,
    SLIP_MATRIX,
    SURFACES,
    UPPER,
    _acting,
    _friction_limits,
    _rate,
    _runge_kutta,
    inlined,
    internal,
)
from templates.core.friction import _slip, _slip_directions, _slip_rate
from templates.core.mixture import _begin_parts, _split_parts
from templates.core.truncated import _shrunk


@internal
def _until_rest(
    t, length, now, voltage, force, mixing, forces, rubbing, parameters, new_state, dry, stages, by_parameter
):
    """A step's length, or less where a surface that slips will first be at rest: there its friction changes within a step."""
    _friction_limits(t, now, voltage, parameters, dry)
    for r in range(forces.size):
        parameters[forces[r]] = 0.0
        for j in range(force.size):
            parameters[forces[r]] += mixing[r, j] * force[j]
    _slip_directions(now, dry)
    _rate(t, now, _acting(t, length, now, voltage, parameters), parameters, dry)
    near = False
    for i in range(SURFACES):
        slip, change = _slip(now, i), REST_MARGIN * length * abs(_slip_rate(dry, RATE, i))
        near = near or (dry[UPPER, i] > dry[LOWER, i] and slip != 0.0 and abs(slip) < change)
    if not near:
        return length
    for i in range(SURFACES):
        slip = _slip(now, i)
        rubs = dry[UPPER, i] if slip > 0.0 else dry[LOWER, i] if slip < 0.0 else rubbing[i]
        for r in range(forces.size):
            parameters[forces[r]] -= SLIP_MATRIX[i, r] * rubs
    dry[DIRECTION] = 0.0
    share, first = 1.0, SURFACES  # that will be at rest first
    for attempt in range(REST_ATTEMPTS):
        _runge_kutta(t, length * share, now, voltage, parameters, new_state, dry, True, False, stages, by_parameter)
        if attempt > 0:
            slip, later = _slip(now, first), _slip(new_state, first)
            share = min(1.0, share * slip / (slip - later))
            continue
        for i in range(SURFACES):
            slip, later = _slip(now, i), _slip(new_state, i)
            if dry[UPPER, i] > dry[LOWER, i] and slip * later < 0.0 and slip / (slip - later) < share:
                share, first = slip / (slip - later), i
        if first == SURFACES or share < MIN_PART:
            return length
    return length * share if MIN_PART < share < 1.0 - MIN_PART else length


@internal
def _rub(
    t, now, sens, voltage, mixing, parameters, columns, covariance, rubbing, added, friction, along, slope, dry, stops,
):  # fmt: skip
    """Dry friction over a step: an impulse that stops what slips, if it can, on the average over where the state may be.

    Implicit time stepping after Moreau (1988): of the slip with which a step would end, friction of a half width κ leaves
    what lies beyond ±κ. The filter knows that slip as a Gaussian variable; mean and slope of what is left follow in
    closed form, and what a line cannot say of it adds to the covariance. Returns the number of surfaces; where it stops
    before one that may stick, the number of those before.
    """
    rows = mixing.shape[0]
    for a in range(NS):
        for b in range(NS):
            added[a, b] = 0.0
    _friction_derivatives(t, now, voltage, parameters, columns, friction, dry)
    for i in range(SURFACES):
        middle, half = friction[0, i, columns.size], friction[1, i, columns.size]
        changes = False
        for c in range(columns.size):
            changes = changes or friction[0, i, c] != 0.0 or friction[1, i, c] != 0.0
        if half == 0.0 and middle == 0.0 and rubbing[i] == 0.0 and not changes:
            continue  # and none of the free parameters would change that
        response = _slip_response(i, rows, sens, along, slope)
        variance = _slip_variance(slope, mixing, covariance)
        slip = _slip(now, i) + response * (rubbing[i] - middle)
        left, share, signed, lost = _shrunk(slip, math.sqrt(max(variance, 1e-60)), response * half)
        if stops and half > 0.0 and share < 1.0 - RARE:
            return i
        force = (slip - left) / response + middle
        lost /= response**2
        for a in range(NS):
            for b in range(NS):
                added[a, b] += along[a] * along[b] * lost
        _push(i, force, response, share, signed, rows, now, sens, rubbing, friction, along, slope)
    return SURFACES


@internal
def _rub_parts(
    surface, count, t, now, sens, voltage, mixing, parameters, columns, covariance, rubbing, friction, along, slope, dry,
    transition, product, mixture, costs, rays,
):  # fmt: skip
    """Dry friction over a step from a surface on, on the average over all parts; cut where it sticks. Returns their number."""
    rows = mixing.shape[0]
    if count > 1:
        _friction_derivatives(t, now, voltage, parameters, columns, friction, dry)
    _begin_parts(count, sens, mixing, covariance, transition, product, mixture)
    for i in range(surface, SURFACES):
        middle, half = friction[0, i, columns.size], friction[1, i, columns.size]
        response = _slip_response(i, rows, sens, along, slope)
        slip = _slip(now, i) + response * (rubbing[i] - middle)
        left, share, signed = slip, 1.0, 0.0
        if half > 0.0:
            _slip_rays(i, along, response, rays)
            count, left, share, signed = _split_parts(count, slip, response * half, rays, mixture, costs)
        force = (slip - left) / response + middle
        _push(i, force, response, share, signed, rows, now, sens, rubbing, friction, along, slope)
    return count


@inlined
def _push(surface, force, response, share, signed, rows, now, sens, rubbing, friction, along, slope):
    """Let a surface's friction act on the states and their sensitivities, instead of what acted over the step."""
    for a in range(NS):
        now[a] -= along[a] * (force - rubbing[surface])
    stopped = (share - 1.0) / response
    for c in range(sens.shape[1]):
        by = stopped * slope[c]
        if c >= NS + rows:
            by -= share * friction[0, surface, c - NS - rows] + signed * friction[1, surface, c - NS - rows]
        for a in range(NS):
            sens[a, c] += along[a] * by
    rubbing[surface] = force


@inlined
def _slip_response(surface, rows, sens, along, slope):
    """Derivatives of the states in a force along a surface, into along, and of its slip in all, into slope.

    Returns the slip's in that force.
    """
    for a in range(NS):
        along[a] = 0.0
        for r in range(rows):
            along[a] += sens[a, NS + r] * SLIP_MATRIX[surface, r]
    response = 0.0
    for k in range(NA):
        response += SLIP_MATRIX[surface, k] * along[RATES[k]]
    for c in range(sens.shape[1]):
        slope[c] = 0.0
        for k in range(NA):
            slope[c] += SLIP_MATRIX[surface, k] * sens[RATES[k], c]
    return response


@inlined
def _slip_rays(surface, along, response, rays):
    """Derivatives of a slip in the variables at the end of a step, and theirs in a slip that friction takes away."""
    for a in range(rays.shape[1]):
        rays[BY_VARIABLE, a] = 0.0
        rays[PUSH, a] = along[a] / response if a < NS else 0.0
    for k in range(NA):
        rays[BY_VARIABLE, RATES[k]] = SLIP_MATRIX[surface, k]


@internal
def _friction_derivatives(t, state, voltage, parameters, columns, friction, dry):
    """Middle and half width of each surface's friction, into friction (2, SURFACES, n + 1), after their derivatives."""
    count = columns.size
    for c in range(count, -1, -1):
        if c < count and not IN_DRY_LAW[columns[c]]:
            for i in range(SURFACES):
                friction[0, i, c] = friction[1, i, c] = 0.0
            continue
        step = 0.0
        if c < count:
            kept = parameters[columns[c]]
            step = 1e-6 * max(abs(kept), 1e-3)
            parameters[columns[c]] = kept + step
        _friction_limits(t, state, voltage, parameters, dry)
        for i in range(SURFACES):
            friction[0, i, c] = 0.5 * (dry[UPPER, i] + dry[LOWER, i])
            friction[1, i, c] = 0.5 * (dry[UPPER, i] - dry[LOWER, i])
            if c < count:
                friction[0, i, c] = (friction[0, i, c] - friction[0, i, count]) / step
                friction[1, i, c] = (friction[1, i, c] - friction[1, i, count]) / step
        if c < count:
            parameters[columns[c]] = kept


@inlined
def _slip_variance(slope, mixing, covariance):
    """Variance of a slip from its derivatives in the states and in the rows' forces at the beginning of the step."""
    size, total = covariance.shape[0], 0.0
    for a in range(size):
        by, crossed = _slope_in(a, slope, mixing), 0.0
        for b in range(a):
            crossed += covariance[a, b] * _slope_in(b, slope, mixing)
        total += by * (covariance[a, a] * by + 2.0 * crossed)
    return total


@inlined
def _slope_in(variable, slope, mixing):
    """Derivative of a slip in one of the filter's variables: a state, or a source by the rows that it acts on."""
    if variable < NS:
        return slope[variable]
    by = 0.0
    for r in range(mixing.shape[0]):
        by += slope[NS + r] * mixing[r, variable - NS]
    return by
