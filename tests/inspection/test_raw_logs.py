"""Raw logs without a model: units that no name states, counters, counts, speeds, commands that are constant."""

from __future__ import annotations

import json
import re
import tomllib
from pathlib import Path

import numpy as np
import pytest
from scipy.signal import lfilter

from tests.raw_logs import (
    arm_with_torque_sensor,
    driven_axis,
    fast_motor,
    late_motor,
    robot,
    swing,
    two_wheels,
    way_of,
    write_csv,
)
from tests.support import ROOT, run
from wheelpend import Failure
from wheelpend.inspection.angle_unit import swings_beyond_a_turn
from wheelpend.inspection.counters import counter_sentence
from wheelpend.inspection.first_look import FirstLook, first_look
from wheelpend.inspection.gravity import turning_points
from wheelpend.inspection.survey import survey_file

pytestmark = pytest.mark.filterwarnings("error")
FREE_TORQUE = 0.5 * np.sin(2 * np.pi * (0.2 + 0.04 * np.arange(3000) * 0.005) * np.arange(3000) * 0.005)


def tracked_swing():
    t, _, angle = swing(1500, 0.9)
    return {
        "t": t,
        "X": np.round(700 * np.sin(angle), 1),
        "Y": np.round(-700 * np.cos(angle), 1),
        "angle_deg": np.degrees(angle),
    }


def free_swing_in_degrees() -> dict[str, np.ndarray]:
    t, _, angle = swing()
    return {"time": t, "angle": np.round(np.degrees(angle) / 0.09) * 0.09}


def driven_swing_in_degrees() -> dict[str, np.ndarray]:
    t, torque, angle = swing(begin=0.0, torque=FREE_TORQUE)
    return {"t": t, "torque_Nm": torque, "q": np.degrees(angle)}


def axis(**other: np.ndarray) -> dict[str, np.ndarray]:
    t, volts, way = driven_axis()
    return {"t": t, "u": volts, "x": way, **other}


def duty_axis(**other: np.ndarray) -> dict[str, np.ndarray]:
    t, volts, way = driven_axis()
    return {"t": t, "pwm": np.round(volts / 11.4 * 255), "x": way, **other}


def two_speeds() -> dict[str, np.ndarray]:
    """A motor's speed as its encoder has it, and behind the low-pass filter of its firmware, which is called actual."""
    t, volts, way = driven_axis()
    raw = np.round(np.gradient(way, t) * 300.0, 2)
    filtered = np.round(lfilter([0.2], [1.0, -0.8], raw), 2)
    return {"t": t, "u": volts, "actual_rpm": filtered, "raw_rpm": raw}


def full_duty() -> np.ndarray:
    """PWM counts (N,) that reach ±255."""
    return np.clip(np.round(driven_axis()[1] / 8.0 * 255), -255, 255)


def sign_law() -> dict[str, np.ndarray]:
    t, torque, angle = swing(begin=0.3, law=0.3)
    return {"time": t, "position": angle, "torque": torque}


