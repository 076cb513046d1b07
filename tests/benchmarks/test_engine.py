"""Every effect in the engine does what its law says: closed forms, balances, energy, and the limit without it."""

import json

import numpy as np
import pytest
from scipy.linalg import expm

from wheelpend import Model, explain, load_log
from wheelpend.benchmarks.hidden_effects.engine import Robot, engine_run
from wheelpend.benchmarks.hidden_effects.laws import SAMPLE_INTERVAL_S, ForceLaws
from wheelpend.benchmarks.hidden_effects.scene import (
    BODY_INERTIA_KG_M2,
    BODY_MASS_KG,
    COM_HEIGHT_M,
    MAX_ENGINE_STEP_S,
    TRUE_PARAMETERS,
    WHEEL_INERTIA_KG_M2,
    WHEEL_RADIUS_M,
)
from wheelpend.benchmarks.hidden_effects.shipped import SHIPPED_LOGS, log_csv_text
from wheelpend.logs.shipped import data_folder

mujoco = pytest.importorskip("mujoco")
pytestmark = pytest.mark.extras

X, PITCH, DRIVE, ROTOR = 0, 1, 2, 3
X1, X2, X6 = TRUE_PARAMETERS["X1"], TRUE_PARAMETERS["X2"], TRUE_PARAMETERS["X6"]


def held(hide, *joints, samples=1000):
    """A robot whose given joints have too much inertia to move."""
    robot = Robot(hide, 2 * MAX_ENGINE_STEP_S, samples)
    robot.model.dof_armature[list(joints)] = 1e9
    mujoco.mj_setConst(robot.model, mujoco.MjData(robot.model))
    return robot


def under(robot, voltage, samples):
    """Positions and rates at every sample under a constant voltage."""
    past = []
    for k in range(samples):
        robot.move(k * SAMPLE_INTERVAL_S, np.full(k + 1, voltage))
        past.append((robot.data.qpos.copy(), robot.data.qvel.copy()))
    return tuple(map(np.array, zip(*past, strict=True)))


def test_inside_the_gap_the_motor_turns_only_the_rotor():
    _, rates = under(Robot({"backlash.gap": 0.1}, 2 * MAX_ENGINE_STEP_S, 100), 1.0, 20)
    t = np.arange(1, 21) * SAMPLE_INTERVAL_S
    assert rates[:, ROTOR] == pytest.approx((1 - np.exp(-X6 / X2 * t)) / X6, rel=0.02)
    assert np.abs(rates[:, DRIVE]).max() < 0.05 * rates[-1, ROTOR]  # the body's reaction alone


def test_the_stops_of_the_gap_are_stiff_and_do_not_bounce():
    angles, _ = under(held({"backlash.gap": 0.01}, PITCH), 2.0, 300)
    play = angles[:, ROTOR] - angles[:, DRIVE]
    touched = int(np.argmax(play > 0.00499))
    assert 5 < touched < 50
    assert play[touched:] == pytest.approx(0.005, abs=5e-5)


def test_an_elastic_shaft_swings_as_the_linear_equations_say():
    stiffness, damping = 40.0, 0.1
    robot = held({"drive_compliance.stiffness": stiffness, "drive_compliance.damping": damping}, PITCH)
    robot.data.qpos[ROTOR] = 0.01
    angles, _ = under(robot, 0.0, 200)
    spring = np.array([[1.0, -1.0], [-1.0, 1.0]])  # on rotor and wheel
    inertia = np.diag(1 / np.array([X2, X1]))
    matrix = np.block([
        [np.zeros((2, 2)), np.eye(2)],
        [-inertia @ spring * stiffness, -inertia @ (spring * damping + np.diag([X6, 0.0]))],
    ])  # fmt: skip
    exact = [expm(matrix * t) @ [0.01, 0, 0, 0] for t in np.arange(1, 201) * SAMPLE_INTERVAL_S]
    assert angles[:, ROTOR] == pytest.approx(np.array(exact)[:, 0], abs=2e-5)
    assert angles[:, DRIVE] == pytest.approx(np.array(exact)[:, 1], abs=2e-5)


def test_presliding_friction_winds_up_and_reverses_as_dahl_says():
    limit, stiffness = 0.3, 30.0
    laws = ForceLaws({"presliding_drive.torque": limit, "presliding_drive.stiffness": stiffness}, 1e-4)
    onward = np.array([laws.presliding(0.5) for _ in range(2000)])
    angle = (np.arange(2000) + 0.5) * 0.5e-4
    assert onward == pytest.approx(limit * (1 - np.exp(-stiffness * angle / limit)), abs=1e-4)
    back = np.array([laws.presliding(-0.5) for _ in range(2000)])
    assert (back[0] - back[1]) / 0.5e-4 == pytest.approx(2 * stiffness, rel=0.02)
    assert onward[-1] - back[-1] == pytest.approx(2 * limit, rel=1e-3)  # height of the loop


