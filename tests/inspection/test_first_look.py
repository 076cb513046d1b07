"""Without a model, inspection says what the columns are, which plant has them, and what model.toml to begin with."""

from __future__ import annotations

import tomllib
from pathlib import Path

import numpy as np
import polars as pl
import pytest
from scipy.integrate import solve_ivp
from scipy.signal import savgol_filter

from tests.inspection.test_survey import pole_on_a_cart
from tests.plants.machines import log_of
from tests.support import DATA, run, simulated
from wheelpend import Failure, Model, simulate
from wheelpend.inspection.first_look import first_look
from wheelpend.inspection.gravity import gravity_zero, zero_offset
from wheelpend.inspection.proposal import propose, with_cures
from wheelpend.inspection.signals import Signals
from wheelpend.inspection.survey import survey_file
from wheelpend.logs.read import save_log

pytestmark = pytest.mark.filterwarnings("error")


def measured(name: str) -> Path:
    path = DATA / name
    if not path.exists():
        pytest.skip("the measured log is not here")
    return path


def roles(path: Path) -> dict[str, tuple[str, str]]:
    return {c.name: (c.role, c.of) for c in survey_file(path).columns}


def remark(path: Path, name: str) -> str:
    return survey_file(path).column(name).remark


def test_the_arms_columns_are_two_angles_their_computed_rates_and_two_torques():
    path = measured("dfki_arm/measured.csv")
    found = roles(path)
    assert found == {"time": ("time", ""), "pos1": ("position", ""), "pos2": ("position", ""), "vel1": ("rate", "pos1"),
                     "vel2": ("rate", "pos2"), "tau1": ("input", ""), "tau2": ("input", "")}  # fmt: skip
    assert remark(path, "vel1").endswith("no sensor of its own.") and remark(path, "vel2").endswith(
        "no sensor of its own."
    )
    assert survey_file(path).column("pos1").step == pytest.approx(3.8e-4, rel=0.01)


def test_the_arm_is_a_pendulum_of_two_links_that_two_torques_drive():
    found = tomllib.loads(first_look(measured("dfki_arm/measured.csv")).model)
    assert (found["plant"], found["assumptions"]) == ("pendulum", {"links": 2, "driven": "both"})
    assert found["input"] == {"unit": "N m"}
    assert {n: c["column"] for n, c in found["columns"].items()} == {
        "t": "time", "v_in": "tau1", "v_in_2": "tau2", "theta_1": "pos1", "theta_2": "pos2"
    }  # fmt: skip


@pytest.mark.parametrize("file", ["DATA_EMPS.mat", "DATA_EMPS_PULSES.mat"])
def test_the_axis_is_a_slide_with_a_reference_and_constants(file):
    path = measured(f"emps/{file}")
    survey = survey_file(path)
    proposal = propose(survey)
    assert tomllib.loads(proposal.text) == {
        "plant": "slide",
        "columns": {"v_in": {"column": "vir"}, "x": {"column": "qm"}, "x_ref": {"column": "qg"}},
    }
    assert survey.scalars == pytest.approx({"gtau": 35.1507, "kp": 160.18, "kv": 243.45}, rel=1e-5)
    assert survey.of_role("further") == (["pulses_N"] if "PULSES" in file else [])


def test_the_free_pendulum_is_measured_from_upright_and_its_rate_is_no_sensor():
    path = measured("free_pendulum/decay.csv")
    proposal = propose(survey_file(path))
    found = tomllib.loads(proposal.text)
    assert found["plant"] == "pendulum" and "assumptions" not in found
    assert found["columns"] == {
        "theta_1": {"column": "angle", "offset": pytest.approx(-np.pi, abs=1e-6)},
        "t": {"column": "time"},
    }
    assert remark(path, "rate").endswith("no sensor of its own.")
    assert any("measured from upright" in s for s in proposal.sentences)


@pytest.mark.parametrize("file", ["sin_sin_400", "up_and_down_100", "sin_time_square_800"])
def test_the_servo_is_a_driven_pendulum_with_4096_counts(file):
    look = first_look(measured(f"servo_pendulum/{file}.csv"))
    found = tomllib.loads(look.model)
    assert (found["plant"], found["assumptions"]) == ("pendulum", {"driven": True})
    assert 2 * np.pi / found["sensors"]["step"]["theta_1"] == pytest.approx(4096, rel=1e-3)
    assert any("4096 counts" in s for s in look.proposal.sentences)


