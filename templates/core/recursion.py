"""Recursive least squares, one update in loops and a whole log in constant memory."""

import numpy as np

from templates.core.filters import _filter_sample, filter_memory
from templates.core.frame import LINEAR, NQ, compiled


@compiled
def recursive_update(estimate, covariance, phi, tau, forgetting):
    """One recursive least-squares update in place: estimate (n,), covariance (n, n), one row phi (n,), its left side tau.

    n is len(LINEAR); sizes are not checked.
    """
    n = estimate.size
    gain = np.empty(n)
    spread, error = forgetting, tau
    for i in range(n):
        gain[i] = 0.0
        for j in range(n):
            gain[i] += covariance[i, j] * phi[j]
        spread += phi[i] * gain[i]
        error -= phi[i] * estimate[i]
    for i in range(n):
        estimate[i] += gain[i] / spread * error
        for j in range(i + 1):
            covariance[i, j] = (covariance[i, j] - gain[i] * gain[j] / spread) / forgetting
            covariance[j, i] = covariance[i, j]


@compiled
def recursive_identification(
    t, states, voltage, parameters, tau1, tau2, first_order_hold, start, first, forgetting, estimate, covariance, track
):
    """Recursive least squares over a log in constant memory, in place; the mean square of the left side's innovations.

    estimate (n,) and covariance (n, n) start as the caller sets them and are updated from sample ``first`` on, when the
    filters have forgotten their start; ``forgetting`` applies once a sample. The estimate is noted in track (M, n) at M
    samples spread evenly over the log.
    """
    tau, phi, squares, noted = np.zeros(NQ), np.zeros((NQ, len(LINEAR))), 0.0, 0
    weights, memory, times = np.zeros(10), filter_memory(), (tau1, tau2)
    for k in range(t.size):
        _filter_sample(k, t, states, voltage, parameters, times, first_order_hold, start, weights, memory, tau, phi)
        for row in range(NQ if k >= first else 0):
            error = tau[row]
            for i in range(estimate.size):
                error -= phi[row, i] * estimate[i]
            squares += error * error
            recursive_update(estimate, covariance, phi[row], tau[row], forgetting if row == 0 else 1.0)
        while noted < len(track) and (noted + 1) * t.size <= (k + 1) * len(track):
            track[noted] = estimate
            noted += 1
    return squares / (max(t.size - first, 1) * NQ)
