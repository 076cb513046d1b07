"""A Gaussian sum for what dry friction leaves of the filter's distribution, while a surface may stick.

Friction cuts a Gaussian variable, the slip with which a step would end, into three: what slips forward, what slips
backward, what sticks. Each part is again taken for Gaussian, with a weight, an offset of its mean from that of all, and
a covariance of its own (Alspach and Sorenson 1972); every reading moves all parts and weighs them anew.

A part mixture[p] of (blocks, variables + 1, variables + 1) holds its covariance, of which the lower half counts, its
offset in the last row, and in the last column its weight and the logarithm of that covariance's volume. The last
three blocks are a covariance to be tried, its factors, and a floor under every covariance. With one part the mixture is
not used.
"""

import math

import numpy as np

from templates.core.frame import (
    ALIKE,
    BY_VARIABLE,
    FLOOR,
    KNOWN_SLIP,
    NS,
    ON_SLIP,
    PUSH,
    RARE,
    TRIAL,
    VOLUME,
    WEIGHT,
    inlined,
    internal,
)
from templates.core.kalman import _learn
from templates.core.merging import _reduce_parts
from templates.core.truncated import _piece, _tails


@inlined
def _empty_mixture(parts, size):
    """Mixture with room for so many parts and the three that friction makes of each, costs of mergers, and a slip's rays."""
    room = 4 * parts if parts > 1 else 0
    return np.zeros((room + 3, size + 1, size + 1)), np.zeros((room, room)), np.zeros((3, size))


@internal
def _begin_parts(count, sens, mixing, covariance, transition, product, mixture):
    """Move all parts to the end of a step without friction's change; where there was one, it is the filter's own."""
    size = covariance.shape[0]
    for a in range(size):
        for b in range(size):
            mixture[FLOOR, a, b] = 0.0
            if count == 1:
                mixture[0, a, b] = covariance[a, b]
        if count == 1:
            mixture[0, size, a] = 0.0
    if count == 1:
        mixture[0, WEIGHT, size] = 1.0
    for i in range(NS):
        for j in range(size):
            transition[i, j] = sens[i, j] if j < NS else 0.0
            for r in range(mixing.shape[0] if j >= NS else 0):
                transition[i, j] += sens[i, NS + r] * mixing[r, j - NS]
    for p in range(count):
        _move_part_on(p, transition, product, mixture)


@internal
def _move_part_on(p, transition, product, mixture):
    """Offset and covariance of a part after a step, by the first rows of a transition: only the states move in it."""
    size = transition.shape[0]
    for i in range(NS):
        total = 0.0
        for k in range(size):
            total += transition[i, k] * mixture[p, size, k]
        mixture[TRIAL, size, i] = total
        for a in range(size):
            total = 0.0
            for k in range(size):
                total += transition[i, k] * mixture[p, k, a]
            product[i, a] = total
    for i in range(NS):
        mixture[p, size, i] = mixture[TRIAL, size, i]
        for j in range(i + 1):
            total = 0.0
            for k in range(size):
                total += product[i, k] * transition[j, k]
            mixture[p, i, j] = mixture[p, j, i] = total
        for j in range(NS, size):
            mixture[p, i, j] = mixture[p, j, i] = product[i, j]


@internal
def _split_parts(count, slip, width, rays, mixture, costs):
    """Cut each part where friction does, and merge what is alike.

    Returns how many parts there are then; and mean, slope and signed share of what friction leaves of the slip, whose
    mean was slip. Offsets are then from that mean.
    """
    size, room, new = rays.shape[1], costs.shape[0] // 4, costs.shape[0] // 4
    left, share, signed = 0.0, 0.0, 0.0
    for p in range(count):
        weight, (offset, variance) = mixture[p, WEIGHT, size], _regress_on_slip(p, width, rays, mixture)
        mean, sigma = slip + offset, math.sqrt(variance)
        above, below, upper, lower, at_upper, at_lower = _tails(mean, sigma, width)
        left += weight * (sigma * (at_upper - at_lower) + (mean - width) * upper + (mean + width) * lower)
        share += weight * (upper + lower)
        signed += weight * (upper - lower)
        sticks = 1.0 - upper - lower
        if weight * sticks >= RARE:
            shift, spread = _piece(sticks, at_lower, at_upper, below * at_lower - above * at_upper)
            _cut_part(
                p, new, sticks, shift * sigma, mean + shift * sigma, spread * variance, variance, True, rays, mixture
            )
            new += 1
        if weight * upper >= RARE:
            shift, spread = _piece(upper, at_upper, 0.0, above * at_upper)
            _cut_part(p, new, upper, shift * sigma, width, spread * variance, variance, False, rays, mixture)
            new += 1
        if weight * lower >= RARE:
            shift, spread = _piece(lower, 0.0, at_lower, -below * at_lower)
            _cut_part(p, new, lower, shift * sigma, -width, spread * variance, variance, False, rays, mixture)
            new += 1
    _settle_parts(new - room, room, slip - left, width, rays, mixture)
    return _reduce_parts(new - room, room, mixture, costs), left, share, signed


@internal
def _regress_on_slip(p, width, rays, mixture):
    """Offset and variance of a part's slip; into rays the regression of its variables on it.

    A slip that stuck before is known to the last digit, and what else varies with it is rounding: so no slip counts as
    known better than a small share of friction's half width.
    """
    size, offset, variance = rays.shape[1], 0.0, 0.0
    for a in range(size):
        total = 0.0
        for b in range(size):
            total += mixture[p, a, b] * rays[BY_VARIABLE, b]
        rays[ON_SLIP, a] = total
        offset += rays[BY_VARIABLE, a] * mixture[p, size, a]
        variance += rays[BY_VARIABLE, a] * total
    variance = max(variance, (KNOWN_SLIP * width) ** 2)
    for a in range(size):
        rays[ON_SLIP, a] /= variance
    return offset, variance


