"""A robot that turns keeps its energy."""

import numpy as np

from wheelpend.kernels import load as kernels

TURNING = {"planar": False}
X = {"X1": 0.0436, "X2": 0.0178, "X3": 0.1149, "X4": 0.8719, "X5": 4.6701, "X6": 0.7268, "X7": 0.7256,
     "X8": 0.15, "X9": 0.08, "X10": 1.6}  # fmt: skip


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
