"""Effects with a state of their own, a delay in the sensors or a moment, against equations typed by hand."""

from functools import lru_cache

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from tests.support import CONSTANTS, energy
from tests.support import X as ROUNDED
from wheelpend.estimation.parameters import kernel_parameters
from wheelpend.kernels import load as kernels
from wheelpend.logs.log import Log

X = {**ROUNDED, "X5": ROUNDED["X3"] * CONSTANTS["g"] / CONSTANTS["R"]}  # of one mass: the paper's are rounded
KNOWN = {**X, **CONSTANTS, "L": 0.716}
START = np.array([0.2, 0.05, 1.0, -0.5])
MOMENTS = {
    "payload_step.time": 0.2012, "payload_step.ratio": 0.1, "external_push.start": 0.31, "external_push.end": 0.4023,
    "external_push.torque": 0.5,
}  # fmt: skip
EVERYWHERE = {
    "presliding_drive.torque": 0.3, "presliding_drive.stiffness": 30.0, "imu_lag.delay": 0.0043,
    "body_damping.coefficient": 0.1, **MOMENTS,
}  # fmt: skip
INSIDE = {
    "twist": {"drive_compliance.stiffness": 50.0, "drive_compliance.damping": 0.1, "backlash.gap": 0.02},
    "creep": {"wheel_slip.stiffness": 20.0, "wheel_slip.limit": 3.0},
    "slosh_angle": {"slosh.mass_ratio": 0.1, "slosh.height": 0.5, "slosh.frequency": 8.0, "slosh.damping": 0.05},
}


@lru_cache
def freed(*names):
    """The library with this free inside the machine."""
    return kernels.library_module("wheel_pendulum", {}, (), names)


