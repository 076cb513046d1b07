"""Normal equations of the filtered regression, sample by sample."""

import numpy as np

from templates.core.filters import _filter_sample
from templates.core.frame import (
    BLOCK_SIZE,
    FEATURE,
    FEATURES,
    LINEAR,
    MIXING,
    NQ,
    PARTIAL_SUMS,
    SIGNALS,
    compiled,
    internal,
)


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
def _add_feature_products(products, gram):
    """Add the products of the features, summed over their lanes, to the Gram matrix of [φ τ]."""
    for a in range(FEATURES):
        for b in range(a + 1):
            total = products[a, b].sum()
            for row in range(NQ):
                for i in range(len(LINEAR) + 1):
                    for j in range(len(LINEAR) + 1):
                        weight = MIXING[row, i, a] * MIXING[row, j, b]
                        if a != b:
                            weight += MIXING[row, i, b] * MIXING[row, j, a]
                        gram[i, j] += weight * total
