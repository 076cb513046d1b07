"""Hidden effects found on other plants."""

import numpy as np
import pytest

from wheelpend import Model, diagnose, explain, simulate


def test_friction_hidden_in_a_free_pendulum_is_found_and_sized():
    log = simulate(Model.default("pendulum"), command="upright", duration=12.0, hide={"coulomb_drive": 0.03}, seed=2)
    assert log.channels == ("theta_1",) and not log.voltage.any()
    found = explain(Model.default("pendulum"), [log])
    assert found.steps[0].effect == "coulomb_drive" and found.error < 1.05
    assert found.parameters["coulomb_drive.torque"].value == pytest.approx(0.03, rel=0.05)
    assert found.parameters["X1"].value == pytest.approx(0.068, rel=0.01)


def test_ripples_along_a_length_are_looked_for_in_its_own_measure():
    model = Model.default("slide")
    log = simulate(model, command="simple", duration=10.0, seed=2,
                   hide={"cogging.sine": 2.0, "cogging.cosine": 0.0, "cogging.periods": 300.0})  # fmt: skip
    found = diagnose(model, [log])
    assert found.candidates[0].effect == "cogging"
    assert found.candidates[0].coefficients["periods"] == pytest.approx(300.0, rel=0.001)


def test_a_log_at_constant_speeds_says_that_it_does_not_determine_the_mass():
    """Behind an infinite mass nothing is missing, whatever drives it: the verdict alone would be taken for praise."""
    step = np.arange(270) * 0.005
    t = np.concatenate([step, step + 2.35])
    x = np.concatenate([0.44 * step - 0.3, 0.3 - 0.46 * step])
    x += 1e-4 * np.random.default_rng(3).normal(size=t.size)
    log = {"t": t, "v_in": np.repeat([9.0, -9.0], 270), "x": x}
    model = Model.parse('plant = "slide"\n')
    found, ladder = diagnose(model, log), explain(model, log)
    for result in (found, ladder):
        assert any("do not determine" in w and "X1 = " in w for w in result.warnings), result.warnings
