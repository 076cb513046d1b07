"""What one reading tells of the parameters: recursive prediction errors, which is Gauss-Newton one reading at a time."""

from templates.core.frame import NS, inlined


@inlined
def _learn_parameters(
    error, root, row, columns, learnt, forgetting, least, parameters, now, sens, force, force_by, crossed
):
    """Move parameters (n,) by the error of a reading and its derivatives row (n,) in them, and their covariance learnt (n, n).

    root is the standard deviation of that error by the filter. State and sources move on to where the filter of the new
    parameters would have them, to first order: without that, a start far off is never forgiven.
    Source: Ljung and Söderström, Theory and Practice of Recursive Identification (1983), section 3.4.
    """
    n, first = columns.size, sens.shape[1] - columns.size
    total = forgetting * root * root
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
            learnt[a, b] = learnt[b, a] = (learnt[a, b] - crossed[a] * crossed[b] / total) / forgetting