@lru_cache
def steps(count=400):
    """A log with a voltage that changes every 50 samples."""
    t, levels = np.arange(count) * 1e-3, np.random.default_rng(0).normal(size=count // 50 + 1) * 2
    return Log("", t, np.repeat(levels, 50)[:count], np.zeros((count, 3)), ("theta_w", "theta_p", "dtheta_p"))


def run(module, values, log=None, start=START, step=1e-4):
    """States at the samples of a log."""
    log = log or steps()
    return module.simulate(log.t, log.voltage, start, kernel_parameters(module, {**KNOWN, **values}, log), step)


def integrate(motion, extra, log=None):
    """States of motion(state, voltage), held between samples, by an adaptive integrator."""
    log, state = log or steps(), np.concatenate([START, np.zeros(extra)])
    found = [state]
    for k in range(len(log) - 1):
        span = (log.t[k], log.t[k + 1])
        state = solve_ivp(lambda t, s, v=log.voltage[k]: motion(s, v), span, state, rtol=1e-9, atol=1e-11).y[:, -1]
        found.append(state)
    return np.array(found)


def two_coordinates(state, force_wheel, force_body):
    """Accelerations of wheel and body under forces beside inertia and gravity (paper eqs. 19, 20)."""
    pitch, dp = state[1], state[3]
    c, s = np.cos(pitch), np.sin(pitch)
    mass = [[X["X1"] + X["X2"], X["X3"] * c - X["X2"]], [X["X3"] * c - X["X2"], X["X4"] + X["X2"]]]
    return np.linalg.solve(mass, [force_wheel + X["X3"] * s * dp**2, force_body + X["X5"] * s])


def test_presliding_friction_is_the_differential_equation_of_dahl(library):
    def motion(state, voltage):
        dw, dp, force = state[2:]
        drive = voltage - X["X6"] * dw + X["X7"] * dp - force
        slope = 30.0 * ((dw - dp) - abs(dw - dp) * force / 0.3)
        return [dw, dp, *two_coordinates(state, drive, -drive), slope]

    values = {"presliding_drive.torque": 0.3, "presliding_drive.stiffness": 30.0}
    assert np.abs(run(library, values) - integrate(motion, 1)[:, :4]).max() < 1e-5


def test_an_elastic_shaft_joins_two_inertias():
    def motion(state, voltage):
        _, pitch, dw, dp, twist, dtwist = state
        c, s, ground = np.cos(pitch), np.sin(pitch), (X["X6"] - X["X7"]) * dw
        shaft, motor = 50.0 * twist + 0.1 * dtwist, voltage - X["X7"] * (dw + dtwist - dp)
        mass = [[X["X1"], X["X3"] * c, 0.0], [X["X3"] * c, X["X4"] + X["X2"], -X["X2"]], [0.0, -X["X2"], X["X2"]]]
        right = [shaft - ground + X["X3"] * s * dp**2, -motor + ground + X["X5"] * s, motor - shaft]
        wheel, body, rotor = np.linalg.solve(mass, right)
        return [dw, dp, wheel, body, dtwist, rotor - wheel]

    values = {"drive_compliance.stiffness": 50.0, "drive_compliance.damping": 0.1}
    assert np.abs(run(freed("twist"), values) - integrate(motion, 2)[:, :4]).max() < 1e-5


def test_inside_a_free_play_the_motor_turns_alone():
    module, start = freed("twist"), np.zeros(6)
    t = np.arange(100) * 1e-3
    log = Log("", t, np.full(100, 2.0), np.zeros((100, 3)), ("theta_w", "theta_p", "dtheta_p"))
    states = run(module, {"backlash.gap": 0.4}, log, start=np.concatenate([start, np.zeros(module.NV - 6)]))
    crossing = np.argmax(states[:, 4] > 0.2)
    assert 0 < crossing < 99
    assert np.abs(states[:crossing, 2]).max() < 0.05 * np.abs(states[:crossing, 5]).max()


def test_wheels_that_creep_pull_the_robot_with_a_limited_force():
    def motion(state, voltage):
        _, pitch, dw, dp, _, dcreep = state
        c, s, spin = np.cos(pitch), np.sin(pitch), 2 * CONSTANTS["J_w"] / CONSTANTS["alpha"]
        travel, drive = X["X1"] - spin, voltage - X["X6"] * dw + X["X7"] * dp
        traction, swing = 3.0 * np.tanh(20.0 * dcreep / 3.0), X["X3"] * s * dp**2
        mass = [
            [X["X1"] + X["X2"], X["X3"] * c - X["X2"], -travel],
            [X["X3"] * c - X["X2"], X["X4"] + X["X2"], -X["X3"] * c],
            [-travel, -X["X3"] * c, travel],
        ]
        wheel, body, creep = np.linalg.solve(mass, [drive + swing, -drive + X["X5"] * s, -traction - swing])
        return [dw, dp, wheel, body, dcreep, creep]

    values = {"wheel_slip.stiffness": 20.0, "wheel_slip.limit": 3.0}
    assert np.abs(run(freed("creep"), values) - integrate(motion, 2)[:, :4]).max() < 1e-5


def test_what_swings_undamped_in_the_body_keeps_the_energy():
    module, values = freed("slosh_angle"), {**KNOWN, "X6": 0.0, "X7": 0.0}
    slosh = {"slosh.mass_ratio": 0.1, "slosh.height": 0.5, "slosh.frequency": 8.0, "slosh.damping": 0.0}
    log = Log("", steps().t, np.zeros(400), np.zeros((400, 3)), ("theta_w", "theta_p", "dtheta_p"))
    start = np.array([0.0, 0.3, 0.5, 0.0, 0.4, 0.0, *np.zeros(module.NV - 6)])
    _, pitch, dw, dp, angle, dangle, *_ = run(module, {**values, **slosh}, log, start=start).T
    length, mass = values["g"] / 64.0, 0.1 * X["X5"] / (values["g"] * values["L"])
    ahead = values["R"] * dw + 0.5 * np.cos(pitch) * dp - length * np.cos(angle) * dangle
    up = -0.5 * np.sin(pitch) * dp + length * np.sin(angle) * dangle
    hung = mass * ((ahead**2 + up**2) / 2 + values["g"] * (0.5 * np.cos(pitch) - length * np.cos(angle)))
    total = energy(np.column_stack([pitch * 0, pitch, dw, dp]), values) + hung
    assert np.ptp(total) < 1e-8 * abs(total[0]) < np.ptp(hung)


def test_late_sensors_report_what_was_true(library):
    log, lag = steps(), 0.0043
    parameters = kernel_parameters(library, {**KNOWN, "imu_lag.delay": lag}, log)
    _, late, _ = library.sensitivities(log.t, log.voltage, START, parameters, np.empty(0, np.int64), 1e-3)
    fine = np.arange(int(0.3995e4)) * 1e-4
    dense = run(
        library, {}, Log("", fine, np.repeat(log.voltage, 10)[: len(fine)], np.zeros((len(fine), 3)), log.channels)
    )
    then = np.round((log.t - lag) * 1e4).astype(int)
    past = then >= 0
    assert np.abs(late[past, 1:] - dense[then[past]][:, [1, 3]]).max() < 1e-6
    assert np.abs(late[:, 0] - dense[np.round(log.t * 1e4).astype(int).clip(max=len(fine) - 1), 0])[:-1].max() < 1e-6


def test_a_payload_changes_the_equivalent_parameters_at_its_moment(library):
    log, ratio = steps(), 0.1
    mass = X["X5"] / (KNOWN["g"] * KNOWN["L"])  # M over alpha
    heavy = {"X1": X["X1"] + ratio * mass * KNOWN["R"] ** 2, "X3": 1.1 * X["X3"],
             "X4": X["X4"] + ratio * mass * KNOWN["L"] ** 2, "X5": 1.1 * X["X5"]}  # fmt: skip
    found = run(library, {"payload_step.time": 0.2, "payload_step.ratio": ratio})
    after = Log("", log.t[200:], log.voltage[200:], log.measured[200:], log.channels)
    assert np.abs(found[:201] - run(library, {})[:201]).max() < 1e-12
    assert np.abs(found[200:] - run(library, heavy, after, start=found[200])).max() < 1e-9


@pytest.mark.parametrize("free", [(), ("twist",), ("creep",), ("slosh_angle",)])
def test_sensitivities_of_effects_with_states_are_the_derivatives(free):
    module, log = freed(*free), steps(600)
    hidden = {**EVERYWHERE, **(INSIDE[free[0]] if free else {})}
    parameters = kernel_parameters(module, {**KNOWN, **hidden}, log)
    names = ["X2", *hidden] if not free else ["X2", *INSIDE[free[0]]]
    columns = np.array([module.PARAMETERS.index(n) for n in names])

    def readings(changed):
        return module.sensitivities(log.t, log.voltage, START, changed, columns[:0], 5e-4)[1]

    exact = module.sensitivities(log.t, log.voltage, START, parameters, columns, 5e-4)[2]
    for number, place in enumerate(columns):
        small = np.zeros_like(parameters)
        small[place] = 1e-6 * max(abs(parameters[place]), 0.01)
        numeric = (readings(parameters + small) - readings(parameters - small)) / (2 * small[place])
        close = 1e-3 if names[number] == "imu_lag.delay" else 1e-4  # a delay also moves where the steps end
        assert exact[:, :, 4 + number] == pytest.approx(numeric, abs=close * np.abs(numeric).max()), names[number]
