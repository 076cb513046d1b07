"""An input is questioned only where nothing says that it is volts; times that are irregular are no lost rows."""

from __future__ import annotations

import tomllib
from dataclasses import replace

import numpy as np
import pytest

from tests import faulty_logs as faulty
from wheelpend.inspection.findings import LogCorrections
from wheelpend.inspection.inspect import inspect_log
from wheelpend.inspection.raw_units import find_duty, find_rectified
from wheelpend.inspection.sampling import dropped_rows
from wheelpend.inspection.survey import survey_file
from wheelpend.logs.columns import DEFAULT_TABLE, ColumnMap
from wheelpend.logs.log import Log
from wheelpend.model.record import Model

pytestmark = pytest.mark.filterwarnings("error")


def said(values: np.ndarray, column: ColumnMap) -> list[str]:
    log = replace(faulty.clean(), voltage=values)
    return [f.sentence for f in find_duty(log, LogCorrections({"v_in": column}, DEFAULT_TABLE, ()))]


def volts(peak: float) -> np.ndarray:
    values = faulty.clean().voltage
    return values * peak / float(np.abs(values).max())


def test_volts_that_are_called_so_are_never_questioned():
    for column in ("pwm_volt", "duty_V", "pwm_mV"):
        assert said(volts(4.97), ColumnMap(column)) == []
    assert said(np.round(volts(255.0)), ColumnMap("pwm", "V")) == []
    assert len(said(volts(4.97), ColumnMap("pwm"))) == 1


def test_a_square_wave_of_one_volt_is_no_duty():
    wave = np.sign(np.sin(4.0 * faulty.clean().t + 0.1))
    assert set(np.unique(wave)) == {-1.0, 1.0}
    assert said(wave, ColumnMap("u")) == []


@pytest.mark.parametrize(("peak", "doubted"), [(255.0, False), (240.0, False), (586.0, True), (150.0, True)])
def test_a_full_scale_that_is_not_reached_is_said_with_its_doubt(peak, doubted):
    log = replace(faulty.clean(), voltage=np.round(volts(peak)))
    (found,) = find_duty(log, LogCorrections({"v_in": ColumnMap("u")}, DEFAULT_TABLE, ()))
    assert ("a driver clips the command below it" in found.cure) == doubted


def test_clipping_alone_is_said_with_its_doubt():
    (sentence,) = said(np.clip(volts(1.5), -1, 1), ColumnMap("u"))
    assert "may be a duty of ±1" in sentence and "looks like" not in sentence
    assert "looks like PWM counts" in said(np.round(volts(255.0)), ColumnMap("u"))[0]


@pytest.mark.parametrize("shape", [4.0, 10.0, 30.0])
def test_an_irregular_clock_lost_no_rows(shape):
    log = faulty.clean()
    intervals = np.random.default_rng(2).gamma(shape, log.dt / shape, len(log) - 1)
    assert dropped_rows(replace(log, t=np.concatenate(([0.0], np.cumsum(intervals))))) == []


@pytest.mark.parametrize("share", [0.01, 0.05])
def test_rows_that_were_lost_are_counted(share):
    (finding,) = dropped_rows(faulty.dropped(faulty.clean(), share))
    assert finding.size == pytest.approx(share, rel=0.25)


@pytest.mark.parametrize("share", [0.1, 0.3, 0.45])
def test_an_even_clock_rounded_to_a_coarse_one_lost_no_rows(share):
    log = faulty.rounded_times(faulty.clean(), 1.0 + share)
    (finding,) = dropped_rows(log)
    assert finding.kind == "rounded_times" and finding.size == pytest.approx(faulty.clean().dt / (1.0 + share))
    assert "or rows are missing at regular intervals" in finding.sentence, "no place was asked"
    (lost,) = dropped_rows(faulty.dropped(faulty.clean(), share))
    assert lost.kind == "dropped_rows"


@pytest.mark.parametrize("every", [4, 5, 10])
def test_rows_that_are_lost_at_regular_intervals_are_told_by_a_place_that_moves(every):
    log = faulty.clean()
    lost = faulty.rows(log, np.arange(len(log)) % every != 0)
    rounded = faulty.rounded_times(log, 1.0 + 1.0 / every)
    kinds = [dropped_rows(each, ["theta_w"])[0] for each in (lost, rounded)]
    assert [f.kind for f in kinds] == ["dropped_rows", "rounded_times"]
    assert "no row need be missing" in kinds[1].sentence


def test_the_step_of_an_interchanged_encoder_goes_to_the_channel_that_it_is():
    log = faulty.clean()
    swapped = faulty.with_columns(log, theta_w=faulty.column(log, "theta_p"), theta_p=faulty.column(log, "theta_w"))
    right, found = (tomllib.loads(inspect_log(each).sensors)["sensors"] for each in (log, swapped))
    assert found["encoder_counts"] == right["encoder_counts"]
    assert "theta_p" not in found.get("step", {})


@pytest.mark.parametrize("held", [100, 4])  # samples: a step, and a random sequence that a speed hardly settles in
def test_a_speed_that_is_taken_for_a_place_is_told_and_no_command_is_blamed(held):
    t = 0.02 * np.arange(400)
    volts = np.repeat(np.random.default_rng(2).uniform(1.0, 8.0, 400 // held), held)
    speed = np.zeros(400)
    for k in range(399):
        speed[k + 1] = speed[k] + 0.2 * (30.0 * volts[k] - speed[k])
    table = Model.parse('plant = "slide"\n').table
    found = find_rectified(Log.from_arrays(t, table=table, v_in=volts, x=speed), table)
    assert [f.kind for f in found] == ["speed"] and "v_in sets" in found[0].sentence
    place = np.cumsum(np.where(np.sin(3.0 * t) > 0.0, 1.0, -1.0) * volts)
    found = find_rectified(Log.from_arrays(t, table=table, v_in=volts, x=place), table)
    assert [f.kind for f in found] == ["rectified"]


@pytest.mark.parametrize(("told", "read"), [("u", "y"), ("pwm", "m1"), ("duty", "wheel_l")])
def test_an_output_that_follows_its_command_as_slowly_as_a_heavy_wheel_is_a_speed_and_a_way_is_none(
    told, read, tmp_path
):
    rng = np.random.default_rng(3)
    t = np.arange(0.0, 9.0, 0.02)
    command = np.repeat(rng.choice([0.35, 0.44], 60), 8)[: t.size]
    decay = np.exp(-0.02 / 0.4)
    speed = np.empty(t.size)
    speed[0] = 1000.0 * (command[0] - 0.25)
    for k in range(1, t.size):
        speed[k] = decay * speed[k - 1] + (1.0 - decay) * 1000.0 * (command[k - 1] - 0.25)
    servo = command + 0.002 * rng.standard_normal(t.size)  # goes to the place that is commanded
    for values, is_speed in ((speed, True), (np.cumsum(speed - speed.mean()) * 0.02, False), (servo, False)):
        path = tmp_path / "log.csv"
        rows = np.column_stack([t, command, values])
        np.savetxt(path, rows, delimiter=",", header=f"t,{told},{read}", comments="")
        found = survey_file(path)
        assert (found.speed == read) == is_speed
        assert (f"{read}, summed" in map(found.title, (c.name for c in found.columns))) == is_speed
