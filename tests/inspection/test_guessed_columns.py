"""Columns under other names are guessed."""

import tomllib

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from tests.raw_logs import fast_motor, two_wheels, write_csv
from wheelpend import Model
from wheelpend.inspection.column_roles import right_sides
from wheelpend.inspection.first_look import first_look
from wheelpend.inspection.gravity import carried_weight_misfit
from wheelpend.inspection.inspect import inspect_file
from wheelpend.inspection.signals import DEGREES_PER_RADIAN
from wheelpend.inspection.survey import survey_file
from wheelpend.logs.read import save_log


def test_columns_are_guessed_by_name_unit_and_by_what_grows(tmp_path):
    from tests.support import simulated

    log = simulated(duration=4.0)
    save_log(tmp_path / "plain.csv", log)
    header = "clock,motor_cmd,enc_wheel,pitch_deg,gyro_y [deg/s]"
    rows = np.column_stack([1e3 * log.t, log.voltage, log.measured[:, 0], np.degrees(log.measured[:, 1:])])
    np.savetxt(tmp_path / "odd.csv", rows, delimiter=",", header=header, comments="")
    plain, _ = inspect_file(Model.default(), tmp_path / "plain.csv")
    read, found = inspect_file(Model.default(), tmp_path / "odd.csv")
    np.testing.assert_allclose(read.measured, plain.measured, atol=1e-9)
    np.testing.assert_allclose(read.t, plain.t, atol=1e-9)
    assert 't = { column = "clock", unit = "ms" }' in found.proposal
    assert 'dtheta_p = { column = "gyro_y [deg/s]", unit = "deg/s" }' in found.proposal
    again = Model.parse(Model.default().text.partition("[columns]")[0] + found.proposal)
    assert again.columns["theta_p"].unit == "deg"


def test_an_angle_of_a_fast_motor_is_in_degrees_wrapped_or_not(tmp_path):
    columns = fast_motor()
    degrees = columns["angle"]
    for name, angle, why in (
        ("wrapped", degrees % 360.0, "it jumps by about 360 where a turn ends"),
        ("on_and_on", degrees, "in rad it would turn 2053 times a second"),
    ):
        found = first_look(write_csv(tmp_path / f"{name}.csv", columns | {"angle": angle}), "pendulum")
        line = next(row for row in found.model.splitlines() if row.startswith("theta_1"))
        assert 'unit = "deg"' in line and f"# guessed: degrees, for {why}" in line
        assert np.ptp(found.log.measured[:, 0]) == pytest.approx(np.deg2rad(np.ptp(degrees)), rel=1e-6)


def test_of_two_wheels_alone_one_is_looked_at_and_a_filtered_difference_is_no_sensor(tmp_path):
    columns = two_wheels()
    found = first_look(write_csv(tmp_path / "wheels.csv", columns))
    said = " ".join(found.proposal.sentences)
    assert "right_pulses is the other wheel's left_pulses: one wheel is looked at alone." in said
    assert "left_speed is the derivative of left_pulses." in said and "no sensor of its own" in said
    assert "right_" not in found.model and "rate_sensor" not in found.model and "links" not in found.model
    body = columns | {"pitch": 0.05 * np.sin(columns["ms"] / 300.0) + 0.001 * np.cos(columns["ms"] / 17.0)}
    (right,) = [c for c in survey_file(write_csv(tmp_path / "robot.csv", body)).columns if c.name == "right_pulses"]
    assert "Where the robot turns, log the mean of both." in right.remark


@pytest.mark.parametrize(
    ("roles", "left_out"),
    [
        ({"left_pulses": "position", "right_pulses": "position", "pwm_l": "input", "pwm_r": "input"},
         {"right_pulses", "pwm_r"}),
        ({"enc_l": "position", "enc_r": "position", "u": "input"}, {"enc_r"}),
        ({"theta_l": "position", "theta_r": "position", "u": "input"}, set()),  # of a load and a rotor, say
        ({"left_pos": "position", "right_pos": "position", "right_u": "input"}, set()),  # which is the right one's
        ({"left_pos": "position", "right_pos": "position", "gyro_y": "further"}, set()),  # it has a body
        ({"left_pos": "position", "right_pos": "position", "pitch": "position"}, {"right_pos"}),
        ({"left_pos": "position", "right_pos": "position", "pitch": "position", "arm": "position"}, set()),
    ],
)  # fmt: skip
def test_one_of_two_wheels_is_left_out_and_nothing_that_is_no_other_wheel(roles, left_out):
    assert set(right_sides({n: (role, "") for n, role in roles.items()})) == left_out


def test_a_rate_goes_with_its_wheel():
    roles = {"left_pos": ("position", ""), "right_pos": ("position", ""), "w": ("rate", "right_pos")}
    assert right_sides(roles)["w"] == "w is the rate of right_pos, the other wheel's."


