"""An input that a sensor reads with noise is told from one whose noise acts, and smoothed without delay."""

import tomllib

import numpy as np
import pytest

from tests.raw_logs import arm_with_torque_sensor, write_csv
from wheelpend import Model
from wheelpend.errors import Failure
from wheelpend.inspection.first_look import first_look
from wheelpend.inspection.inspect import inspect_file
from wheelpend.logs.smoothed_input import likeliest_width, smoothed_input

T = 0.005 * np.arange(3000)
SLOW = np.sin(2.1 * T) + 0.5 * np.sin(7.9 * T)


def test_noise_of_a_sensor_does_not_act_and_is_smoothed_away(tmp_path):
    columns = arm_with_torque_sensor()
    path = write_csv(tmp_path / "arm.csv", columns)
    look = first_look(path)
    (found,) = [f for f in look.inspection.findings if f.kind == "noisy_input"]
    assert found.size == pytest.approx(0.03, rel=0.15)
    assert found.settings["columns.v_in.smooth"] == tomllib.loads(look.model)["columns"]["v_in"]["smooth"]
    log, again = inspect_file(Model.parse(look.model), path)
    assert not [f for f in again.findings if f.kind == "noisy_input"]
    true = 0.4 * np.sin(1.1 * T) + 0.2 * np.sin(2.3 * T + 1.0) + 0.1 * np.sin(9.1 * T)
    assert np.std((log.voltage - true)[50:-50]) < 0.5 * 0.03, "most of its noise is gone"


def test_noise_that_acts_is_left_as_it_is(tmp_path):
    look = first_look(write_csv(tmp_path / "arm.csv", arm_with_torque_sensor(acts=True)))
    assert not [f for f in look.inspection.findings if f.kind == "noisy_input"] and "smooth" not in look.model


def test_the_likeliest_width_is_that_of_the_noise_and_the_least_of_steps():
    random = np.random.default_rng(1)
    width, missed = likeliest_width(SLOW + 0.1 * random.standard_normal(T.size))
    assert width > 3.0 and missed == pytest.approx(0.1, rel=0.1)
    steps = np.repeat(random.standard_normal(150), 20)
    assert likeliest_width(steps)[0] == likeliest_width(SLOW)[0] == 0.5


def test_smoothing_delays_nothing_and_reaches_across_no_gap():
    smooth = smoothed_input(SLOW, T, 0.02)
    assert np.abs(np.correlate(smooth, SLOW, "full").argmax() - (T.size - 1)) == 0
    assert np.abs(smooth - SLOW)[50:-50].max() < 0.03
    jump = np.where(T < 7.5, 0.0, 1.0)
    apart = T + (T >= 7.5)
    assert smoothed_input(jump, apart, 0.05) == pytest.approx(jump)
    unknown = np.where(np.abs(T - 7.5) < 0.1, np.nan, jump)
    assert np.array_equal(np.isnan(smoothed_input(unknown, T, 0.05)), np.isnan(unknown))


def test_only_an_input_is_smoothed(tmp_path):
    path = write_csv(tmp_path / "arm.csv", arm_with_torque_sensor())
    text = first_look(path).model.replace('theta_1 = { column = "q_rad"', 'theta_1 = { column = "q_rad", smooth = 0.02')
    with pytest.raises(Failure, match="must have no smooth"):
        inspect_file(Model.parse(text), path)


@pytest.mark.parametrize("delay", [0.0, 0.04])
def test_a_command_that_acts_late_acts(delay, tmp_path):
    random, fine = np.random.default_rng(3), 10
    volts = SLOW + 0.3 * random.standard_normal(T.size)
    late = np.interp(np.arange(T.size * fine) / fine - delay / 0.005, np.arange(T.size), volts)
    speed, place, places = 0.0, 0.0, []
    for k, u in enumerate(late):
        places += [place] if k % fine == 0 else []
        speed += 0.0005 * (u - 0.1 * speed) / 0.02
        place += 0.0005 * speed
    columns = {"t": T, "voltage": volts, "angle_rad": np.array(places) + 1e-5 * random.standard_normal(T.size)}
    found = first_look(write_csv(tmp_path / "late.csv", columns)).inspection.findings
    assert not [f for f in found if f.kind == "noisy_input"]
