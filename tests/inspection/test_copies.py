"""Columns that tell nothing of their own: what is another one times a factor, or that from a constant."""

import numpy as np
import pytest

from wheelpend.inspection.counters import coordinates_among, copies_among

T = np.linspace(0.0, 3.0, 200)
ANGLE = np.round(135.0 * (1.0 - np.exp(-T / 0.3)) + 20.0 * np.sin(5.0 * T))


def left_out(**columns):
    return copies_among({n: np.asarray(v, dtype=float) for n, v in columns.items()})


@pytest.mark.parametrize("order", [("angle", "err"), ("err", "angle")])
def test_a_control_error_is_a_copy_of_what_is_read_wherever_it_stands(order):
    columns = {"angle": ANGLE, "err": 135.0 - ANGLE}
    assert left_out(**{n: columns[n] for n in order}) == {
        "err": "err is 135 - angle throughout: the same once more, and left out."
    }


def test_what_a_controller_makes_of_a_reading_is_its_command_and_no_copy():
    assert left_out(angle=ANGLE, u=10.0 * (135.0 - ANGLE)) == {} == left_out(angle=ANGLE, cmd=-4.0 * ANGLE)
    assert left_out(motor_angle=ANGLE, motor_cmd=0.2 * (90.0 - ANGLE)) == {}, "both are called after the motor"
    assert left_out(wheel_pos=ANGLE, wheel_torque=-3.0 * ANGLE) == {}
    assert list(left_out(u=ANGLE, u_counts=21.25 * ANGLE)) == ["u_counts"]


def test_two_that_are_the_same_but_for_the_sign_may_be_two_motors():
    assert left_out(left=ANGLE, right=-ANGLE) == {} == left_out(left=ANGLE, right=ANGLE)
    assert list(left_out(left=ANGLE, right=ANGLE + 7.0)) == ["right"]


def test_one_that_is_nearly_another_is_a_reading_of_its_own():
    assert left_out(angle=ANGLE, other=90.0 - ANGLE + np.where(np.arange(200) == 77, 1.0, 0.0)) == {}


def test_of_a_tracker_the_coordinates_of_its_angle_are_no_places_and_others_are():
    t = np.arange(600) * 0.02
    angle = 0.8 * np.sin(3.0 * t) * np.exp(-0.05 * t)
    length = 300.0 + 5.0 * np.sin(7.0 * t)  # the pivot is not quite where the tracker has it
    tracked = {"X": length * np.sin(angle), "Y": -length * np.cos(angle), "angle (deg)": np.degrees(angle) + 90.0}
    assert set(coordinates_among(tracked)) == {"X", "Y"}
    assert set(coordinates_among(tracked | {"Y": -tracked["Y"]})) == {"X", "Y"}
    assert not coordinates_among(tracked | {"X": tracked["X"] + 5.0 * np.sin(11.0 * t)})
    assert not coordinates_among({n: v for n, v in tracked.items() if n != "angle (deg)"})
