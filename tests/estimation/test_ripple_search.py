"""Starts of ripples and lags come out as SciPy has their pieces."""

import math

import numpy as np
import pytest
from scipy import signal, special

from wheelpend.estimation import ripple_search


@pytest.mark.parametrize("count", [1, 4])
def test_sums_of_exponentials(count):
    assert ripple_search.poisson_below(count, 3.3) == pytest.approx(special.gammaincc(count, 3.3), rel=1e-12)


def test_two_lags_in_a_row():
    wave = np.exp(1j * np.linspace(0.0, 90.0, 777))
    response = ripple_search.lag_frequency_response(777, 0.002, (0.01, 0.013))
    found, expected = np.fft.ifft(np.fft.fft(wave, len(response)) * response)[:777], wave
    for tau in (0.01, 0.013):
        keep = math.exp(-0.002 / tau)
        expected = signal.lfilter([1 - keep], [1, -keep], expected)
    np.testing.assert_allclose(found, expected, atol=1e-12)


@pytest.mark.parametrize(("samples", "before"), [(200, 0), (200, 37), (203, 100)])
def test_filters_turned_round_weigh_a_wave_as_the_filtered_wave_is_weighed(samples, before):
    rng, dt, taus, blocks = np.random.default_rng(1), 0.01, (0.03, 0.05), 10
    angle = np.cumsum(rng.normal(size=before + samples))
    record = ripple_search.RippleResidual(
        rng.normal(size=samples), angle, before, ripple_search.lag_frequency_response(len(angle), dt, taus)
    )
    wave, seen = np.exp(3j * angle), np.exp(3j * angle)
    for tau in taus:
        keep = math.exp(-dt / tau)
        seen = signal.lfilter([1.0 - keep], [1.0, -keep], seen)
    seen, size = seen[before:], samples // blocks
    products = (seen * record.missing)[: blocks * size].reshape(blocks, size).sum(axis=1)
    np.testing.assert_allclose([wave[s] @ w for s, w in record.weights(blocks)], products, atol=1e-10)
    assert record.length(wave) == pytest.approx(np.linalg.norm(seen), rel=1e-9)


def test_a_log_of_fewer_samples_than_blocks_weighs_nothing():
    record = ripple_search.RippleResidual(
        np.ones(7), np.arange(7.0), 0, ripple_search.lag_frequency_response(7, 0.01, (0.03, 0.05))
    )
    assert [len(w) for _, w in record.weights(10)] == [0] * 10
