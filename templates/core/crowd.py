"""A batch of machines, a crowd of them side by side."""

import math

import numpy as np

from templates.core.frame import CROWD, CROWD_ROWS, GAINS, INTEGRAL, NOW, NP, NX, _control, _crowd_step, compiled


@compiled
def closed_loop_batch(t, reference, reference_rate, gains, states, parameters, max_step, every, record):
    """Many machines under their PID controllers, as in closed_loop without noise.

    gains (B, 3), initial states (B, NX), which become the final ones, and parameters (B, NP) of each; record
    (ceil(N / every), NX + 1, B) receives states and voltage at every so many samples.
    The machines of a crowd take each stage of a step side by side: one instruction advances several of them.
    """
    lanes = np.zeros((CROWD_ROWS + NP) * CROWD)
    for first in range(0, states.shape[0], CROWD):
        count = min(CROWD, states.shape[0] - first)
        for c in range(CROWD):
            b = first + min(c, count - 1)  # the last one fills the crowd up
            lanes[INTEGRAL * CROWD + c] = 0.0
            for i in range(NX):
                lanes[(NOW + i) * CROWD + c] = states[b, i]
            for i in range(3):
                lanes[(GAINS + i) * CROWD + c] = gains[b, i]
            for i in range(NP):
                lanes[(CROWD_ROWS + i) * CROWD + c] = parameters[b, i]
        for k in range(t.size):
            _control(t[k], t[k] - t[max(k - 1, 0)], reference[k], reference_rate[k], lanes)
            if k % every == 0:
                for i in range(NX + 1):  # the voltage stands behind the states
                    for c in range(count):
                        record[k // every, i, first + c] = lanes[(NOW + i) * CROWD + c]
            if k + 1 < t.size:
                steps = max(1, int(math.ceil((t[k + 1] - t[k]) / max_step - 1e-6)))
                h = (t[k + 1] - t[k]) / steps
                for step in range(steps):
                    _crowd_step(t[k] + step * h, h, lanes)
        for c in range(count):
            for i in range(NX):
                states[first + c, i] = lanes[(NOW + i) * CROWD + c]
