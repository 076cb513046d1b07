"""A robot that turns, identified, diagnosed and compared."""

import numpy as np
import pytest

from wheelpend import Model, compare, diagnose, identify
from wheelpend.inspection.inspect import inspect_for_model
from wheelpend.kernels import load as kernels
from wheelpend.logs.log import Log

TURNING = {"planar": False}
TEXT = 'plant = "wheel_pendulum"\n[assumptions]\nplanar = false\n[constants]\nR = 0.1\nW = 0.3\n'
X = {"X1": 0.0436, "X2": 0.0178, "X3": 0.1149, "X4": 0.8719, "X5": 4.6701, "X6": 0.7268, "X7": 0.7256,
     "X8": 0.15, "X9": 0.08, "X10": 1.6}  # fmt: skip


def parameters(module, values=X):
    known = {**values, "R": 0.1, "W": 0.3}
    return np.array([known.get(n, a) for n, a in zip(module.PARAMETERS, module.ABSENT, strict=True)])


def recorded(seed: int = 1, seconds: float = 8.0, **effects: float) -> Log:
    """A log of a robot that a controller holds upright and a second one turns, with sensor noise."""
    module = kernels.library_module("wheel_pendulum", TURNING)
    values = parameters(module)
    for name, value in effects.items():
        values[module.PARAMETERS.index(name.replace("__", "."))] = value
    rng, dt = np.random.default_rng(seed), 1e-3
    t = np.arange(round(seconds / dt)) * dt
    lean = np.radians(6.0 * np.sin(1.3 * t) + 4.0 * np.sin(3.1 * t))
    turn = 1.5 * np.sin(0.9 * t) + np.sign(np.sin(1.7 * t))
    state, integral = np.zeros(module.NX), 0.0
    voltage, measured = np.zeros((len(t), 2)), np.zeros((len(t), 4))
    sigma = np.array([1e-4, 2e-3, 5e-3, 5e-3])
    for k in range(len(t)):
        reading = state[[0, 1, 4, 5]] + sigma * rng.normal(size=4)
        error = lean[k] - reading[1]
        integral += error * dt
        both = -168.0 * error - 800.0 * integral + 8.8 * reading[2]
        voltage[k], measured[k] = (both - turn[k], both + turn[k]), reading
        if k + 1 < len(t):
            state = module.simulate(t[k : k + 2], voltage[k : k + 2], state, values, dt)[1]
    return Log("turning", t, voltage, measured, tuple(module.OUTPUTS))


@pytest.fixture(scope="module")
def log():
    return recorded()


@pytest.fixture(scope="module")
def identified(log):
    return identify(Model.parse(TEXT), [log])


@pytest.mark.slow
def test_the_parameters_of_turning_are_identified_beside_the_others(identified):
    for name in ("X3", "X4", "X5", "X8", "X10"):
        row = identified.parameters[name]
        assert abs(row.value - X[name]) < max(4 * row.sigma, 0.01 * X[name]), name
    assert identified.error == pytest.approx(1.0, abs=0.05)


@pytest.mark.slow
def test_scrubbing_tyres_are_what_a_robot_that_turns_is_missing():
    found = diagnose(Model.parse(TEXT), [recorded(coulomb_turn__torque=0.5)])
    assert found.candidates[0].effect == "coulomb_turn"
    assert found.candidates[0].coefficients["torque"] == pytest.approx(0.5, rel=0.05)


@pytest.mark.slow
def test_a_log_with_two_voltages_is_looked_over_and_compared(log, identified):
    found = inspect_for_model(Model.parse(TEXT), log)
    assert set(found.channels) == {"v_left", "v_right", "theta_w", "theta_p", "dtheta_p", "dpsi"}
    judged = compare(identified.model, [log])
    assert judged.error == pytest.approx(1.0, abs=0.05) and "dpsi" in judged.fit_percent
