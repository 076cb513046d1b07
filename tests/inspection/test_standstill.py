"""Where a place stands still."""

import numpy as np
import pytest

from wheelpend.inspection.standstill import standstill_times


def test_a_place_stands_still_where_it_moves_less_than_its_noise():
    place = np.concatenate([np.linspace(0, 1, 500), np.full(300, 1.0), np.linspace(1, 2, 500)])
    found = standstill_times(np.arange(1300) * 0.001, place + np.random.default_rng(1).normal(0, 1e-4, 1300), 1e-3)
    assert len(found) == 1 and found[0] == pytest.approx((0.5, 0.8), abs=0.01)
