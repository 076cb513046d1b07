"""A batch of machines in closed loop, BATCH_SIZE of them side by side."""

import math

import numpy as np

from templates.core.frame import (
    BATCH_ROWS,
    BATCH_SIZE,
    GAINS,
    INTEGRAL,
    NP,
    NX,
    STATE_ROW,
    _batch_step,
    _control,
    compiled,
)


@compiled
def closed_loop_batch(t, reference, reference_rate, gains, states, parameters, max_step, every, record):
    """Many machines under their PID controllers, as in closed_loop without noise.

    gains (B, 3), initial states (B, NX), which become the final ones, and parameters (B, NP) of each; record
    (ceil(N / every), NX + 1, B) receives states and voltage at every so many samples.
    BATCH_SIZE machines take each stage of a step side by side: one instruction advances several of them.
    """
    lanes = np.zeros((BATCH_ROWS + NP) * BATCH_SIZE)
    for first in range(0, states.shape[0], BATCH_SIZE):
        count = min(BATCH_SIZE, states.shape[0] - first)
        for c in range(BATCH_SIZE):
            b = first + min(c, count - 1)  # the last one fills the rows up
            lanes[INTEGRAL * BATCH_SIZE + c] = 0.0
            for i in range(NX):
                lanes[(STATE_ROW + i) * BATCH_SIZE + c] = states[b, i]
            for i in range(3):
                lanes[(GAINS + i) * BATCH_SIZE + c] = gains[b, i]
            for i in range(NP):
                lanes[(BATCH_ROWS + i) * BATCH_SIZE + c] = parameters[b, i]
        for k in range(t.size):
            _control(t[k], t[k] - t[max(k - 1, 0)], reference[k], reference_rate[k], lanes)
            if k % every == 0:
                for i in range(NX + 1):  # the voltage stands behind the states
                    for c in range(count):
                        record[k // every, i, first + c] = lanes[(STATE_ROW + i) * BATCH_SIZE + c]
            if k + 1 < t.size:
                steps = max(1, int(math.ceil((t[k + 1] - t[k]) / max_step - 1e-6)))
                h = (t[k + 1] - t[k]) / steps
                for step in range(steps):
                    _batch_step(t[k] + step * h, h, lanes)
        for c in range(count):
            for i in range(NX):
                states[first + c, i] = lanes[(STATE_ROW + i) * BATCH_SIZE + c]
