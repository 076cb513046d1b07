"""How a log is cut into segments."""

import numpy as np
import pytest

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
    np.testing.assert_array_equal(bounds, np.column_stack((np.arange(0, 1000, 50), np.arange(50, 1001, 50))))


def test_segments_of_a_jittered_log_are_as_long_as_the_horizon():
    rng = np.random.default_rng(2)
    log = synthetic(t=np.arange(2000) * 0.01 + rng.uniform(-0.003, 0.003, 2000))
    first = segment_bounds(log, 0.5)[:, 0]
    assert np.abs(np.diff(log.t[first]) - 0.5).max() < 0.01


def test_a_segment_has_at_least_five_samples():
    bounds = segment_bounds(synthetic(43), 0.01)
    assert np.diff(bounds).ravel().tolist() == [5] * 8


def test_segments_stay_within_start_and_stop():
    bounds = segment_bounds(synthetic(1000), 0.5, start=120, stop=300)
    assert bounds.tolist() == [[120, 170], [170, 220], [220, 270], [270, 300]]


def test_a_leftover_under_a_fifth_of_the_horizon_is_dropped():
    assert segment_bounds(synthetic(109), 0.5).tolist() == [[0, 50], [50, 100]]
    assert segment_bounds(synthetic(110), 0.5).tolist() == [[0, 50], [50, 100], [100, 110]]


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
    assert len(inside) == 400 - 21


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
    assert sum(last - first for first, last in bounds) == 400
