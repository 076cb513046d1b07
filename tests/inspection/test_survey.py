"""What a file's columns are taken for: by the units in their names, by their names, and then by what they do."""

from __future__ import annotations

import tomllib
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from tests.support import simulated
from wheelpend import Failure, Model
from wheelpend.inspection.column_names import inputs_among, is_called_rate, kind_by_name
from wheelpend.inspection.file_values import continuous
from wheelpend.inspection.first_look import first_look
from wheelpend.inspection.plant_fit import toml_value
from wheelpend.inspection.proposal import Proposal, propose
from wheelpend.inspection.survey import survey_file
from wheelpend.logs.units import stated_unit

pytestmark = pytest.mark.filterwarnings("error")
DT_S = 0.005


def written(path: Path, columns: dict[str, np.ndarray]) -> Path:
    """A CSV file of columns (N,), with an empty cell for each NaN."""
    rows = [",".join("" if np.isnan(v) else f"{v:.9g}" for v in row) for row in zip(*columns.values(), strict=True)]
    path.write_text("\n".join([",".join(columns), *rows]) + "\n", encoding="utf-8")
    return path


def roles(path: Path) -> dict[str, str]:
    return {c.name: c.role for c in survey_file(path).columns}


def proposed(path: Path) -> tuple[Proposal, dict]:
    proposal = propose(survey_file(path))
    return proposal, tomllib.loads(proposal.text)


def pendulum_swing(turns_over: bool) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Times [s], torques [N m] and angles from hanging [rad] of a driven pendulum, (N,) each."""
    t = np.arange(4000) * DT_S
    torque = 0.9 * np.sin(2 * np.pi * (0.2 + 0.04 * t) * t) + 0.4 * np.sin(2 * np.pi * 0.31 * t)
    torque *= 1.0 if turns_over else 0.5
    angle, speed, states = 0.0, 0.0, []
    for u in torque:
        states.append(angle)
        for _ in range(5):
            speed += DT_S / 5 * (u - 1.2 * np.sin(angle) - 0.03 * speed) / 0.05
            angle += DT_S / 5 * speed
    step = 2 * np.pi / 2048
    return t, np.round(torque, 4), np.round(np.array(states) / step) * step


def robot(**changed: np.ndarray) -> dict[str, np.ndarray]:
    """The columns (N,) of a balancing robot's log under their own names, with others in their place."""
    log = simulated(duration=8.0)
    columns = {"t": log.t, "v_in": log.voltage, **dict(zip(log.channels, log.measured.T, strict=True))}
    return {n: v.copy() for n, v in columns.items()} | changed


@pytest.mark.parametrize(("name", "unit", "kind"), [
    ("torque_Nm", "N m", "input"), ("Drehmoment_Nm", "N m", "input"), ("tau [N m]", "N m", "input"),
    ("current_A", "A", "input"), ("u_mV", "mV", "input"), ("v_V", "V", "input"), ("angle_deg", "deg", "position"),
    ("theta_1_deg", "deg", "position"), ("pos_mm", "mm", "position"), ("gyro_dps", "deg/s", "rate"),
    ("rate_deg_s", "deg/s", "rate"), ("rate_rad_per_s", "rad/s", "rate"), ("wheel_turns", "rev", "position"),
    ("motor_pos_mm", "mm", "position"), ("x_a", "", ""), ("theta_n", "", ""), ("theta", "", ""),
])  # fmt: skip
def test_a_name_states_its_unit_and_that_what_a_column_can_be(name, unit, kind):
    assert (stated_unit(name), kind_by_name(name)) == (unit, kind)


def test_commands_of_a_left_and_a_right_motor_are_inputs_by_their_letter_and_a_speed_beside_them_is_none():
    assert inputs_among(["v", "u_L", "u_R", "w_L", "omega_R", "x_r"]) == ["u_L", "u_R"]
    assert inputs_among(["v", "u_left", "u2"]) == ["u_left", "u2"]


def test_a_supply_voltage_is_no_input_beside_the_command():
    assert inputs_among(["u_V", "vbat_V", "motor_angle_deg"]) == ["u_V"]
    assert inputs_among(["v_V", "pos_mm"]) == ["v_V"]


@pytest.mark.parametrize("changed", [{}, {"v_in": 3.0}])
def test_a_file_of_nothing_but_constants_is_refused_with_what_they_are(changed, tmp_path):
    t = np.arange(500) * DT_S
    path = written(tmp_path / "log.csv", {"t": t} | {n: np.full(500, v) for n, v in changed.items()})
    with pytest.raises(Failure, match=r"must vary.*(v_in is 3 throughout|there is none)\. Record a log"):
        survey_file(path)


