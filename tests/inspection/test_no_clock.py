"""A log whose times are missing, or of no use: its rows are counted."""

import numpy as np
import polars as pl
import pytest

from tests.support import run
from wheelpend import Failure, Model
from wheelpend.inspection.column_names import is_likely_input
from wheelpend.inspection.first_look import first_look
from wheelpend.inspection.split import split_log
from wheelpend.inspection.survey import survey_file
from wheelpend.logs.columns import ColumnMap
from wheelpend.logs.polars_files import seconds_of_stamps
from wheelpend.logs.read import load_log
from wheelpend.logs.tables import ROW_NUMBER

T = 0.025 * np.arange(300)
ANGLE = np.round(0.5 * np.cos(5.0 * T) * np.exp(-0.1 * T), 4)


def write(path, **columns):
    rows = zip(*columns.values(), strict=True)
    path.write_text("\n".join([",".join(columns), *(",".join(f"{v:.10g}" for v in row) for row in rows)]) + "\n")
    return path


def write_nameless(path, *columns):
    path.write_text("\n".join(",".join(f"{v:.10g}" for v in row) for row in zip(*columns, strict=True)) + "\n")
    return path


def test_rows_are_counted_where_no_column_is_the_time_and_that_is_marked_as_a_guess(tmp_path):
    look = first_look(write(tmp_path / "log.csv", angle=ANGLE))
    assert f't = {{ column = "{ROW_NUMBER}", scale = 0.001 }}  # guessed: no column is the time' in look.model
    assert look.log is not None and look.log.dt == pytest.approx(1e-3)


@pytest.mark.parametrize("interval", [0.025, 1e-3])
def test_the_seconds_from_row_to_row_that_are_said_are_no_guess(tmp_path, interval):
    look = first_look(write(tmp_path / "log.csv", angle=ANGLE), interval=interval)
    assert "t" not in look.guesses and Model.parse(look.model).columns["t"].scale == interval
    assert look.survey.values["t"][1] == pytest.approx(interval) == look.log.dt
    assert look.survey.column(ROW_NUMBER).role == "time"


def test_a_log_is_read_by_them_in_a_model_and_in_memory_also_beside_stamps_of_no_use(tmp_path):
    model = Model.parse(f'plant = "pendulum"\n\n[columns]\nt = {{ column = "{ROW_NUMBER}", scale = 0.025 }}\n')
    stamps = np.repeat(T[::2], 2)
    path = write(tmp_path / "log.csv", t=stamps, theta_1=ANGLE)
    for source in (path, {"theta_1": ANGLE}):
        log = load_log(source, model.columns, model.table)
        np.testing.assert_allclose(log.t, T, atol=1e-12)
    own = load_log({ROW_NUMBER: 2.0 * np.arange(300.0), "theta_1": ANGLE}, model.columns, model.table)
    np.testing.assert_allclose(own.t, 2.0 * T, atol=1e-12)


def test_a_model_without_them_is_told_how(tmp_path):
    with pytest.raises(Failure, match=f't = {{ column = "{ROW_NUMBER}", scale = 0.001 }}'):
        load_log(write(tmp_path / "log.csv", theta_1=ANGLE), {}, Model.parse('plant = "pendulum"\n').table)


def test_nothing_is_made_up_where_a_column_looks_like_times(tmp_path):
    pairs = write(tmp_path / "pairs.csv", a=1e6 + np.repeat(T[::2], 2), b=ANGLE)
    with pytest.raises(Failure, match="Every time is there twice: if two sensors take turns, keep the rows of one"):
        survey_file(pairs)
    arrival = write(tmp_path / "arrival.csv", a=np.floor(T / 0.04), b=ANGLE)
    with pytest.raises(Failure, match=r"a grows, but stays the same in .* rows.* --interval S"):
        survey_file(arrival)
    assert survey_file(arrival, 0.025).clock.column == ROW_NUMBER
    falling = write(tmp_path / "falling.csv", a=1e3 - T, b=ANGLE)
    with pytest.raises(Failure, match="a falls evenly: if it is the time, sort the rows by it"):
        survey_file(falling)


