"""Initial states of a log's segments, fitted one after the other."""

import math

import numpy as np

from templates.core.frame import FIRST_SAMPLE, NV, NX, compiled, internal, shoot, simulate


@compiled
def fit_initial_states(t, voltage, measured, weight, bounds, states, parameters, max_step, rounds, from_before):
    """Fit the initial states (S, NX) of segments one after the other, in place; added states carry over from one to the next.

    Coordinates and rates are fitted by Levenberg and Marquardt in at most ``rounds`` iterations; where ``from_before`` is
    set also from the state in which the segment before ended, of which the better fit is kept.
    """
    residual, gram, trial_gram = np.empty(measured.shape), np.zeros((1, NX + 1, NX + 1)), np.zeros((1, NX + 1, NX + 1))
    normal, step = np.zeros((NX, NX)), np.zeros(NX)
    start, other, arrived, ended = np.zeros((1, NV)), np.zeros((1, NV)), np.zeros(NV), FIRST_SAMPLE - 1
    for s in range(bounds.shape[0]):
        segment, last = bounds[s : s + 1], bounds[s, 1]
        start[0, :NX], start[0, NX:] = states[s], arrived[NX:]
        cost = _fit_start(
            t, voltage, measured, weight, segment, start, parameters, max_step, rounds, gram, trial_gram, residual, normal, step
        )
        if from_before and ended == bounds[s, 0] and np.isfinite(arrived).all():
            other[0] = arrived
            if cost > _fit_start(
                t, voltage, measured, weight, segment, other, parameters, max_step, rounds, gram, trial_gram, residual, normal, step
            ):
                start[0] = other[0]
        states[s] = start[0, :NX]
        until = min(last + 1, t.size)
        path = simulate(t[bounds[s, 0] : until], voltage[bounds[s, 0] : until], start[0], parameters, max_step)
        arrived[:], ended = path[-1], last
        for i in range(NX, NV):
            if not np.isfinite(arrived[i]):
                arrived[i] = 0.0


@internal
def _fit_start(
    t, voltage, measured, weight, segment, start, parameters, max_step, rounds, gram, trial_gram, residual, normal, step
):
    """Fit coordinates and rates in start (1, NV), in place; returns the sum of squares that they leave."""
    columns, window, trial, damping = np.empty(0, np.int64), np.empty((0, 2), np.int64), start.copy(), 1e-4
    shoot(t, voltage, measured, weight, segment, start, parameters, columns, window, max_step, gram, residual)
    cost = gram[0, NX, NX] if np.isfinite(gram[0, NX, NX]) else np.inf
    for _ in range(rounds):
        _damped_step(gram[0], damping, normal, step)
        for i in range(NX):
            trial[0, i] = start[0, i] + step[i]
        shoot(t, voltage, measured, weight, segment, trial, parameters, columns, window, max_step, trial_gram, residual)
        gain = cost - trial_gram[0, NX, NX]
        if gain > 0.0:
            start[0], gram[0], cost, damping = trial[0], trial_gram[0], trial_gram[0, NX, NX], 0.1 * damping
            if gain < 1e-5 * (1.0 + cost):
                break
        else:
            damping *= 10.0
            if damping > 1e3 or abs(gain) < 1e-9 * cost:
                break
    return cost


@internal
def _damped_step(gram, damping, normal, step):
    """Solve the states' normal equations, scaled to a unit diagonal and damped, by Cholesky; what is not finite stays."""
    for i in range(NX):
        for j in range(i + 1):
            total = gram[i, j] / math.sqrt(gram[i, i] * gram[j, j] + 1e-300) + (1e-10 + damping if i == j else 0.0)
            for k in range(j):
                total -= normal[i, k] * normal[j, k]
            normal[i, j] = math.sqrt(max(total, 1e-12)) if i == j else total / normal[j, j]
        step[i] = gram[i, NX] / math.sqrt(gram[i, i] + 1e-300)
        for k in range(i):
            step[i] -= normal[i, k] * step[k]
        step[i] /= normal[i, i]
    for i in range(NX - 1, -1, -1):
        for k in range(i + 1, NX):
            step[i] -= normal[k, i] * step[k]
        step[i] /= normal[i, i]
    for i in range(NX):
        step[i] = step[i] / math.sqrt(gram[i, i] + 1e-300)
        if not np.isfinite(step[i]):
            step[:] = 0.0
            break
