"""Angles that wrap and encoders that start again are made continuous; nothing else is touched."""

import numpy as np
import pytest

from wheelpend.logs.unwrap import make_continuous, overflowing_count, whole_turn

T = np.arange(4000) * 0.002
TURNING = 30.0 * np.sin(0.5 * T) + 0.1 * np.sin(9 * T)


def test_a_wrapped_angle_is_made_continuous():
    wrapped = (TURNING + np.pi) % (2 * np.pi) - np.pi
    found, remarks = make_continuous("theta_1", wrapped, T, "rad")
    np.testing.assert_allclose(np.diff(found), np.diff(TURNING), atol=1e-9)
    assert "was wrapped" in remarks[0]


def test_an_encoder_that_starts_again_goes_on_where_it_was():
    reset = TURNING.copy()
    reset[1500:] -= reset[1500]
    reset[2900:] -= reset[2900]
    found, remarks = make_continuous("theta_w", reset, T, "rad")
    np.testing.assert_allclose(found, TURNING, atol=0.1)  # a step's own motion is lost at each start
    assert "2 times, first 3" in remarks[0]


@pytest.mark.parametrize("name", ["still", "noise", "swing", "dropout", "fast start"])
def test_what_is_continuous_stays_as_it_is(name):
    rng = np.random.default_rng(4)
    signals = {
        "still": np.zeros(4000),
        "noise": rng.normal(size=4000),
        "swing": np.sin(20 * T),
        "dropout": np.where(np.arange(4000) == 700, 0.0, 3.0 + np.sin(3 * T)),
        "fast start": np.tanh(T) * 5.0,
    }
    found, remarks = make_continuous("x", signals[name], T, "m")
    assert found is signals[name] and remarks == []


@pytest.mark.parametrize("per_sample", [70.0, 91.0, 150.0])
def test_an_angle_that_goes_on_by_less_than_half_a_turn_from_sample_to_sample_is_made_continuous(per_sample):
    t = np.arange(400) * 0.01
    turning = np.deg2rad(per_sample) * (np.arange(400) - 20.0 * (1.0 - np.exp(-np.arange(400) / 20.0)))  # it speeds up
    found, remarks = make_continuous("theta_1", turning % (2 * np.pi), t, "rad")
    np.testing.assert_allclose(np.diff(found), np.diff(turning), atol=1e-9)
    assert "was wrapped" in remarks[0]
    assert whole_turn(np.rad2deg(turning) % 360.0) == 360.0