def test_a_clock_that_once_goes_back_is_named_with_its_row(tmp_path):
    stamps = 1e3 * T
    stamps[100:] -= 42.0
    path = write_nameless(tmp_path / "back.csv", stamps, ANGLE)
    with pytest.raises(Failure, match=r"column 1 grows evenly, but in row 101 goes from 2475 to 2458 \(1 such rows\)"):
        survey_file(path)
    assert survey_file(path, 0.025).clock.column == ROW_NUMBER
    often = np.where(np.arange(len(T)) % 10 == 0, T - 1.0, T)
    for other in (often, np.where(T[-3] < T, T[-3] - T, T), np.rad2deg(5.0 * T) % 360.0):  # one that turns, or wraps
        assert survey_file(write_nameless(tmp_path / "other.csv", other, ANGLE)).clock.column == ROW_NUMBER
    named = write(tmp_path / "named.csv", position=stamps, b=ANGLE)
    assert survey_file(named).clock.column == ROW_NUMBER


def test_a_setting_that_is_called_after_the_time_is_no_clock(tmp_path):
    path = write(tmp_path / "log.csv", Sample_Time=0.01 + 0.0 * T, seconds=T, angle=ANGLE)
    assert survey_file(path).clock.column == "seconds"
    alone = write(tmp_path / "alone.csv", Sample_Time=0.01 + 0.0 * T, angle=ANGLE)
    assert survey_file(alone).clock.column == ROW_NUMBER
    with pytest.raises(Failure, match="t must grow from row to row"):
        survey_file(write(tmp_path / "stuck.csv", t=0.0 * T, angle=ANGLE))


@pytest.mark.parametrize("even", ["t", "time_ms"])
def test_an_even_clock_goes_before_stamps_of_arrival(tmp_path, even):
    arrival = T + 0.02 * np.random.default_rng(1).uniform(size=len(T))
    scale = 1e3 if even == "time_ms" else 1.0
    path = write(tmp_path / "log.csv", **{"timestamp": arrival, even: scale * T, "angle": ANGLE})
    assert survey_file(path).clock.column == even


