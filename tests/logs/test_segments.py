"""How a log is cut into segments."""

from dataclasses import replace

import numpy as np
import pytest

from derive.effects import EFFECT_LIBRARY, INPUT_MEMORY_S
from tests.support import CHANNELS
from wheelpend.errors import Failure
from wheelpend.logs.log import Log, segment_bounds


def synthetic(n=1000, dt=0.01, t=None):
    """A log in memory, standing still but for its input."""
    t = np.arange(n) * dt if t is None else t
    return Log("made.csv", t, np.sin(9 * t), np.zeros((len(t), 3)), CHANNELS)


def test_a_part_keeps_the_time_of_the_whole_log():
    part = synthetic(100).part(40, 60)
    assert (part.t[0], len(part)) == (pytest.approx(0.4), 20)


def test_segments_follow_each_other_and_share_no_sample():
    bounds = segment_bounds(synthetic(1000), 0.5)
    np.testing.assert_array_equal(bounds, [*([k, k + 50] for k in range(15, 950, 50)), [965, 1000]])


def test_segments_of_a_jittered_log_are_as_long_as_the_horizon():
    rng = np.random.default_rng(2)
    log = synthetic(t=np.arange(2000) * 0.01 + rng.uniform(-0.003, 0.003, 2000))
    first = segment_bounds(log, 0.5)[:, 0]
    assert np.abs(np.diff(log.t[first]) - 0.5).max() < 0.01


def test_a_segment_has_at_least_five_samples():
    bounds = segment_bounds(synthetic(43), 0.01)
    assert np.diff(bounds).ravel().tolist() == [5] * 7


def test_a_segment_of_a_sensor_that_is_read_seldom_is_as_long_as_five_readings_take():
    log = synthetic(1000)
    seldom = np.where(np.arange(1000)[:, None] % 25 == 0, log.measured, np.nan)
    bounds = segment_bounds(replace(log, measured=seldom), 0.5)
    readings = [int(np.isfinite(seldom[a:b, 0]).sum()) for a, b in bounds]
    assert min(readings) == 5 and np.diff(bounds).min() >= 100
    assert not len(segment_bounds(replace(log, measured=np.full((1000, 3), np.nan)), 0.5))


def test_segments_stay_within_start_and_stop():
    bounds = segment_bounds(synthetic(1000), 0.5, start=120, stop=300)
    assert bounds.tolist() == [[120, 170], [170, 220], [220, 270], [270, 300]]


def test_a_leftover_under_a_fifth_of_the_horizon_is_dropped():
    assert segment_bounds(synthetic(600), 0.5, 100, 209).tolist() == [[100, 150], [150, 200]]
    assert segment_bounds(synthetic(600), 0.5, 100, 210).tolist() == [[100, 150], [150, 200], [200, 210]]


def test_no_segment_contains_a_gap_a_missing_input_or_a_fallen_body():
    t = np.arange(400) * 0.01
    t[130:] += 1.0
    log = synthetic(t=t)
    log.voltage[210] = np.nan
    log.measured[300:320, 1] = 2.0
    bounds = segment_bounds(log, 0.5)
    inside = {int(k) for first, last in bounds for k in range(first, last)}
    assert not inside & {210, *range(300, 320)}
    assert not any(first < 130 < last for first, last in bounds)
    assert [(s.begin, s.end) for s in log.stretches] == [(0, 130), (130, 210), (211, 300), (320, 400)]
    assert len(inside) == 319  # without warm-ups of 0.15 s, and what they leave over


def test_a_log_without_usable_samples_has_no_segments():
    log = synthetic(100)
    log.measured[:, 1] = 2.0
    assert segment_bounds(log, 0.5).shape == (0, 2)


@pytest.mark.parametrize("horizon", [0.0, -1.0, float("nan")])
def test_a_horizon_must_be_positive(horizon):
    with pytest.raises(Failure, match="positive time"):
        segment_bounds(synthetic(), horizon)


def test_no_segment_goes_on_across_a_gap_shorter_than_the_horizon():
    t = np.arange(400) * 0.01
    t[130:] += 0.06
    bounds = segment_bounds(synthetic(t=t), 0.5)
    assert not any(first < 130 < last for first, last in bounds)
    assert sum(last - first for first, last in bounds) == 400 - 2 * 15 - 5  # two warm-ups, and a leftover