def test_columns_that_end_at_different_rows_have_one_length(tmp_path):
    columns = robot()
    columns["note"] = np.where(np.arange(len(columns["t"])) < 500, columns["theta_w"], np.nan)
    columns["dtheta_p"][-300:] = np.nan
    path = written(tmp_path / "log.csv", columns)
    assert {len(v) for v in survey_file(path).values.values()} == {len(columns["t"])}


def test_a_header_in_the_middle_is_named_with_its_row(tmp_path):
    path = written(tmp_path / "log.csv", robot())
    lines = path.read_text(encoding="utf-8").splitlines()
    lines.insert(700, lines[0])
    path.write_text("\n".join(lines), encoding="utf-8")
    with pytest.raises(Failure, match=r"must hold numbers, and no column does.*row 700 of column t has 't'"):
        survey_file(path)


@pytest.mark.parametrize("names", [("t", "torque_Nm", "angle_deg"), ("Zeit_s", "Drehmoment_Nm", "Winkel_deg")])
@pytest.mark.parametrize("turns_over", [True, False])
def test_a_pendulum_in_degrees_from_upright_is_one_however_often_it_turned_over(names, turns_over, tmp_path):
    t, torque, angle = pendulum_swing(turns_over)
    assert (np.ptp(angle) > 3 * np.pi) == turns_over
    _, found = proposed(
        written(tmp_path / "log.csv", dict(zip(names, (t, torque, np.degrees(angle) - 180), strict=True)))
    )
    assert (found["plant"], found["assumptions"], found["input"]) == ("pendulum", {"driven": True}, {"unit": "N m"})
    mapped = {"column": names[2], "unit": "deg", "offset": pytest.approx(np.pi, abs=1e-6)}
    assert found["columns"]["theta_1"] == mapped


@pytest.mark.parametrize(("inputs", "place", "first"), [
    ("u_V", "angle_deg", {"pendulum", "shaft"}), ("u_V", "pos_mm", {"slide"}),
    ("torque_Nm", "q", {"pendulum", "shaft"}), ("force_N", "q", {"slide"}),
])  # fmt: skip
def test_a_unit_of_angle_or_torque_excludes_the_slide_and_one_of_length_or_force_the_pendulum(
    inputs, place, first, tmp_path
):
    t = np.arange(3000) * DT_S
    path = written(tmp_path / "log.csv", {"t": t, inputs: np.sin(3.1 * t), place: path_at(t)})
    assert {p.split()[0] for p in proposed(path)[0].plants} == first


@pytest.mark.parametrize(("unit", "turn"), [("_deg", 360.0), ("", 2 * np.pi)])
def test_a_wrapped_angle_is_a_place_with_its_offset(unit, turn, tmp_path):
    t, torque, angle = pendulum_swing(True)
    wrapped = (angle / (2 * np.pi)) % 1.0 * turn - 0.5 * turn  # hangs at minus half a turn
    _, found = proposed(written(tmp_path / "log.csv", {"t": t, "torque_Nm": torque, f"theta{unit}": wrapped}))
    assert found["plant"] == "pendulum"
    assert abs(found["columns"]["theta_1"]["offset"]) == pytest.approx(np.pi, abs=1e-6)


def test_a_robot_in_units_of_its_own_is_a_wheel_pendulum(tmp_path):
    own = robot()
    columns = {"time_ms": 1e3 * own["t"], "u_mV": 1e3 * own["v_in"], "wheel_deg": np.degrees(own["theta_w"]),
               "pitch_deg": np.degrees(own["theta_p"]), "gyro_dps": np.degrees(own["dtheta_p"])}  # fmt: skip
    _, found = proposed(written(tmp_path / "log.csv", columns))
    assert found == {"plant": "wheel_pendulum", "columns": {
        "v_in": {"column": "u_mV", "unit": "mV"}, "theta_w": {"column": "wheel_deg", "unit": "deg"},
        "theta_p": {"column": "pitch_deg", "unit": "deg"}, "dtheta_p": {"column": "gyro_dps", "unit": "deg/s"},
        "t": {"column": "time_ms", "unit": "ms"}}}  # fmt: skip


