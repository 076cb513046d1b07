"""Other plants identified from nothing, by every method that fits them."""

from dataclasses import replace

import numpy as np
import pytest

from wheelpend import Model, identify, simulate


def test_a_free_pendulum_is_identified_from_nothing():
    log = simulate(Model.default("pendulum"), command="upright", duration=10.0, seed=4)
    found = identify(Model.parse('plant = "pendulum"\n'), [log])
    assert found.parameters["X1"].value == pytest.approx(0.068, rel=0.002) and found.error < 1.05


@pytest.mark.slow
def test_two_free_links_are_identified_from_nothing():
    text = 'plant = "pendulum"\n[assumptions]\nlinks = 2\n'
    truth = {"X1": 0.15, "X2": 0.03, "X3": 0.03, "X4": 0.3}
    machine = "[simulation]\ntheta_1 = 1.0\ntheta_2 = 0.4\n" + "".join(f"{n} = {v}\n" for n, v in truth.items())
    log = simulate(Model.parse(text + machine), command="upright", duration=6.0, seed=4)
    found = identify(Model.parse(text), [log])
    assert {n: found.parameters[n].value for n in truth} == pytest.approx(truth, rel=0.01)


def test_missing_stretches_do_not_bend_inverse_dynamics():
    model = Model.default("slide")
    log = simulate(model, command="simple", duration=8.0, noise=False)
    whole = identify(model, [log], method="inverse")
    measured = log.measured.copy()
    measured[3000:3700] = np.nan
    cut = identify(model, [replace(log, measured=measured)], method="inverse")
    assert cut.parameters["X1"].value == pytest.approx(whole.parameters["X1"].value, rel=0.01)


def test_the_regression_of_a_free_pendulum_takes_gravity_for_the_left_side():
    model = Model.default("pendulum")
    log = simulate(model, command="upright", duration=8.0, noise=False)
    for method, tau in (("inverse", None), ("filtered", (0.1, 0.2))):
        found = identify(model, [log], method=method, tau=tau, test_bias=False)
        assert found.parameters["X1"].value == pytest.approx(0.068, rel=0.002), method


def test_every_method_that_needs_no_controller_identifies_a_plant_with_a_single_parameter():
    model = Model.default("slide")
    log = simulate(model, command="simple", duration=6.0, seed=3)
    for method in ("shooting", "filtered", "differentiation", "energy", "recursive", "inverse"):
        tau = (0.1, 0.2) if method in ("filtered", "recursive") else None
        found = identify(model, [log], method=method, tau=tau)
        assert found.parameters["X1"].value > 0.0, method