def test_below_its_limit_presliding_friction_holds_the_drive_on_a_spring():
    robot = held({"presliding_drive.torque": 0.5, "presliding_drive.stiffness": 20.0}, PITCH, samples=2000)
    _, rates = under(robot, 0.2, 1500)
    assert np.abs(rates[-100:, DRIVE]).max() < 1e-4
    assert 20.0 * robot.laws.bristle == pytest.approx(0.2, rel=1e-3)


@pytest.mark.parametrize("voltage, moves", [(0.45, False), (0.55, True)])
def test_static_friction_holds_up_to_its_limit_and_then_slides_at_the_speed_of_its_law(voltage, moves):
    hide = {"stribeck_drive.static": 0.5, "stribeck_drive.sliding": 0.2, "stribeck_drive.speed": 0.1}
    angles, rates = under(held(hide, PITCH), voltage, 900)
    if not moves:
        assert np.abs(angles[:, DRIVE]).max() < 1e-5
        return
    assert rates[-1, DRIVE] == pytest.approx((voltage - 0.2) / X6, rel=1e-3)


def test_the_pendulum_has_the_frequency_and_damping_that_were_asked_for():
    frequency, ratio = 6.0, 0.1
    hide = {"slosh.mass_ratio": 0.1, "slosh.height": 0.8, "slosh.frequency": frequency, "slosh.damping": ratio}
    robot = held(hide, X, PITCH, samples=2000)
    robot.data.qpos[3] = 0.02
    angles, _ = under(robot, 0.0, 1500)
    t, swing = np.arange(1, 1501) * SAMPLE_INTERVAL_S, frequency * np.sqrt(1 - ratio**2)
    shape = np.cos(swing * t) + ratio * frequency / swing * np.sin(swing * t)
    assert angles[:, 3] == pytest.approx(0.02 * np.exp(-ratio * frequency * t) * shape, abs=2e-5)


def test_wheels_that_stand_slip_at_the_speed_at_which_traction_balances_a_push():
    push, limit, stiffness = 1.5, 2.0, 10.0
    hide = {"wheel_slip.stiffness": stiffness, "wheel_slip.limit": limit, "external_push.torque": push,
            "external_push.start": 0.0, "external_push.end": 9.0}  # fmt: skip
    _, rates = under(held(hide, PITCH, DRIVE), 0.0, 300)
    assert rates[-1, X] / WHEEL_RADIUS_M == pytest.approx(limit / stiffness * np.arctanh(push / limit), rel=1e-4)


def test_a_push_sets_the_robot_rolling_and_then_leaves_it_alone():
    hide = {"external_push.torque": 0.5, "external_push.start": 0.01, "external_push.end": 0.05}
    _, rates = under(held(hide, PITCH), 0.0, 100)
    pushed = 0.5 / X6 * (1 - np.exp(-X6 / (X1 + X2) * 0.04))
    assert np.abs(rates[:9]).max() < 1e-9
    assert rates[49, DRIVE] == pytest.approx(pushed, rel=1e-3)
    assert rates[99, DRIVE] == pytest.approx(pushed * np.exp(-X6 / (X1 + X2) * 0.05), rel=1e-3)


def test_a_payload_is_a_mass_at_the_centre_of_mass_from_its_moment_on():
    robot = Robot({"payload_step.time": 0.003, "payload_step.ratio": 0.25}, 2 * MAX_ENGINE_STEP_S, 100)
    turned = []
    for k in range(5):
        robot.move(k * SAMPLE_INTERVAL_S, np.zeros(k + 1))
        column = np.zeros(3)
        mujoco.mj_forward(robot.model, robot.data)
        mujoco.mj_mulM(robot.model, robot.data, column, np.array([0.0, 1.0, 0.0]))
        turned.append(column[:2])
    upright = np.array(
        [BODY_MASS_KG * COM_HEIGHT_M, BODY_MASS_KG * COM_HEIGHT_M**2 + BODY_INERTIA_KG_M2]
    )  # of x and pitch when the body turns
    laden = np.array([1.25 * BODY_MASS_KG * COM_HEIGHT_M, 1.25 * BODY_MASS_KG * COM_HEIGHT_M**2 + BODY_INERTIA_KG_M2])
    assert np.array(turned[:3]) - [0.0, 2 * WHEEL_INERTIA_KG_M2] == pytest.approx(np.tile(upright, (3, 1)))
    assert np.array(turned[3:]) - [0.0, 2 * WHEEL_INERTIA_KG_M2] == pytest.approx(np.tile(laden, (2, 1)))


