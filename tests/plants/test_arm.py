"""A pendulum of two links with a motor at each joint, against equations written by hand from the textbooks.

Spong, Hutchinson, Vidyasagar: Robot Modeling and Control, in angles of the joints: the second one against the first
link. Nothing of this project's derivation is in it.
"""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from wheelpend import Log, Model, explain, identify
from wheelpend.kernels import load as kernels

G = 9.81
M1, M2, L1, A1, A2, J1, J2, ALPHA = 0.9, 0.6, 0.3, 0.16, 0.11, 0.008, 0.004, 0.5  # kg, m, kg m², N m/V
DAMPING = (0.03, 0.02)  # N m s/rad, at the joints


def joint_torques(t):
    """Torques of both motors [N m]; smooth, so that an integrator may take any step."""
    return np.array([1.1 * np.sin(2.1 * t) + 0.3, 0.4 * np.cos(3.3 * t)])


def arm(t, y, torque=joint_torques, damping=DAMPING):
    """States (q1, q2, dq1, dq2) of the joints and their rates."""
    q1, q2, d1, d2 = y
    h = M2 * L1 * A2 * np.sin(q2)
    inner = M2 * (A2**2 + L1 * A2 * np.cos(q2)) + J2
    mass = np.array([
        [M1 * A1**2 + M2 * (L1**2 + A2**2 + 2 * L1 * A2 * np.cos(q2)) + J1 + J2, inner],
        [inner, M2 * A2**2 + J2],
    ])  # fmt: skip
    coriolis = np.array([-h * (2 * d1 * d2 + d2**2), h * d1**2])
    far = M2 * A2 * G * np.sin(q1 + q2)
    gravity = np.array([(M1 * A1 + M2 * L1) * G * np.sin(q1) + far, far])
    force = torque(t) - np.array(damping) * [d1, d2] - coriolis - gravity
    return np.array([d1, d2, *np.linalg.solve(mass, force)])


def joint_energy(y):
    q1, q2, d1, d2 = y
    kinetic = (M1 * A1**2 + J1 + M2 * L1**2) * d1**2 / 2 + (M2 * A2**2 + J2) * (d1 + d2) ** 2 / 2
    kinetic += M2 * L1 * A2 * np.cos(q2) * d1 * (d1 + d2)
    return kinetic - (M1 * A1 + M2 * L1) * G * np.cos(q1) - M2 * A2 * G * np.cos(q1 + q2)


def values(driven, damping=DAMPING):
    """X1, X2, ... as docs/plants.md states them."""
    first, second = ({True: (1, 0), "second": (0, 1), "both": (1, 1)}[driven]) * np.array(damping) / ALPHA
    own = [M1 * A1**2 + J1 + M2 * L1**2, M2 * L1 * A2, M2 * A2**2 + J2, (M1 * A1 + M2 * L1) * G, M2 * A2 * G]
    rates = {True: [first], "second": [second], "both": [first + second, second]}[driven]
    return dict(zip([f"X{k}" for k in range(1, 8)], [*(v / ALPHA for v in own), *rates], strict=False))


def module_and_parameters(driven, damping=DAMPING):
    module = kernels.model_module("pendulum", {"links": 2, "driven": driven}, ())
    known = values(driven, damping)
    return module, np.array([known[n] for n in module.PARAMETERS])


def against_vertical(y):
    """Our coordinates of the same motion: both angles against the vertical."""
    return np.array([y[0], y[0] + y[1], y[2], y[2] + y[3]])


ARM_MODEL = Model.parse('plant = "pendulum"\n[assumptions]\nlinks = 2\ndriven = "both"\n[constants]\nalpha = 0.5\n')


def arm_log(hidden, seed=5):
    """A log of 20 s in which each motor has a voltage of its own."""
    module = kernels.model_module("pendulum", {"links": 2, "driven": "both"}, ("coulomb_drive", "coulomb_joint"))
    known, random = {**values("both"), **hidden}, np.random.default_rng(seed)
    parameters = np.array([known.get(n, 0.0) for n in module.PARAMETERS])
    t, steps = np.arange(0.0, 20.0, 0.005), np.arange(0.0, 20.3, 0.2)
    volts = np.column_stack([np.interp(t, steps, random.normal(size=len(steps)) * s) for s in (4.0, 1.5)])
    states = module.simulate(t, volts, np.zeros(4), parameters, 1e-3)
    measured = states @ module.OUTPUT_MATRIX.T + random.normal(size=(len(t), 2)) * 5e-4
    return Log("arm.csv", t, volts, measured, tuple(module.OUTPUTS), range_channel="")


def in_joints(states):
    """States (4, N) in the joints' angles, of ours (N, 4)."""
    a, b, da, db = states.T
    return np.array([a, b - a, da, db - da])


