"""The extended Kalman filter of a machine with random forces and random errors of its sensors: start, prediction, update.

Both are zero-mean and of first order: between samples they are held, from one to the next they decay with their
correlation time and are driven by white noise that keeps their rms. The filter's variables are the states, a lagging
input among them, then these: the sources.
"""

import math

from templates.core.frame import NR, NS, NY, SLIP_MATRIX, SURFACES, inlined, internal


@internal
def _start_filter(sens, spread, by_state, reads, noise, force, force_by, covariance, transition):
    """Start with states of standard deviations spread (NS,) and sources of their own rms, both regardless of parameters.

    What a low-pass filter has of a sensor's past is as unknown as the state.
    """
    sens[:], force[:], force_by[:], covariance[:], transition[:] = 0.0, 0.0, 0.0, 0.0, 0.0
    for i in range(NS):
        covariance[i, i], transition[i, i] = spread[i] ** 2, 1.0
    for j in range(force.size):
        covariance[NS + j, NS + j], transition[NS + j, NS + j] = noise[j, 0] ** 2, 1.0
        for i in range(NR):
            for y in range(NY):
                covariance[NS + j, NS + j] += noise[j, 2] * (reads[y, j] * by_state[y, i] * spread[i]) ** 2


@inlined
def _hold_forces(sens, force, mixing, forces, rubbing, parameters):
    """Let the random forces and friction act on their rows over a step that is linear in the states and in these forces."""
    for r in range(forces.size):
        total = 0.0
        for i in range(SURFACES):
            total -= SLIP_MATRIX[i, r] * rubbing[i]
        for j in range(force.size):
            total += mixing[r, j] * force[j]
        parameters[forces[r]] = total
    for i in range(NS):
        for c in range(NS + forces.size):
            sens[i, c] = 1.0 if i == c else 0.0


@inlined
def _move_sources(elapsed, sens, mixing, noise, force, force_by, transition):
    """Decay the sources over a step, and set the transition of the variables from the sensitivities of the states over it."""
    rows, count = mixing.shape[0], force_by.shape[1]
    for i in range(NS):
        for j in range(NS):
            transition[i, j] = sens[i, j]
        for j in range(force.size):
            total = 0.0
            for r in range(rows):
                total += sens[i, NS + r] * mixing[r, j]
            transition[i, NS + j] = total
            for c in range(count):
                sens[i, NS + rows + c] += total * force_by[j, c]
    for j in range(force.size):
        decay = math.exp(-elapsed / noise[j, 1])
        transition[NS + j, NS + j] = decay
        force[j] *= decay
        for c in range(count):
            force_by[j, c] *= decay


@internal
def _lag_sensors(elapsed, before, sens_before, now, sens, by_state, reads, noise, force, force_by, transition):
    """Move the errors of sensors behind a low-pass filter by what these should read: e' = -e/T - y'."""
    first = sens.shape[1] - force_by.shape[1]
    for j in range(force.size):
        if noise[j, 2] == 0.0:
            continue
        share = noise[j, 1] * (1.0 - transition[NS + j, NS + j]) / elapsed
        for v in range(transition.shape[0]):
            moved = 0.0
            for i in range(NR):
                for y in range(NY):
                    moved += reads[y, j] * by_state[y, i] * (transition[i, v] - (1.0 if i == v else 0.0))
            if v != NS + j:
                transition[NS + j, v] = -share * moved
        for i in range(NR):
            for y in range(NY):
                along = share * reads[y, j] * by_state[y, i]
                force[j] -= along * (now[i] - before[i])
                for c in range(force_by.shape[1]):
                    force_by[j, c] -= along * (sens[i, first + c] - sens_before[i, c])


@inlined
def _spread(noise, added, covariance, transition, product):
    """Covariance of the variables after a step, from their transition, what is added to the states, and the sources' noise.

    What is known exactly, as an added state that its effect does not use is, takes no time.
    """
    size = covariance.shape[0]
    for i in range(size):
        for j in range(size):
            product[i, j] = 0.0
        for k in range(size):
            by = transition[i, k]
            if by != 0.0 and covariance[k, k] != 0.0:
                for j in range(size):
                    product[i, j] += by * covariance[k, j]
    for i in range(size):
        for j in range(i + 1):
            total = 0.0
            for k in range(size):
                total += product[i, k] * transition[j, k]
            covariance[i, j] = covariance[j, i] = total
    for i in range(NS):
        for j in range(NS):
            covariance[i, j] += added[i, j]
    for j in range(noise.shape[0]):
        covariance[NS + j, NS + j] += noise[j, 0] ** 2 * (1.0 - transition[NS + j, NS + j] ** 2)


@inlined
def _reading_direction(y, by_state, reads, by):
    """Derivatives of a reading in the variables, into by (variables,): in the states, then in the sources."""
    for i in range(by.size):
        by[i] = by_state[y, i] if i < NR else 0.0 if i < NS else reads[y, i - NS]


@inlined
def _learn(variance, by, covariance, shown, gain, crossed):
    """Update a covariance by a reading, in Joseph's form, which keeps it positive. Returns the variance of the error.

    The gain stands in gain then; crossed and shown (variables,) are scratch.
    """
    total = variance
    for i in range(by.size):
        crossed[i] = shown[i] = 0.0
    for k in range(by.size):
        if by[k] != 0.0:  # a reading shows few of the variables
            for i in range(by.size):
                crossed[i] += by[k] * covariance[k, i]
    for k in range(by.size):
        total += by[k] * crossed[k]
    for i in range(by.size):
        gain[i] = crossed[i] / total
    for k in range(by.size):
        if by[k] != 0.0:
            for i in range(by.size):
                shown[i] += by[k] * (covariance[k, i] - gain[i] * crossed[k])
    for i in range(by.size):
        for j in range(i + 1 if gain[i] != 0.0 else 0):
            left = covariance[i, j] - gain[i] * crossed[j] - shown[i] * gain[j]
            covariance[i, j] = covariance[j, i] = left + gain[i] * variance * gain[j]
    return total


@inlined
def _assimilate(error, variance, by, row, now, sens, force, force_by, covariance, product, gain, crossed):
    """Update by a reading: error and its derivatives row (n,) in the parameters, which both begin to count less.

    Returns the standard deviation of the error.
    """
    rows, count = sens.shape[1] - force_by.shape[1], force_by.shape[1]
    total = _learn(variance, by, covariance, product[0], gain, crossed)
    for i in range(NS):
        now[i] += gain[i] * error
        for c in range(count):
            sens[i, rows + c] -= gain[i] * row[c]
    for j in range(force.size):
        force[j] += gain[NS + j] * error
        for c in range(count):
            force_by[j, c] -= gain[NS + j] * row[c]
    return math.sqrt(total)


@internal
def _stand_still(moved):
    """The transition (variables, variables) over no time at all."""
    moved[:] = 0.0
    for i in range(moved.shape[0]):
        moved[i, i] = 1.0


@internal
def _follow(transition, moved, product):
    """Put a transition after those that moved holds."""
    size = moved.shape[0]
    for i in range(size):
        for j in range(size):
            product[i, j] = 0.0
            for k in range(size):
                product[i, j] += transition[i, k] * moved[k, j]
    moved[:] = product


@internal
def _store_step(number, which, now, force, covariance, means, covariances):
    """Store mean and covariance of a step: predicted (0) or filtered (1)."""
    for i in range(NS):
        means[number, which, i] = now[i]
    for j in range(force.size):
        means[number, which, NS + j] = force[j]
    covariances[number, which] = covariance
