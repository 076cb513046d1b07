"""What makes the kernels fast must not cost digits."""

import mpmath as mp
import numpy as np
import pytest

from tests.support import X, simulated
from wheelpend.estimation import least_squares
from wheelpend.estimation.parameters import kernel_parameters

PARAMETERS = np.array(list(X.values()))
MACHINES = 70  # more than are advanced side by side


def exact_steps(state, voltage, h):
    """The classical Runge-Kutta method on the paper's equations (19), (20), typed by hand, in 50 digits."""
    x1, x2, x3, x4, x5, x6, x7 = map(mp.mpf, map(float, PARAMETERS))

    def slope(s, v):
        sine, cosine = mp.sin(s[1]), mp.cos(s[1])
        drive = v - x6 * s[2] + x7 * s[3]
        a, b, d = x1 + x2, x3 * cosine - x2, x2 + x4
        f, g = drive + x3 * s[3] ** 2 * sine, -drive + x5 * sine
        return [s[2], s[3], (d * f - b * g) / (a * d - b * b), (a * g - b * f) / (a * d - b * b)]

    now, path = [mp.mpf(float(x)) for x in state], [[float(x) for x in state]]
    for v in voltage:
        v, h = mp.mpf(float(v)), mp.mpf(h)
        one = slope(now, v)
        two = slope([x + h / 2 * k for x, k in zip(now, one, strict=True)], v)
        three = slope([x + h / 2 * k for x, k in zip(now, two, strict=True)], v)
        four = slope([x + h * k for x, k in zip(now, three, strict=True)], v)
        now = [x + h / 6 * (a + 2 * b + 2 * c + d) for x, a, b, c, d in zip(now, one, two, three, four, strict=True)]
        path.append([float(x) for x in now])
    return np.array(path)


@pytest.mark.parametrize("speed", [0.5, 300.0])  # the second turns the body by 0.3 rad a step, beyond the short series
def test_a_step_is_right_to_the_last_digits_of_a_50_digit_one(lean, speed):
    h, count = 2.0**-10, 40
    t, voltage = np.arange(count + 1) * h, np.sin(np.arange(count + 1.0))
    start = np.array([0.3, 0.2, 1.0, speed])
    with mp.workdps(50):
        exact = exact_steps(start, voltage[:-1], h)
    got = lean.simulate(t, voltage, start, PARAMETERS, h)
    scale = np.abs(exact).max(axis=0)
    assert np.all(np.abs(got - exact) <= 2e-13 * scale)


def test_many_machines_side_by_side_go_as_each_alone(lean):
    t = np.arange(301) * 1e-3
    rng = np.random.default_rng(3)
    parameters = PARAMETERS * (1.0 + 0.05 * rng.normal(size=(MACHINES, 7)))
    begin = rng.normal(size=(MACHINES, 4)) * [1.0, 0.05, 0.5, 0.1]
    begin[5, 3] = 200.0  # one that turns fast takes all beside it the long way
    gains = np.tile([-168.0, -800.0, -8.8], (MACHINES, 1)) * rng.uniform(0.9, 1.1, size=(MACHINES, 1))
    reference, rate = 0.05 * np.sin(3 * t), 0.15 * np.cos(3 * t)
    every, record, states = 50, np.zeros((7, 5, MACHINES)), begin.copy()
    lean.closed_loop_batch(t, reference, rate, gains, states, parameters, 1e-3, every, record)
    noise, quantum = np.zeros((t.size, 3)), np.zeros(3)
    for machine in (0, 5, 63, 64, MACHINES - 1):
        path, _, voltage = lean.closed_loop(
            t, reference, rate, gains[machine], begin[machine], parameters[machine], noise, quantum, 1e-3
        )
        assert record[:, :4, machine] == pytest.approx(path[::every], rel=1e-10, abs=1e-12)
        assert record[:, 4, machine] == pytest.approx(voltage[::every], rel=1e-10, abs=1e-12)
        assert states[machine] == pytest.approx(path[-1], rel=1e-10, abs=1e-12)


def test_the_gram_of_blocks_is_that_of_the_rows(lean):
    log = simulated(duration=3.0)
    states = least_squares.measured_states(lean, log)
    parameters, own = kernel_parameters(lean, X, log), (0.14, 0.18, True)
    sides, phi = lean.filter_regressor(log.t, states, log.voltage, parameters, *own, states[0])
    rows = np.concatenate([phi, sides[:, :, None]], axis=2).reshape(-1, 8)
    gram, memory = np.zeros((8, 8)), lean.filter_memory()
    lean.filter_start(0.0, states[0], log.voltage[0], parameters, lean.filter_weights(log.dt, *own[:2]), memory)
    for a, b in ((0, 1000), (999, 1500), (1499, len(log))):  # pieces that share a sample
        lean.filtered_gram(log.t[a:b], states[a:b], log.voltage[a:b], parameters, *own, memory, gram)
    scale = np.sqrt(np.outer(np.diag(gram), np.diag(gram)))
    assert np.abs(gram - rows.T @ rows).max() < 1e-9 * scale.max()
    assert np.all(np.abs(gram - rows.T @ rows) < 1e-9 * scale)


def test_only_contraction_is_allowed_to_change_the_order_of_arithmetic(lean, library):
    assert lean.options["fastmath"] == library.options["fastmath"] == {"contract"}