def test_counts_are_no_degrees_however_fast_they_come(tmp_path):
    columns = fast_motor()
    counts = columns | {"angle": np.round(columns["angle"] * 4096 / 360)}
    found = first_look(write_csv(tmp_path / "counts.csv", counts), "pendulum")
    assert "put your encoder's counts per turn" in next(r for r in found.model.splitlines() if r.startswith("theta_1"))


@pytest.mark.parametrize("unit", [1.0, DEGREES_PER_RADIAN])
def test_what_is_left_of_a_constant_input_is_rounding_and_tells_nothing_of_gravity(tmp_path, unit):
    columns = fast_motor()
    for pwm, told in ((columns["pwm"], False), (columns["pwm"] + 0.5 * np.sin(columns["t"] * 40.0), True)):
        look = survey_file(write_csv(tmp_path / "motor.csv", columns | {"pwm": pwm}))
        share = carried_weight_misfit(look.signals, "angle", "pwm", unit)
        assert (share < 1.0) is told and 0.0 < share <= 1.0


def test_a_shaft_in_degrees_along_a_slide_is_made_continuous_too(tmp_path):
    columns = fast_motor()
    path = write_csv(tmp_path / "shaft.csv", columns | {"angle": columns["angle"] % 360.0})
    look = first_look(path, "slide")
    assert np.ptp(look.log.measured[:, 0]) == pytest.approx(np.deg2rad(np.ptp(columns["angle"])), rel=1e-6)


def test_a_speed_is_no_place_and_is_summed_where_nothing_else_is_one(tmp_path):
    t = np.arange(300) * 0.01
    speed, pwm = np.sin(9.0 * t), 50.0 + 40.0 * np.sign(np.sin(t))
    look = first_look(write_csv(tmp_path / "speeds.csv", {"t": t, "PWM": pwm, "RPM_1": speed}))
    assert look.survey.speed == "RPM_1" and '{ column = "RPM_1", unit = ' in look.model
    other = {"leftCommand": pwm, "leftSpeed": speed, "rightSpeed": 0.9 * speed, "rightCommand": pwm[::-1]}
    of_two = first_look(write_csv(tmp_path / "two.csv", {"t": t, **other}))
    assert of_two.survey.speed == "leftSpeed" and of_two.survey.of_role("input") == ["leftCommand"]
    wanted = write_csv(tmp_path / "wanted.csv", {"t": t, "PWM": pwm, "target_rpm": 1.1 * speed, "rpm": speed})
    assert first_look(wanted).survey.speed == "rpm"
    beside = first_look(write_csv(tmp_path / "place.csv", {"t": t, "PWM": pwm, "RPM_1": speed, "x": np.cos(3.0 * t)}))
    assert beside.survey.speed == "" and beside.survey.of_role("position") == ["x"]


def test_a_coarse_log_of_a_pendulum_that_hangs_elsewhere_than_at_0_gets_its_offset(tmp_path):
    t = np.arange(201) * 0.2
    swing = solve_ivp(lambda _, y: (y[1], -8.53 * np.sin(y[0]) - 0.02 * y[1]), (0.0, 41.0), (0.38, 0.0), rtol=1e-9,
                      t_eval=t).y[0]  # fmt: skip
    noise = 0.003 * np.random.default_rng(2).standard_normal(t.size)
    angle = np.rad2deg(swing + noise) + 90.0
    found = tomllib.loads(first_look(write_csv(tmp_path / "video.csv", {"time (s)": t, "angle (deg)": angle})).model)
    assert found["columns"]["theta_1"]["offset"] == pytest.approx(-np.pi / 2, abs=0.01)


def test_what_no_header_names_is_marked_as_guessed(tmp_path):
    columns = swinging_columns()
    rows = np.column_stack(list(columns.values()))
    np.savetxt(tmp_path / "bare.csv", rows, delimiter=",", fmt="%.7g")
    line = next(r for r in first_look(tmp_path / "bare.csv").model.splitlines() if r.startswith("theta_1"))
    assert "# guessed: the file has no header, so by what the column does" in line
    named = first_look(write_csv(tmp_path / "named.csv", columns))
    assert "guessed" not in named.model


def test_a_column_called_force_is_no_unit_of_what_turns_a_pendulum(tmp_path):
    columns = swinging_columns() | {"force": np.sin(np.arange(900) * 0.02) ** 3}
    found = tomllib.loads(first_look(write_csv(tmp_path / "pushed.csv", columns), "pendulum").model)
    assert found["columns"]["v_in"]["column"] == "force" and found.get("input", {}).get("unit", "N m") == "N m"


def swinging_columns() -> dict[str, np.ndarray]:
    t = np.arange(900) * 0.01
    swing = solve_ivp(lambda _, s: (s[1], -30.0 * np.sin(s[0]) - 0.1 * s[1]), (0.0, 9.0), (0.9, 0.0), t_eval=t).y[0]
    return {"time": t, "angle_rad": swing + 1e-3 * np.random.default_rng(5).standard_normal(t.size)}