K = np.arange(400)
JUMPING = {
    "anywhere": np.random.default_rng(5).uniform(-np.pi, np.pi, 400),
    "a square wave": 2.0 * np.sign(np.sin(K / 23.0)),
    "a duty in degrees": np.deg2rad(100.0 + 100.0 * np.sign(np.sin(K / 23.0))),
    "a servo from end to end": np.deg2rad(np.where(K // 15 % 2, 200.0, 0.0)) + 0.01 * np.sin(K),
}


@pytest.mark.parametrize("name", JUMPING)
def test_what_jumps_about_within_a_turn_is_not_wrapped(name):
    assert make_continuous("theta_1", JUMPING[name], K * 0.01, "rad")[1] == []
    assert whole_turn(JUMPING[name]) == whole_turn(np.rad2deg(JUMPING[name])) == 0.0


def test_nothing_is_no_turn_and_a_way_of_metres_is_no_angle():
    assert whole_turn(np.full(9, np.nan)) == whole_turn(np.zeros(1)) == whole_turn(np.zeros(0)) == 0.0
    dropouts = np.where(K % 80 == 7, 0.0, 5.5 + 0.4 * np.sin(K / 30.0))
    assert make_continuous("x", dropouts, K * 0.01, "m")[1] == []


def test_a_gap_does_not_hide_a_wrap():
    wrapped = (TURNING + np.pi) % (2 * np.pi) - np.pi
    for first in range(300, 3600, 170):
        cut = wrapped.copy()
        cut[first : first + 100] = np.nan
        assert "was wrapped" in make_continuous("theta_1", cut, T, "rad")[1][0]


SQUARE = np.where(np.sin(4 * T) > 0, 0.1, 0.0) + 1e-5 * np.sin(50 * T)
RETURN = np.interp(T, [0, 2, 4, 8], [0, 0.2, 0.0, 0.0]) + 1e-5 * np.sin(50 * T)
SWING = np.where(T < 5, 0.7 * np.sin(3 * T), 0.0) + 1e-4 * np.sin(40 * T)


@pytest.mark.parametrize(
    ("motion", "lost"),
    [
        (SQUARE, slice(0, 0)),  # it jumps back
        (RETURN, slice(1000, 2100)),  # what happened in between is not known
        (SWING, slice(2490, 2520)),
        (np.where((T > 3) & (T < 3.2), 0.0, 0.4 + 0.01 * np.sin(9 * T)), slice(0, 0)),  # a sensor that gave nothing
    ],
)
def test_motion_and_dropouts_are_no_encoder_that_starts_again(motion, lost):
    values = motion.copy()
    values[lost] = np.nan
    found, remarks = make_continuous("x", values, T, "m")
    assert found is values and remarks == []


def test_missing_samples_do_not_hide_a_wrap():
    wrapped = (TURNING + np.pi) % (2 * np.pi) - np.pi
    wrapped[::7] = np.nan
    found, _ = make_continuous("theta_1", wrapped, T, "rad")
    good = np.isfinite(found)
    assert np.abs(found[good] - TURNING[good] - (found[good] - TURNING[good])[0]).max() < 1e-9


def test_what_happened_in_a_gap_is_no_wrap():
    t = np.where(np.arange(4000) < 2000, T, T + 30.0)
    values = np.where(np.arange(4000) < 2000, 0.1, 0.1 + 2 * np.pi) + 0.01 * np.sin(9 * T)
    found, remarks = make_continuous("theta_1", values, t, "rad", can_reset=False)
    assert found is values and remarks == []


def test_a_turn_that_is_taken_across_a_gap_is_said_to_be_the_nearest():
    wrapped = (TURNING + np.pi) % (2 * np.pi) - np.pi
    jump = int(np.flatnonzero(np.abs(np.diff(wrapped)) > 5.0)[3])
    wrapped[jump - 1 : jump + 1] = np.nan
    found, remarks = make_continuous("theta_1", wrapped, T, "rad")
    assert "made continuous, over 1 gap by the nearest turn." in remarks[0]
    known = np.isfinite(found)
    np.testing.assert_allclose(np.diff(found[known]), np.diff(TURNING[known]), atol=1e-9)


def turning(rows=2000):
    """Counts (rows,) of an encoder of 20000 a turn that goes to and fro over 40 turns."""
    return np.round(4e5 * np.sin(0.004 * np.arange(rows)) + 2000.0 * np.sin(0.1 * np.arange(rows)))


@pytest.mark.parametrize("bits", [12, 16])
@pytest.mark.parametrize("scale", [2 * np.pi / 20000, -1e-5])
def test_a_counter_that_overflows_is_made_continuous(bits, scale):
    counts = turning() if bits == 16 else np.round(turning() / 20)
    read = np.mod(counts + 2 ** (bits - 1), 2**bits) - 2 ** (bits - 1)
    values, remarks = make_continuous("x", read * scale, np.arange(2000) * 0.01, "m", count=scale)
    np.testing.assert_allclose(values - values[0], (counts - counts[0]) * scale, atol=1e-9)
    assert remarks == [f"x jumps by {2**bits} counts: its counter overflows, and is made continuous."]


def commanded():
    """Counts (2000,) of a command between both ends of what nine bits hold, and back, by steps of any size."""
    return np.repeat(np.random.default_rng(2).integers(-255, 256, 100), 20).astype(float)


@pytest.mark.parametrize(
    "values",
    [commanded(), np.where(np.arange(2000) // 100 % 2, 250.0, -250.0), turning() / 3.7, np.full(50, np.nan)],
    ids=["steps", "a relay", "no whole numbers", "nothing"],
)
def test_what_does_not_count_does_not_overflow(values):
    assert overflowing_count(values) == 0.0


def test_an_odd_reading_at_first_is_left_out_and_what_follows_does_not_start_again():
    way = 0.02 * np.arange(300.0)
    way[0] = 335.7
    values, (remark,) = make_continuous("theta_1", way, np.arange(300) * 0.01, "m")
    assert np.isnan(values[0]) and values[1:].tolist() == way[1:].tolist()
    assert remark == "theta_1 begins with a reading far off zero, from which it goes on: left out."