def test_the_balancing_robot_has_its_encoder_against_the_body_and_a_fused_pitch():
    look = first_look(measured("mini_segway/balancing.csv"))
    assert tomllib.loads(look.model) == {
        "plant": "wheel_pendulum",
        "sensors": {"encoder": "relative", "encoder_counts": 4496},
    }
    assert [f.kind for f in look.inspection.findings] == ["filtered", "filtered", "relative_encoder"]
    assert "no raw sensor" in look.survey.column("dtheta_p").remark


@pytest.mark.slow
@pytest.mark.parametrize(("machine", "plant", "chosen"), [
    ("slide", "slide", {}), ("cart_pole", "cart_pole", {}), ("driven pendulum", "pendulum", {"driven": True}),
    ("two links", "pendulum", {"links": 2}), ("pendulum", "pendulum", {}),
])  # fmt: skip
def test_a_simulated_log_of_each_plant_is_recognised_by_its_columns(machine, plant, chosen, tmp_path):
    from tests.plants.machines import model_of

    save_log(tmp_path / "log.csv", log_of(machine), table=model_of(machine).table)
    found = tomllib.loads(propose(survey_file(tmp_path / "log.csv")).text)
    assert (found["plant"], found.get("assumptions", {})) == (plant, chosen)


def test_a_gyro_with_noise_of_its_own_is_a_sensor(tmp_path):
    save_log(tmp_path / "log.csv", simulated(duration=8.0))
    assert "a sensor of its own" in remark(tmp_path / "log.csv", "dtheta_p")


@pytest.mark.parametrize("zero", [0.0, 0.6, np.pi, -2.0])
def test_gravity_shows_where_an_angle_hangs(zero):
    t = np.arange(20_000) * 1e-3
    angle, speed, states = 1.2, 0.0, []
    for _ in t:
        speed -= 1e-3 * (20 * np.sin(angle) + 0.1 * speed)
        angle += 1e-3 * speed
        states.append(angle)
    found = gravity_zero(Signals(1e-3, np.zeros(t.size), {"q": np.array(states) + zero}, ""), "q", [])
    assert abs(np.angle(np.exp(1j * (found - zero)))) < 0.01
    assert zero_offset(found) == pytest.approx({0.0: 0.0, np.pi: -np.pi}.get(zero, -zero), abs=0.01)


def test_an_arm_that_is_held_at_first_hangs_where_it_comes_to_rest(tmp_path):
    t = np.arange(0.0, 1.2, 0.036)
    swing = solve_ivp(lambda _, x: (x[1], -300.0 * np.sin(x[0]) - 16.0 * x[1]), (0.0, 1.2), (-0.53, 0.0), t_eval=t).y[0]
    seen = np.round(np.r_[np.full(75, -0.53), swing] / 0.0015) * 0.0015
    path = tmp_path / "let_go.csv"
    rows = "".join(f"{0.036 * k:.4f},{v:.5f}\n" for k, v in enumerate(seen))
    path.write_text("time,angle_rad\n" + rows, encoding="utf-8")
    assert "offset" not in first_look(path).proposal.text


@pytest.mark.parametrize("unit", ["_rad", "_deg", ""])
@pytest.mark.parametrize(("relative", "zero"), [(True, np.pi / 2), (True, 0.0), (False, -0.7), (True, np.pi)])
def test_gravity_shows_where_the_first_of_two_links_hangs(relative, zero, unit, tmp_path):
    def rates(_, x):  # two equal point masses on equal massless links
        bend = x[0] - x[1]
        matrix = np.array([[2.0, np.cos(bend)], [np.cos(bend), 1.0]])
        forces = -40.0 * np.array([2.0 * np.sin(x[0]), np.sin(x[1])])
        forces += np.sin(bend) * np.array([-(x[3] ** 2), x[2] ** 2]) - 0.05 * x[2:]
        return [*x[2:], *np.linalg.solve(matrix, forces)]

    t = np.arange(0.0, 8.0, 0.004)
    one, two, *_ = solve_ivp(rates, (0.0, 8.0), (1.1, 0.3, 0.0, 0.0), t_eval=t, rtol=1e-8).y
    seen = np.c_[one, two - one if relative else two] + (zero if not relative else (zero, 0.0))
    seen += 1e-4 * np.random.default_rng(4).normal(size=seen.shape)
    seen *= 1.0 if unit == "_rad" else 180.0 / np.pi
    path = tmp_path / "chain.csv"
    rows = "".join(f"{s:.4f},{a:.6f},{b:.6f}\n" for s, (a, b) in zip(t, seen, strict=True))
    path.write_text(f"t,theta1{unit},theta2{unit}\n" + rows, encoding="utf-8")
    found = tomllib.loads(first_look(path).proposal.text)["columns"]
    assert found["theta_1"].get("offset", 0.0) == pytest.approx(-zero, abs=0.03)
    assert found["theta_2"].get("offset", 0.0) == pytest.approx(0.0 if relative else -zero, abs=0.03)


