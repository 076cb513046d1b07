"""Merging the Gaussian parts of a mixture, cheapest first (Runnalls 2007); mixture.py says how one is stored."""

import math

from templates.core.frame import FACTOR, FLOOR, RARE, TRIAL, VOLUME, WEIGHT, internal


@internal
def _reduce_parts(count, room, mixture, costs):
    """Merge parts while they are more than there is room for, or while it costs next to nothing; returns their number."""
    size = mixture.shape[1] - 1
    for p in range(count):
        mixture[p, VOLUME, size] = _log_volume(p, mixture)
        for q in range(p):
            costs[p, q] = _merging_cost(p, q, mixture)
    while count > 1:
        least, first, second = math.inf, 0, 1
        for p in range(count):
            for q in range(p):
                if costs[p, q] < least:
                    least, first, second = costs[p, q], q, p
        if count <= room and least > RARE:
            break
        _merge(first, second, mixture)
        count -= 1
        _move_part(count, second, mixture, costs)
        for p in range(count):
            if p != first:
                costs[max(p, first), min(p, first)] = _merging_cost(p, first, mixture)
    return count


@internal
def _move_part(old, new, mixture, costs):
    """Let the last of all parts take the place of another."""
    for a in range(mixture.shape[1]):
        for b in range(mixture.shape[1]):
            mixture[new, a, b] = mixture[old, a, b]
    for p in range(old):
        if p != new:
            costs[max(p, new), min(p, new)] = costs[old, p]


@internal
def _merging_cost(first, second, mixture):
    """What the merger of two parts costs at most [nat] (Runnalls 2007, equation 16)."""
    size = mixture.shape[1] - 1
    _merge_covariances(first, second, mixture)
    one, other = mixture[first, WEIGHT, size], mixture[second, WEIGHT, size]
    apart = one * mixture[first, VOLUME, size] + other * mixture[second, VOLUME, size]
    return 0.5 * ((one + other) * _log_volume(TRIAL, mixture) - apart)


@internal
def _merge(first, second, mixture):
    """Let the first of two parts be both."""
    size = mixture.shape[1] - 1
    _merge_covariances(first, second, mixture)
    share = mixture[second, WEIGHT, size] / (mixture[first, WEIGHT, size] + mixture[second, WEIGHT, size])
    for a in range(size):
        mixture[first, size, a] += share * (mixture[second, size, a] - mixture[first, size, a])
        for b in range(a + 1):
            mixture[first, a, b] = mixture[first, b, a] = mixture[TRIAL, a, b]
    mixture[first, WEIGHT, size] += mixture[second, WEIGHT, size]
    mixture[first, VOLUME, size] = _log_volume(TRIAL, mixture)


@internal
def _merge_covariances(first, second, mixture):
    """Covariance of two parts together, to be tried."""
    size = mixture.shape[1] - 1
    share = mixture[second, WEIGHT, size] / (mixture[first, WEIGHT, size] + mixture[second, WEIGHT, size])
    between = share * (1.0 - share)
    for a in range(size):
        by = between * (mixture[second, size, a] - mixture[first, size, a])
        for b in range(a + 1):
            both = mixture[first, a, b] + share * (mixture[second, a, b] - mixture[first, a, b])
            mixture[TRIAL, a, b] = both + by * (mixture[second, size, b] - mixture[first, size, b])


@internal
def _log_volume(part, mixture):
    """Logarithm of the determinant of a covariance, no less than the floor, from its factors L D Lᵀ."""
    size, total, product = mixture.shape[1] - 1, 0.0, 1.0
    for a in range(size):
        for b in range(a):
            value = mixture[part, a, b] + mixture[FLOOR, a, b]
            for c in range(b):
                value -= mixture[FACTOR, a, c] * mixture[FACTOR, c, b]
            mixture[FACTOR, a, b] = value  # of L D
        diagonal = value = mixture[part, a, a] + mixture[FLOOR, a, a]
        for c in range(a):
            mixture[FACTOR, c, a] = mixture[FACTOR, a, c] * mixture[FACTOR, c, c]  # of Lᵀ
            value -= mixture[FACTOR, a, c] * mixture[FACTOR, c, a]
        value = max(value, 1e-12 * diagonal, 1e-100)
        mixture[FACTOR, a, a] = 1.0 / value
        product *= value
        if not 1e-150 < product < 1e150:
            total += math.log(product)
            product = 1.0
    return total + math.log(product)
