"""Hours of samples, reduced to a window."""

import time

import numpy as np
import pytest

from wheelpend.view.reduction import reduced, window_of

PIXELS = 600


def test_every_extreme_of_a_pixel_is_shown_where_and_when_it_was():
    random = np.random.default_rng(4)
    t = np.sort(random.uniform(0.0, 100.0, 50_000))
    values = random.normal(size=50_000)
    shown_t, shown = reduced(t, values, PIXELS)
    assert len(shown) == len(shown_t) <= 3 * PIXELS and np.all(np.diff(shown_t) >= 0)
    drawn = {(a, b) for a, b in zip(shown_t, shown, strict=True) if b == b}
    assert drawn <= set(zip(t, values, strict=True))
    pixel = np.searchsorted(np.linspace(t[0], t[-1], PIXELS, endpoint=False), t, side="right")
    for k in range(1, PIXELS + 1, 7):
        own = np.flatnonzero(pixel == k)
        for place in (own[values[own].argmin()], own[values[own].argmax()]):
            assert (t[place], values[place]) in drawn


def test_a_peak_before_a_dip_is_shown_before_it():
    t, values = np.arange(100_000.0), np.zeros(100_000)
    values[[1005, 1100]] = 5.0, -3.0
    shown_t, shown = reduced(t, values, PIXELS)
    assert (shown_t[shown.argmax()], shown_t[shown.argmin()]) == (1005.0, 1100.0)


def test_pixels_are_of_time_however_dense_the_samples_are():
    t = np.concatenate([np.linspace(0.0, 1.0, 90_000, endpoint=False), np.linspace(1.0, 100.0, 10_000)])
    shown_t, _ = reduced(t, np.sin(np.arange(100_000) * 0.7), PIXELS)
    assert 0.95 < np.mean(shown_t > 1.0) < 1.0


def test_what_fits_is_shown_as_it_is():
    t, values = np.arange(10.0), np.arange(10.0) ** 2
    assert np.array_equal(reduced(t, values, 5)[1], values)


@pytest.mark.parametrize("of_stamps", [False, True], ids=["missing values", "missing rows"])
@pytest.mark.parametrize("count", [400, 100_000])
def test_a_gap_stays_one_however_short(of_stamps, count):
    t, values = np.arange(float(count)), np.ones(count)
    first, last = int(0.5 * count), int(0.5 * count) + 20
    if of_stamps:
        t, values = np.delete(t, slice(first, last)), np.delete(values, slice(first, last))
    else:
        values[first:last] = np.nan
    shown_t, shown = reduced(t, values, PIXELS)
    missing = shown_t[np.isnan(shown)]
    assert len(missing) and np.all(np.abs(missing - first) <= count / PIXELS + 20)


def test_a_missing_value_hides_no_other():
    values = np.full(10_000, np.nan)
    values[[1, 5000]] = 2.0, 3.0
    shown = reduced(np.arange(10_000.0), values, 100)[1]
    assert np.nanmax(shown) == 3.0 and np.nanmin(shown) == 2.0 and np.isnan(shown).any()


@pytest.mark.parametrize("count", [0, 1, 2])
def test_hardly_any_sample_is_shown_all_the_same(count):
    shown_t, shown = reduced(np.arange(float(count)), np.ones(count), PIXELS)
    assert len(shown_t) == len(shown) == count


def test_nothing_but_missing_values_are_nothing():
    shown_t, shown = reduced(np.arange(10_000.0), np.full(10_000, np.nan), PIXELS)
    assert len(shown_t) == len(shown) <= 3 * PIXELS and np.isnan(shown).all()


def test_a_window_reaches_one_sample_beyond_its_edges():
    t = np.arange(10.0)
    assert list(t[window_of(t, 2.5, 5.5)]) == [2, 3, 4, 5, 6] and list(t[window_of(t, -5, 50)]) == list(t)


def test_an_hour_at_a_kilohertz_is_reduced_while_nobody_waits():
    values = np.random.default_rng(0).normal(size=3_600_000)
    t = np.arange(len(values)) * 1e-3
    begin = time.process_time()
    reduced(t, values, PIXELS)
    assert time.process_time() - begin < 1.0
