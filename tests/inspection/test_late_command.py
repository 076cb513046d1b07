"""A command that is logged a row after it acts is told by a machine that answers in its row, and is moved."""

import tomllib

import numpy as np
import pytest

from tests.raw_logs import late_motor, write_csv
from wheelpend import Model
from wheelpend.errors import Failure
from wheelpend.inspection.first_look import first_look
from wheelpend.inspection.inspect import inspect_file


def kinds(look) -> list[str]:
    return [f.kind for f in look.inspection.findings]


@pytest.mark.parametrize("reading", ["counts", "speed"])
def test_a_late_command_is_told_and_the_model_reads_it_as_it_acted(reading, tmp_path):
    path = write_csv(tmp_path / "motor.csv", late_motor(reading))
    look = first_look(path)
    assert "late_command" in kinds(look)
    assert tomllib.loads(look.model)["columns"]["v_in"]["held"] == "before"
    log, again = inspect_file(Model.parse(look.model), path)
    assert not [f for f in again.findings if f.kind == "late_command"]
    logged = late_motor(reading)["volts"]
    assert log.voltage[:-1] == pytest.approx(logged[1:]) and log.voltage[-1] == pytest.approx(logged[-1])


def test_a_late_command_in_jittering_rows_with_a_gap_is_told(tmp_path):
    columns = late_motor("counts", jitter=0.3)
    kept = np.abs(columns["t"] - 3.0) > 0.2
    assert "late_command" in kinds(first_look(write_csv(tmp_path / "m.csv", {n: v[kept] for n, v in columns.items()})))


@pytest.mark.parametrize("reading", ["counts", "speed"])
@pytest.mark.parametrize("late", [0.0, -1.0])
def test_a_command_in_time_or_ahead_of_the_machine_is_no_late_one(reading, late, tmp_path):
    assert "late_command" not in kinds(first_look(write_csv(tmp_path / "motor.csv", late_motor(reading, late))))


def test_one_step_from_rest_is_enough_where_the_machine_surely_moves_in_its_row(tmp_path):
    columns = {n: v[37:79] for n, v in late_motor("counts").items()}
    assert np.count_nonzero(np.diff(columns["volts"])) == 1
    assert "late_command" in kinds(first_look(write_csv(tmp_path / "late.csv", columns)))
    columns = {n: v[37:79] for n, v in late_motor("counts", 0.0).items()}
    assert "late_command" not in kinds(first_look(write_csv(tmp_path / "in_time.csv", columns)))


def test_a_speed_that_is_smoothed_from_both_sides_moves_before_the_change_and_tells_no_late_command(tmp_path):
    columns = late_motor("speed", 0.0)
    columns["rpm"] = np.convolve(columns["rpm"], np.ones(5) / 5, "same")
    assert "late_command" not in kinds(first_look(write_csv(tmp_path / "motor.csv", columns)))


def test_a_relay_on_the_measured_place_is_no_late_command(tmp_path):
    assert "late_command" not in kinds(first_look(write_csv(tmp_path / "relay.csv", late_motor("relay"))))


@pytest.mark.parametrize(("entry", "said"), [
    ('theta_m = { column = "counts", held = "before" }', "theta_m must have no held"),
    ('v_in = { column = "volts", held = "late" }', "columns.v_in.held: must be 'after' or 'before', not 'late'"),
])  # fmt: skip
def test_what_cannot_be_held_is_refused(entry, said, tmp_path):
    path = write_csv(tmp_path / "motor.csv", late_motor("counts"))
    with pytest.raises(Failure, match=said):
        inspect_file(Model.parse(f'plant = "shaft"\neffects = []\n[columns]\n{entry}\n'), path)