ROWS = np.arange(2000.0)
KEPT = np.random.default_rng(2).random(2000) > 0.1  # of the rows; the others were lost
RAW = {
    "an angle in degrees": free_swing_in_degrees,
    "a driven angle in degrees": driven_swing_in_degrees,
    "an angle within a turn, in degrees": lambda: fast_motor() | {"angle": fast_motor()["angle"] % 360.0},
    "an angle that turns too fast in rad": fast_motor,
    "an encoder's counts": lambda: {
        "t": driven_axis()[0],
        "u": driven_axis()[1],
        "Encoder": np.round(4e3 * axis()["x"]),
    },
    "PWM counts and a battery": lambda: duty_axis(vbat=11.6 - 0.2 * np.sin(0.003 * ROWS) ** 2),
    "PWM counts alone": duty_axis,
    "PWM counts under a name that says nothing": lambda: {"t": axis()["t"], "x": axis()["x"], "m": full_duty()},
    "a counter of rows": lambda: {"n": ROWS, **axis()},
    "the other wheel of a robot whose body is not logged": two_wheels,
    "a speed behind a filter, beside it": two_speeds,
    "a copy of a column": lambda: axis(u_counts=21.25 * axis()["u"]),
    "the coordinates beside an angle, of a tracker": tracked_swing,
    "no times": lambda: {n: v for n, v in axis().items() if n != "t"},
    "a control error beside the reading": lambda: axis(err=0.5 - axis()["x"]),
    "a second clock": lambda: {n: v[KEPT] for n, v in axis(device_time=5.0 + 1e3 * axis()["t"]).items()},
    "a controller on the sign of the rate": sign_law,
    "a current beside the voltage": lambda: {
        "t": axis()["t"],
        "voltage": axis()["u"],
        "current": axis()["u"] - 30.0 * np.gradient(axis()["x"]),
        "x": axis()["x"],
    },
    "the raw counts of a gyro": lambda: robot(gyro=131.0 * np.rad2deg(1.0) * robot()["gyro"]),
    "a pitch sensor that is mounted upside down": lambda: robot(pitch=180.0 + np.rad2deg(robot()["pitch"])),
    "a robot of whose wheels only the speed is logged": lambda: {
        n: v for n, v in robot(wheel_speed=np.gradient(robot()["wheel"], robot()["time"])).items() if n != "wheel"
    },
    "a torque that a sensor reads with noise": arm_with_torque_sensor,
    "a command that is logged a row after it acts": late_motor,
}


def look_at(columns: dict[str, np.ndarray], folder: Path) -> FirstLook:
    return first_look(write_csv(folder / "log.csv", columns))


def said_and_found(look: FirstLook) -> list[str]:
    return [*look.proposal.sentences, *(f.sentence for f in (look.inspection.findings if look.inspection else ()))]


def documented() -> dict[str, str]:
    text = (ROOT / "docs" / "faults.md").read_text(encoding="utf-8").partition("## Without a model")[2]
    rows = re.findall(r"^\| (.+?) \| (.+?) \| .+? \|$", text, re.M)[1:]
    return {name: said for name, said in rows if set(name) != {"-"}}


def test_the_table_lists_every_raw_log_that_is_tried():
    assert list(documented()) == list(RAW)


@pytest.mark.parametrize("name", RAW)
def test_each_raw_log_is_read_as_the_docs_say(name, tmp_path):
    look = look_at(RAW[name](), tmp_path)
    pattern = ".*".join(map(re.escape, documented()[name].split("…")))
    assert any(re.fullmatch(pattern, s, re.S) for s in said_and_found(look)), (pattern, said_and_found(look))
    assert not any("no machine does that" in s for s in said_and_found(look))


@pytest.mark.parametrize(("name", "channel", "entry"), [
    ("an angle in degrees", "theta_1", {"unit": "deg"}), ("a driven angle in degrees", "theta_1", {"unit": "deg"}),
    ("an encoder's counts", "theta_m", {"scale": pytest.approx(2 * np.pi / 4096, rel=1e-6)}),
    ("PWM counts alone", "v_in", {"scale": 0.0470588}),
    ("PWM counts and a battery", "v_in", {"scale": pytest.approx(1 / 255, rel=1e-5), "times": "vbat"}),
    ("PWM counts under a name that says nothing", "v_in", {"column": "m", "scale": 0.0470588}),
])  # fmt: skip
def test_a_guess_is_a_line_with_its_reason(name, channel, entry, tmp_path):
    look = look_at(RAW[name](), tmp_path)
    found = tomllib.loads(look.model)["columns"][channel]
    assert {k: found[k] for k in entry} == entry
    (line,) = [row for row in look.model.splitlines() if row.startswith(f"{channel} = {{")]
    assert "# guessed: " in line and look.guesses[channel] in line


@pytest.mark.parametrize("name", ["n", "frame_idx", "index"])
def test_a_counter_is_never_the_time_where_a_clock_is_there(name, tmp_path):
    columns = axis()
    jitter = 1e-4 * np.sin(7.0 * ROWS)
    found = survey_file(write_csv(tmp_path / "log.csv", {name: ROWS, "clock": 1e6 * (columns["t"] + jitter), **{
        k: columns[k] for k in ("u", "x")}}))  # fmt: skip
    assert (found.clock.column, found.clock.unit, found.column(name).role) == ("clock", "us", "counter")


