"""Kernels of other plants against textbooks."""

import numpy as np
from scipy.integrate import solve_ivp

from wheelpend.kernels import load as kernels

G = 9.81


def double_pendulum(t, y, m1, m2, l1, l2):
    """Two point masses on massless rods, as in the textbooks, without the project's Lagrangian."""
    a, b, da, db = y
    d = a - b
    mass = np.array([[(m1 + m2) * l1, m2 * l2 * np.cos(d)], [l1 * np.cos(d), l2]])
    force = [-m2 * l2 * db**2 * np.sin(d) - (m1 + m2) * G * np.sin(a), l1 * da**2 * np.sin(d) - G * np.sin(b)]
    return [da, db, *np.linalg.solve(mass, force)]


def test_two_links_swing_as_the_textbooks_double_pendulum_does():
    m1, m2, l1, l2 = 1.2, 0.7, 0.9, 0.5
    gravity = (m1 + m2) * l1 * G  # forces are counted in units of what holds the level first link
    values = {"X1": (m1 + m2) * l1**2, "X2": m2 * l1 * l2, "X3": m2 * l2**2, "X4": m2 * l2 * G}
    module = kernels.model_module("pendulum", {"links": 2}, ())
    parameters = np.array([values[n] / gravity for n in module.PARAMETERS])
    t, start = np.arange(0.0, 3.0, 1e-3), np.array([1.2, -0.6, 0.3, 0.0])
    ours = module.simulate(t, np.zeros_like(t), start, parameters, 5e-4)
    theirs = solve_ivp(double_pendulum, (0, 3), start, t_eval=t, rtol=1e-10, atol=1e-12, args=(m1, m2, l1, l2)).y.T
    np.testing.assert_allclose(ours, theirs, atol=1e-6)


def cart_and_pole(state, force, M, m, l, J, K):
    """Accelerations by Newton's laws for cart and pole, with a force on the cart and its back-EMF."""
    _, theta, dx, dtheta = state
    matrix = np.array([[M + m, m * l * np.cos(theta)], [m * l * np.cos(theta), J + m * l**2]])
    return np.linalg.solve(matrix, [force - K * dx + m * l * dtheta**2 * np.sin(theta), m * G * l * np.sin(theta)])


def test_cart_and_pole_accelerate_as_newton_says():
    M, m, l, J, K, gain = 0.8, 0.2, 0.4, 0.01, 3.0, 2.0
    values = {"X1": (M + m) / gain, "X2": m * l / gain, "X3": (J + m * l**2) / gain, "X4": m * G * l / gain, "X5": K}
    module = kernels.model_module("cart_pole", {}, ())
    parameters = np.array([values[n] for n in module.PARAMETERS])
    for state in np.random.default_rng(1).normal(size=(20, 4)):
        expected = cart_and_pole(state, gain * 1.7, M, m, l, J, gain * K)
        np.testing.assert_allclose(module.acceleration(0.0, state, 1.7, parameters), expected, rtol=1e-10)


def test_a_freely_swinging_pendulum_keeps_its_energy_until_friction_takes_it():
    module = kernels.library_module("pendulum", {})
    t = np.arange(0.0, 20.0, 1e-3)
    bare = np.array([{"X1": 0.07}.get(n, a) for n, a in zip(module.PARAMETERS, module.ABSENT, strict=True)])
    rubbing = bare.copy()
    rubbing[module.PARAMETERS.index("coulomb_drive.torque")] = 0.05
    free, stopped = (module.simulate(t, np.zeros_like(t), np.array([1.5, 0.0]), p, 1e-3) for p in (bare, rubbing))
    energy = 0.07 * free[:, 1] ** 2 / 2 - np.cos(free[:, 0])
    assert np.ptp(energy) < 1e-7
    assert abs(stopped[-1, 1]) < 1e-12 and abs(np.sin(stopped[-1, 0])) < 0.05  # it sticks where gravity cannot move it


def test_friction_in_a_joint_opposes_how_its_two_links_turn_against_each_other():
    module = kernels.model_module("pendulum", {"links": 2}, ("coulomb_joint", "quadratic_joint"))
    plain = np.array([{"X1": 0.1, "X2": 0.02, "X3": 0.03, "X4": 0.3}.get(n, a)
                      for n, a in zip(module.PARAMETERS, module.ABSENT, strict=True)])  # fmt: skip
    state = np.array([0.3, -0.2, 0.5, 1.7])
    mass = np.array([[0.1, 0.02 * np.cos(0.5)], [0.02 * np.cos(0.5), 0.03]])
    laws = {"coulomb_joint.torque": 1.0, "quadratic_joint.coefficient": 1.2**2}  # per unit of size, at a slip of 1.2
    for name, law in laws.items():
        rubbing = plain.copy()
        rubbing[module.PARAMETERS.index(name)] = 0.05
        more = module.acceleration(0.0, state, 0.0, rubbing) - module.acceleration(0.0, state, 0.0, plain)
        np.testing.assert_allclose(mass @ more, 0.05 * law * np.array([1.0, -1.0]), rtol=1e-9)


def test_friction_in_a_joint_never_adds_energy():
    module = kernels.model_module("pendulum", {"links": 2}, ("coulomb_joint", "quadratic_joint"))
    own = {"X1": 0.1, "X2": 0.02, "X3": 0.03, "X4": 0.3}
    t = np.arange(0.0, 3.0, 1e-3)
    for name, size in (("coulomb_joint.torque", 0.02), ("quadratic_joint.coefficient", 0.01), ("", 0.0)):
        values = {**own, name: size}
        parameters = np.array([values.get(n, a) for n, a in zip(module.PARAMETERS, module.ABSENT, strict=True)])
        a, b, da, db = module.simulate(t, np.zeros_like(t), np.array([1.2, -0.6, 0.3, 0.0]), parameters, 5e-4)[:, :4].T
        kinetic = 0.05 * da**2 + 0.02 * np.cos(a - b) * da * db + 0.015 * db**2
        energy = kinetic - np.cos(a) - 0.3 * np.cos(b)
        assert np.diff(energy).max() < 1e-8
        assert np.ptp(energy) > 0.02 if name else np.ptp(energy) < 1e-6