def test_a_slide_has_no_gravity(tmp_path):
    save_log(tmp_path / "log.csv", log_of("slide"), table=Model.default("slide").table)
    survey = survey_file(tmp_path / "log.csv")
    assert gravity_zero(survey.signals, "x", ["v_in"]) is None


def test_a_file_of_no_plant_is_refused_with_what_its_columns_are(tmp_path):
    rng = np.random.default_rng(1)
    walks = np.cumsum(rng.normal(size=(1000, 4)), axis=0)
    rows = np.column_stack([np.arange(1000) * 0.01, walks])
    np.savetxt(tmp_path / "log.csv", rows, delimiter=",", header="t,a,b,c,d", comments="")
    with pytest.raises(Failure, match=r"no plant has 4 positions and no inputs.*--plant NAME"):
        first_look(tmp_path / "log.csv")


def test_sections_are_joined_key_by_key():
    joined = with_cures(
        'plant = "slide"\n[columns]\nx = { column = "q" }\n',
        "[columns]\nx = { sign = -1 }\n[sensors]\nstep = { x = 0.5 }\n",
    )
    assert tomllib.loads(joined) == {
        "plant": "slide",
        "columns": {"x": {"column": "q", "sign": -1}},
        "sensors": {"step": {"x": 0.5}},
    }


def test_a_workspace_starts_as_its_log_suggests(tmp_path, monkeypatch):
    log = log_of("driven pendulum")
    save_log(tmp_path / "log.csv", log, table=Model.parse('plant = "pendulum"\n[assumptions]\ndriven = true\n').table)
    monkeypatch.chdir(tmp_path)
    assert "driven = true" in run("inspect", tmp_path / "log.csv").stdout
    said = run("new", tmp_path / "arm", "--from", tmp_path / "log.csv").output
    assert f"Try `wheelpend compare {(tmp_path / 'log.csv').resolve()}` there." in said
    assert Model.open(tmp_path / "arm").assumptions["driven"] is True
    said = run("new", tmp_path / "other", "--plant", "cart_pole", "--from", tmp_path / "log.csv").output
    assert (
        "x is not recognised: put theta_1_ref in its place" in said
        and Model.open(tmp_path / "other").plant == "cart_pole"
    )


def test_a_gyro_by_its_name_is_a_sensor_however_smooth_its_numbers_are(tmp_path):
    """At 200 Hz a filter of the angle gives most of a gyro's errors too: by its columns that was another machine."""
    log = simulate(Model.default(), duration=8.0, sample=0.005, seed=1, hide={"coulomb_drive.torque": 0.3}).to_frame()
    columns = {
        "time_ms": 52_341 + (1000 * log["t"]).round(),
        "pwm": (log["v_in"] * 255 / 24).round(),
        "left_enc": (log["theta_w"] * 4096 / (2 * np.pi)).round(),
        "pitch_deg": np.degrees(log["theta_p"]).round(2),
        "gyro_dps": np.degrees(log["dtheta_p"]).round(2),
    }
    pl.DataFrame(columns).write_csv(tmp_path / "drive.csv")
    assert 'plant = "wheel_pendulum"' in first_look(tmp_path / "drive.csv").model


