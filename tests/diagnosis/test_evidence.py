"""Discoveries are confirmed on data that did not make them."""

from types import SimpleNamespace

import numpy as np
from scipy.signal import lfilter

from wheelpend.diagnosis.evidence import confirmation_p_value


def autoregressive(shape, share, seed=0):
    noise = np.random.default_rng(seed).normal(size=shape) * np.sqrt(1 - share**2)
    return lfilter([1.0], [1.0, -share], noise, axis=-1)


def held_out(residual, change):
    part = SimpleNamespace(values=residual.size)
    problem = SimpleNamespace(
        validation=[SimpleNamespace(part=part)], training=[SimpleNamespace(values=2 * residual.size)]
    )
    return confirmation_p_value(problem, [residual], [residual - change])


def test_held_out_data_confirm_an_effect_that_is_there_and_no_other():
    change = 0.3 * autoregressive((1, 1000), 0.98, 1).T
    by_chance = [held_out(autoregressive((1, 1000), 0.8, seed).T, change) for seed in range(10, 410)]
    assert np.mean(np.array(by_chance) < 0.05) < 0.08
    assert held_out(autoregressive((1, 1000), 0.8, 2).T + 3 * change, 3 * change) < 1e-4
    assert held_out(autoregressive((1, 1000), 0.0, 2).T - change, change) > 0.9