@pytest.mark.parametrize(("driven", "acting"), [(True, [1, 0]), ("second", [0, 1]), ("both", [1, 1])])
def test_an_arm_accelerates_as_the_textbook_says_under_torques_at_its_joints(driven, acting):
    module, parameters = module_and_parameters(driven)
    assert {True: ("v_in",), "second": ("v_in_2",), "both": ("v_in", "v_in_2")}[driven] == module.INPUTS
    for y in np.random.default_rng(3).normal(size=(20, 4)):
        torque = np.array([0.7, -0.4]) * acting
        expected = arm(0.0, y, lambda t: torque, np.array(DAMPING) * acting)[2:]  # noqa: B023
        volts = torque[np.array(acting, bool)] / ALPHA
        found = module.acceleration(0.0, against_vertical(y), volts if driven == "both" else volts[0], parameters)
        np.testing.assert_allclose(found, [expected[0], expected.sum()], rtol=1e-9)


def test_an_arm_driven_at_both_joints_moves_as_another_integrator_says():
    module, parameters = module_and_parameters("both")
    t, start = np.arange(0.0, 0.6, 5e-4), np.array([0.4, -0.3, 0.2, 0.0])
    held = joint_torques(t).T / ALPHA  # each value is held until the next sample

    def torque(now):
        return held[min(int(now / 5e-4 + 1e-9), len(t) - 1)] * ALPHA

    ours = module.simulate(t, held, against_vertical(start), parameters, 5e-4)
    theirs = np.empty_like(ours)
    theirs[0], y = against_vertical(start), start
    for k in range(len(t) - 1):
        middle = 0.5 * (t[k] + t[k + 1])
        y = solve_ivp(lambda _, x: arm(middle, x, torque), (t[k], t[k + 1]), y, rtol=1e-9, atol=1e-11).y[:, -1]  # noqa: B023
        theirs[k + 1] = against_vertical(y)
    np.testing.assert_allclose(ours, theirs, atol=1e-7)
    assert np.ptp(ours[:, 1]) > 0.3


def test_the_energy_of_an_arm_changes_by_the_work_of_its_motors_alone():
    module, parameters = module_and_parameters("both", (0.0, 0.0))
    t = np.arange(0.0, 2.0, 2e-4)
    driven, coasting = (
        module.simulate(t, volts, np.array([1.4, 0.1, 0.0, 0.0]), parameters, 2e-4)
        for volts in (joint_torques(t).T / ALPHA, np.zeros((len(t), 2)))
    )
    joints = in_joints(driven)
    turned = np.diff(joints[:2], axis=1)
    work = np.cumsum((joint_torques(t)[:, :-1] * turned).sum(axis=0))
    gained = joint_energy(joints)[1:] - joint_energy(joints)[0]
    np.testing.assert_allclose(gained, work, atol=1e-6)
    assert np.ptp(work) > 0.1
    assert np.ptp(joint_energy(in_joints(coasting))) < 1e-8


def test_dry_friction_at_either_joint_of_a_driven_arm_has_its_own_name():
    effects = ("coulomb_drive", "coulomb_joint", "stribeck_joint", "load_friction_joint")
    module = kernels.model_module("pendulum", {"links": 2, "driven": "both"}, effects)
    plain = np.array([values("both").get(n, a) for n, a in zip(module.PARAMETERS, module.ABSENT, strict=True)])
    state, volts = np.array([0.3, -0.2, 0.5, 1.7]), np.array([0.8, 0.6])
    own = values("both")
    coupling = own["X2"] * np.cos(state[0] - state[1])
    mass = np.array([[own["X1"], coupling], [coupling, own["X3"]]])
    load = 0.6 - own["X7"] * (state[3] - state[2])  # of the second motor, less its back-EMF
    sizes = {"coulomb_drive.torque": [-1, 0], "coulomb_joint.torque": [1, -1],
             "load_friction_joint.share": [abs(load), -abs(load)]}  # fmt: skip
    for name, force in sizes.items():
        rubbing = plain.copy()
        rubbing[module.PARAMETERS.index(name)] = 0.05
        more = module.acceleration(0.0, state, volts, rubbing) - module.acceleration(0.0, state, volts, plain)
        np.testing.assert_allclose(mass @ more, 0.05 * np.array(force), rtol=1e-8, atol=1e-12)


def test_an_arm_is_identified_without_nominal_values():
    found = identify(ARM_MODEL, [arm_log({})], method="inverse").parameters
    for name, value in values("both").items():
        assert found[name].value == pytest.approx(value, rel=0.05, abs=0.005), name


@pytest.mark.slow
def test_dry_friction_at_both_joints_of_an_arm_is_found_and_told_apart():
    hidden = {"coulomb_drive.torque": 0.25, "coulomb_joint.torque": 0.12}
    found = explain(ARM_MODEL, [arm_log(hidden)])
    assert set(found.effects) == {"coulomb_drive", "coulomb_joint"} and found.verdict == "nothing_missing"
    for name, value in {**values("both"), **hidden}.items():
        assert found.parameters[name].value == pytest.approx(value, rel=0.01, abs=1e-3), name
