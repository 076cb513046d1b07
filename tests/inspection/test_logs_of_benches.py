"""Columns as small controllers print them: PID blocks, currents, minutes, gyros that hit a stop, text among numbers."""

import math
import tomllib

import numpy as np
import pytest

from tests.raw_logs import robot, swing, way_of, write_csv
from wheelpend.errors import Failure
from wheelpend.inspection.first_look import first_look
from wheelpend.inspection.kinematics import gyro_counts, times_back
from wheelpend.inspection.survey import survey_file
from wheelpend.logs.noise import noise_of_moving, noise_of_values
from wheelpend.logs.white_noise import white_sigma


def motor(rows=1500, interval=0.01):
    """Times [s], volts, places and speeds (rows,) of a motor under steps that its speed follows within 0.1 s."""
    t = interval * np.arange(rows)
    volts = np.repeat(np.random.default_rng(4).uniform(-8.0, 8.0, rows // 100 + 1), 100)[:rows]
    speed = np.zeros(rows)
    for k in range(rows - 1):
        speed[k + 1] = speed[k] + interval / 0.1 * (12.0 * volts[k] - speed[k])
    return t, volts, np.cumsum(speed) * interval, speed


def columns_of(path):
    return tomllib.loads(first_look(path).model)["columns"]


def roles(path):
    return {c.name: c.role for c in survey_file(path).columns}


def test_a_set_point_of_a_speed_is_no_sensor_of_it(tmp_path):
    t, volts, _, speed = motor()
    log = {"ms": 1000 * t, "target_rpm": 100.0 * volts, "rpm": speed * 30.0 / math.pi, "pwm": np.round(20.0 * volts)}
    found = columns_of(write_csv(tmp_path / "speed.csv", log))
    assert found["theta_m"]["column"] == "rpm" and "dtheta_m" not in found


def test_of_a_pid_block_the_input_is_read_and_the_output_drives(tmp_path):
    t, volts, place, _ = motor()
    log = {"Time": 1000 * t, "Setpoint": place + 0.3 * volts, "Input": place, "Output": np.round(20.0 * volts)}
    found = columns_of(write_csv(tmp_path / "pid.csv", log))
    assert (found["v_in"]["column"], found["theta_m"]["column"]) == ("Output", "Input")


def test_the_terms_of_a_controller_are_no_places(tmp_path):
    t, volts, place, _ = motor()
    terms = {"P": 3.0 * np.sin(place) - place, "I": np.cumsum(np.cos(place)) * 0.01, "pwm": np.round(20.0 * volts)}
    found = roles(
        write_csv(tmp_path / "terms.csv", {"ms": 1000 * t, "setpoint": place + volts, "angle": place, **terms})
    )
    assert (found["angle"], found["P"], found["I"]) == ("position", "further", "further")


def test_a_current_beside_the_voltage_is_left_and_one_alone_drives(tmp_path):
    t, volts, place, speed = motor()
    current = volts - speed / 12.0 + 0.01 * np.sin(40.0 * t)
    log = {"time": t, "voltage": volts, "current": current, "position": place}
    look = first_look(write_csv(tmp_path / "both.csv", log))
    assert tomllib.loads(look.model)["columns"]["v_in"]["column"] == "voltage"
    assert any("current is measured beside voltage" in s for s in look.proposal.sentences)
    del log["voltage"]
    log["Iq_measured"] = log.pop("current")
    model = tomllib.loads(first_look(write_csv(tmp_path / "one.csv", log)).model)
    assert (model["columns"]["v_in"]["column"], model["input"]["unit"]) == ("Iq_measured", "A")


@pytest.mark.parametrize("name", ["time_min", "Time [min]", "t (minutes)"])
def test_minutes_are_sixty_seconds(tmp_path, name):
    t, volts, place, _ = motor()
    path = write_csv(tmp_path / "slow.csv", {name: t / 60.0, "voltage": volts, "position": place})
    assert first_look(path).log.t[-1] == pytest.approx(t[-1])


def test_a_gyro_that_a_stop_turns_round_is_no_wrapped_angle(tmp_path):
    t = 0.01 * np.arange(800)
    rate = np.where(t < 5.0, 20.0 * np.sin(2.0 * t), 0.0)
    rate[(t >= 4.8) & (t < 5.0)] = -330.0
    tilt = np.cumsum(rate) * 0.01
    log = {"time": t, "pitch_deg": tilt, "gyro_dps": rate, "enc": np.round(100 * np.sin(t)), "pwm": np.round(90 * tilt)}
    assert roles(write_csv(tmp_path / "stop.csv", log))["gyro_dps"] == "rate"


def test_columns_of_text_are_listed(tmp_path):
    t, volts, place, _ = motor(300)
    path = write_csv(tmp_path / "text.csv", {"time": t, "voltage": volts, "position": place})
    lines = path.read_text().splitlines()
    path.write_text("\n".join([lines[0] + ",state", *(f"{line},FWD" for line in lines[1:])]))
    assert roles(path)["state"] == "text"


@pytest.mark.parametrize(("cell", "said"), [(0, "Without its times"), (1, "a machine that nothing drives")])
def test_one_bad_cell_makes_no_log_without_times_or_without_an_input(tmp_path, cell, said):
    t, volts, place, _ = motor(300)
    path = write_csv(tmp_path / "bad.csv", {"time_ms": 1000 * t, "pwm": np.round(20 * volts), "position": place})
    lines = [line.split(",") for line in path.read_text().splitlines()]
    lines[200][cell] = "I2C error"
    path.write_text("\n".join(",".join(line) for line in lines))
    with pytest.raises(Failure, match=said) as failure:
        first_look(path)
    assert "row 200" in str(failure.value)


def test_an_upside_down_sensor_is_offset_by_half_a_turn_and_the_robot_stands(tmp_path):
    degrees = {n: np.degrees(robot()[n]) for n in ("pitch", "gyro")}
    log = robot(pitch=180.0 + degrees["pitch"], gyro=degrees["gyro"])
    look = first_look(write_csv(tmp_path / "over.csv", log))
    model = tomllib.loads(look.model)
    assert model["columns"]["theta_p"]["offset"] == pytest.approx(-math.pi, abs=1e-6)
    assert model["columns"]["theta_p"]["unit"] == "deg" and "range" not in model.get("assumptions", {})
    assert np.abs(look.log.measured[:, look.log.channels.index("theta_p")]).max() < 0.5


def test_a_robot_whose_wheels_speed_alone_is_logged_has_wheels(tmp_path):
    log = robot()
    log["wheel_speed"] = np.gradient(log.pop("wheel"), log["time"])
    look = first_look(write_csv(tmp_path / "speeds.csv", log))
    model = tomllib.loads(look.model)
    assert model["plant"] == "wheel_pendulum" and model["columns"]["theta_w"]["column"] == "wheel_speed"


def test_what_sways_by_forty_degrees_again_and_again_is_in_degrees():
    sway = 1.1 * np.sin(np.linspace(0.0, 20.0 * math.pi, 2000))
    assert times_back(sway, 0.7, 0.0) == 10 and times_back(0.5 * sway, 0.7, 0.0) == 0
    assert times_back(np.abs(2.0 * sway), 1.6, 0.8) == 20


def test_counts_of_a_gyro_are_known_by_how_many_are_a_degree_per_second():
    assert [gyro_counts(f * math.degrees(1.0)) for f in (131.0, 17.0, 64.0, 1.0, 17.5)] == [131.0, 16.4, 65.5, 0.0, 0.0]


def test_rows_that_are_missing_are_no_noise():
    rng = np.random.default_rng(5)
    t = 0.005 * np.arange(4000)
    kept = rng.uniform(size=t.size) > 0.1
    signal = 3.0 * np.sin(7.0 * t) + 0.001 * rng.standard_normal(t.size)
    assert white_sigma(signal[kept], t=t[kept]) == pytest.approx(0.001, rel=0.15)


def test_the_noise_of_a_speed_is_that_of_its_motion_however_long_it_stands():
    rng = np.random.default_rng(6)
    running = 20.0 + np.round(np.cumsum(rng.standard_normal(400)) * 0.01 + 0.2 * rng.standard_normal(400), 2)
    speed = np.concatenate([running, np.zeros(1200)])
    assert noise_of_moving(speed) == pytest.approx(0.2, rel=0.15)
    assert noise_of_values(speed) < 0.05


@pytest.mark.parametrize(("peak", "limit"), [(105, 127), (9999, 100)])
def test_a_short_peak_of_a_command_tells_its_full_scale_and_a_bad_cell_does_not(peak, limit, tmp_path):
    rng = np.random.default_rng(7)
    t = 0.005 * np.arange(2000)
    duty = np.round(60.0 * np.sin(3.1 * t) + 5.0 * rng.standard_normal(2000))
    place = way_of(duty / 10.0)
    duty[1200] = peak  # a row of the controller's, hardly felt
    path = write_csv(tmp_path / "duty.csv", {"time": t, "pwm": duty, "position": place})
    assert f"±{limit} " in first_look(path).guesses["v_in"]


@pytest.mark.parametrize("amplitude", [1.2, 0.15])
def test_a_free_pendulum_on_a_counter_hangs_where_it_swings_about(amplitude, tmp_path):
    t, _, angle = swing(begin=amplitude)
    counts = 1234.0 + np.round(4096 / (2 * math.pi) * angle)
    look = first_look(write_csv(tmp_path / "raw.csv", {"time": t, "raw": counts}))
    entry = tomllib.loads(look.model)["columns"]["theta_1"]
    assert entry["offset"] == pytest.approx(-1234.0 * entry["scale"], abs=0.01)
    assert np.abs(look.log.measured).max() == pytest.approx(amplitude, rel=0.03)


def test_a_small_swing_about_a_zero_of_its_own_is_about_where_the_pendulum_hangs(tmp_path):
    t, _, angle = swing(begin=0.2)
    look = first_look(write_csv(tmp_path / "small.csv", {"time": t, "angle_rad": 1.9 + angle}))
    assert tomllib.loads(look.model)["columns"]["theta_1"]["offset"] == pytest.approx(-1.9, abs=0.01)
    at_zero = first_look(write_csv(tmp_path / "zero.csv", {"time": t, "angle_rad": 0.03 + angle}))
    assert "offset" not in at_zero.model


@pytest.mark.parametrize(("units", "factors"), [(("rev", "rpm"), (1.0, 60.0)), (("rad", "rpm"), (2 * math.pi, 60.0))])
@pytest.mark.parametrize("rows", [90, 400])
def test_a_shaft_and_its_speed_in_counts_of_a_row_are_in_units_that_their_ratio_tells(units, factors, rows, tmp_path):
    t = 0.01 * np.arange(rows)
    turns = np.cumsum(8.0 * np.where(t < 0.6, 1.0, -0.6) * (1.0 - np.exp(-(t % 0.6) / 0.05))) * 0.01
    counts = np.floor(120 * turns)
    speed = np.diff(counts, prepend=counts[0]) / 120 / 0.01  # steps of 50 rpm: it flickers between two of them
    columns = {"t": t, "duty": np.where(t < 0.6, 50, -30), "theta": factors[0] * counts / 120}
    look = first_look(write_csv(tmp_path / "shaft.csv", columns | {"omega": factors[1] * speed}))
    entries = tomllib.loads(look.model)["columns"]
    assert entries["theta_m"].get("unit", "rad") == units[0]
    assert ("dtheta_m" in entries) == (rows == 90), "of a long log it is seen to be no sensor of its own"
    assert "dtheta_m" not in entries or entries["dtheta_m"]["unit"] == units[1]
    assert not look.log.faults and np.isfinite(look.log.measured).all()


def test_an_angle_that_a_servo_is_commanded_is_a_set_point_and_drives_nothing(tmp_path):
    t = 0.05 * np.arange(300)
    command = np.repeat([90.0, 20.0, 90.0, 160.0, 60.0, 120.0], 50)
    angle, angles = 90.0, []
    for goal in command:
        angles.append(np.round(angle))
        angle += 0.3 * (goal - angle)
    columns = {"t": t, "command_angle": command, "feedback_angle": np.array(angles)}
    look = first_look(write_csv(tmp_path / "servo.csv", columns))
    assert roles(tmp_path / "servo.csv")["command_angle"] == "reference" and "v_in" not in look.model
    assert any("command_angle is a set point: a controller drives the machine" in s for s in look.proposal.sentences)
    torque = {"t": t, "torque_angle_Nm": 0.01 * columns["feedback_angle"], "angle": 0.01 * columns["feedback_angle"]}
    assert roles(write_csv(tmp_path / "torque.csv", torque)).get("torque_angle_Nm") != "reference"
    drive = write_csv(tmp_path / "drive.csv", columns | {"command_angle": 0.01 * command - 0.9})
    assert roles(drive)["command_angle"] == "input", "what the place does not come to drives it"


def test_a_ramp_that_is_called_a_command_is_no_counter_and_no_clock(tmp_path):
    t = 0.1 * np.arange(90)
    for name, ramp in (("pwm", np.arange(90.0)), ("voltage", 0.045 * np.arange(90))):
        speed = 3.0 * np.maximum(0.045 * np.arange(90) - 0.4, 0.0)
        path = write_csv(tmp_path / f"{name}.csv", {"time_ms": 1000 * t, name: ramp, "omega": speed})
        assert roles(path)[name] == "input"
    clocks = {"time_ms": 1000 * t, "n": np.arange(90.0), "stamp_us": 7.0 + 1e6 * t, "motor_time_ms": 3.0 + 1000 * t}
    clocks |= {"cmd_seq": np.arange(90.0), "voltage": 6.0 * np.sin(t), "omega": speed}
    told = roles(write_csv(tmp_path / "clocks.csv", clocks))
    assert {told[n] for n in ("n", "stamp_us", "motor_time_ms", "cmd_seq")} == {"counter"} and told[
        "voltage"
    ] == "input"


def test_what_is_called_a_control_is_no_joint_where_a_torque_drives(tmp_path):
    t, torque, angle = swing(torque=0.3 * np.sin(2.0 * 0.005 * np.arange(3000)), begin=0.3)
    columns = {"time": t, "angle": angle, "torque": torque, "control": 0.5 * np.roll(torque, 3) + 0.1 * np.cos(t)}
    path = write_csv(tmp_path / "joint.csv", columns)
    assert roles(path)["control"] == "further" and roles(path)["torque"] == "input"
    assert 'plant = "pendulum"' in first_look(path).model and "links" not in first_look(path).model


def test_a_constant_voltage_drives_and_not_the_current_that_the_motor_draws_under_it(tmp_path):
    t = 0.001 * np.arange(400)
    speed = -30.0 * (1.0 - np.exp(-t / 0.03))
    columns = {"time": t, "motor_voltage": np.full(400, -3.0), "motor_current": -0.05 - 0.2 * np.exp(-t / 0.03)}
    columns["encoder"] = np.round(7835.0 + 72.0 * np.cumsum(speed) * 0.001)
    drawn = roles(write_csv(tmp_path / "step.csv", columns))
    assert (drawn["motor_voltage"], drawn["motor_current"]) == ("input", "further")
    commanded = columns | {"motor_current": 0.01 * speed - 0.05}  # the faster the more: it is what drives
    assert roles(write_csv(tmp_path / "bus.csv", commanded))["motor_current"] == "input"
    both_ways = columns | {"motor_current": 0.2 * np.sin(9.0 * t)}
    assert roles(write_csv(tmp_path / "servo.csv", both_ways))["motor_current"] == "input"


def test_the_unit_of_a_rate_beside_another_is_its_own_and_a_gear_makes_no_rpm(tmp_path):
    t = 0.01 * np.arange(300)
    turns = np.cumsum(np.sin(2.0 * t) + 0.3) * 0.01
    rate = np.gradient(turns, t) * (1.0 + 0.01 * np.random.default_rng(4).standard_normal(300))
    columns = {
        "t": t,
        "voltage": np.sin(2.0 * t),
        "turns": turns,
        "speed_rad_s": 2 * math.pi * rate,
        "speed_rpm": 60 * rate,
    }
    model = tomllib.loads(first_look(write_csv(tmp_path / "two.csv", columns)).model)
    assert all(e.get("unit", "rad/s") != "rpm" for e in model["columns"].values() if e["column"] == "speed_rad_s")
    geared = {"t": t, "voltage": np.sin(2.0 * t), "joint_angle": turns, "motor_speed": 60.0 * rate}
    assert "rev" not in first_look(write_csv(tmp_path / "gear.csv", geared)).model


def test_an_arm_that_is_called_after_its_control_is_a_place(tmp_path):
    t = 0.01 * np.arange(300)
    columns = {"t": t, "voltage": np.sin(2.0 * t), "control_arm_angle": way_of(np.sin(2.0 * t))}
    assert roles(write_csv(tmp_path / "arm.csv", columns))["control_arm_angle"] == "position"


def test_a_name_that_ends_in_mps_is_a_speed_in_metres_a_second(tmp_path):
    t = 0.01 * np.arange(200)
    speed = 1.0 - np.exp(-t / 0.2)
    wheels = {"t": t, "left_mps": speed, "right_mps": 1.02 * speed, "pwm": np.full(t.size, 300.0)}
    found = columns_of(write_csv(tmp_path / "wheels.csv", wheels))
    assert (found["v_in"]["column"], found["x"]["column"], found["x"]["unit"]) == ("pwm", "left_mps", "m/s")


def test_another_wheel_is_not_advised_as_the_input_that_is_missing(tmp_path):
    t = 0.01 * np.arange(200)
    wheels = {"t": t, "left_angle": 5.0 * t**2, "right_angle": 5.1 * t**1.9}
    found = tomllib.loads(first_look(write_csv(tmp_path / "two.csv", wheels), plant="shaft").model)["columns"]
    assert found["theta_m"]["column"] == "left_angle" and found["v_in"]["column"] == "?"
    text = first_look(tmp_path / "two.csv", plant="shaft").model
    assert "no column is left over" in text and "right_angle" not in text


def test_the_first_row_of_a_step_whose_speed_is_summed_is_no_spike_and_its_constant_duty_drives(tmp_path):
    t = 0.05 * np.arange(100)
    begun = np.array([0.0, 0.17, 0.44, 0.55, 0.62, 0.68, 0.75, 0.79])
    speed = np.append(begun, np.round(0.9 - 0.08 * np.exp(-(t[8:] - 0.4) / 0.3), 2))
    other = np.round(1.01 * speed + 0.01 * np.sin(t), 2)
    log = {"t": t, "left_speed": speed, "right_speed": other, "pwm": np.full(t.size, 300.0)}
    found = columns_of(write_csv(tmp_path / "step.csv", log))
    assert (found["v_in"]["column"], found["theta_m"]["column"]) == ("pwm", "left_speed")