@pytest.mark.parametrize("unit", ["rad", "deg"])
def test_a_pole_that_hangs_may_be_anywhere_and_one_that_balances_may_not(tmp_path, unit):
    t = np.arange(0.0, 8.0, 0.01)
    voltage, swing = 6.0 * (np.sin(1.7 * t) > 0.3), 0.4 * np.exp(-0.2 * t) * np.sin(5.0 * t)
    place = 0.1 * np.cumsum(voltage - 2.0 * np.tanh(t)) * 0.01
    scale = np.degrees(1.0) if unit == "deg" else 1.0
    balanced = pole_on_a_cart(hanging=False)
    logs = {
        "hanging": {"t": t, "volt": voltage, "x": place, f"theta_{unit}": scale * (np.pi + swing)},
        "balancing": {f"theta_{unit}" if n == "angle" else n: v for n, v in balanced.items()},
    }
    logs["balancing"][f"theta_{unit}"] = scale * logs["balancing"][f"theta_{unit}"]
    for name, columns in logs.items():
        pl.DataFrame(columns).write_csv(tmp_path / f"{name}.csv")
    found = {name: first_look(tmp_path / f"{name}.csv", "cart_pole") for name in ("hanging", "balancing")}
    assert 'range = "any"' in found["hanging"].model and "range" not in found["balancing"].model
    said = " ".join(found["hanging"].proposal.sentences)
    assert f'theta_{unit} is beyond ±π/2 for most of the log: it hangs or swings up, hence range = "any"' in said


def test_a_shaft_in_degrees_is_a_slides_place_in_rad(tmp_path):
    t = np.arange(600) * 0.01
    columns = {"t": t, "u": np.round(3.0 * np.sin(2.0 * t), 3), "q_deg": 200.0 * (1.0 - np.cos(2.0 * t))}
    pl.DataFrame(columns).write_csv(tmp_path / "log.csv")
    look = first_look(tmp_path / "log.csv", "slide")
    assert tomllib.loads(look.model)["columns"]["x"] == {"column": "q_deg", "scale": 0.01745329}
    assert "deg of a shaft, which are then rad in the place of m" in look.guesses["x"]


def test_a_joint_of_a_message_of_ros_is_in_rad_however_far_it_turns(tmp_path):
    t = np.arange(600) * 0.01
    u = np.round(3.0 * np.sin(2.0 * t), 3)
    for topic, told in (("/joint_states/arm/position", False), ("/encoder/arm/position", True)):
        columns = {"__time": t, "/cmd/voltage": u, topic: 15.0 * (1.0 - np.cos(2.0 * t))}
        pl.DataFrame(columns).write_csv(tmp_path / "log.csv")
        guess = first_look(tmp_path / "log.csv", "slide").guesses["x"]
        assert ("degrees" in guess) is told and ("rad of a shaft, as the messages of ROS" in guess) is not told


def test_a_rate_that_was_filtered_with_its_angle_is_no_second_sensor_of_a_pendulum(tmp_path):
    t = np.arange(0.0, 8.0, 0.025)
    swing = 1.2 * np.exp(-0.1 * t) * np.cos(5.0 * t) + 0.01 * np.random.default_rng(4).standard_normal(t.size)
    angle = savgol_filter(swing, 9, 3)
    rate = savgol_filter(swing, 9, 3, deriv=1, delta=0.025)
    pl.DataFrame({"time": t, "theta_kalman": angle, "theta_dot_kalman": rate}).write_csv(tmp_path / "kalman.csv")
    found = propose(survey_file(tmp_path / "kalman.csv"))
    assert remark(tmp_path / "kalman.csv", "theta_dot_kalman").endswith("no raw sensor.")
    assert tomllib.loads(found.text).get("assumptions") is None


def test_gravity_does_not_tell_degrees_from_radians_on_a_shaft(tmp_path):
    t = np.arange(0.0, 10.0, 0.02)
    voltage = 6.0 * np.sin(2 * np.pi * 0.55 * t)

    def speeds(now, state):
        drive = 6.0 * np.sin(2 * np.pi * 0.55 * now) - 0.04 * state[1] - 1.1e-4 * state[1] * abs(state[1]) + 0.19
        return [state[1], 115.0 * drive]

    angle = solve_ivp(speeds, (0.0, 10.0), [0.0, 0.0], t_eval=t, rtol=1e-8, max_step=0.02).y[0]
    counted = np.round(angle * 2048 / (2 * np.pi)) * 2 * np.pi / 2048
    pl.DataFrame({"t": t, "v_in": voltage, "theta_1": counted}).write_csv(tmp_path / "motor.csv")
    found = tomllib.loads(propose(survey_file(tmp_path / "motor.csv"), "shaft").text)
    assert found["columns"] == {"theta_m": {"column": "theta_1"}}
