"""The study of benches: its machines move as closed forms say, and its counts are those of its outcomes."""

import numpy as np
import pytest

from wheelpend.benchmarks.benches.cases import MACHINE_KINDS, made, plan
from wheelpend.benchmarks.benches.machines import Bench, counted, motion
from wheelpend.benchmarks.benches.page import page_text
from wheelpend.benchmarks.benches.robots import Imu, Loop, Robot, balanced, gains_of
from wheelpend.benchmarks.benches.runner import run
from wheelpend.benchmarks.benches.trial import Outcome


def test_a_shaft_gathers_speed_as_its_closed_form_says_and_stands_where_friction_holds_it():
    drive = np.full(200, 3.0)
    t, speed, tau = np.arange(200) * 0.01, 2.5 / 0.1, 0.02 / 0.1
    angles = motion(Bench(0.02, viscous=0.1, dry=0.5), 0.01, drive)
    assert angles == pytest.approx(speed * (t - tau * (1.0 - np.exp(-t / tau))), abs=2e-3)
    assert not motion(Bench(0.02, viscous=0.1, dry=3.1), 0.01, drive).any()


def test_a_motor_that_coasts_in_the_pauses_of_its_driver_runs_at_half_the_duty_nearly_as_fast_as_at_full():
    bench = Bench(0.02, viscous=0.01, back_emf=0.1, supply=12.0)
    half, full, back = (np.ptp(motion(bench, 0.01, np.full(300, d))[-50:]) / 0.49 for d in (6.0, 12.0, -6.0))
    assert full == pytest.approx(12.0 / 0.11, rel=1e-3)
    assert half == pytest.approx(6.0 / (0.01 + 0.1 / 2), rel=1e-3) and back == pytest.approx(half, rel=1e-6)


def test_a_link_without_friction_keeps_its_energy_and_dry_friction_takes_four_times_itself_a_period():
    free = motion(Bench(0.02, 1.0), 0.005, np.zeros(2000), 0.3)
    assert np.abs(free[-200:]).max() == pytest.approx(0.3, abs=1e-4)
    rubbed = motion(Bench(0.02, 1.0, dry=0.01), 0.005, np.zeros(2000), 0.3)
    turns = np.abs(rubbed[1:-1][np.diff(np.sign(np.diff(rubbed))) != 0])
    assert np.diff(turns[:6]) == pytest.approx(-0.02, abs=2e-3)  # of half a period, of a swing with sin θ near θ
    assert np.ptp(rubbed[-100:]) == 0.0 and abs(rubbed[-1]) <= 0.0101


