"""The judges of the case studies measure what they say, on machines whose equations stand here by hand."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from wheelpend import Model
from wheelpend.benchmarks.measured.free_run import free_run_error
from wheelpend.benchmarks.measured.roll_out import best_roll_out_values, roll_out_error
from wheelpend.benchmarks.measured.rungs import FittedModel
from wheelpend.benchmarks.measured.torque import log_halves, torque_error
from wheelpend.kernels.load import model_module
from wheelpend.logs.log import Log

ARM = {"X1": 0.10, "X2": 0.035, "X3": 0.02, "X4": 3.2, "X5": 1.1, "X6": 0.45, "X7": 0.15}
FREE = {"X1": 0.0156, "viscous_drive.coefficient": 8e-4}
SERVO = {"X1": 0.11, "X2": 2.0, "X3": 1.3}


def module_of(text, *effects):
    model = Model.parse(text)
    return model_module(model.plant, model.assumptions, effects)


@pytest.fixture(scope="module")
def arm():
    return module_of('plant = "pendulum"\n[assumptions]\nlinks = 2\ndriven = "both"\n[input]\nunit = "N m"\n')


@pytest.fixture(scope="module")
def pendulum():
    return module_of('plant = "pendulum"\n', "viscous_drive")


@pytest.fixture(scope="module")
def servo():
    return module_of('plant = "pendulum"\n[assumptions]\ndriven = true\n')


# ---- the arm: torques of a motion that is given, joint angles against each other


def joint_motion(t):
    """Joint angles (2, N), their rates and accelerations, all below 2 Hz."""
    rates, sizes = (
        2 * np.pi * np.array([[0.3, 0.8, 1.3], [0.4, 0.7, 1.6]]),
        np.array([[1.2, 0.4, 0.2], [0.9, 0.5, 0.1]]),
    )
    angles = rates[:, :, None] * t
    return tuple(
        (sizes[:, :, None] * factor * wave(angles)).sum(1)
        for factor, wave in ((1.0, np.sin), (rates[:, :, None], np.cos), (-(rates[:, :, None] ** 2), np.sin))
    )


def joint_torques_by_hand(t, damping):
    """Torques (2, N) at shoulder and elbow as textbooks have them, in relative angles, and the part of damping."""
    (q1, q2), (w1, w2), (a1, a2) = joint_motion(t)
    (X1, X2, X3, X4, X5), c, s = (ARM[f"X{k}"] for k in range(1, 6)), np.cos(q2), np.sin(q2)
    shoulder = (X1 + X3 + 2 * X2 * c) * a1 + (X3 + X2 * c) * a2 - X2 * s * (2 * w1 * w2 + w2**2) + X4 * np.sin(q1)
    elbow = (X3 + X2 * c) * a1 + X3 * a2 + X2 * s * w1**2 + X5 * np.sin(q1 + q2)
    shoulder += X5 * np.sin(q1 + q2)
    friction = damping * np.array([(ARM["X6"] - ARM["X7"]) * w1, ARM["X7"] * w2])
    return np.array([shoulder, elbow]) + friction, friction


def arm_log(damping=1.0, seconds=20.0):
    t = np.arange(round(300 * seconds)) / 300
    torques, _ = joint_torques_by_hand(t, damping)
    return Log("arm", t, torques.T.copy(), joint_motion(t)[0].T.copy(), ("theta_1", "theta_2"))


def test_the_equations_need_the_torques_that_moved_the_arm(arm):
    assert torque_error(arm, ARM, arm_log()) < 1.0


def test_what_a_model_without_friction_misses_is_the_share_of_friction_in_the_torques(arm):
    t = arm_log().t
    torques, friction = joint_torques_by_hand(t, 1.0)
    share = 100 * np.linalg.norm(friction) / np.linalg.norm(torques)
    assert share > 10.0
    assert torque_error(arm, {**ARM, "X6": 0.0, "X7": 0.0}, arm_log()) == pytest.approx(share, rel=0.03)


def test_steps_of_an_encoder_and_fast_noise_of_the_torque_do_not_count(arm):
    log, noise = arm_log(), np.random.default_rng(1).normal(size=(6000, 2))
    coarse = np.round(log.measured / 3.8e-4) * 3.8e-4
    unfiltered = 100 * np.linalg.norm(noise) / np.linalg.norm(log.voltage)
    noisy = Log("noisy", log.t, log.voltage + noise, coarse, log.channels)
    assert torque_error(arm, ARM, noisy) < 0.25 * unfiltered


def test_halves_are_cut_at_the_middle_of_the_time():
    t = np.concatenate([np.arange(0.0, 2.0, 0.01), np.arange(2.0, 10.0, 0.1)])
    first, second = log_halves(Log("log", t, np.zeros(len(t)), np.zeros((len(t), 1)), ("theta_1",)))
    assert first.t[-1] < 4.96 <= second.t[0] and len(first) + len(second) == len(t)


# ---- the pendulum that swings freely


def free_log(noise=0.0, seconds=20.0):
    t = np.arange(round(200 * seconds)) / 200

    def slope(_, y):
        return [y[1], -(np.sin(y[0]) + FREE["viscous_drive.coefficient"] * y[1]) / FREE["X1"]]

    angle = solve_ivp(slope, (0.0, t[-1]), [1.2, 0.5], t_eval=t, rtol=1e-10, atol=1e-12).y[0]
    angle = angle + noise * np.random.default_rng(0).normal(size=len(t))
    return Log("decay", t, np.zeros(len(t)), angle[:, None], ("theta_1",))


def test_a_free_run_with_the_true_values_leaves_the_noise_though_the_start_is_not_known(pendulum):
    assert free_run_error(pendulum, FREE, free_log(noise=0.02)) == pytest.approx(0.02, rel=0.03)


def test_nothing_but_the_start_is_refitted_in_a_free_run(pendulum):
    log = free_log()
    without = free_run_error(pendulum, {**FREE, "viscous_drive.coefficient": 0.0}, log)
    assert 0.05 < without < np.sqrt(np.mean(log.measured**2))  # a swing that never decays, from the best start


def test_a_start_is_found_also_where_the_swing_loses_its_phase(pendulum):
    log = free_log(seconds=60.0)
    without = free_run_error(pendulum, {**FREE, "viscous_drive.coefficient": 0.0}, log)
    assert without < np.sqrt(np.mean(log.measured**2))  # no worse than a pendulum that hangs


# ---- the driven pendulum


def servo_log(start=0.0, phase=0.0):
    t = np.arange(1000) / 200
    voltage = 1.5 * np.sin(2 * np.pi * 0.7 * t + phase) + 0.8 * np.sin(2 * np.pi * 1.9 * t)
    angle, state = [start], np.array([start, 0.0])

    def slope(_, y, volts):
        return [y[1], (volts - SERVO["X2"] * np.sin(y[0]) - SERVO["X3"] * y[1]) / SERVO["X1"]]

    for begin, end, volts in zip(t[:-1], t[1:], voltage[:-1], strict=True):
        state = solve_ivp(slope, (begin, end), state, args=(volts,), rtol=1e-8, atol=1e-10).y[:, -1]
        angle.append(state[0])
    return Log("servo", t, voltage, np.array(angle)[:, None], ("theta_1",))


@pytest.fixture(scope="module")
def servo_logs():
    return [servo_log(), servo_log(0.0, 1.0)]


def test_a_roll_out_follows_a_whole_log_and_its_error_is_the_mean_absolute_one(servo, servo_logs):
    log = servo_logs[0]
    assert roll_out_error(servo, SERVO, [log]) < 2e-3
    off = log.measured + np.where(np.arange(len(log)) >= 750, 0.2, 0.0)[:, None]
    moved = Log("moved", log.t, log.voltage, off, log.channels)
    assert roll_out_error(servo, SERVO, [moved]) == pytest.approx(0.05, abs=2e-3)  # 0.1 if it were a root mean square
    assert roll_out_error(servo, SERVO, [log, moved]) == pytest.approx(0.025, abs=2e-3)


def test_the_best_roll_out_is_that_of_the_true_values_and_outliers_do_not_move_it(servo, servo_logs):
    log = servo_logs[1]
    spoilt = log.measured.copy()
    spoilt[100::25] += 0.5
    model = Model.parse('plant = "pendulum"\n[assumptions]\ndriven = true\n')
    begun = FittedModel("begun", model, {n: 1.15 * v for n, v in SERVO.items()})
    found = best_roll_out_values(begun, [Log("spoilt", log.t, log.voltage, spoilt, log.channels)])
    assert found == pytest.approx(SERVO, rel=0.03)
    assert roll_out_error(servo, found, servo_logs) < 0.2 * roll_out_error(servo, begun.values, servo_logs)
