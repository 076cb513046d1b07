"""A sensor's filter is a state: what it makes of a reading, and its derivatives."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline

from tests.support import simulated
from wheelpend import Model
from wheelpend.kernels.load import model_module
from wheelpend.simulation.hidden import machine_values

GAIN_S, TIME_S = 0.004, 0.7
HIDE = {"accelerometer_tilt__gain": GAIN_S, "accelerometer_tilt__time_constant": TIME_S}


def test_a_fused_pitch_is_what_gyro_and_accelerometer_make_of_the_motion():
    """The complementary filter itself, with the acceleration, which the model's own form does without."""
    log = simulated(duration=4.0, noise=False, **HIDE)
    wheel, gyro = CubicSpline(log.t, log.measured[:, 0]), CubicSpline(log.t, log.measured[:, 2])
    true = gyro.antiderivative()

    def filtered(t, fused):
        tilt = true(t) - true(0.0) - GAIN_S * TIME_S * wheel(t, 2)
        return gyro(t) + (tilt - fused) / TIME_S

    run = solve_ivp(filtered, (0.0, 4.0), [log.measured[0, 1]], t_eval=log.t, max_step=2e-3, rtol=1e-8)
    off = np.abs(log.measured[:, 1] - true(log.t)).max()
    assert off > 0.01 and np.abs(run.y[0] - log.measured[:, 1]).max() < 0.02 * off


@pytest.mark.parametrize("others", [(), ("coulomb_drive",)], ids=["smooth", "sticking"])
def test_derivatives_of_a_filtered_reading_are_those_of_differences(others):
    module = model_module("wheel_pendulum", dict(Model.default().assumptions), ("accelerometer_tilt", *others))
    values = {**machine_values(Model.default(), {}), "coulomb_drive.torque": 0.2}
    values |= {"accelerometer_tilt.gain": GAIN_S, "accelerometer_tilt.time_constant": TIME_S}
    p = np.array([values.get(n, a) for n, a in zip(module.PARAMETERS, module.ABSENT, strict=True)])
    log, start = simulated(duration=0.2, noise=False), np.array([0.1, 0.05, 3.0, 0.2])
    columns = np.arange(module.FITTED)

    def read(at, state):
        return module.sensitivities(log.t, log.voltage, state, at, columns, 1e-3)

    found = read(p, start)[2]
    for c in range(module.NX + module.FITTED):
        step, moved, state = 1e-6, [p.copy(), p.copy()], [start.copy(), start.copy()]
        for k, sign in enumerate((1.0, -1.0)):
            (state[k] if c < module.NX else moved[k])[c if c < module.NX else c - module.NX] += sign * step
        ends = [read(a, s)[1] for a, s in zip(moved, state, strict=True)]
        expected = (ends[0] - ends[1]) / (2.0 * step)
        assert found[:, :, c] == pytest.approx(expected, abs=1e-5 * max(np.abs(expected).max(), 1e-6))
