"""A command that is logged a row after it acts is told by a machine that answers in its row, and is moved."""

import tomllib
from types import SimpleNamespace

import numpy as np
import pytest

from tests.raw_logs import late_motor, write_csv
from wheelpend import Model
from wheelpend.errors import Failure
from wheelpend.inspection import late_command
from wheelpend.inspection.findings import LogCorrections
from wheelpend.inspection.first_look import first_look
from wheelpend.inspection.inspect import inspect_file
from wheelpend.inspection.late_command import Answer, find_late_command
from wheelpend.logs.read import signals_of_file


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


def servo_log(counts: int, interval: float, gain: float, seed: int) -> dict[str, np.ndarray]:
    """A motor that goes from place to place by a loop in proportion to the count that each row reads."""
    rng = np.random.default_rng(seed)
    t, wanted = interval * np.arange(1500), np.repeat(rng.uniform(-3.0, 3.0, 6), 250)
    angle, speed, rows = 0.0, 0.0, []
    for place in wanted:
        seen = np.round(angle * counts / (2 * np.pi))
        volts = float(np.clip(gain * (place - seen * 2 * np.pi / counts), -12.0, 12.0))
        rows.append((seen, volts))
        for _ in range(20):
            speed += interval / 20 * (4.0 * volts - speed) / 0.09
            angle += interval / 20 * speed
    seen, volts = np.array(rows).T
    return {"t": t, "volts": volts, "counts": seen}


@pytest.mark.parametrize("seed", range(4))
def test_a_loop_that_commands_by_the_row_that_it_reads_is_not_late(seed, tmp_path):
    path = write_csv(tmp_path / "servo.csv", servo_log(12, 0.02, 3.0, seed))
    assert "late_command" not in kinds(first_look(path))


@pytest.mark.parametrize(("pitch", "is_told"), [((0.0, 0.0, 0.0, -9.0), False), ((0.0, 0.0, -9.0, -9.0), True)])
def test_a_place_that_surely_answers_in_time_outweighs_one_that_is_smoothed(pitch, is_told, monkeypatch):
    wheel, table = (0.0, 0.0, 1.0, 1.5), Model.default().table
    answers = {1.0: wheel, 2.0: pitch}  # of places that are called so
    monkeypatch.setattr(late_command, "channel_values", lambda log, name: {"theta_w": 1.0, "theta_p": 2.0}[name])
    monkeypatch.setattr(late_command, "answer_of",
                        lambda log, place: Answer(np.pad(answers[place], (0, 2)), 1e-4 * np.eye(6), 10))  # fmt: skip
    log = SimpleNamespace(voltage=np.zeros(3), channels=("theta_w", "theta_p"), dt=0.01)
    corrections = LogCorrections({}, table, ())
    assert bool(find_late_command(log, corrections)) is is_told
    assert (table.input in corrections.late) is is_told


def test_what_a_view_draws_of_a_late_command_is_what_a_fit_is_given(tmp_path):
    path = write_csv(tmp_path / "motor.csv", late_motor("counts"))
    model = Model.parse(first_look(path).model)
    log, _ = inspect_file(model, path)
    _, signals = signals_of_file(path, model.columns, model.table)
    assert signals["v_in"][: len(log)] == pytest.approx(log.voltage)


@pytest.mark.parametrize(("entry", "said"), [
    ('theta_m = { column = "counts", held = "before" }', "theta_m must have no held"),
    ('v_in = { column = "volts", held = "late" }', "columns.v_in.held: must be 'after' or 'before', not 'late'"),
])  # fmt: skip
def test_what_cannot_be_held_is_refused(entry, said, tmp_path):
    path = write_csv(tmp_path / "motor.csv", late_motor("counts"))
    with pytest.raises(Failure, match=said):
        inspect_file(Model.parse(f'plant = "shaft"\neffects = []\n[columns]\n{entry}\n'), path)
