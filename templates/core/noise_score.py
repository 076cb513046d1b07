"""Score and information of the filter's likelihood in the sizes and correlation times of its random sources.

Mean and covariance P are differentiated along with the filter, in the logarithms of those that are chosen (k,): sizes of
the m sources (0 to m - 1) and their times (m on). Of P the array by_noise (variables, (variables + 1) k) has halves H,
∂P = H + Hᵀ, of which only one product of a step or a reading is to be taken, k beside each other at each entry; behind
them stands the mean. Where the machine is expanded, and what friction leaves of a slip, is taken as it is: what a size
changes there is of second order.
Source: Gupta and Mehra, Computational aspects of maximum likelihood estimation, IEEE Trans. Automatic Control 19 (1974) 774.
"""

from templates.core.frame import NS, inlined, internal


@internal
def _start_score(noise, chosen, by_noise):
    """Start where the sources have their own rms, and everything else is as unknown whatever that is."""
    by_noise[:] = 0.0
    for a in range(chosen.size):
        j = chosen[a]
        if j < noise.shape[0]:
            by_noise[NS + j, (NS + j) * chosen.size + a] = noise[j, 0] ** 2


@inlined
def _product(transition, width, factor, result):
    """The transition times a matrix (variables, width or more), into another."""
    for i in range(transition.shape[0]):
        for x in range(width):
            result[i, x] = 0.0
        for k in range(transition.shape[0]):
            along = transition[i, k]
            if along != 0.0:
                for x in range(width):
                    result[i, x] += along * factor[k, x]


@internal
def _spread_score(elapsed, noise, chosen, before, force, transition, covariance, by_noise, moved):
    """Take the derivatives over a step: its transition, the covariance and the sources' means before it, these after it."""
    size, count, beside = covariance.shape[0], noise.shape[0], chosen.size
    last = size * beside
    _product(transition, last + beside, by_noise, moved)
    for i in range(size):
        for j in range(size):
            for a in range(beside):
                by_noise[j, i * beside + a] = moved[i, j * beside + a]
    _product(transition, last, by_noise, moved)
    for i in range(size):
        for x in range(last):
            by_noise[i, x] = moved[i, x]
        for a in range(beside):
            by_noise[i, last + a] = moved[i, last + a]
    for a in range(beside):
        j = chosen[a] % count
        own, square = NS + j, noise[j, 0] ** 2
        decay = transition[own, own]
        if chosen[a] < count:
            by_noise[own, own * beside + a] += square * (1.0 - decay**2)
            continue
        slower, share = decay * elapsed / noise[j, 1], noise[j, 1] * (1.0 - decay) / elapsed
        later = (share - decay) / share if noise[j, 2] != 0.0 else 0.0  # of what a sensor's lag takes from the states
        by_noise[own, own * beside + a] -= square * decay * slower
        by_noise[own, last + a] += slower * before[j] + later * (force[j] - decay * before[j])
        for v in range(size):
            along = slower if v == own else later * transition[own, v]
            if along != 0.0:
                for b in range(size):
                    for k in range(size):
                        by_noise[own, b * beside + a] += along * covariance[v, k] * transition[b, k]


@internal
def _learn_score(error, root, by, gain, by_noise, shown, learnt, information, score):
    """Take the derivatives over an update by a reading, and add what it tells to information (k, k) and score (k,).

    error is that of the reading, root its standard deviation.
    """
    size, beside, variance, white = by.size, score.size, root * root, error / root
    last = size * beside
    for x in range(last + beside):
        shown[x] = 0.0
    for k in range(size):
        if by[k] != 0.0:  # a reading shows few of the variables
            for x in range(last + beside):
                shown[x] += by[k] * by_noise[k, x]
            for i in range(size):
                for a in range(beside):
                    shown[i * beside + a] += by[k] * by_noise[i, k * beside + a]
    for a in range(beside):
        learnt[0, a], learnt[1, a] = -shown[last + a], 0.0
        for i in range(size):
            learnt[1, a] += by[i] * shown[i * beside + a]
    for i in range(size):
        for a in range(beside):
            sooner = (shown[i * beside + a] - gain[i] * learnt[1, a]) / variance
            by_noise[i, last + a] += gain[i] * learnt[0, a] + sooner * error
            shown[i * beside + a] -= 0.5 * gain[i] * learnt[1, a]
    for i in range(size):
        for x in range(last):
            by_noise[i, x] -= gain[i] * shown[x]
    for a in range(beside):
        learnt[0, a] /= root
        learnt[1, a] /= variance
        score[a] -= white * learnt[0, a] + 0.5 * (1.0 - white * white) * learnt[1, a]
        for b in range(a + 1):
            information[a, b] += learnt[0, a] * learnt[0, b] + 0.5 * learnt[1, a] * learnt[1, b]