@pytest.mark.parametrize("sensor", ["dtheta_p", "theta_w", "theta_p", "v_in"])
@pytest.mark.parametrize("value", [0.0, np.nan])
def test_a_dead_sensor_is_named_and_the_plant_is_still_that_of_the_names(sensor, value, tmp_path):
    size = len(robot()["t"])
    proposal, found = proposed(written(tmp_path / "log.csv", robot(**{sensor: np.full(size, value)})))
    assert found["plant"] == "wheel_pendulum"
    said = "has no values at all" if np.isnan(value) else "is 0 throughout"
    assert any(s.startswith(f"{sensor} {said}") for s in proposal.sentences)
    assert any("dead" in s for s in proposal.sentences) == (value == 0.0 and sensor != "v_in")


def test_spikes_do_not_change_what_a_column_is(tmp_path):
    columns = robot()
    rng = np.random.default_rng(3)
    at = rng.choice(len(columns["t"]) - 10, 15, replace=False)
    columns["theta_p"][np.append(at, at[0] + 2)] += rng.choice([-1, 1], 16) * rng.uniform(0.3, 1, 16)
    path = written(tmp_path / "log.csv", columns)
    assert roles(path) == {
        "t": "time", "v_in": "input", "theta_w": "position", "theta_p": "position", "dtheta_p": "rate",
    }  # fmt: skip
    assert proposed(path)[1]["plant"] == "wheel_pendulum"


def test_two_spikes_two_samples_apart_do_not_change_whose_rate_a_gyro_is(tmp_path):
    columns = robot()
    columns["theta_p"][[500, 502]] += 0.6
    survey = survey_file(written(tmp_path / "log.csv", columns))
    assert (survey.column("dtheta_p").role, survey.column("dtheta_p").of) == ("rate", "theta_p")


def test_a_supply_that_sags_is_no_place_of_a_machine(tmp_path):
    columns = robot()
    columns["vbat"] = 12.4 - 0.05 * columns["t"] + 0.002 * np.random.default_rng(1).normal(size=len(columns["t"]))
    assert roles(written(tmp_path / "log.csv", columns))["vbat"] == "further"


def test_a_file_with_a_header_alone_is_too_short(tmp_path):
    (tmp_path / "log.csv").write_text("t,v_in,theta_w\n", encoding="utf-8")
    with pytest.raises(Failure, match="too short"):
        survey_file(tmp_path / "log.csv")


def test_a_column_read_now_and_then_is_left_out_and_spoils_nothing(tmp_path):
    columns = robot()
    battery = np.full(len(columns["t"]), np.nan)
    battery[::100] = np.linspace(12.4, 11.9, len(battery[::100]))
    path = written(tmp_path / "log.csv", columns | {"battery": battery})
    found = roles(path)
    assert (found["battery"], found["dtheta_p"]) == ("further", "rate")
    assert survey_file(path).signals is not None


def roles_of_pair(second: np.ndarray, path: Path, name: str = "q2") -> str:
    """The role of a column beside a position with noise, both of a machine that is driven."""
    columns = driven_position()
    return roles(written(path / "log.csv", columns | {name: second}))[name]


def driven_position() -> dict[str, np.ndarray]:
    t = np.arange(3000) * DT_S
    return {"t": t, "u": np.sin(3.1 * t), "q": path_at(t) + 1e-3 * np.random.default_rng(7).normal(size=t.size)}


def path_at(t: np.ndarray) -> np.ndarray:
    return np.sin(2.0 * t) + 0.4 * np.sin(5.3 * t + 1)


def test_two_wheels_that_move_alike_are_two_positions(tmp_path):
    t = driven_position()["t"]
    for seed in range(3):
        other = path_at(t) + 1e-3 * np.random.default_rng(seed).normal(size=t.size)
        assert roles_of_pair(other, tmp_path) == "position"


def test_a_filtered_copy_beside_the_raw_one_is_neither_a_reference_nor_a_second_position(tmp_path):
    columns = driven_position()
    weights = np.exp(-np.arange(30) / 6.0)
    filtered = np.convolve(columns["q"], weights / weights.sum())[: len(columns["t"])]
    assert roles_of_pair(filtered, tmp_path) == "further"


def test_what_leads_and_is_smoother_is_the_reference_and_a_name_is_enough(tmp_path):
    t = driven_position()["t"]
    assert roles_of_pair(path_at(t + 4 * DT_S), tmp_path) == "reference"
    assert roles_of_pair(path_at(t), tmp_path, "q_ref") == "reference"


def test_names_with_quotes_and_backslashes_stand_in_the_model(tmp_path):
    t, torque, angle = pendulum_swing(False)
    path = written(tmp_path / "log.csv", {"t": t, "tau": torque, "\\theta": angle})
    assert proposed(path)[1]["columns"]["theta_1"]["column"] == "\\theta"
    assert tomllib.loads(f"x = {toml_value('a' + chr(34) + 'b' + chr(10))}") == {"x": 'a"b\n'}


