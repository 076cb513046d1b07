"""Where a free swing hangs that is too coarse for its acceleration, and when it was let go."""

import numpy as np
import pytest

from wheelpend.inspection.gravity import resting_zero
from wheelpend.logs.faults import held_samples

RATE_HZ, ZERO = 6.0, -1.45  # readings a second, some five in a swing; what the sensor reads as it hangs


def swing(held_s: float, duration_s: float, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """Times and readings of a pendulum that is held away from where it hangs, let go, and comes to rest."""
    fine = 0.001
    angle, speed, path = 1.4, 0.0, []
    for k in range(round(duration_s / fine)):
        path.append(angle)
        if k * fine >= held_s:
            speed += fine * (-56.0 * np.sin(angle) - 1.4 * np.sign(speed))
            angle += fine * speed
            if abs(speed) < 0.02 and 56.0 * abs(np.sin(angle)) < 1.4:
                speed = 0.0
    step = round(1.0 / RATE_HZ / fine)
    t = np.arange(len(path))[::step] * fine
    return t, np.array(path)[::step] + ZERO + 0.004 * np.random.default_rng(seed).standard_normal(t.size)


def test_a_swing_that_dies_out_hangs_where_it_rests():
    _, angle = swing(0.0, 20.0)
    assert resting_zero(angle) == pytest.approx(ZERO, abs=0.03)
    assert resting_zero(np.where(np.arange(angle.size) % 7 == 3, np.nan, angle)) == pytest.approx(ZERO, abs=0.03)


def test_no_swing_that_goes_on_and_nothing_that_only_stops_hangs_where_it_ends():
    t, angle = swing(0.0, 20.0)
    assert resting_zero(angle[: np.searchsorted(t, 6.0)]) is None
    assert resting_zero(np.minimum(t / 3.0, 2.0)) is None  # turned to another place, and left there
    assert resting_zero(0.1 * (angle - ZERO)) is None and resting_zero(np.full(50, np.nan)) is None


@pytest.mark.parametrize("held_s", [1.0, 2.0])
def test_a_pendulum_that_was_held_is_seen_to_be_let_go_in_a_coarse_log(held_s):
    t, angle = swing(held_s, 14.0)
    assert t[held_samples(t, [angle])] == pytest.approx(held_s, abs=1.5 / RATE_HZ)
    free, released = swing(0.0, 14.0)
    assert held_samples(free, [released]) == 0
