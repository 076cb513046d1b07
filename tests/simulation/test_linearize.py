"""The model linearised at rest, against the paper's equations and against its own simulation."""

import math
import sys
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.linalg import expm

from tests.support import CONSTANTS, X
from wheelpend import Failure, Model, linearize
from wheelpend.kernels.load import model_module

ROBOT = Model.default().with_fit({n: (v, None) for n, v in X.items()})


def with_effects(**sizes) -> Model:
    """The robot with effects of given sizes, by effect__parameter."""
    values = {name.replace("__", "."): size for name, size in sizes.items()}
    model = ROBOT.with_effects(sorted({name.partition(".")[0] for name in values}))
    return model.with_fit({name: (size, None) for name, size in values.items()})


@pytest.fixture(scope="module")
def robot():
    return linearize(ROBOT)


def test_gravity_and_voltage_act_as_the_papers_equations_say(robot):
    mass = np.array([[X["X1"] + X["X2"], X["X3"] - X["X2"]], [X["X3"] - X["X2"], X["X2"] + X["X4"]]])
    gravity = np.array([[0.0, 0.0], [0.0, X["X5"]]])
    np.testing.assert_allclose(robot.A[2:, :2], np.linalg.solve(mass, gravity), rtol=1e-8, atol=1e-9)
    np.testing.assert_allclose(robot.B[2:, 0], np.linalg.solve(mass, [1.0, -1.0]), rtol=1e-8)
    np.testing.assert_array_equal(robot.A[:2], np.eye(4)[2:])
    np.testing.assert_array_equal(robot.B[:2], 0.0)


def test_near_rest_the_simulation_is_that_of_the_matrices(robot):
    module = model_module(ROBOT.plant, ROBOT.assumptions, ())
    parameters = np.array([{**CONSTANTS, **X}.get(n, a) for n, a in zip(module.PARAMETERS, module.ABSENT, strict=True)])
    state, voltage, t = np.array([0.0, 1e-4, 2e-4, -1e-4]), 1e-4, np.linspace(0.0, 0.3, 301)
    simulated = module.simulate(t, np.full(t.size, voltage), state, parameters, 1e-3)[-1]
    whole = expm(np.block([[robot.A, robot.B], [np.zeros((1, 5))]]) * 0.3)
    np.testing.assert_allclose(simulated, whole[:4] @ [*state, voltage], rtol=1e-5, atol=1e-10)


def test_readings_are_those_of_the_sensors(robot):
    assert robot.outputs == ("theta_w", "theta_p", "dtheta_p")
    np.testing.assert_allclose(robot.C, [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 0, 1]], atol=1e-10)
    scaled = linearize(with_effects(gyro_scale__scale=0.05))
    assert scaled.C[2, 3] == pytest.approx(1.05, rel=1e-9)
    assert not robot.D.any() and robot.D.shape == (3, 1)


def test_a_voltage_offset_is_balanced_by_the_voltage_at_rest():
    shifted = linearize(with_effects(voltage_offset__offset=0.2))
    assert shifted.rest_input == pytest.approx([-0.2])
    assert shifted.rest_state == pytest.approx(np.zeros(4), abs=1e-9)


def test_smooth_effects_are_in_the_matrices_and_dry_friction_is_not(robot):
    rubbed = linearize(with_effects(coulomb_drive__torque=0.3))
    assert rubbed.left_out == ("coulomb_drive",)
    np.testing.assert_allclose(rubbed.A, robot.A, rtol=1e-8, atol=1e-9)
    assert "without coulomb_drive" in repr(rubbed)
    dragged = linearize(with_effects(tether_spring__stiffness=0.5))
    assert dragged.left_out == () and abs(dragged.A[2, 0]) > 0.1


def test_a_pendulum_has_two_rests():
    model = Model.default("pendulum")
    (angle,) = linearize(model).states[:1]
    down, up = (linearize(model, near={angle: a}) for a in (0.1, 3.0))
    assert down.rest_state[0] == pytest.approx(0.0, abs=1e-6)
    assert up.rest_state[0] == pytest.approx(math.pi, abs=1e-6)
    assert np.linalg.eigvals(down.A).real.max() < 1e-6 < 1.0 < np.linalg.eigvals(up.A).real.max()


def test_what_cannot_be_linearised_is_refused_in_words():
    with pytest.raises(Failure, match="must have a value to linearise"):
        linearize(Model.parse('plant = "wheel_pendulum"\n[sensors]\nencoder_counts = 60000\n'))
    with pytest.raises(Failure, match=r"not 'theta_q'\. Did you mean 'theta_"):
        linearize(ROBOT, near={"theta_q": 0.1})
    with pytest.raises(Failure, match="v_in does not: it is in a dead zone"):
        linearize(with_effects(voltage_dead_zone__threshold=0.5))


def test_the_frame_is_the_matrices_side_by_side(robot):
    frame = robot.to_frame()
    assert frame.columns == ["rate of", *robot.states, "v_in"]
    np.testing.assert_array_equal(frame.drop("rate of").to_numpy(), np.hstack([robot.A, robot.B]))


def test_python_control_gets_matrices_and_names(robot, monkeypatch):
    monkeypatch.setitem(sys.modules, "control", SimpleNamespace(ss=lambda *matrices, **names: (matrices, names)))
    matrices, names = robot.to_control()
    for given, own in zip(matrices, (robot.A, robot.B, robot.C, robot.D), strict=True):
        np.testing.assert_array_equal(given, own)
    assert names == {"states": list(robot.states), "inputs": ["v_in"], "outputs": list(robot.outputs)}


def test_without_python_control_the_cure_is_named(robot, monkeypatch):
    monkeypatch.setitem(sys.modules, "control", None)
    with pytest.raises(Failure, match="pip install control"):
        robot.to_control()
