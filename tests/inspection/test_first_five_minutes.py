"""What somebody types in the first five minutes with a log as it came from the bench, and what must come out."""

from __future__ import annotations

import json
import tomllib
from pathlib import Path
from time import process_time

import numpy as np
import pytest

from tests.plants.machines import log_of
from tests.raw_logs import write_csv
from tests.support import DATA, run, simulated
from wheelpend import Model

MAX_INSPECT_S = 5.0  # of processor time


@pytest.fixture(autouse=True)
def _where_no_model_is(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


def started(folder: Path, log: Path) -> tuple[dict, str]:
    """The model of a workspace that `new --from` starts for a log, and what it says; `inspect` is quick before."""
    begin = process_time()
    run("inspect", log)
    assert process_time() - begin < MAX_INSPECT_S
    said = run("new", folder, "--from", log).output
    return tomllib.loads((folder / "model.toml").read_text(encoding="utf-8")), said


def compared(folder: Path, log: Path) -> dict:
    """What `identify --save` and `compare` say of a log in a workspace."""
    model, out = folder / "model.toml", folder / "compare.json"
    run("identify", log, "--model", model, "--save")
    run("compare", log, "--model", model, "--json", out)
    return json.loads(out.read_text(encoding="utf-8"))


def at_noise(found: dict) -> bool:
    """True where a comparison leaves no more than the noise."""
    return found["error"] < 1.1 * found["noise_floor"]


def test_a_students_degrees_milliseconds_millivolts_and_flipped_gyro(tmp_path):
    log = simulated(duration=10.0)
    wheel, pitch, gyro = log.measured.T
    path = write_csv(tmp_path / "lab1.csv", {
        "millis": np.round(1e3 * log.t, 3), "u_mV": np.round(1e3 * log.voltage), "wheel_deg": np.degrees(wheel),
        "pitch": np.degrees(pitch), "gyro": -np.degrees(gyro)})  # fmt: skip
    found, said = started(tmp_path / "lab", path)
    assert found["plant"] == "wheel_pendulum"
    assert found["columns"]["t"] == {"column": "millis", "unit": "ms"}
    assert found["columns"]["v_in"] == {"column": "u_mV", "unit": "mV"}
    assert found["columns"]["theta_p"]["unit"] == "deg"
    assert found["columns"]["dtheta_p"] == {"column": "gyro", "unit": "deg/s", "sign": -1}
    assert "counts the other way" in said
    assert at_noise(compared(tmp_path / "lab", path))


@pytest.mark.slow
def test_counts_pwm_and_battery_of_a_two_wheeled_robot(tmp_path):
    log = simulated(duration=10.0)
    wheel, pitch, gyro = log.measured.T
    battery = 24.3 - 0.02 * log.t
    path = write_csv(tmp_path / "robot.csv", {
        "frame": np.arange(len(log)), "micros": np.round(1e6 * log.t), "pwm": np.round(255 * log.voltage / battery),
        "vbat": battery, "enc_ticks": np.round(wheel * 4480 / (2 * np.pi)), "pitch": pitch, "gyro": gyro})  # fmt: skip
    found, said = started(tmp_path / "robot", path)
    text = (tmp_path / "robot" / "model.toml").read_text(encoding="utf-8")
    columns = found["columns"]
    assert found["plant"] == "wheel_pendulum" and columns["t"] == {"column": "micros", "unit": "us"}
    assert columns["v_in"]["scale"] == pytest.approx(24.2 / 255, rel=0.01)
    assert 2 * np.pi / columns["theta_w"]["scale"] == pytest.approx(4480, rel=0.05)
    counts = found["sensors"]["encoder_counts"]  # of the wheel in rad, not of the column in counts
    assert counts * columns["theta_w"]["scale"] == pytest.approx(2 * np.pi, rel=0.01)
    assert text.count("# guessed: ") == 3 and said.count("is guessed") == 2
    assert compared(tmp_path / "robot", path)["fit_percent"]["theta_p"] > 80


@pytest.mark.slow
def test_a_control_engineers_semicolons_and_decimal_commas(tmp_path):
    log = log_of("slide", duration=10.0)
    rows = [f"{t:.4f};{u:.5f};{1e3 * x:.6f}" for t, u, x in zip(log.t, log.voltage, log.measured[:, 0], strict=True)]
    path = tmp_path / "Achse.csv"
    path.write_text("\n".join(["Zeit [s];u [V];Weg [mm]", *rows]).replace(".", ",") + "\n", encoding="utf-8")
    found, _ = started(tmp_path / "axis", path)
    assert found["plant"] == "slide"
    assert found["columns"]["x"] == {"column": "Weg [mm]", "unit": "mm"}
    assert at_noise(compared(tmp_path / "axis", path))


def test_a_researchers_log_in_the_papers_columns(tmp_path):
    log = simulated(duration=10.0)
    path = write_csv(tmp_path / "run.csv", {"t": log.t, "v_in": log.voltage, **dict(zip(log.channels, log.measured.T,
                                                                                       strict=True))})  # fmt: skip
    found, said = started(tmp_path / "run", path)
    assert found["plant"] == "wheel_pendulum" and "columns" not in found and "guessed" not in said
    assert at_noise(compared(tmp_path / "run", path))


@pytest.mark.skipif(not DATA.exists(), reason="the measured logs are not here")
def test_nothing_is_guessed_of_the_measured_machines(tmp_path):
    from wheelpend.inspection.first_look import first_look

    for name in ("dfki_arm/measured.csv", "emps/DATA_EMPS.mat", "free_pendulum/decay.csv", "mini_segway/balancing.csv"):
        look = first_look(DATA / name)
        assert look.guesses == {} and "guessed" not in look.model and Model.parse(look.model)
