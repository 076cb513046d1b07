"""Faults of wiring on plants other than the first: what the equations of motion and pairs of channels show."""

from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest

from tests.inspection.test_survey import pole_on_a_cart
from tests.plants.machines import LEVER, log_of, model_of
from wheelpend import Log, Model, simulate
from wheelpend.inspection.inspect import inspect_for_model
from wheelpend.kernels.plant_signature import plant_signature
from wheelpend.logs.columns import DEFAULT_TABLE, ColumnTable


def findings(plant, change):
    model, log = model_of(plant), log_of(plant)
    return [(f.kind, f.channel) for f in inspect_for_model(model, change(log)).findings if f.kind != "stand_still"]


def flipped(name):
    def turn(log):
        if name not in log.channels:
            return replace(log, voltage=-log.voltage)
        return replace(log, measured=log.measured * np.where(np.array(log.channels) == name, -1.0, 1.0))

    return turn


@pytest.mark.parametrize("plant", ["slide", "cart_pole", LEVER])
def test_a_sound_log_of_any_plant_shows_no_fault(plant):
    assert findings(plant, lambda log: log) == []


@pytest.mark.parametrize(("plant", "name"), [("slide", "v_in"), ("cart_pole", "v_in"), ("cart_pole", "theta_p"),
                                             (LEVER, "tau")])  # fmt: skip
def test_a_sign_that_the_equations_of_any_plant_exclude_is_found(plant, name):
    assert findings(plant, flipped(name)) == [("flipped_sign", name)]


def test_an_input_that_is_logged_late_is_found_on_a_slide():
    late = findings("slide", lambda log: replace(log, voltage=np.roll(log.voltage, 25)))
    assert late == [("time_shift", "v_in")]


def test_a_rate_in_degrees_is_found_by_its_angle_whatever_their_names():
    in_degrees = findings(LEVER, lambda log: replace(log, measured=log.measured * [1.0, 180 / np.pi]))
    assert in_degrees == [("wrong_unit", "spin")]


@lru_cache
def robot_with_a_tachometer(at):
    text = Model.default().dump().replace("rate_sensor = false", "rate_sensor = true")
    model = Model.parse(text.replace('range = "upright"', f'range = "{at}"'))
    return model, simulate(model, duration=10.0)


@pytest.mark.slow
@pytest.mark.parametrize("at", ["upright", "any"])
@pytest.mark.parametrize(("order", "signs", "found"), [
    ([0, 1, 2, 3], [1, 1, 1, 1], []),
    ([0, 2, 1, 3], [1, 1, 1, 1], [("swapped_channels", "dtheta_p and theta_p")]),
    ([0, 1, 2, 3], [1, 1, -1, 1], [("flipped_sign", "dtheta_p")]),
])  # fmt: skip
def test_a_robot_with_a_tachometer_is_inspected_as_one_without_at_any_angle_too(at, order, signs, found):
    model, log = robot_with_a_tachometer(at)
    assert log.channels == ("theta_w", "theta_p", "dtheta_p", "dtheta_w")
    faulty = replace(log, measured=log.measured[:, order] * signs)
    assert [(f.kind, f.channel) for f in inspect_for_model(model, faulty).findings] == found


def test_the_table_of_logs_read_without_a_model_is_that_of_the_first_plant():
    assert ColumnTable.of(plant_signature("wheel_pendulum", model_of("wheel_pendulum").assumptions)) == DEFAULT_TABLE


@pytest.mark.parametrize("pulsatance", [5.0, 20.0])  # the equations fit with a sign turned round, or at another time
def test_what_a_spring_does_to_the_phase_of_a_sine_is_no_fault_of_wiring(pulsatance):
    """Friction that gives before it slides is one: the place is then in phase with the input, and not its speed."""
    model, log = model_of("slide"), log_of("slide")
    push = 4.0 * np.sin(pulsatance * log.t)
    noise = np.random.default_rng(2).normal(size=len(log)) * 2e-5
    elastic = replace(log, voltage=push, measured=(0.01 * push + noise)[:, None])
    found = [f.kind for f in inspect_for_model(model, elastic).findings]
    assert "time_shift" not in found and "flipped_sign" not in found


def test_a_pole_that_counts_the_other_way_is_found_though_its_cart_hardly_feels_it():
    """Its row, which no input drives, tells: gravity and what the cart does must balance its acceleration."""
    model = Model.parse('plant = "cart_pole"\n[assumptions]\nrange = "any"\n')
    moved = pole_on_a_cart(hanging=True)
    push = 1.5 * np.sin(2.1 * moved["t"]) + 1.1 * np.sin(5.7 * moved["t"] + 1.0)  # the cart's acceleration
    for sign, found in ((-1.0, []), (1.0, ["theta_p"])):
        angle = sign * (moved["angle"] + np.pi)
        log = Log.from_arrays(moved["t"], table=model.table, v_in=20.0 * push, x=moved["x"], theta_p=angle)
        assert [f.channel for f in inspect_for_model(model, log).findings if f.kind == "flipped_sign"] == found
