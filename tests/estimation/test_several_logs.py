"""Several logs: one machine, with an initial state and a bias for every log."""

from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest

from wheelpend import Model, identify, simulate
from wheelpend.estimation.data import prepare
from wheelpend.estimation.parameters import FreeParameter, ParameterLayout
from wheelpend.estimation.tied_amplitudes import TiedAmplitudes


@lru_cache
def log(seed, **hide):
    """6 s at 500 Hz; effects are hidden as effect__parameter=value."""
    hidden = {name.replace("__", "."): value for name, value in hide.items()}
    made = simulate(Model.default(), duration=6.0, hide=hidden, seed=seed, sample=0.002)
    return replace(made, name=f"log {seed}")


def logs(parameter, sizes):
    return [log(seed, **{parameter: size}) for seed, size in enumerate(sizes, 1)]


@pytest.mark.slow
def test_two_logs_are_identified_with_one_machine_and_two_biases():
    model = Model.default().with_effects(["imu_bias"])
    found = identify(model, logs("imu_bias__bias", (0.02, -0.01)))
    assert [r.value for r in found.parameters["imu_bias.bias"].per_log] == pytest.approx([0.02, -0.01], abs=6e-4)
    assert not found.parameters["X1"].per_log
    assert found.parameters["X5"].value == pytest.approx(4.6701, rel=0.005)


def test_pairs_that_are_tied_move_with_equal_amplitudes_only():
    plan = ParameterLayout.of(
        [FreeParameter("X1"), *(FreeParameter(n, scope="per log") for n in ("e.sine", "e.cosine"))], 3
    )
    tied = TiedAmplitudes.of(plan.elements, [("e.sine", "e.cosine")])
    theta = tied.with_equal_amplitudes(np.array([5.0, 1.0, 0.0, 0.0, 2.0, -1.0, 1.0]))
    lengths = [np.hypot(*theta[p]) for p in tied.pairs[0]]
    assert lengths == pytest.approx([lengths[0]] * 3)
    small = 1e-6 * np.random.default_rng(0).normal(size=tied.basis(theta).shape[1])
    assert tied.after_step(theta, small) - theta == pytest.approx(tied.basis(theta) @ small, abs=1e-11)


def test_a_held_out_log_has_a_first_third_of_its_own():
    first, second, third = logs("slope__angle", (0.02, -0.015, 0.01))
    problem = prepare(Model.default(), [first, second], [third])
    assert problem.data.validation[0].calibration.bounds.max() <= problem.data.validation[0].part.bounds.min()
    assert problem.data.validation[0].calibration.bounds.max() == pytest.approx(len(third) / 3, abs=250)