def test_a_position_may_be_anywhere_after_a_pause(tmp_path):
    step = np.arange(240) * 0.005
    t = np.concatenate([step, step + 2.2, step + 4.4])
    way = np.concatenate([0.29 - 0.4 * step, 0.2 - 0.3 * step, -0.25 + 0.4 * step])
    swing = np.concatenate([0.5 * np.cos(5.0 * step), -0.6 * np.cos(5.0 * step), 0.55 * np.cos(5.0 * step)])
    columns = {"t": t, "pwm": np.repeat([-180.0, -140.0, 180.0], 240), "position": way, "swing": swing}
    assert roles(written(tmp_path / "log.csv", columns))["swing"] == "position"
    columns["t"] = np.arange(720) * 0.005  # the same without pauses jumps
    assert roles(written(tmp_path / "log.csv", columns))["swing"] == "further"


def test_a_clock_that_nothing_calls_one_is_a_guess_and_none_begins_below_zero(tmp_path):
    t = np.arange(400) * 0.01
    angle = np.exp(-0.3 * t) * np.sin(8.0 * t)
    said, model = proposed(written(tmp_path / "log.csv", {"y1": 100.0 + t, "angle": angle}))
    assert model["columns"]["t"]["column"] == "y1"
    assert said.guesses["t"].startswith("no column is called a time") and "# guessed: no column is" in said.text
    restarted = {"time": np.r_[t[:200], t[:200]], "y1": 100.0 + t, "angle": angle}
    assert proposed(written(tmp_path / "log.csv", restarted))[0].guesses["t"].startswith("time does not grow")
    assert any(s.startswith("y1 is read as t by a guess") for s in said.sentences)
    for named in ({"stamp": t, "angle": angle}, {"t": t, "angle": angle}):
        assert "t" not in proposed(written(tmp_path / "log.csv", named))[0].guesses
    before_trigger = {"x-axis": t - 1.0, "angle": angle}
    assert proposed(written(tmp_path / "log.csv", before_trigger))[1]["columns"]["t"]["column"] == "x-axis"
    coasting = {"y2": -100.0 * np.exp(-0.1 * t), "angle": angle, "row": np.arange(400.0)}
    assert proposed(written(tmp_path / "log.csv", coasting))[1]["columns"]["t"]["column"] == "row"


def test_of_many_places_those_with_rates_are_the_coordinates(tmp_path):
    t = np.arange(800) * DT_S
    q1, q2 = 1.2 * np.cos(5.0 * t) * np.exp(-0.1 * t), 0.9 * np.sin(8.0 * t + 1.0)
    columns = {"t": t, "q1": q1, "q2": q2, "dq1": np.gradient(q1, DT_S), "dq2": np.gradient(q2, DT_S)}
    tips = {"tip_x": np.sin(q1) + np.sin(q1 + q2), "tip_z": -np.cos(q1) - np.cos(q1 + q2), "elbow_x": 0.5 * np.sin(q1)}
    said, model = proposed(written(tmp_path / "log.csv", columns | tips))
    assert model["assumptions"]["links"] == 2
    assert [model["columns"][n]["column"] for n in ("theta_1", "theta_2")] == ["q1", "q2"]
    assert said.guesses["theta_1"].startswith("one of 5 positions")