def test_a_late_sensor_shows_the_motion_of_a_moment_ago():
    delay = 0.00337
    run = engine_run({"imu_lag.delay": delay}, duration=1.0, noise=0.0)
    then = np.interp(run.log.t - delay, run.log.t, run.angles[:, PITCH])
    assert run.log.measured[:, 1] == pytest.approx(then, abs=1e-5)
    assert run.log.measured[:3, 1] == pytest.approx(0.0, abs=1e-12)


VANISHING = {
    "backlash": {"gap": 1e-9},
    "drive_compliance": {"stiffness": 1e6, "damping": 100.0},
    "wheel_slip": {"stiffness": 500.0, "limit": 500.0},
    "slosh": {"mass_ratio": 1e-9, "height": 0.8, "frequency": 6.0, "damping": 0.05},
    "payload_step": {"time": 0.1, "ratio": 1e-9},
    "external_push": {"start": 0.1, "end": 0.2, "torque": 1e-9},
    "imu_lag": {"delay": 1e-9},
    "accelerometer_tilt": {"gain": 1e-9, "time_constant": 1.0},
    "stribeck_drive": {"static": 1e-9, "sliding": 1e-9, "speed": 0.5},
    "presliding_drive": {"torque": 1e-9, "stiffness": 1.0},
    "body_damping": {"coefficient": 1e-9},
}


@pytest.mark.parametrize("effect", VANISHING)
def test_an_effect_of_no_size_leaves_no_trace(effect):
    hide = {f"{effect}.{name}": value for name, value in VANISHING[effect].items()}
    plain, with_it = (engine_run(h, duration=0.5, noise=0.0).log.measured for h in ({}, hide))
    assert with_it == pytest.approx(plain, abs=2e-3)


def test_springs_and_pendulums_without_damping_keep_the_energy():
    hide = {"drive_compliance.stiffness": 40.0, "slosh.mass_ratio": 0.2, "slosh.height": 0.8, "slosh.frequency": 6.0}
    robot = Robot(hide, 2 * MAX_ENGINE_STEP_S, 1000)
    robot.model.dof_damping[:] = 0.0
    robot.model.opt.enableflags |= mujoco.mjtEnableBit.mjENBL_ENERGY
    robot.data.qpos[:] = WHEEL_RADIUS_M * 0.12, 0.1, 0.02, 0.0, 0.3
    kept = []
    for k in range(500):
        robot.move(k * SAMPLE_INTERVAL_S, np.zeros(k + 1))
        mujoco.mj_forward(robot.model, robot.data)
        kept.append(robot.data.energy.copy())
    total, moving = np.sum(kept, axis=1), np.array(kept)[:, 1]
    assert np.ptp(total) < 1e-4 * np.ptp(moving)


def test_a_delay_of_part_of_a_step_acts_on_average_when_it_should():
    hide = {"actuator_delay.delay": 0.00137}
    robot = held(hide, PITCH)
    commands = np.array([0.0, *np.ones(4)])
    for k in range(5):
        robot.move(k * SAMPLE_INTERVAL_S, commands[: k + 1])
    acted = 0.005 - 0.00237
    assert robot.data.qvel[DRIVE] == pytest.approx((1 - np.exp(-X6 / (X1 + X2) * acted)) / X6, rel=1e-3)


@pytest.mark.slow
@pytest.mark.parametrize("name", sorted(SHIPPED_LOGS))
def test_explain_finds_what_is_hidden_in_a_shipped_log_of_the_engine(name):
    told = explain(Model.default(), [data_folder() / f"{name}.csv"])
    assert set(told.effects) == {n.partition(".")[0] for n in SHIPPED_LOGS[name]} and told.verdict == "nothing_missing"
    assert told.error < 1.03 * told.noise_floor
    for full, value in SHIPPED_LOGS[name].items():
        row = told.parameters[full]
        assert abs(row.value - value) < 4.5 * row.sigma


@pytest.mark.parametrize("name", SHIPPED_LOGS)
def test_a_shipped_log_can_be_read_and_its_truth_lies_beside_it(name):
    log = load_log(data_folder() / f"{name}.csv")
    assert len(log) == 10001 and log.warnings == () and np.isfinite(log.measured).all()
    truth = json.loads((data_folder() / f"{name}_truth.json").read_text(encoding="utf-8"))
    assert truth["effects"] == SHIPPED_LOGS[name] and truth["parameters"]["X5"] == pytest.approx(
        TRUE_PARAMETERS["X5"], rel=1e-5
    )


def test_a_log_is_shipped_as_the_engine_measured_it(tmp_path):
    log = engine_run({}, duration=0.2, seed=3).log
    (tmp_path / "log.csv").write_text(log_csv_text(log), encoding="utf-8")
    again = load_log(tmp_path / "log.csv")
    assert again.measured == pytest.approx(log.measured, abs=6e-6) and again.voltage == pytest.approx(
        log.voltage, abs=6e-4
    )