@internal
def _cut_part(old, new, share, shift, taken, spread, variance, sticks, rays, mixture):
    """Moments of a part given that its slip has another mean and variance, from which friction takes what it does."""
    size = rays.shape[1]
    mixture[new, WEIGHT, size] = mixture[old, WEIGHT, size] * share
    for a in range(size):
        on_slip = rays[ON_SLIP, a]
        by = on_slip - rays[PUSH, a] if sticks else on_slip
        mixture[new, size, a] = mixture[old, size, a] + on_slip * shift - rays[PUSH, a] * taken
        for b in range(a + 1):
            other = rays[ON_SLIP, b] - rays[PUSH, b] if sticks else rays[ON_SLIP, b]
            value = mixture[old, a, b] - on_slip * rays[ON_SLIP, b] * variance + by * other * spread
            mixture[new, a, b] = mixture[new, b, a] = value


@inlined
def _settle_parts(count, first, taken, width, rays, mixture):
    """Let what was cut be the mixture's parts, with weights of sum 1 and offsets from where friction leaves the mean."""
    size, total = rays.shape[1], 0.0
    for p in range(count):
        total += mixture[first + p, WEIGHT, size]
    for p in range(count):
        for a in range(size + 1):
            for b in range(size + 1):
                mixture[p, a, b] = mixture[first + p, a, b]
        mixture[p, WEIGHT, size] /= total
        for a in range(size):
            mixture[p, size, a] += rays[PUSH, a] * taken
    for a in range(size):
        for b in range(a + 1):
            mixture[FLOOR, a, b] += (ALIKE * width) ** 2 * rays[PUSH, a] * rays[PUSH, b]


@internal
def _end_parts(count, noise, now, force, covariance, transition, mixture):
    """Let the parts' forces decay and be driven anew, after the filter's own did."""
    size = covariance.shape[0]
    for p in range(count):
        for j in range(NS, size):
            decay = transition[j, j]
            mixture[p, size, j] *= decay
            for a in range(size):
                mixture[p, a, j] *= decay
            for a in range(size):
                mixture[p, j, a] *= decay
            mixture[p, j, j] += noise[j - NS, 0] ** 2 * (1.0 - decay**2)
    _gather(count, now, force, covariance, mixture)


@internal
def _gather(count, now, force, covariance, mixture):
    """Mean and covariance of all parts are the filter's own; their offsets are from that mean."""
    size = covariance.shape[0]
    for a in range(size):
        mean = 0.0
        for p in range(count):
            mean += mixture[p, WEIGHT, size] * mixture[p, size, a]
        for p in range(count):
            mixture[p, size, a] -= mean
        if a < NS:
            now[a] += mean
        else:
            force[a - NS] += mean
    for a in range(size):
        for b in range(a + 1):
            total = 0.0
            for p in range(count):
                own = mixture[p, a, b] + mixture[p, size, a] * mixture[p, size, b]
                total += mixture[p, WEIGHT, size] * own
            covariance[a, b] = covariance[b, a] = total


@internal
def _assimilate_parts(count, error, variance, by, row, now, sens, force, force_by, covariance, gain, crossed, mixture):
    """Update all parts by a reading, and weigh them by how well each foretold it.

    Returns the standard deviation of the error, the whitened innovation and the logarithm of a variance: such that the
    innovation's slope in the error is the score of the mixture, and that both make −2 log of its likelihood.
    """
    size, rows = by.size, sens.shape[1] - row.size + 1
    total, score, likelihood, largest = variance, 0.0, 0.0, -math.inf
    for a in range(size):
        for b in range(size):
            total += by[a] * covariance[a, b] * by[b]
    for p in range(count):
        largest = max(largest, _assimilate_part(p, error, variance, by, gain, crossed, mixture))
    for p in range(count):
        likelihood += math.exp(mixture[p, VOLUME, size] - largest)
    for p in range(count):
        share = math.exp(mixture[p, VOLUME, size] - largest) / likelihood
        score += share * mixture[p, WEIGHT, size]
        mixture[p, WEIGHT, size] = share
    _gather(count, now, force, covariance, mixture)
    for a in range(size):
        effective = 0.0  # the mean's derivative in the error: covariance with the reading over the noise (Tweedie)
        for b in range(size):
            effective += covariance[a, b] * by[b] / variance
        for c in range(row.size - 1):
            if a < NS:
                sens[a, rows + c] -= effective * row[c]
            else:
                force_by[a - NS, c] -= effective * row[c]
    root = math.sqrt(total)
    return root, root * score, -2.0 * (largest + math.log(likelihood)) - total * score**2


@internal
def _assimilate_part(p, error, variance, by, gain, crossed, mixture):
    """Update a part by a reading; in place of its weight stands its score then, of its volume its log-likelihood.

    Returns this logarithm.
    """
    size, own = by.size, error
    for i in range(size):
        own -= by[i] * mixture[p, size, i]
    total = _learn(variance, by, mixture[p], mixture[TRIAL, size], gain, crossed)
    for i in range(size):
        mixture[p, size, i] += gain[i] * own
    weight = max(mixture[p, WEIGHT, size], 1e-300)
    mixture[p, WEIGHT, size] = own / total
    mixture[p, VOLUME, size] = math.log(weight) - 0.5 * own**2 / total - 0.5 * math.log(total)
    return mixture[p, VOLUME, size]