@pytest.mark.parametrize(("share", "gaps"), [(0.2, 0), (0.12, 0), (0.05, 50)])
def test_a_pause_that_one_interval_in_ten_has_is_no_gap(share, gaps):
    """As of a logger that writes in bursts: intervals of 2 ms, and one in so many of 14 ms."""
    intervals = np.where(np.arange(999) % round(1.0 / share) == 0, 0.014, 0.002)
    log = synthetic(t=np.concatenate([[0.0], np.cumsum(intervals)]))
    bounds = segment_bounds(log, 0.5)
    long = [np.diff(log.t[a:b]).max() > 0.01 for a, b in bounds]
    assert any(long) == (not gaps) and len(bounds) == (0 if gaps else pytest.approx(log.duration / 0.5, abs=1.0))
    lost = synthetic(t=log.t + np.where(np.arange(1000) < 500, 0.0, 0.2))
    assert not any(a < 500 < b for a, b in segment_bounds(lost, 0.5))


def test_what_was_commanded_before_the_first_sample_or_in_a_gap_has_no_weight():
    t = np.arange(2000) * 0.01
    t[1000:] += 1.0
    log = synthetic(t=t)
    log.voltage[1500] = np.nan
    bounds = segment_bounds(log, 0.5)
    judged = {int(k) for first, last in bounds for k in range(first, last)}
    unknown = {*range(15), *range(1000, 1015), *range(1500, 1516)}
    assert not judged & unknown and judged == set(range(2000)) - unknown


def test_the_warm_up_lasts_until_the_slowest_winding_has_forgotten_the_last_command():
    slowest = EFFECT_LIBRARY["winding_inductance"].parameters[0].grid[-1]
    assert EFFECT_LIBRARY["actuator_delay"].parameters[0].grid[-1] < INPUT_MEMORY_S
    assert np.exp(-INPUT_MEMORY_S / slowest) == pytest.approx(0.05, rel=0.01)
    assert 20.0 * np.exp(-INPUT_MEMORY_S / 0.015) < 1e-3  # V, of 20 V, of a usual winding


def test_a_range_that_begins_in_the_middle_of_a_log_needs_no_warm_up():
    assert segment_bounds(synthetic(1000), 0.5, start=400)[0].tolist() == [400, 450]
    assert segment_bounds(synthetic(1000).part(400, 1000), 0.5)[0].tolist() == [15, 65]


@pytest.mark.parametrize(("samples", "warm_up"), [(140, 0.15), (130, 0.075), (50, 0.0375), (12, 0.0)])
def test_a_short_log_has_a_shorter_warm_up(samples, warm_up):
    assert synthetic(samples).warm_up_s == pytest.approx(warm_up)


def test_a_missing_command_counts_as_the_next_one_that_is_known():
    log = synthetic(6)
    log.voltage[:] = [np.nan, 1.0, np.nan, np.nan, 4.0, np.nan]
    assert log.known_voltage.tolist() == [1.0, 1.0, 4.0, 4.0, 4.0, 0.0]
    two = Log("two", log.t, np.column_stack([log.voltage, np.arange(6.0)]), log.measured, CHANNELS)
    assert two.known_voltage.tolist() == np.column_stack([[1.0, 1.0, 4.0, 4.0, 4.0, 0.0], np.arange(6.0)]).tolist()


def test_a_part_knows_the_commands_before_it():
    log = synthetic(1000)
    times, commands = log.part(400, 1000).earlier
    assert times.tolist() == log.t[350:400].tolist() and commands.tolist() == log.voltage[350:400].tolist()
    assert log.part(0, 500).earlier is None


def test_a_log_that_begins_at_rest_is_judged_from_its_first_sample():
    log = synthetic(1000)
    log.measured[:] = np.sin(9 * log.t)[:, None]
    still = log.t < 0.3
    log.measured[still], log.voltage[still] = 0.0, 0.0
    assert segment_bounds(log, 0.5)[0].tolist() == [0, 50]
    for moved in (log.measured[:, 0], log.voltage):
        kept, moved[still] = moved[still].copy(), 0.5 * np.sin(40 * log.t[still])
        assert segment_bounds(replace(log), 0.5)[0].tolist() == [15, 65]
        moved[still] = kept
    log.voltage[still] = 0.5 * np.sin(0.9 * log.t[still])  # sets out at once, from nothing: friction holds for a while
    assert segment_bounds(replace(log), 0.5)[0].tolist() == [0, 50]
