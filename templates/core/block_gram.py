"""Normal equations of the filtered regression, blocks of samples side by side."""

import numpy as np

from templates.core.filters import _filter_sample, filter_weights
from templates.core.frame import (
    BLOCK_SIZE,
    FEATURE,
    FEATURES,
    FREE_DECAY,
    INTERVAL_TOLERANCE,
    LINEAR,
    NQ,
    PARTIAL_SUMS,
    SIGNALS,
    _filter_block,
    compiled,
    internal,
)
from templates.core.gram import _add_feature_products


@compiled
def filtered_gram(t, states, voltage, parameters, tau1, tau2, first_order_hold, memory, gram):
    """Add [φ τ]ᵀ[φ τ] of the filtered rows of samples 1 to N - 1, as of filter_regressor, to gram (n + 1, n + 1), n = len(LINEAR).

    ``memory`` is the filters' at sample 0, as filter_start sets it, and ends at the last: a log may be handed over in
    pieces that share one sample. The square root of the condition of the scaled gram is that of the regressor: above 1e5
    digits are lost that a QR decomposition would keep.
    """
    products, weights = np.zeros((FEATURES, FEATURES, PARTIAL_SUMS)), np.zeros(10)
    lanes, value, tau, phi = np.zeros(FEATURE + FEATURES * BLOCK_SIZE), np.zeros(SIGNALS), np.zeros(NQ), np.zeros((NQ, len(LINEAR)))
    k = 1
    while k < t.size:
        if k + BLOCK_SIZE <= t.size:
            if abs(t[k] - t[k - 1] - weights[9]) > INTERVAL_TOLERANCE * weights[9]:
                weights[9] = t[k] - t[k - 1]
                weights[:9] = filter_weights(weights[9], tau1, tau2)
                _free_decay(weights, lanes)
            ahead, h, uneven = t[k : k + BLOCK_SIZE], weights[9], 0
            for c in range(1, BLOCK_SIZE):
                uneven += abs(ahead[c] - ahead[c - 1] - h) > INTERVAL_TOLERANCE * h
            if uneven == 0:
                _filter_block(k, h, t, states, voltage, parameters, weights, first_order_hold, memory, lanes, products)
                k += BLOCK_SIZE
                continue
        for k in range(k, min(k + BLOCK_SIZE, t.size)):
            _filter_sample(
                k, t, states, voltage, parameters, (tau1, tau2), first_order_hold, states[0], weights, memory, tau, phi
            )
            for row in range(NQ):
                for a in range(len(LINEAR) + 1):
                    for b in range(len(LINEAR) + 1):
                        gram[a, b] += (phi[row, a] if a < len(LINEAR) else tau[row]) * (phi[row, b] if b < len(LINEAR) else tau[row])
        k += 1
    _add_feature_products(products, gram)


@internal
def _free_decay(weights, lanes):
    """Free response of the filters 1, 2, ... samples later: of z1 in z1, of z2 in z2, and of z1 in z2."""
    first, second, coupled = 1.0, 1.0, 0.0
    for c in range(BLOCK_SIZE):
        coupled = weights[1] * coupled + weights[2] * first
        first, second = weights[0] * first, weights[1] * second
        lanes[FREE_DECAY + c], lanes[FREE_DECAY + BLOCK_SIZE + c], lanes[FREE_DECAY + 2 * BLOCK_SIZE + c] = first, second, coupled
