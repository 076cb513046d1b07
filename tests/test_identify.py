"""Identification recovers what was planted, from good starts, bad ones and none."""

import numpy as np
import pytest

from tests.conftest import simulated
from tests.test_kernels import X
from wheelpend import Failure, Model, identify

BARE = 'plant = "wheel_pendulum"\n[sensors]\nencoder_counts = 60000\n'


def deviations(result):
    """Errors in standard errors."""
    return np.array([(row["value"] - X[n]) / row["sigma"] for n, row in result.parameters.items()])


def test_shooting_reaches_the_cramer_rao_bound_of_its_own_problem():
    squares = [deviations(identify(Model.default(), [simulated(seed=seed, duration=10.0)])) ** 2 for seed in range(20)]
    assert np.all(np.sqrt(np.mean(squares, axis=0)) < 1.5)


def test_shooting_starts_from_nothing():
    result = identify(Model.parse(BARE), [simulated()])
    assert np.abs(deviations(result)).max() < 4.5
    assert result.error < 1.02 * result.noise_floor


def test_shooting_starts_from_parameters_30_percent_off():
    lines = [f"{n} = {{ nominal = {v * (0.7 if k % 2 else 1.3)} }}" for k, (n, v) in enumerate(X.items())]
    result = identify(Model.parse(BARE + "[parameters]\n" + "\n".join(lines)), [simulated()])
    assert np.abs(deviations(result)).max() < 4.5


def test_shooting_identifies_a_robot_of_another_size():
    small = {"X1": 0.004, "X2": 0.002, "X3": 0.006, "X4": 0.02, "X5": 0.5, "X6": 0.3, "X7": 0.299}
    machine = "[controller]\nkind = 'pid'\ngains = [-40.0, -100.0, -2.0]\n[simulation]\n" + "".join(
        f"{n} = {v}\n" for n, v in small.items()
    )
    from wheelpend import simulate

    result = identify(Model.parse(BARE), [simulate(Model.parse(BARE + machine), command="aggressive", seed=1)])
    assert all(abs(row["value"] - small[n]) < 5 * row["sigma"] for n, row in result.parameters.items())


def test_the_filtered_method_is_exact_on_ideal_data():
    result = identify(Model.default(), [simulated(noise=False)], method="filtered", tau=(0.14, 0.14), test_bias=False)
    assert all(abs(row["value"] / X[n] - 1) < 0.01 for n, row in result.parameters.items())


def test_differentiation_is_badly_biased_on_noisy_data():
    result = identify(Model.default(), [simulated()], method="differentiation", test_bias=False)
    assert abs(result.parameters["X4"]["value"] / X["X4"] - 1) > 0.5


def test_an_unknown_method_lists_the_known_ones():
    with pytest.raises(Failure, match="differentiation, filtered, iv, shooting, recursive, energy"):
        identify(Model.default(), [simulated()], method="shoting")


def test_a_robot_that_stands_still_names_what_its_log_never_excites():
    log = simulated(command="upright", duration=5.0, noise=False)
    still = type(log)("still.csv", log.t, np.full_like(log.voltage, 1e-9), np.zeros_like(log.measured), log.channels)
    with pytest.raises(Failure):
        identify(Model.parse(BARE), [still])