def test_counts_beside_a_rate_get_their_unit_from_it(tmp_path):
    t = np.arange(500) * 0.02
    turned = np.cumsum(2.0 + 1.5 * np.sin(3.0 * t)) * 0.02
    columns = {"time": t, "motor_power": np.sin(3.0 * t + 0.3), "motor_position": np.round(120.0 * turned)}
    columns |= {"motor_velocity": np.round(2.0 + 1.5 * np.sin(3.0 * t), 2)}
    found = first_look(write_csv(tmp_path / "counted.csv", columns), "slide")
    entry = tomllib.loads(found.model)["columns"]["x"]
    assert entry["scale"] == pytest.approx(1.0 / 120.0, rel=0.01)
    assert "# guessed: counts, for motor_velocity makes 120" in found.model


def test_a_torque_that_is_a_target_is_the_input_and_an_error_of_the_speed_no_rate(tmp_path):
    t = np.arange(500) * 0.01
    speed = np.sin(2.0 * t) ** 3
    columns = {"Tempo": t, "Position": np.cumsum(speed) * 0.01, "Velocity": speed + 1e-3 * np.cos(37.0 * t)}
    columns |= {"Velocity Error": 0.3 - speed, "Target Torque": np.cos(2.0 * t), "Target Pos": np.full(500, 2.0)}
    roles = {c.name: c.role for c in survey_file(write_csv(tmp_path / "servo.csv", columns)).columns}
    assert (roles["Tempo"], roles["Target Torque"], roles["Velocity"]) == ("time", "input", "rate")
    assert roles["Velocity Error"] not in ("rate", "position") and roles["Target Pos"] == "constant"


def test_a_set_point_without_a_command_is_told_to_be_of_a_machine_that_is_driven(tmp_path):
    columns = swinging_columns() | {"TargetAngle": np.full(900, 0.3)}
    found = first_look(write_csv(tmp_path / "held.csv", columns))
    assert any("TargetAngle is a set point: a controller drives" in s for s in found.proposal.sentences)
    columns |= {"voltage": np.sin(np.arange(900) * 0.02)}
    found = first_look(write_csv(tmp_path / "driven.csv", columns))
    assert not any("set point" in s for s in found.proposal.sentences)


@pytest.mark.parametrize("name", ["temps_moteur", "tempo_c", "torque_error", "rope_tension"])
def test_words_that_only_begin_alike_are_neither_times_nor_inputs(name, tmp_path):
    columns = swinging_columns()
    columns = {name: 20.0 + 0.01 * np.arange(900) + 0.3 * np.sin(np.arange(900)), **columns}
    roles = {c.name: c.role for c in survey_file(write_csv(tmp_path / "warm.csv", columns)).columns}
    assert roles["time"] == "time" and roles[name] not in ("time", "input")


def square_wave_axis(rows: int = 450) -> tuple[np.ndarray, ...]:
    """Time, a command of four levels and the way of a carriage with friction that it pushes, a pixel of noise on it."""
    t, rng = 0.0067 * np.arange(rows), np.random.default_rng(1)
    command = np.where((t % 0.5) < 0.25, 4.0, -4.0)
    speed, way = 0.0, np.zeros(rows)
    for k in range(1, rows):
        push = command[k - 1] - 0.6 * np.sign(speed)
        speed += 0.0067 * push / 1.9
        way[k] = way[k - 1] + 0.0067 * speed
    return t, command, 0.3 + way + rng.normal(size=rows, scale=5e-5)


def test_a_column_without_a_name_that_goes_between_few_levels_is_the_command(tmp_path):
    t, command, way = square_wave_axis()
    speed = np.gradient(way, t)
    for columns in ((t, command, way), (t, command, way, speed), (t, way, command)):
        path = tmp_path / "log.csv"
        np.savetxt(path, np.column_stack(columns), delimiter=",", fmt="%.6f")
        found = survey_file(path)
        assert found.of_role("input") == [f"column {2 if columns[1] is command else 3}"]


def test_what_moves_while_all_else_stands_still_is_the_command_and_two_links_command_each_other(tmp_path):
    t = 0.01 * np.arange(500)
    command, speed, way = np.sin(2 * np.pi * t + 2.0 * t**2), 0.0, np.zeros(500)
    for k in range(1, 500):
        pushed = command[k - 11] if k > 10 else 0.0
        speed += 0.01 * (8.0 * pushed - 20.0 * speed)
        way[k] = way[k - 1] + 0.01 * speed
    path = tmp_path / "log.csv"
    np.savetxt(path, np.column_stack([t, command, np.round(way, 3)]), delimiter=",", fmt="%.6f")
    assert survey_file(path).of_role("input") == ["column 2"]
    rng, both = np.random.default_rng(0), np.column_stack([np.cos(3 * t) + 0.4 * np.cos(7.1 * t), np.cos(3 * t + 0.2)])
    np.savetxt(path, np.column_stack([t, both + rng.normal(size=both.shape, scale=1e-3)]), delimiter=",", fmt="%.6f")
    assert survey_file(path).of_role("input") == []