def test_what_is_called_an_angle_is_one_though_a_camera_repeats_its_readings(tmp_path):
    t = np.arange(300) / 29.4
    held = -19.0 * np.cos(6.6 * t[np.arange(300) // 7 * 7])  # degrees, new every seventh row
    assert roles(written(tmp_path / "log.csv", {"t": t, "theta": held}))["theta"] == "position"
    assert roles(written(tmp_path / "other.csv", {"t": t, "level": held}))["level"] == "further"
    for name in ("theta_ref", "theta_err", "angle_cmd", "theta_acc", "theta_ddot", "pitch_pid", "thetaSp"):
        assert roles(written(tmp_path / "told.csv", {"t": t, name: held}))[name] != "position", name


def test_an_acceleration_is_neither_a_place_nor_summed_to_one(tmp_path):
    t = np.arange(300) * 0.01
    path = written(tmp_path / "log.csv", {"t": t, "xAccl": np.round(500.0 * np.cos(6.0 * t))})
    with pytest.raises(Failure) as failed:
        proposed(path)
    assert "xAccl is not recognised" in str(failed.value) and "--plant" not in str(failed.value)


def test_a_fast_rate_is_no_wrapped_angle(tmp_path):
    t = np.arange(1000) * 0.01
    angle = 0.8 * np.sin(2.0 * t) + 0.02 * np.sin(29.0 * t)
    rate = np.gradient(angle, 0.01) * 5.0
    rate[500:] = -rate[500:] + 6.2  # a jump of a turn, of a signal that spans more than one
    assert np.ptp(rate) > 8.0
    np.testing.assert_array_equal(continuous(rate), rate)
    turning = np.mod(2.0 * t, 2.0 * np.pi)
    np.testing.assert_allclose(continuous(turning), 2.0 * t, atol=1e-12)


def test_a_clock_that_counts_rows_is_a_guess(tmp_path):
    t = np.arange(800)
    proposal, model = proposed(written(tmp_path / "log.csv", {"frame": t, "angle": 0.8 * np.cos(t * 0.03)}))
    assert model["columns"]["t"] == {"column": "frame", "scale": 0.001} and "counts rows" in proposal.guesses["t"]
    guesses = {}
    for name in ("time_ms", "t"):
        proposal, _ = proposed(written(tmp_path / "log.csv", {name: t, "angle": 0.8 * np.cos(t * 0.03)}))
        guesses[name] = proposal.guesses.get("t", "")
    assert guesses == {"time_ms": "", "t": "no unit is said; ms, by how far its rows are apart"}


def test_a_shaft_in_degrees_is_no_carriage_that_goes_far_and_its_reference_counts_alike(tmp_path):
    t = np.arange(800) * 0.02
    y, r = 170.37 * path_at(t), 170.37 * path_at(t + 0.02)
    u = np.sin(1.3 * t)
    _, model = proposed(written(tmp_path / "log.csv", {"t": t, "y_ref": r, "y": y, "ua": u}))
    assert model["plant"] == "shaft" and model["columns"]["theta_m"] == {"column": "y", "unit": "deg"}
    assert model["columns"]["theta_m_ref"] == {"column": "y_ref", "unit": "deg"}
    assert model["columns"]["v_in"]["column"] == "ua"
    _, model = proposed(written(tmp_path / "log.csv", {"t": t, "y_ref": r / 30.0, "y": y / 30.0, "ua": u}))
    assert "unit" not in [*model["columns"].get("theta_m", {}), *model["columns"].get("x", {})]


def test_a_rate_may_be_called_dot(tmp_path):
    t = np.arange(800) * 0.02
    columns = {"t": t, "u": np.sin(1.3 * t), "phi": np.sin(t), "phi_dot": np.cos(t)}
    found = roles(written(tmp_path / "log.csv", columns))
    assert found["phi_dot"] == "rate" and is_called_rate("phi_dot")


def pole_on_a_cart(hanging: bool, pauses: bool = False) -> dict[str, np.ndarray]:
    """Columns (N,) of a pole of 0.4 m on a cart, swinging below it or balanced above it by the cart."""
    t, length, found = np.arange(1200) * DT_S, 0.4, []
    angle, speed, x, dx = (0.5 if hanging else 0.05), 0.0, 0.0, 0.0
    for k in range(len(t)):
        found.append((x, angle))
        for _ in range(5):
            push = 1.5 * np.sin(2.1 * t[k]) + 1.1 * np.sin(5.7 * t[k] + 1.0)
            if not hanging:
                push += 30.0 * angle + 5.0 * speed + 2.0 * x + 3.0 * dx
            gravity = (-9.81 if hanging else 9.81) * np.sin(angle)
            speed += DT_S / 5 * ((gravity - push * np.cos(angle)) / length - 0.1 * speed)
            angle, dx = angle + DT_S / 5 * speed, dx + DT_S / 5 * push
            x += DT_S / 5 * dx
    rng = np.random.default_rng(4)
    place, tilt = np.array(found).T + rng.normal(size=(2, len(t))) * [[2e-4], [1e-3]]
    if pauses:
        t = t + 1.5 * (np.arange(len(t)) // 240)
    return {"t": t, "u": np.round(rng.normal(size=len(t)), 3), "x": place, "angle": tilt}


@pytest.mark.parametrize("pauses", [False, True])
@pytest.mark.parametrize("hanging", [False, True])
def test_a_pole_that_hangs_where_it_reads_zero_is_turned_upright(hanging, pauses, tmp_path):
    proposal, model = proposed(written(tmp_path / "log.csv", pole_on_a_cart(hanging, pauses)))
    assert model["plant"] == "cart_pole"
    assert model["columns"]["theta_p"].get("offset", 0.0) == pytest.approx(np.pi if hanging else 0.0)
    assert model.get("assumptions", {}).get("range") == ("any" if hanging else None)
    assert any("measured from hanging" in s for s in proposal.sentences) == hanging


def test_a_cart_in_cm_and_a_pole_in_degrees_are_told_by_their_units_in_whatever_order(tmp_path):
    columns = pole_on_a_cart(hanging=True)
    t, x, u = columns["t"], 20.0 * columns["x"], columns["u"]
    speed = np.convolve(np.gradient(x, t), np.full(9, 1 / 9), mode="same")
    tilt = np.degrees(np.pi + 3.0 * columns["angle"])  # over the top, so that only the way stays within a quarter turn
    file = {"t": t, "theta_deg": tilt, "x_cm": x, "x_dot_cm": speed, "u": u}
    proposal, model = proposed(written(tmp_path / "log.csv", file))
    assert model["plant"] == "cart_pole"
    assert model["columns"]["x"] == {"column": "x_cm", "unit": "cm"}
    assert (model["columns"]["theta_p"]["column"], model["columns"]["theta_p"]["unit"]) == ("theta_deg", "deg")
    assert not any("x_dot_cm is position" in s for s in proposal.sentences)


def test_no_cart_goes_many_metres_so_its_place_is_in_mm(tmp_path):
    columns = pole_on_a_cart(hanging=False)
    file = {"t": columns["t"], "u": columns["u"], "position": 1e3 * columns["x"], "angle": columns["angle"]}
    _, model = proposed(written(tmp_path / "log.csv", file))
    assert model["plant"] == "cart_pole" and model["columns"]["x"] == {"column": "position", "unit": "mm"}


def test_a_slow_arm_is_in_degrees_by_what_carries_its_weight(tmp_path):
    """In a short log at constant speeds, where gravity shows in the torque alone."""
    t = np.arange(330) * 0.015
    angle = 90.0 - 80.0 * np.abs((t / 2.5) % 2.0 - 1.0)
    speed = np.gradient(angle, t)
    rng = np.random.default_rng(6)
    torque = 38.0 * np.sin(np.radians(angle)) + 6.0 * np.tanh(speed) + 0.5 * rng.normal(size=t.size)
    _, model = proposed(written(tmp_path / "log.csv", {"t": t, "q": angle, "tau": torque}))
    assert model["columns"]["theta_1"]["unit"] == "deg"


def test_times_that_begin_anew_are_recordings_to_be_saved_apart(tmp_path):
    columns = pole_on_a_cart(hanging=False)
    twice = {n: np.concatenate([v[:400], v[:400]]) for n, v in columns.items()}
    with pytest.raises(Failure, match=r"begin anew: 2 recordings .* \(the next ones begin in row 401\)"):
        survey_file(written(tmp_path / "log.csv", twice))
    swapped, zeroed, backwards = columns["t"].copy(), columns["t"].copy(), columns["t"][::-1]
    swapped[[300, 301]], zeroed[500] = swapped[[301, 300]], 0.0
    for stamps in (swapped, zeroed, backwards):
        with pytest.raises(Failure, match="Sort the rows"):
            survey_file(written(tmp_path / "log.csv", columns | {"t": stamps}))


def test_a_column_with_a_cell_that_is_no_number_is_named_with_that_cell(tmp_path):
    path = written(tmp_path / "log.csv", pole_on_a_cart(hanging=False))
    header, *rows = path.read_text().splitlines()
    name = header.split(",")[-1]
    rows[199] = rows[199].rpartition(",")[0] + ",bad"
    path.write_text("\n".join([header, *rows]) + "\n")
    (unread,) = [c for c in survey_file(path).columns if c.role == "unread"]
    assert unread.name == name and f"row 200 of column {name} has 'bad'" in unread.remark
    rows = [f"{row},{'idle' if k % 3 else 'on'}" for k, row in enumerate(rows)]
    path.write_text("\n".join([f"{header},state", *rows]) + "\n")
    assert [c.name for c in survey_file(path).columns if c.role == "unread"] == [name], "text is no quantity"


def test_a_stamp_that_repeats_is_named_with_its_row(tmp_path):
    columns = pole_on_a_cart(hanging=False)
    columns["t"] = columns["t"].copy()
    columns["t"][500] = columns["t"][499]
    with pytest.raises(Failure, match=r"t must grow from row to row, but row 501 has .* in row 500 \(1 such rows\)"):
        survey_file(written(tmp_path / "log.csv", columns))


@pytest.mark.parametrize("name", ["voltage", "input_volts", "battery_voltage"])
def test_volts_that_hardly_vary_beside_a_duty_are_its_supply_whatever_they_are_called(name, tmp_path):
    t = np.arange(1500) * DT_S
    duty = np.round(200.0 * np.sin(1.3 * t) + 40.0 * np.sin(5.0 * t))
    volts = 7.4 - 0.004 * np.abs(duty) + 0.03 * np.random.default_rng(0).normal(size=t.size)
    columns = {"t": t, "pwm": duty, name: np.round(volts, 2), "position": path_at(t)}
    _, model = proposed(written(tmp_path / "log.csv", columns))
    assert model["columns"]["v_in"]["column"] == "pwm" and model["columns"]["v_in"]["times"] == name
    del columns["pwm"]  # alone it may be what drives
    assert roles(written(tmp_path / "log.csv", columns))[name] == ("further" if "battery" in name else "input")


@pytest.mark.parametrize(
    ("wheel", "pitch"), [("phi", "theta"), ("theta", "phi"), ("theta", "tilt"), ("wheel", "theta")]
)
def test_of_two_angles_the_one_that_stays_upright_is_the_pitch_whatever_they_are_called(wheel, pitch, tmp_path):
    log = robot()
    assert np.abs(log["theta_w"]).max() > np.pi / 2 > np.abs(log["theta_p"]).max()
    columns = {"t": log["t"], "u": log["v_in"], wheel: log["theta_w"], pitch: log["theta_p"],
               f"{pitch}_dot": log["dtheta_p"]}  # fmt: skip
    proposal = propose(survey_file(written(tmp_path / "log.csv", columns)), "wheel_pendulum")
    found = {n: c["column"] for n, c in tomllib.loads(proposal.text)["columns"].items()}
    assert (found["theta_w"], found["theta_p"], found["dtheta_p"]) == (wheel, pitch, f"{pitch}_dot")


def swung_freely(scale: float, reach: float) -> dict[str, np.ndarray]:
    """Columns of a pendulum that swings freely from an angle [rad], in a unit of which so many are a rad."""
    t = np.arange(0.0, 20.0, 1 / 30)
    angle = solve_ivp(lambda _, y: [y[1], -17.0 * np.sin(y[0]) - 0.03 * y[1]], (0.0, 20.0), [reach, 0.0], t_eval=t).y[0]
    return {"t": t, "column": scale * (angle + 5e-4 * np.random.default_rng(2).normal(size=len(t)))}


def test_a_way_that_swings_like_a_small_angle_is_no_angle_in_degrees(tmp_path):
    found, model = proposed(written(tmp_path / "mm.csv", swung_freely(624.0, 0.09)))
    assert model["columns"]["theta_1"] == {"column": "column", "scale": 0.001}
    assert "a way, for gravity" in " ".join(found.sentences)
    _, model = proposed(written(tmp_path / "deg.csv", swung_freely(180 / np.pi, 0.9)))
    assert model["columns"]["theta_1"]["unit"] == "deg"
    counted = swung_freely(4096 / (2 * np.pi), 0.37)
    _, model = proposed(written(tmp_path / "counts.csv", counted | {"column": np.round(counted["column"])}))
    assert model["columns"]["theta_1"]["scale"] == pytest.approx(2 * np.pi / 4096)
    short = {name: values[:60] for name, values in counted.items()}  # hardly more than one swing, over 480
    _, model = proposed(written(tmp_path / "short.csv", short | {"column": np.round(short["column"])}))
    assert model["columns"]["theta_1"]["scale"] == pytest.approx(2 * np.pi / 4096)


def test_a_column_that_is_another_one_times_a_factor_is_left_out(tmp_path):
    columns = pole_on_a_cart(hanging=False)
    volts = columns["u"]
    file = {"t": columns["t"], "pwm": np.round(volts * 255 / 12), "x": columns["x"], "angle": columns["angle"]}
    file["Voltaje (V)"] = np.round(file["pwm"] * 12 / 255, 4)
    found, model = proposed(written(tmp_path / "log.csv", file))
    assert model["plant"] == "cart_pole" and model["columns"]["v_in"] == {"column": "Voltaje (V)"}
    assert any("pwm is 21.25 times Voltaje (V) throughout" in s for s in found.sentences)
    twice = file | {"Voltaje (V)": file["pwm"]}  # two motors with one command are two
    assert not survey_file(written(tmp_path / "twice.csv", twice)).of_role("copy")
    noisy = file["pwm"] + 0.3 * np.random.default_rng(0).normal(size=len(volts))
    survey = survey_file(written(tmp_path / "noisy.csv", file | {"pwm": noisy}))
    assert not survey.of_role("copy")


def test_stamps_of_rows_that_arrive_together_are_no_times(tmp_path):
    t = np.repeat(np.arange(60) * 124.0, 5)
    rows = {"column": t, "deg": 40.0 * np.sin(np.arange(300) / 11), "rate": np.cos(np.arange(300) / 11)}
    with pytest.raises(Failure, match=r"column grows, but stays the same in 240 rows\. .*stamped as they arrived"):
        survey_file(written(tmp_path / "log.csv", rows))


def test_an_angle_by_its_name_is_a_place_however_coarsely_it_is_sampled(tmp_path):
    t = np.arange(60) * 0.124
    swing = 81.0 * np.exp(-t) * np.cos(8.0 * t)
    _, model = proposed(written(tmp_path / "log.csv", {"t": t, "angle_deg": np.round(swing / 0.45) * 0.45}))
    assert model["plant"] == "pendulum" and model["columns"]["theta_1"] == {"column": "angle_deg", "unit": "deg"}


def test_a_cart_is_called_x_and_its_pole_theta(tmp_path):
    columns = pole_on_a_cart(hanging=False)
    file = {"t": columns["t"], "U": columns["u"], "X": columns["x"], "Theta": columns["angle"]}
    assert proposed(written(tmp_path / "log.csv", file))[1]["plant"] == "cart_pole"


def test_a_rate_of_a_log_too_short_for_derivatives_sums_up_to_its_place(tmp_path):
    t = 0.0065 * np.arange(119)
    place = np.round(353.0 * (t - 0.1 * (1.0 - np.exp(-t / 0.1)))) - 68124.0
    rate = np.round(353.0 * (1.0 - np.exp(-t / 0.1)))
    path = tmp_path / "step.csv"
    path.write_text("\n".join(f"60;{a:.6f};{r:g};{p:g}" for a, r, p in zip(t, rate, place, strict=True)) + "\n")
    look = first_look(path, "slide")
    assert (look.survey.column("column 3").role, look.survey.column("column 3").of) == ("rate", "column 4")
    columns = Model.parse(look.model).columns
    assert columns["dx"].column == "column 3" and columns["dx"].scale == columns["x"].scale == pytest.approx(0.0174533)
    assert "the rate" in look.guesses["dx"], "what is guessed of the place is said of its rate"


def test_what_sums_up_to_a_place_in_another_size_is_no_rate_of_it(tmp_path):
    t = 0.01 * np.arange(100)
    place, other = np.sin(4.0 * t), 12.0 * np.cos(4.0 * t)  # three times its rate: a second place
    survey = survey_file(written(tmp_path / "log.csv", {"t": t, "a": place, "b": other}))
    assert [survey.column(n).role for n in "ab"] == ["position", "position"]


@pytest.mark.parametrize(("name", "role"), [("gyro", "rate"), ("b", "position")])
def test_what_is_called_a_rate_is_one_in_any_size_and_its_size_is_told(name, role, tmp_path):
    t = 0.04 * np.arange(133)
    place, rate = np.cos(2.6 * t), -26.0 * np.sin(2.6 * t)  # a clock that runs ten times too slow
    look = first_look(
        written(tmp_path / "log.csv", {"t": t, "theta": place, name: rate}), "pendulum" if role == "rate" else ""
    )
    assert look.survey.column(name).role == role
    told = [f for f in (look.inspection.findings if look.inspection else ()) if f.kind == "wrong_unit"]
    assert bool(told) == (role == "rate")
    assert all("10 times the derivative" in f.sentence and "and of the times" in f.cure for f in told)


def test_a_correction_that_hardly_changes_is_no_rate_of_what_grows_evenly(tmp_path):
    t = 0.01 * np.arange(200)
    random = np.random.default_rng(1)
    columns = {"t": t, "enc": 20.0 * t + 0.3 * np.sin(9.0 * t), "comp": 20.0 + np.cumsum(random.normal(size=200)) * 0.2}
    assert survey_file(written(tmp_path / "log.csv", columns)).column("comp").role != "rate"


def test_what_a_place_is_told_to_do_has_no_rate_in_a_short_log_either(tmp_path):
    t = 0.01 * np.arange(120)
    followed = np.sin(3.0 * t)
    columns = {"t": t, "ref": followed, "pos": followed + 0.02 * np.sin(17.0 * t), "speed": 3.0 * np.cos(3.0 * t)}
    assert survey_file(written(tmp_path / "log.csv", columns)).column("speed").of == "pos"