ROBOT = Robot(0.02, 0.05, 0.025, 0.003, 3.0, 0.0, 0.0)
PERFECT_IMU = Imu(0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


def _run(robot, loop, imu=PERFECT_IMU, wanted=0.0, rows=100):
    return balanced(robot, imu, loop, np.full(rows, wanted), np.zeros(rows), np.random.default_rng(0))


def test_a_robot_without_a_voltage_falls_as_its_energy_says():
    idle = Loop(0.002, (0.0,) * 4, 6.0, 0, 10**8)
    readings, voltages = _run(ROBOT, idle, rows=190)
    pitch, rate = readings[:, 1], readings[:, 2]
    wheel = np.gradient(readings[:, 0] + pitch, 0.002)
    kinetic = 0.5 * (ROBOT.roll * wheel**2 + ROBOT.lean * rate**2 + ROBOT.rotor * (wheel - rate) ** 2)
    energy = kinetic + ROBOT.coupling * np.cos(pitch) * wheel * rate + ROBOT.weight * np.cos(pitch)
    assert not voltages.any() and pitch[-1] > 0.2
    assert energy[1:-1] == pytest.approx(ROBOT.weight * np.cos(0.03), abs=1e-3)
    assert _run(ROBOT, idle, rows=1000) is None


def test_a_robot_in_its_loop_goes_where_it_is_sent_and_sticking_gears_hold_it_off():
    damped = ROBOT._replace(damping=0.3)
    gains = gains_of(damped, 0.005, (4.0, 0.2, 10.0, 2.0), 2.0)
    loop = Loop(0.005, gains, 6.0, 0, 2000)
    readings, voltages = _run(damped, loop, wanted=2.0, rows=2000)
    assert readings[-200:, 0] + readings[-200:, 1] == pytest.approx(2.0, abs=0.05)
    assert np.abs(readings[-200:, 1]).max() < 0.01 and np.abs(voltages).max() <= 6.0
    stuck, _ = _run(damped._replace(dry=0.5), loop, wanted=2.0, rows=2000)
    assert np.ptp(readings[-800:, 0]) < 0.02 < 0.5 < np.ptp(stuck[-800:, 0])  # it hunts


def test_a_pitch_that_is_fused_with_an_accelerometer_lags_in_proportion_to_the_speed_gained():
    idle = Loop(0.002, (0.0,) * 4, 6.0, 0, 10**8)
    true, _ = _run(ROBOT, idle, rows=100)
    fused, _ = _run(ROBOT, idle, PERFECT_IMU._replace(radius_over_gravity=0.006, time_constant=2.0), rows=100)
    speed = np.gradient(true[:, 0] + true[:, 1], 0.002)
    assert (true[:, 1] - fused[:, 1])[-20:] == pytest.approx(0.003 * speed[-20:], rel=0.1)


def test_cases_are_drawn_alike_each_time_and_hold_what_they_hide():
    cases = plan(30)
    assert [c.kind for c in cases[:5]] == list(MACHINE_KINDS)
    for case in cases:
        bench = made(case)
        assert np.array_equal(bench.log.measured, made(case).log.measured)
        assert np.isfinite(bench.log.measured).all() and set(bench.hidden) <= set(_sizes(case.kind))
        assert ("coasting_driver.rate" in bench.hidden) == (case.kind == "coasting motor")
    assert 30 <= sum(len(made(c).hidden) for c in cases) <= 80


def _sizes(kind):
    swing = ("viscous_drive.coefficient", "coulomb_drive.torque", "quadratic_drive.coefficient", "encoder_zero.bias")
    if kind == "balancing robot":
        fused = ("accelerometer_tilt.gain", "accelerometer_tilt.time_constant")
        return ("coulomb_drive.torque", "actuator_delay.delay", "imu_bias.bias", "gyro_bias.bias", *fused)
    driven = ("coulomb_drive.torque", "actuator_delay.delay", "voltage_saturation.limit", "coasting_driver.rate")
    return swing if kind == "swing" else (*driven, swing[3] if kind == "driven pendulum" else swing[2])


def test_an_encoder_rounds_to_its_counts():
    assert counted(np.array([0.0, 0.9, 1.1]) * 2 * np.pi / 8, 8) == pytest.approx(np.array([0, 1, 1]) * 2 * np.pi / 8)


OUTCOMES = [
    Outcome("000 swing", {"coulomb_drive.torque": 0.1}, "nothing_missing", (("coulomb_drive", ()),),
            {"coulomb_drive.torque": (0.12, 0.01)}, 1.0),
    Outcome("001 motor", {"coulomb_drive.torque": 0.1}, "ambiguous",
            (("stribeck_drive", ("coulomb_drive",)),), {}, 1.0),
    Outcome("002 driven pendulum", {"encoder_zero.bias": 0.1}, "unexplained", (("tether_spring", ()),), {}, 2.0),
    Outcome("003 swing", failure="too short"),
]  # fmt: skip


def test_outcomes_are_counted_and_what_is_wrong_is_listed():
    assert [(o.missed, o.wrong, o.far_off) for o in OUTCOMES[:3]] == [
        (set(), [], []), (set(), [], []), ({"encoder_zero"}, ["tether_spring"], []),
    ]  # fmt: skip
    text = page_text(OUTCOMES)
    assert "3 of 120 planned logs. 1 more could not be explained." in text
    assert "| 002 driven pendulum | `encoder_zero.bias` 0.1 | `tether_spring` | `unexplained` |" in text
    assert "| 001 motor |" not in text and "| all | 3 | 2 of 3" in text and "| 1 of 3, " in text


def test_a_run_goes_on_where_it_was_interrupted(tmp_path):
    tried = []

    def attempt(case):
        tried.append(case.key)
        return Outcome(case.key)

    cases = plan(4)
    run(tmp_path, cases[:2], jobs=1, progress=lambda line: None, attempt=attempt)
    found = run(tmp_path, cases, jobs=1, progress=lambda line: None, attempt=attempt)
    assert [o.key for o in found] == [c.key for c in cases]
