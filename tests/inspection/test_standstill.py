"""Where a place stands still."""

import numpy as np
import pytest

from wheelpend.logs.rest import standstill_times


def test_a_place_stands_still_where_it_moves_less_than_its_noise():
    place = np.concatenate([np.linspace(0, 1, 500), np.full(300, 1.0), np.linspace(1, 2, 500)])
    found = standstill_times(np.arange(1300) * 0.001, place + np.random.default_rng(1).normal(0, 1e-4, 1300), 1e-3)
    assert len(found) == 1 and found[0] == pytest.approx((0.5, 0.8), abs=0.01)


def test_where_a_swing_turns_it_does_not_stand_still():
    t = np.arange(0.0, 20.0, 1 / 30)
    swing = 0.9 * np.cos(4.0 * t) * np.exp(-0.02 * t)
    assert standstill_times(t, swing, 0.02) == []
    rest = np.where(t < 10.0, swing, swing[300])
    ((begin, end),) = standstill_times(t, rest, 0.02)
    assert 9.8 < begin < 10.1 and end == pytest.approx(t[-1])