@pytest.mark.parametrize(
    "stamp", ["{h:02d}:{m:02d}:{s:06.3f}", "2025-03-27 {h:02d}:{m:02d}:{s:06.3f}", "2025-03-27T{h}:{m:02d}:{s:06.3f}Z"]
)
def test_times_of_day_are_a_clock(tmp_path, stamp):
    begin = 17 * 3600.0 + 59 * 60 + 55
    rows = [(int(x // 3600), int(x // 60 % 60), x % 60) for x in begin + np.round(T, 3)]
    lines = [f"{stamp.format(h=h, m=m, s=s)},{a:.6f}" for (h, m, s), a in zip(rows, ANGLE, strict=True)]
    path = tmp_path / "log.csv"
    path.write_text("\n".join(["Timestamp,angle", *lines]))
    found = survey_file(path)
    assert (found.clock.column, found.clock.unit) == ("Timestamp", "s")
    assert np.abs(found.values["t"] - T).max() < 2e-3


def test_times_of_day_go_on_past_midnight_and_other_text_is_none():
    stamps = pl.Series("t", ["23:59:59.5", None, "0:00:00,25", "00:00:01"])
    found = seconds_of_stamps(stamps)
    assert found[[0, 2, 3]] == pytest.approx([86399.5, 86400.25, 86401.0]) and np.isnan(found[1])
    days = seconds_of_stamps(pl.Series("t", ["2025-03-27 23:59:59", "2025-03-28 00:00:01", "2025-13-41 00:00:02"]))
    assert days[1] - days[0] == 2.0 and np.isnan(days[2])
    for written in ("29.11.2026 12:00:00.25", "11/29/2026 12:00:00.25 PM", "2026/11/29 12:00:00,25", "1:02:03 am"):
        assert seconds_of_stamps(pl.Series("t", [written]))[0] % 86400.0 in (43200.25, 3723.0)
    zones = seconds_of_stamps(pl.Series("t", ["2026-11-29T12:00:00.000+01", "2026-11-29T12:00:00.010+01"]))
    assert zones[1] - zones[0] == pytest.approx(0.01, abs=1e-6)
    midnight = seconds_of_stamps(pl.Series("t", ["29.11.2026 23:59:59", "30.11.2026 00:00:01"]))
    assert midnight[1] - midnight[0] == 2.0
    for other in (["12:30"], ["1.5", "12:30:00"], ["noon"], [None]):
        assert seconds_of_stamps(pl.Series("t", other, dtype=pl.String)) is None


def test_commands_take_the_interval_where_there_is_no_model_yet(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    write(tmp_path / "log.csv", angle=ANGLE)
    assert "new robot --from log.csv --interval 0.025" in run("inspect", "log.csv", "--interval", "0.025").output
    run("new", "robot", "--from", "log.csv", "--interval", "0.025")
    assert Model.open(tmp_path / "robot").columns["t"].scale == 0.025
    monkeypatch.chdir(tmp_path / "robot")
    refused = run("inspect", "../log.csv", "--interval", "0.025", code=1)
    said = " ".join(refused.output.split())
    assert f"set 'columns.t={{ column = \"{ROW_NUMBER}\", scale = 0.025 }}'" in said
    run("set", "columns.t.unit=ms")
    run("set", f'columns.t={{ column = "{ROW_NUMBER}", scale = 0.025 }}')
    assert Model.open(".").columns["t"].unit == ""
    assert "--from LOG" in run("new", "../other", "--interval", "0.025", code=1).output


def test_stamps_that_are_of_no_use_are_no_sensor_where_the_interval_is_said(tmp_path):
    look = first_look(write(tmp_path / "log.csv", t=np.repeat(T[::2], 2), angle=ANGLE), interval=0.025)
    assert look.proposal.plants[0] == "pendulum" and "theta_2" not in look.model


def test_a_column_that_is_called_so_is_a_counter_like_any_other(tmp_path):
    look = first_look(write(tmp_path / "log.csv", **{ROW_NUMBER: np.arange(300.0), "angle": ANGLE}))
    assert "it counts rows" in look.guesses["t"]


@pytest.mark.parametrize("stamps", [np.repeat(T[::2], 2), np.repeat(T[::2], 2)[1:-1]])
def test_times_that_are_there_twice_are_told_also_of_a_column_that_is_called_the_time(tmp_path, stamps):
    path = write(tmp_path / "log.csv", t=stamps, angle=ANGLE[: len(stamps)])
    with pytest.raises(Failure, match="Every time is there twice"):
        survey_file(path)


def test_a_log_without_times_is_split_by_its_rows_and_the_rest_keeps_its_gap(tmp_path):
    path = write(tmp_path / "log.csv", theta_1=ANGLE)
    columns = {"t": ColumnMap(ROW_NUMBER, scale=0.025)}
    found = split_log(path, 2.0, 4.0, tmp_path, columns["t"])
    table = Model.parse('plant = "pendulum"\n').table
    rest, held = (load_log(p, columns, table) for p in (found.rest, found.held_out))
    assert (len(rest), len(held)) == (220, 80) and held.duration == pytest.approx(79 * 0.025)
    assert np.diff(rest.t).max() == pytest.approx(81 * 0.025)


def test_stamps_since_1970_tell_their_unit_where_the_stated_one_would_make_microseconds(tmp_path):
    stamps = 1749713027.902 + 0.01 * np.arange(300)
    rows = "\n".join(f"{t:.3f},{a:.4f}" for t, a in zip(stamps, ANGLE, strict=True))
    (tmp_path / "log.csv").write_text(f"timestamp(ms),angle\n{rows}\n")
    look = first_look(tmp_path / "log.csv")
    assert 't = { column = "timestamp(ms)" }  # guessed: in s its stamps count since 1970' in look.model
    assert look.log.t[1] == pytest.approx(0.01, rel=1e-3)


def test_a_ramp_is_no_clock_beside_stamps_of_whole_seconds(tmp_path):
    ramp = {"Time (s)": 1764251518 + np.arange(300) // 3, "Output": np.linspace(-250, 250, 300), "angle": ANGLE}
    path = write(tmp_path / "log.csv", **ramp)
    with pytest.raises(Failure, match=r"t must grow from row to row.*--interval S"):
        survey_file(path)


def test_an_encoder_that_grows_evenly_is_no_clock_and_no_counter(tmp_path):
    k = np.arange(300)
    path = write(tmp_path / "log.csv", sample_num=k, left_count=2580 + 41 * k, right_count=49294 + 40 * k, angle=ANGLE)
    found = survey_file(path)
    assert found.clock.column == "sample_num"
    assert not any("counter" in sentence for sentence in first_look(path).proposal.sentences)


def test_a_load_that_a_servo_reports_is_what_drives_it_and_that_of_a_crane_is_an_angle():
    assert is_likely_input("present_load") and is_likely_input("Motor Load")
    assert not is_likely_input("load_angle") and not is_likely_input("theta_load") and not is_likely_input("load")
