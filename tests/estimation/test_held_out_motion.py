"""What is held out and hardly judges what was fitted: a warning says so."""

from dataclasses import replace

import numpy as np
import pytest

from wheelpend.estimation.data import prepare
from wheelpend.estimation.held_out_motion import runs_at_one_speed, runs_the_other_way
from wheelpend.logs.log import Log
from wheelpend.model.record import Model

SLIDE = Model.parse('plant = "slide"\neffects = []\n')
T = np.arange(0.0, 6.0, 0.01)
OTHER_WAY, ONE_SPEED = "runs one way, and most of what is held out the other", "runs at one speed"
HARDER = "is driven harder than all that is fitted"


def slide_log(speed: np.ndarray) -> Log:
    place = np.cumsum(speed) * 0.01 + 1e-5 * np.random.default_rng(3).normal(size=len(T))
    return Log("run.csv", T, speed, place[:, None], ("x",))


def said_of(log: Log, holdout=()) -> list[str]:
    return [
        w for w in prepare(SLIDE, [log], holdout, lean=True).warnings if OTHER_WAY in w or ONE_SPEED in w or HARDER in w
    ]


SWINGS = np.sin(3.0 * T)
THERE_AND_BACK = np.where(T < 4.1, 1.0, -1.0) * (1.2 + SWINGS)
STEP = 1.0 - np.exp(-T)


def test_a_way_back_that_only_the_held_out_third_has_is_told():
    (said,) = said_of(slide_log(THERE_AND_BACK))
    assert said.startswith("run.csv: all that is fitted of x ") and OTHER_WAY in said and "--holdout" in said
    (turned,) = said_of(slide_log(-THERE_AND_BACK))
    assert turned == said


def test_a_third_at_one_speed_is_told():
    (said,) = said_of(slide_log(STEP))
    assert ONE_SPEED in said and "run.csv" in said


def test_a_third_that_is_driven_harder_than_all_before_is_told():
    log = slide_log(SWINGS)
    ramp = replace(log, voltage=100.0 * T * np.sign(SWINGS))
    (said,) = said_of(ramp)
    assert HARDER in said and "by v_in of 595 V against 391 V" in said
    spiked = np.where(T[50] == T, 500.0, log.voltage)
    assert said_of(replace(log, voltage=spiked)) == [] and said_of(replace(log, voltage=spiked[::-1])) == []


@pytest.mark.parametrize("speed", [SWINGS, 1.2 + SWINGS, SWINGS * np.exp(-T)])
def test_nothing_is_told_where_both_parts_move_alike_or_a_swing_decays(speed):
    assert said_of(slide_log(speed)) == []


def test_nothing_is_told_of_logs_that_are_given_to_hold_out():
    log = slide_log(SWINGS)
    other = replace(log, measured=slide_log(STEP).measured, voltage=STEP, name="other.csv")
    assert said_of(log, [other]) == []


@pytest.mark.parametrize("back", [0.005, 0.2])
def test_a_direction_that_some_of_the_fitted_motion_has_is_no_new_one(back):
    before = np.where(np.linspace(0.0, 1.0, 1000) < back, -1.0, 1.0)
    assert runs_the_other_way(before, np.full(500, -1.0)) == (back < 0.01)
    assert not runs_the_other_way(before, np.full(500, 1.0))


def test_a_slow_creep_is_no_direction_and_no_speed():
    before = np.full(1000, 1.0)
    assert not runs_the_other_way(before, np.full(500, -0.05))
    assert not runs_at_one_speed(before, np.full(500, 0.05))
    assert not runs_the_other_way(np.zeros(0), np.full(5, -1.0)) and not runs_at_one_speed(before, np.zeros(0))