def test_a_moving_place_is_no_counter():
    t = np.arange(100) * 0.01
    assert counter_sentence("x", way_of(np.full(100, 9.0)), t) == ""
    assert counter_sentence("n", np.arange(100.0), t) and counter_sentence("s", 1e3 * t + 1, t)
    assert counter_sentence("v", 3.0 * t + 1, t) == "", "no clock has such a unit"


@pytest.mark.parametrize("other", ["rpm", "motor_speed", "estimated_velocity", "dt_avg_ms", "wheelOmega"])
def test_a_speed_or_a_duration_is_no_place(other, tmp_path):
    noise = np.cumsum(np.random.default_rng(5).normal(size=2000))
    found = survey_file(write_csv(tmp_path / "log.csv", axis(**{other: noise})))
    assert found.of_role("position") == ["x"] and found.column(other).role == "further"


def test_a_log_of_a_speed_alone_has_it_summed(tmp_path):
    columns = duty_axis()
    path = write_csv(tmp_path / "log.csv", {"time_ms": 1e3 * columns["t"], "pwm": columns["pwm"],
                                            "rpm": 60 * np.gradient(columns["x"], 0.005)})  # fmt: skip
    look = first_look(path)
    assert '{ column = "rpm", unit = "rpm" }  # guessed: a speed, which is summed over time' in look.model
    turned = 2 * np.pi * (columns["x"] - columns["x"][0])
    assert look.log.measured[:, 0] == pytest.approx(turned, abs=0.02 * np.ptp(turned))
    assert "[sensors.step]" not in look.model  # what it comes to has none
    as_slide = first_look(path, "slide")
    assert 'x = { column = "rpm", unit = "m/s", scale = 0.1047198 }' in as_slide.model
    assert as_slide.log.measured == pytest.approx(look.log.measured, rel=1e-6)


def test_a_motors_encoder_is_read_and_its_pwm_is_told(tmp_path):
    columns = duty_axis()
    found = survey_file(write_csv(tmp_path / "log.csv", {"t": columns["t"], "MotorPWM": columns["pwm"],
                                                         "motor_encoder_L": columns["x"]}))  # fmt: skip
    assert (found.of_role("input"), found.of_role("position")) == (["MotorPWM"], ["motor_encoder_L"])


@pytest.mark.parametrize("place", ["theta", "q"])
def test_a_v_that_is_no_rate_is_the_input_and_a_theta_is_an_angle(place, tmp_path):
    t, volts, way = driven_axis()
    look = look_at({"t": t, "v": np.round(20 * volts), place: np.round(60 * way)}, tmp_path)
    found = tomllib.loads(look.model)
    assert found["columns"]["v_in"]["column"] == "v"
    assert found["plant"] == "shaft"  # counts that no gravity pulls back


def test_an_encoder_of_4096_counts_a_turn_reads_an_angle(tmp_path):
    step = 2 * np.pi / 4096
    found = tomllib.loads(look_at(axis(x=np.round(axis()["x"] / step) * step), tmp_path).model)
    assert found["plant"] == "shaft" and "assumptions" not in found


@pytest.mark.parametrize("header", [True, False])
def test_a_step_from_rest_is_an_input_that_never_changes(header, tmp_path):
    t = np.arange(100) * 0.005
    path = write_csv(tmp_path / "log.csv", {"i": ROWS[:100], "pwm": np.full(100, 200.0), "micros": 88 + 1e6 * t,
                                            "x": way_of(np.full(100, 9.0))}, header)  # fmt: skip
    look = first_look(path)
    assert tomllib.loads(look.model)["plant"] == "slide" and not look.refusal
    assert look.log is not None and np.ptp(look.log.voltage) == 0.0 and "a duty of ±255" in look.guesses["v_in"]


