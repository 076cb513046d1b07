"""A machine in modes, for solvers that step it themselves: each surface slips one way or sticks, until an event ends it."""

import numpy as np

from templates.core.frame import (
    AT_REST,
    BEFORE,
    DIRECTION,
    FORCE,
    LAG,
    LOWER,
    NA,
    NV,
    RATE,
    RATES,
    SURFACES,
    UPPER,
    _friction_limits,
    _rate,
    _slopes,
    compiled,
    internal,
)
from templates.core.friction import _slip, _slip_rate, _stick_or_slip, _store_rate


@compiled
def machine_slopes(t, now, voltage, parameters, directions, slope):
    """Time derivatives of all states (NS,), into slope, while every surface slips in its direction or sticks, at 0."""
    dry = np.zeros((6, max(NA, SURFACES)))
    acting = now[NV] if LAG >= 0 else voltage
    for i in range(SURFACES):
        dry[DIRECTION, i] = directions[i]
    _rate(t, now, acting, parameters, dry)
    _slopes(t, now, voltage, parameters, dry, slope)


@compiled
def friction_reserves(t, now, voltage, parameters, directions, reserves):
    """How far each surface is from another mode, into reserves (2 SURFACES,): one of them falls below zero at an event.

    While it slips: its speed in its direction, and AT_REST so that it begins above zero; and 1. While it sticks: how far
    the force that holds it is from its upper limit, and from its lower one.
    """
    dry = np.zeros((6, max(NA, SURFACES)))
    acting = now[NV] if LAG >= 0 else voltage
    for i in range(SURFACES):
        dry[DIRECTION, i] = directions[i]
    _rate(t, now, acting, parameters, dry)
    _friction_limits(t, now, acting, parameters, dry)
    for i in range(SURFACES):
        if directions[i] == 0.0:
            reserves[2 * i] = dry[UPPER, i] - dry[FORCE, i]
            reserves[2 * i + 1] = dry[FORCE, i] - dry[LOWER, i]
        else:
            reserves[2 * i] = directions[i] * _slip(now, i) + AT_REST
            reserves[2 * i + 1] = 1.0


@compiled
def settle_friction(t, now, voltage, parameters, directions):
    """The mode of each surface, into directions (SURFACES,), from the one that it had, at an event.

    One that has come to rest, or has just passed it, is stopped, and sticks where friction can hold it. Where directions
    are 2 no mode is known yet.
    """
    dry = np.zeros((6, max(NA, SURFACES)))
    acting = now[NV] if LAG >= 0 else voltage
    for i in range(SURFACES):
        _friction_limits(t, now, acting, parameters, dry)
        rubs = directions[i] < 2.0 and dry[UPPER, i] > dry[LOWER, i]
        if rubs and directions[i] * _slip(now, i) <= AT_REST:
            _stop(t, now, acting, parameters, directions, dry, i)
    _stick_or_slip(t, now, acting, parameters, dry)
    for i in range(SURFACES):
        directions[i] = dry[DIRECTION, i]


@internal
def _stop(t, now, voltage, parameters, directions, dry, surface):
    """Take what is left of a surface's slip away, by an impulse of its friction."""
    for i in range(SURFACES):
        dry[DIRECTION, i] = directions[i]
    forward = 0.0
    for way in range(2):  # of the two ways the one that is braked more, which says best what an impulse does
        dry[DIRECTION, surface] = 1.0 if way == 0 else -1.0
        _rate(t, now, voltage, parameters, dry)
        if way == 0:
            forward = _slip_rate(dry, RATE, surface)
            _store_rate(dry)
        elif abs(_slip_rate(dry, RATE, surface)) > abs(forward):
            _store_rate(dry)
    dry[DIRECTION, surface] = 0.0
    _rate(t, now, voltage, parameters, dry)
    braked = _slip_rate(dry, BEFORE, surface)
    share = _slip(now, surface) / braked if braked != 0.0 else 0.0
    for k in range(NA):
        now[RATES[k]] -= share * (dry[BEFORE, k] - dry[RATE, k])
