"""The wheel-driven pendulum with yaw: the planar robot is its special case, and Newton's laws hold while it turns."""

import numpy as np
import pytest
import sympy as sp

from derive.functions import symbol
from derive.model import compose
from wheelpend import Model, compare, diagnose, identify
from wheelpend.inspection.inspect import inspect_for_model
from wheelpend.kernels import load as kernels
from wheelpend.logs.log import Log
from wheelpend.logs.read import load_log, save_log

TURNING = {"planar": False}
TEXT = 'plant = "wheel_pendulum"\n[assumptions]\nplanar = false\n[constants]\nR = 0.1\nW = 0.3\n'
X = {"X1": 0.0436, "X2": 0.0178, "X3": 0.1149, "X4": 0.8719, "X5": 4.6701, "X6": 0.7268, "X7": 0.7256,
     "X8": 0.15, "X9": 0.08, "X10": 1.6}  # fmt: skip


def straight() -> dict:
    return {symbol(n): 0 for n in ("psi", "dpsi", "ddpsi")} | {symbol(n): symbol("v_in") for n in ("v_left", "v_right")}


@pytest.mark.parametrize(
    "choices", [{}, {"ground_friction_reaction": "none"}, {"rotor_speed": "world"}, {"rotor_inertia": False}]
)
def test_the_planar_robot_is_the_special_case_of_one_that_turns(choices):
    planar, turning = compose("wheel_pendulum", choices, []), compose("wheel_pendulum", {**choices, **TURNING}, [])
    names = dict(zip(planar.grouping.names, planar.grouping.definitions, strict=True))
    own = dict(zip(turning.grouping.names, turning.grouping.definitions, strict=True))
    assert all(sp.expand(own[n] - d) == 0 for n, d in names.items())  # the same parameters under the same names
    for row, flat in zip(turning.residual, planar.residual, strict=False):
        assert sp.expand(row.subs(straight()) - flat) == 0
    assert turning.residual[2].subs(straight()) == 0


def test_the_turning_robot_obeys_the_published_equations():
    """Kim and Kwon 2017, Int. J. Control Autom. Syst. 15, (1)-(3), in this project's letters."""
    rows = compose("wheel_pendulum", TURNING, []).residual
    q, dq, dpsi = symbol("theta_p"), symbol("dtheta_p"), symbol("dpsi")
    X3, X9 = symbol("X3"), symbol("X9")
    assert rows[0].coeff(dpsi, 2) == -X3 * sp.sin(q)  # the centripetal force of the leaning body
    assert sp.simplify(rows[1].coeff(dpsi, 2) + X9 * sp.sin(2 * q)) == 0
    assert sp.simplify(rows[2].coeff(dpsi).coeff(dq) - 2 * X9 * sp.sin(2 * q)) == 0
    assert rows[2].coeff(dpsi).coeff(symbol("dtheta_w")) == X3 * sp.sin(q)


def parameters(module, values=X):
    known = {**values, "R": 0.1, "W": 0.3}
    return np.array([known.get(n, a) for n, a in zip(module.PARAMETERS, module.ABSENT, strict=True)])


def test_a_robot_that_coasts_without_friction_keeps_its_energy_while_it_turns():
    module = kernels.model_module("wheel_pendulum", TURNING, ())
    free = parameters(module, {**X, "X6": 0.0, "X7": 0.0, "X10": 0.0})
    t = np.arange(0.0, 2.0, 1e-3)
    states = module.simulate(t, np.zeros((len(t), 2)), np.array([0.0, 0.3, 0.0, 1.0, -0.5, 2.0]), free, 5e-4)
    _, q, _, dw, dp, dpsi = states.T
    kinetic = 0.5 * (X["X1"] * dw**2 + X["X2"] * (dw - dp) ** 2 + X["X4"] * dp**2) + X["X3"] * np.cos(q) * dw * dp
    turning = 0.5 * (X["X8"] - X["X9"] * np.cos(2 * q)) * dpsi**2
    energy = kinetic + turning + X["X5"] * np.cos(q)
    assert np.ptp(energy) < 1e-6 * np.abs(energy).max()
    assert np.ptp(dpsi) > 0.5  # it did turn, faster and slower as it leaned


def recorded(seed: int = 1, seconds: float = 12.0, **effects: float) -> Log:
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


def test_the_parameters_of_turning_are_identified_beside_the_others(log):
    found = identify(Model.parse(TEXT), [log])
    for name in ("X3", "X4", "X5", "X8", "X10"):
        row = found.parameters[name]
        assert abs(row["value"] - X[name]) < max(4 * row["sigma"], 0.01 * X[name]), name
    assert found.error == pytest.approx(1.0, abs=0.05)


def test_scrubbing_tyres_are_what_a_robot_that_turns_is_missing():
    found = diagnose(Model.parse(TEXT), [recorded(seconds=8.0, coulomb_turn__torque=0.5)])
    assert found.candidates[0].effect == "coulomb_turn"
    assert found.candidates[0].coefficients["torque"] == pytest.approx(0.5, rel=0.05)


def test_a_log_with_two_voltages_comes_back_as_it_was_saved(log, tmp_path):
    table = Model.parse(TEXT).table
    assert table.required == ("t", "v_left", "v_right", "theta_w", "theta_p", "dtheta_p", "dpsi")
    save_log(tmp_path / "log.csv", log.part(0, 500), table=table)
    read = load_log(tmp_path / "log.csv", table=table)
    np.testing.assert_allclose(read.voltage, log.voltage[:500])
    np.testing.assert_allclose(read.measured, log.measured[:500])


def test_a_log_with_two_voltages_is_looked_over_and_compared(log, tmp_path):
    model = Model.parse(TEXT)
    found = inspect_for_model(model, log)
    assert set(found.channels) == {"v_left", "v_right", "theta_w", "theta_p", "dtheta_p", "dpsi"}
    judged = compare(identify(model, [log]).model, [log])
    assert judged.error == pytest.approx(1.0, abs=0.05) and "dpsi" in judged.fit_percent


def test_a_difference_of_inertias_may_be_negative():
    module = kernels.library_module("wheel_pendulum", TURNING)
    assert module.SIGNED == ("X9",) and kernels.library_module("wheel_pendulum", {}).SIGNED == ()