@pytest.mark.parametrize("command", ["identify", "explain"])
def test_a_step_from_rest_is_identified(command, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    way = np.round(way_of(np.full(300, 9.0)), 5)
    path = write_csv(tmp_path / "step.csv", {"t": np.arange(300) * 0.005, "v_in": np.full(300, 9.0), "x": way})
    run("new", tmp_path / "axis", "--from", path)
    run(command, path, "--model", tmp_path / "axis" / "model.toml", "--json", tmp_path / "out.json")
    found = json.loads((tmp_path / "out.json").read_text(encoding="utf-8"))
    if command == "explain":  # with the motor's own damping, the inertia is that of the axis
        assert found["effects"] == ["viscous_drive"] and found["error"] < 1.5 * found["noise_floor"]
        assert found["parameters"]["X1"]["value"] == pytest.approx(0.8, rel=0.02)


@pytest.mark.parametrize(("volts", "moves"), [(0.0, True), (6.0, False)])
def test_a_constant_command_that_moves_nothing_is_refused(volts, moves, tmp_path):
    t = np.arange(200) * 0.005
    way = way_of(np.full(200, 6.0)) if moves else 1e-6 * np.random.default_rng(1).normal(size=200)
    write_csv(tmp_path / "log.csv", {"t": t, "v_in": np.full(200, volts), "x": way})
    (tmp_path / "model.toml").write_text('plant = "slide"\n', encoding="utf-8")
    failed = run("identify", tmp_path / "log.csv", "--model", tmp_path / "model.toml", code=1)
    assert "Failure" in failed.output and "Traceback" not in failed.output


def test_a_plant_and_columns_that_nearly_match_are_suggested(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    path = write_csv(tmp_path / "log.csv", axis())
    for command in (("inspect", path), ("new", tmp_path / "axis", "--from", path)):
        assert "Did you mean 'slide'?" in " ".join(run(*command, "--plant", "slid", code=1).output.split())
    (tmp_path / "model.toml").write_text('plant = "slide"\n[columns]\nx_rf = { column = "x" }\n', encoding="utf-8")
    failed = run("inspect", path, "--model", tmp_path / "model.toml", code=1)
    assert "Did you mean 'x_ref'?" in " ".join(failed.output.split())


def test_turning_points_and_swings_beyond_a_turn():
    t = np.linspace(0, 20, 2000)
    assert turning_points(np.cos(np.pi * t)).size == 19
    assert not swings_beyond_a_turn(3.0 * np.cos(t)) and swings_beyond_a_turn(100 * np.cos(t))
    assert not swings_beyond_a_turn(20 * t)


MACHINES = {
    "axis": axis, "free": lambda: {"t": swing()[0], "q": swing()[2]}, "sign law": sign_law, "duty": duty_axis,
    "two": lambda: axis(y=1.5 * np.sin(2 * axis()["t"]), x_ref=axis()["x"] + 0.01, dx=np.gradient(axis()["x"], 0.005)),
}  # fmt: skip


@pytest.mark.parametrize("rows", [0, 1, 2, 3, 19, 20, 21, 25, 33, 50, 61, 100, 121, 250, 399, 401])
@pytest.mark.parametrize("machine", MACHINES)
def test_a_log_of_any_length_is_read_or_refused_in_words(machine, rows, tmp_path):
    path = write_csv(tmp_path / "log.csv", {n: v[:rows] for n, v in MACHINES[machine]().items()})
    try:
        assert first_look(path).model
    except Failure as failure:
        assert str(failure).startswith("log.csv")


@pytest.mark.parametrize("rows", [1, 20, 23, 50])
def test_every_command_tells_what_a_tiny_log_lacks(rows, tmp_path):
    path = write_csv(tmp_path / "log.csv", {n: v[:rows] for n, v in axis(v_in=axis()["u"]).items() if n != "u"})
    (tmp_path / "model.toml").write_text('plant = "slide"\n', encoding="utf-8")
    for command in ("identify", "compare", "diagnose", "explain", "inspect"):
        result = run(command, path, "--model", tmp_path / "model.toml", code=None)
        assert result.exit_code == 0 or "Failure" in result.output, (command, result.exception)


def test_a_motors_speed_without_a_name_is_summed(tmp_path):
    rng, speed = np.random.default_rng(4), np.zeros(500)
    volts = np.repeat(rng.choice([1.84, 3.08], 50), 10)
    for k in range(499):
        speed[k + 1] = speed[k] + 0.42 * (160.0 * volts[k] - 35.0 - speed[k])
    speed = np.round(speed / 6.428571) * 6.428571  # deg/s, by an encoder's counts
    rows = "\n".join(f"{0.02 * k:.2f},{u:.4f},{y:.6f}" for k, (u, y) in enumerate(zip(volts, speed, strict=True)))
    (tmp_path / "log.csv").write_text(f"t,u,y\n{rows}\n")
    look = first_look(tmp_path / "log.csv")
    assert 'theta_m = { column = "y", unit = "rad/s" }  # guessed' in look.model and "0.0174533 for deg/s" in look.model
    assert "y, a speed, is summed" in " ".join(look.proposal.sentences)


def test_stamps_that_come_late_are_no_place_where_the_interval_is_said(tmp_path):
    t = 0.001 * np.arange(400)
    t[200:] += 0.002
    t[39] = t[38]  # stamped late
    way = np.cumsum(0.05 * np.sin(0.05 * np.arange(400)))
    rows = "\n".join(f"{a:.3f} {b:.5f}" for a, b in zip(t, way, strict=True))
    (tmp_path / "log.txt").write_text(f"{rows}\n")
    columns = {c.name: c for c in survey_file(tmp_path / "log.txt", interval=0.001).columns}
    assert columns["column 1"].role == "counter" and "those that are said are used" in columns["column 1"].remark
    assert columns["column 2"].role == "position"


def test_a_plant_whose_place_no_column_fits_keeps_the_input(tmp_path):
    rows = "\n".join(f"{0.01 * k:.2f},{k // 50 % 2},{(-1) ** k * 7.0}" for k in range(300))
    (tmp_path / "log.csv").write_text(f"t,u,y\n{rows}\n")
    model = first_look(tmp_path / "log.csv", "pendulum").model
    assert "driven = true" in model and 'v_in = { column = "u" }' in model


def test_a_plant_takes_of_two_inputs_the_one_that_acts_and_says_so(tmp_path):
    t = 0.01 * np.arange(600)
    commanded = {"command_angle": 20.0 * np.sign(np.sin(t)), "current_mA": 200.0 * np.sin(3.0 * t)}
    write_csv(tmp_path / "log.csv", {"t": t, **commanded, "feedback_angle": 30.0 * np.sin(2.0 * t)})
    look = first_look(tmp_path / "log.csv", "pendulum")
    assert "driven = true" in look.model and 'v_in = { column = "current_mA"' in look.model
    assert "one of 2 inputs" in look.model


@pytest.mark.parametrize("rows", [100, 102, 110])
def test_an_angle_that_is_read_too_seldom_in_every_stretch_is_no_fault(tmp_path, rows):
    rng = np.random.default_rng(0)
    t = np.cumsum(0.017 * (1.0 + 0.4 * rng.uniform(-1.0, 1.0, rows)))
    angle = np.cumsum(np.abs(rng.normal(0.22, 0.15, rows)))
    angle[50] += 5.0  # one reading is off, and the stretch has one too few
    write_csv(tmp_path / "log.csv", {"time": t, "voltage": 0.3 + 0.1 * np.sin(9.0 * t), "angle": angle})
    assert "angle" in first_look(tmp_path / "log.csv").model


def test_an_angle_in_degrees_beside_the_same_in_rad_is_a_copy_and_so_is_the_motors_side_of_a_gear(tmp_path):
    t = 0.01 * np.arange(600)
    angle = np.sin(t)
    columns = {"t": t, "angle [rad]": angle, "angle [deg]": np.degrees(angle), "shaft [deg]": 6.0 * np.degrees(angle)}
    write_csv(tmp_path / "log.csv", columns)
    roles = {c.name: c.role for c in survey_file(tmp_path / "log.csv").columns}
    assert sorted(roles.values()) == ["copy", "copy", "position", "time"]


def counted_per_row() -> dict[str, np.ndarray]:
    """Counts (N,) of both wheels' encoders since the row before, under a staircase of duties."""
    duty = np.repeat(np.r_[0.0, 100.0, 140.0, 0.0, -120.0, 0.0], 100)
    noise = np.random.default_rng(3)
    speed = lfilter([0.3], [1.0, -0.7], duty * 0.14)
    return {
        "command": duty,
        **{f"delta_{s}": np.round(speed + noise.normal(size=600, scale=0.4)) for s in ("left", "right")},
    }


def test_counts_since_the_row_before_are_a_speed(tmp_path):
    look = first_look(write_csv(tmp_path / "log.csv", counted_per_row()), interval=0.01)
    assert 'theta_m = { column = "delta_left", unit = "rad/s" }  # guessed: a speed' in look.model
    places = {n: np.cumsum(v) if n.startswith("delta") else v for n, v in counted_per_row().items()}
    found = survey_file(write_csv(tmp_path / "place.csv", places), interval=0.01)
    assert found.of_role("position") == ["delta_left"] and not found.speed  # called so, but it follows no level


def test_where_no_plant_fits_the_line_to_begin_with_names_the_speed_and_not_what_it_was_summed_to(tmp_path):
    columns = {"t": np.arange(600) * 0.01, **counted_per_row(), "load_torque": np.sin(np.arange(600) * 0.05)}
    speed = columns.pop("delta_left")
    del columns["delta_right"]
    path = write_csv(tmp_path / "log.csv", {**columns, "voltage": np.cos(np.arange(600) * 0.03), "output_speed": speed})
    with pytest.raises(Failure, match="no plant has 1 position and 3 inputs") as refused:
        first_look(path)
    assert 'theta_m = { column = "output_speed", unit = "rad/s" }' in str(refused.value)


def swinging_phone(**other: np.ndarray) -> dict[str, np.ndarray]:
    """What the gyro of a phone reads that swings about its y."""
    t, _, angle = swing(3000, 0.9)
    rng = np.random.default_rng(9)
    axes = {n: rng.normal(size=t.size, scale=0.01) for n in "xz"} | {"y": np.gradient(angle, t)}
    gyro = {f"Gyroscope {n} (rad/s)": axes[n] + rng.normal(size=t.size, scale=0.01) for n in "xyz"}
    size = np.sqrt(sum(v**2 for v in gyro.values()))
    return {"Time (s)": t, **gyro, "Absolute (rad/s)": size, **other}


def test_a_phone_that_swings_is_a_pendulum_by_the_axis_of_its_gyro_that_turns(tmp_path):
    look = first_look(write_csv(tmp_path / "log.csv", swinging_phone()))
    entry = tomllib.loads(look.model)["columns"]["theta_1"]
    assert (entry["column"], entry["unit"]) == ("Gyroscope y (rad/s)", "rad/s")
    assert abs(float(np.mean(look.log.measured))) < 0.05  # it hangs at 0, wherever the sum began


def test_the_gyro_of_what_is_driven_is_no_place(tmp_path):
    driven = swinging_phone(pwm=np.round(200 * np.sin(np.arange(3000) * 0.05)))
    assert survey_file(write_csv(tmp_path / "log.csv", driven)).speed == ""


def test_accelerations_of_an_imu_are_no_places(tmp_path):
    t, _, angle = swing(2000, 0.9)
    columns = {"t": t, "ax": np.sin(angle), "az": np.cos(angle), "gy": np.gradient(angle, t), "gx": 0.01 * np.sin(t)}
    found = survey_file(write_csv(tmp_path / "log.csv", columns))
    assert found.speed == "gy" and {found.column(n).role for n in ("ax", "az", "gx")} == {"further"}


def two_joints() -> dict[str, np.ndarray]:
    """Two joints that move nearly alike in a short log, with their rates."""
    t = np.arange(90) * 0.002
    noise = np.random.default_rng(1).normal(size=(4, 90), scale=1e-4)
    one, other = np.sin(9.0 * t), -0.8 * np.sin(9.0 * t)
    rates = np.gradient(one, t), np.gradient(other, t)
    return {"t": t, "joint0/position": one + 10 * noise[0], "joint1/position": other + noise[1],
            "joint1/velocity": rates[1] + 50 * noise[2], "joint0/velocity": rates[0] + 50 * noise[3]}  # fmt: skip


def test_of_places_that_move_alike_a_rate_has_the_one_of_its_name(tmp_path):
    found = survey_file(write_csv(tmp_path / "log.csv", two_joints()))
    assert {c.name: c.of for c in found.columns if c.role == "rate"} == {
        "joint0/velocity": "joint0/position", "joint1/velocity": "joint1/position"}  # fmt: skip


def test_a_gyro_that_counts_the_other_way_is_a_rate(tmp_path):
    t, _, angle = swing(3000, 1.0)
    rng = np.random.default_rng(3)
    columns = {"t": t, "angle": angle + rng.normal(size=t.size, scale=2e-3),
               "gyro_z": -np.gradient(angle, t) + rng.normal(size=t.size, scale=0.01)}  # fmt: skip
    entry = survey_file(write_csv(tmp_path / "log.csv", columns)).column("gyro_z")
    assert entry.words == "rate of angle" and entry.remark.endswith("nothing of its white noise: a sensor of its own.")


def test_a_reading_that_stands_twice_is_a_copy_and_the_same_command_of_two_motors_is_not(tmp_path):
    twice = axis(theta=axis()["x"])
    found = survey_file(write_csv(tmp_path / "log.csv", {**twice, "theta_copy": twice["theta"]}))
    assert found.column("theta_copy").role == "copy"
    duty = duty_axis()["pwm"]
    motors = {**axis(), "Output_l": duty, "Output_r": duty}
    assert survey_file(write_csv(tmp_path / "motors.csv", motors)).column("Output_r").role != "copy"


def test_the_motors_of_a_machine_have_one_full_scale(tmp_path):
    t, _, angle = swing(2000, 0.3)
    duty = np.round(120.0 * np.sin(3.0 * t))
    columns = {"t": t, "left_pwm": np.clip(duty, -110, 110), "right_pwm": duty + 15, "left_count": np.cumsum(duty),
               "right_count": np.cumsum(duty + 15), "pitch": angle}  # fmt: skip
    model = first_look(write_csv(tmp_path / "log.csv", columns), "wheel_pendulum").model
    scales = {e["scale"] for n, e in tomllib.loads(model)["columns"].items() if n.startswith("v_")}
    assert len(scales) == 1 and pytest.approx(scales.pop(), rel=1e-4) == 12.0 / 255


def test_a_unit_without_a_conversion_is_asked_for(tmp_path):
    columns = {n if n != "u" else "force (kgf)": v for n, v in axis().items()}
    model = first_look(write_csv(tmp_path / "log.csv", columns)).model
    assert 'v_in = { column = "force (kgf)" }  # guessed: kgf is no known unit: put scale = N per kgf' in model


def test_a_stated_unit_of_the_times_is_kept_however_slow_the_log_is(tmp_path):
    slow = write_csv(
        tmp_path / "log.csv", {"time_s": np.arange(600.0), **{n: v[:600] for n, v in axis().items() if n != "t"}}
    )
    assert survey_file(slow).clock.unit == "s"


def test_sec_in_a_word_is_no_clock(tmp_path):
    t, _, angle = swing(2000, 0.3)
    columns = {"second_angle": angle, "speed_deg_per_sec": np.degrees(np.gradient(angle, t))}
    found = survey_file(write_csv(tmp_path / "log.csv", columns), interval=0.005)
    assert found.column("speed_deg_per_sec").words == "rate of second_angle"


def test_a_motors_voltage_by_its_letters_is_the_input(tmp_path):
    columns = axis()
    path = write_csv(tmp_path / "log.csv", {"t": columns["t"], "V_m": columns["u"], "theta_m": columns["x"]})
    found = survey_file(path)
    assert (found.of_role("input"), found.of_role("position")) == (["V_m"], ["theta_m"])
    torque = write_csv(tmp_path / "torque.csv", {"t": columns["t"], "tau_m": columns["u"], "q": columns["x"]})
    assert 'unit = "N m"' in first_look(torque).model


def test_a_speed_that_the_plant_has_no_place_for_is_not_summed(tmp_path):
    path = tmp_path / "log.csv"
    rows = "\n".join(f"{0.02 * k},{np.sin(k)},0.1,0.01,{np.cos(0.1 * k)}" for k in range(200))
    path.write_text(f"t,v_in,theta_w,theta_p,dtheta_p\ns,V,deg,nothing,?\n{rows}\n")  # the rate alone holds numbers
    assert survey_file(path).speed == "dtheta_p"
    assert "summed" not in " ".join(first_look(path).proposal.sentences)
