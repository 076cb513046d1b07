"""A robot's log under names that say nothing: what its numbers tell, and what is only guessed."""

from __future__ import annotations

import tomllib
from pathlib import Path

import numpy as np
import pytest

from tests.raw_logs import balancing_robot, write_csv
from wheelpend import Model
from wheelpend.inspection.first_look import first_look
from wheelpend.inspection.inspect import inspect_file

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


def test_a_wheel_in_whole_numbers_of_hundreds_looks_like_counts(robot, tmp_path):
    model = Model.parse(MODEL)
    _, found = inspect_file(model, written(tmp_path, slow_encoder(named(robot))))
    (said,) = [f for f in found.findings if f.kind == "counts"]
    assert said.sentence.startswith("theta_w looks like counts: whole numbers up to")
    assert "encoder_counts" not in found.sensors and "theta_w" not in found.sensors
