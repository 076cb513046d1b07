"""What one reading tells of the parameters: recursive prediction errors, which is Gauss-Newton one reading at a time."""

import math

from templates.core.frame import NS, compiled, inlined


@inlined
def _learn_parameters(
    error, root, row, columns, learnt, least, parameters, now, sens, force, force_by, crossed
):
    """Move parameters (n,) by the error of a reading and its derivatives row (n,) in them, and their covariance learnt (n, n).

    root is the standard deviation of that error by the filter. State and sources move on to where the filter of the new
    parameters would have them, to first order: without that, a start far off is never forgiven.
    Source: Ljung and Söderström, Theory and Practice of Recursive Identification (1983), section 3.4.
    """
    n, first = columns.size, sens.shape[1] - columns.size
    total = root * root
    for a in range(n):
        crossed[a] = 0.0
        for b in range(n):
            crossed[a] += learnt[a, b] * row[b]
        total += crossed[a] * row[a]
    for a in range(n):
        before = parameters[columns[a]]
        parameters[columns[a]] = max(before + crossed[a] / total * error, least[a])
        moved = parameters[columns[a]] - before
        for i in range(NS):
            now[i] += sens[i, first + a] * moved
        for j in range(force.size):
            force[j] += force_by[j, a] * moved
        for b in range(a + 1):
            learnt[a, b] = learnt[b, a] = learnt[a, b] - crossed[a] * crossed[b] / total


@compiled
def adapt_filter(t, period, forgetting, doubt, learnt, force, force_by, covariance, noise):
    """After the readings at a time t [s] since the start: forget a little, and take the random sources to be as large as they show.

    A filter of wrong parameters is right about its readings only where it leaves room for a force. So the rms of each source in noise (m, 3)
    follows the mean square of what is known of it over 0.02 s, expectation maximisation one sample at a time: it begins large, which
    keeps what wrong parameters seem to tell from weighing much, and ends as large as what nobody modelled. Of what the readings leave
    open a twentieth is taken not to be there, since expectation maximisation finds it out but slowly. What was learnt
    about the first parameters is forgotten within 0.4 s, later less and less; forgetting is how much older samples count then, 1 or less.
    Nothing is forgotten while a variance in learnt (n, n) would exceed its first, doubt (n,).
    Source: Ljung and Söderström, Theory and Practice of Recursive Identification (1983), section 5.6, on forgetting that fades; Dempster,
    Laird and Rubin, Journal of the Royal Statistical Society B 39 (1977) 1, on expectation maximisation.
    """
    n, first = learnt.shape[0], covariance.shape[0] - force.size
    kept = forgetting * (1.0 - period / max(0.4, 40.0 * period) * math.exp(-t / 3.0))
    for a in range(n):
        if learnt[a, a] > kept * doubt[a]:
            kept = 1.0
    for a in range(n):
        for b in range(n):
            learnt[a, b] /= kept
    share = period / max(0.02, 3.0 * period)
    for j in range(force.size):
        square = force[j] ** 2 + 0.95 * covariance[first + j, first + j]
        for a in range(n):
            for b in range(n):
                square += force_by[j, a] * learnt[a, b] * force_by[j, b]
        noise[j, 0] = max(math.sqrt(noise[j, 0] ** 2 + share * (square - noise[j, 0] ** 2)), 1e-6)
