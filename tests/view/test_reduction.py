"""Hours of samples, reduced to a window."""

import time

import numpy as np

from wheelpend.view.reduction import reduced, window_of


def test_no_peak_is_lost():
    t, values = np.arange(100_000.0), np.zeros(100_000)
    values[[777, 54_321]] = 5.0, -3.0
    shown_t, shown = reduced(t, values, 600)
    assert len(shown) == len(shown_t) == 1200 and (shown.max(), shown.min()) == (5.0, -3.0)
    assert abs(shown_t[shown.argmax()] - 777) < 200 and np.all(np.diff(shown_t) >= 0)


def test_what_fits_is_shown_as_it_is():
    t, values = np.arange(10.0), np.arange(10.0) ** 2
    assert np.array_equal(reduced(t, values, 5)[1], values)


def test_a_missing_value_hides_no_other_and_a_gap_stays_one():
    values = np.full(10_000, np.nan)
    values[1] = 2.0
    shown = reduced(np.arange(10_000.0), values, 100)[1]
    assert np.nanmax(shown) == 2.0 and np.isnan(shown[2:]).all()


def test_a_window_reaches_one_sample_beyond_its_edges():
    t = np.arange(10.0)
    assert list(t[window_of(t, 2.5, 5.5)]) == [2, 3, 4, 5, 6] and list(t[window_of(t, -5, 50)]) == list(t)


def test_three_hours_at_a_kilohertz_are_reduced_while_nobody_waits():
    values = np.random.default_rng(0).normal(size=10_800_000)
    begin = time.process_time()
    reduced(np.arange(len(values)) * 1e-3, values, 600)
    assert time.process_time() - begin < 1.0
