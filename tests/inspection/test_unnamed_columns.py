"""A robot's log under names that say nothing: what its numbers tell, and what is only guessed."""

from __future__ import annotations

import tomllib
from pathlib import Path

import numpy as np
import pytest

from tests.raw_logs import balancing_robot, driven_axis, write_csv
from tests.support import run
from wheelpend import Failure, Model
from wheelpend.inspection.first_look import first_look
from wheelpend.inspection.inspect import inspect_file
from wheelpend.inspection.survey import survey_file

WHEEL = "wheel_pendulum"
MODEL = """
plant = "wheel_pendulum"
[columns]
v_in = { column = "pwm", scale = 0.094 }
theta_w = { column = "pos" }
theta_p = { column = "ang", unit = "deg" }
dtheta_p = { column = "rate", unit = "deg/s" }
t = { column = "ms", unit = "ms" }
"""


@pytest.fixture(scope="module")
def robot() -> dict[str, np.ndarray]:
    return balancing_robot()


def named(columns: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    return {{"m": "pwm", "vb": "vbat"}.get(name, name): values for name, values in columns.items()}


def slow_encoder(columns: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """The log with a wheel of which the equations say nothing: whole numbers that wander, over thousands."""
    walk = np.cumsum(np.random.default_rng(4).normal(size=len(columns["ms"]), scale=40.0))
    return {**columns, "pos": np.round(walk)}


def written(folder: Path, columns: dict[str, np.ndarray]) -> Path:
    return write_csv(folder / "log.csv", columns)


def test_counts_that_the_equations_do_not_tell_are_guessed_and_marked(robot, tmp_path):
    text = first_look(written(tmp_path, slow_encoder(named(robot))), WHEEL).model
    found = tomllib.loads(text)
    assert found["columns"]["theta_w"]["scale"] == pytest.approx(2 * np.pi / 4096)
    (line,) = [row for row in text.splitlines() if row.startswith("theta_w")]
    assert "# guessed: counts up to" in line and "put your encoder's counts per turn" in line
    assert found["sensors"]["encoder_counts"] == 4096
    assert "encoder_counts = 4096  # guessed: with the scale of theta_w" in text


def test_counts_are_taken_to_be_read_against_the_body_where_the_equations_do_not_tell(robot, tmp_path):
    look = first_look(written(tmp_path, slow_encoder(named(robot))), WHEEL)
    assert not any(f.kind == "relative_encoder" for f in look.inspection.findings)
    assert tomllib.loads(look.model)["sensors"]["encoder"] == "relative" and "encoder" in look.guesses
    assert 'encoder = "relative"  # guessed: counts are read against the body' in look.model


def test_an_angle_of_the_wheel_in_fractions_or_counts_that_contain_the_pitch_are_not(robot, tmp_path):
    columns = named(slow_encoder(robot))
    look = first_look(written(tmp_path, {**columns, "pos": columns["pos"] / 300.0 + 0.001}), WHEEL)
    assert "relative" not in look.model and "encoder" not in look.guesses
    columns = named(robot)
    leaning = -columns["ang"] * 1440 / 360  # in counts, as the firmware adds it
    look = first_look(written(tmp_path, {**columns, "pos": np.round(columns["pos"] + leaning)}), WHEEL)
    assert "relative" not in look.model and "encoder" not in look.guesses


def test_a_wheel_in_whole_numbers_of_hundreds_looks_like_counts(robot, tmp_path):
    model = Model.parse(MODEL)
    _, found = inspect_file(model, written(tmp_path, slow_encoder(named(robot))))
    (said,) = [f for f in found.findings if f.kind == "counts"]
    assert said.sentence.startswith("theta_w looks like counts: whole numbers up to")
    assert "encoder_counts" not in found.sensors and "theta_w" not in found.sensors


def test_a_command_is_told_by_its_numbers_and_a_battery_multiplies_it(robot, tmp_path):
    look = first_look(written(tmp_path, robot))
    roles = {c.name: c.role for c in look.survey.columns}
    assert roles == {"ms": "time", "m": "input", "vb": "supply", "pos": "position", "ang": "position", "rate": "rate"}
    entry = tomllib.loads(look.model)["columns"]["v_in"]
    assert entry == {"column": "m", "scale": pytest.approx(1 / 255, rel=1e-5), "times": "vb"}
    (line,) = [row for row in look.model.splitlines() if row.startswith("v_in")]
    assert "# guessed: whole numbers within a timer's full scale" in line


def test_the_model_of_a_named_plant_reads_the_robot_rightly(robot, tmp_path):
    look = first_look(written(tmp_path, robot), WHEEL)
    found = tomllib.loads(look.model)
    assert found["sensors"]["encoder"] == "relative"
    assert {n: e.get("sign", 1) for n, e in found["columns"].items() if n in ("v_in", "theta_w")} == {
        "v_in": 1, "theta_w": 1}  # fmt: skip
    assert all(found["columns"][n]["sign"] == -1 for n in ("theta_p", "dtheta_p"))
    assert not any("left out" in w for w in look.log.warnings)


@pytest.mark.parametrize(("name", "values"), [
    ("mode", lambda rng: rng.integers(0, 4, 2401)), ("n2", lambda rng: 40 + rng.integers(-3, 4, 2401)),
    ("load", lambda rng: rng.integers(-200, 201, 2401)), ("distance_mm", lambda rng: 255 * rng.integers(0, 2, 2401)),
])  # fmt: skip
def test_whole_numbers_that_move_nothing_are_no_command(name, values, robot, tmp_path):
    other = {n: v for n, v in robot.items() if n not in ("m", "vb")}
    columns = {**other, name: values(np.random.default_rng(6)).astype(float)}
    assert survey_file(written(tmp_path, columns)).of_role("input") == []


def test_an_encoders_counts_are_no_command(robot, tmp_path):
    columns = {n: v for n, v in robot.items() if n not in ("m", "vb")}
    columns["ang"] = np.round(5.0 * columns["ang"])  # as an encoder of 1800 counts reads it
    assert survey_file(written(tmp_path, columns)).of_role("input") == []


def test_a_steady_battery_gives_its_median(robot, tmp_path):
    columns = {**robot, "vb": np.round(24.0 + 0.02 * np.sin(np.arange(len(robot["ms"]))), 2)}
    look = first_look(written(tmp_path, columns), WHEEL)
    entry = tomllib.loads(look.model)["columns"]["v_in"]
    assert entry == {"column": "m", "scale": pytest.approx(24.0 / 255, rel=1e-3)} and "median of vb" in look.model


def test_volts_beside_volts_are_no_battery(robot, tmp_path):
    columns = {**robot, "m": 0.1 * robot["m"]}
    columns["v_in"] = columns.pop("m")
    assert survey_file(written(tmp_path, columns)).of_role("supply") == []


def test_a_named_plant_is_written_with_what_fits_and_says_what_is_left(robot, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    columns = {**robot, "m": np.round(90 * np.sin(0.01 * np.arange(len(robot["ms"]))))}  # as smooth as an encoder
    said = run("new", "robot", "--from", written(tmp_path, columns), "--plant", WHEEL).output
    text = Path("robot/model.toml").read_text(encoding="utf-8")
    found = tomllib.loads(text)["columns"]
    assert {n: e["column"] for n, e in found.items()} == {
        "t": "ms", "v_in": "?", "theta_p": "ang", "dtheta_p": "rate", "theta_w": "m"}  # fmt: skip
    assert 'v_in = { column = "?" }  # not recognised: put one of vb, pos in its place' in text
    assert "v_in is not recognised: put one of vb, pos" in said
    assert "theta_w" in said and "# guessed: " in next(r for r in text.splitlines() if r.startswith("theta_w"))
    assert "column v_in is missing" in run("inspect", "log.csv", "--model", "robot/model.toml", code=1).output


def test_a_log_without_a_plant_says_which_command_starts_one(robot, tmp_path):
    columns = {n: v for n, v in robot.items() if n != "m"} | {
        "speed": np.sin(robot["ms"]),
        "level": np.cos(robot["ms"]),
    }
    with pytest.raises(Failure) as failed:
        first_look(written(tmp_path, columns))
    said = str(failed.value)
    assert "Not recognised: speed, level." in said and "`wheelpend new FOLDER --from log.csv --plant NAME`" in said
    assert 'v_in = { column = "level" }' in said and "`wheelpend new --plant" not in said


def test_a_named_plant_without_any_position_is_refused(tmp_path, robot):
    columns = {"ms": robot["ms"], "pwm": robot["m"]}
    with pytest.raises(Failure, match="wheel_pendulum has a position, and no column is one"):
        first_look(written(tmp_path, columns), WHEEL)


def test_a_named_plant_gets_a_line_for_the_place_that_was_not_recognised(tmp_path, robot):
    columns = {"ms": robot["ms"], "level": np.sin(robot["ms"])}
    with pytest.raises(Failure, match="--plant NAME"):
        first_look(written(tmp_path, columns))
    written_as = first_look(written(tmp_path, columns), "pendulum").proposal.text
    assert 'theta_1 = { column = "?" }  # not recognised: put level in its place' in written_as


def test_a_gyro_that_shares_the_fast_motion_of_its_angle_is_a_sensor(robot, tmp_path):
    said = survey_file(written(tmp_path, robot)).column("rate").remark
    assert "% of its scatter from sample to sample and not the rest: a sensor of its own." in said


def smoothed_slope(angle: np.ndarray) -> np.ndarray:
    """A rate as a program computes it: differences of the angle, averaged over five."""
    return np.convolve(np.gradient(angle, 0.005), np.full(5, 0.2), mode="same")


def test_a_rate_that_was_computed_is_no_sensor(robot, tmp_path):
    columns = {**robot, "rate": np.round(smoothed_slope(robot["ang"]), 2)}
    said = survey_file(written(tmp_path, columns)).column("rate").remark
    assert said.endswith("computed from it, no sensor of its own.")


def test_a_rate_that_was_computed_from_a_coarse_angle_before_is_no_sensor(tmp_path):
    t, _, way = driven_axis(3000)
    place = np.round(way / 2e-3) * 2e-3
    other = np.random.default_rng(8).normal(size=t.size, scale=0.02)
    path = written(tmp_path, {"t": t, "q": place, "dq": smoothed_slope(place) + other})
    assert survey_file(path).column("dq").remark.endswith("no sensor of its own.")


def test_a_body_with_a_gyro_is_a_robot_on_wheels_rather_than_a_cart(robot, tmp_path):
    assert first_look(written(tmp_path, robot)).proposal.plants[0] == WHEEL
    assert first_look(written(tmp_path, {n: v for n, v in robot.items() if n != "rate"})).proposal.plants[0] != WHEEL


def test_a_column_that_no_place_was_found_for_is_not_recognised(robot, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    said = run("inspect", written(tmp_path, {**robot, "mode": np.arange(len(robot["ms"])) // 100 % 3})).output
    assert "not recognised" in said and "further" not in said
