"""Starts of ripples and lags come out as SciPy has their pieces."""

import math
from types import SimpleNamespace

import numpy as np
import pytest
from scipy import signal, special

from wheelpend.estimation import ripple_search


@pytest.mark.parametrize("count", [1, 4])
def test_sums_of_exponentials(count):
    assert ripple_search.poisson_below(count, 3.3) == pytest.approx(special.gammaincc(count, 3.3), rel=1e-12)


def test_two_lags_in_a_row():
    wave = np.exp(1j * np.linspace(0.0, 90.0, 777))
    response = ripple_search.lag_frequency_response(777, [math.exp(-0.002 / tau) for tau in (0.01, 0.013)])
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
        rng.normal(size=samples), angle, before, tuple(math.exp(-dt / tau) for tau in taus)
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
    record = ripple_search.RippleResidual(np.ones(7), np.arange(7.0), 0, (0.7, 0.8))
    assert [len(w) for _, w in record.weights(10)] == [0] * 10


def made_up_residual(samples, turns, periods, size=0.3):
    """Noise and a ripple in the residual of a port that turns to and fro, far in the log's middle third."""
    rng, count = np.random.default_rng(5), np.arange(samples)
    middle = np.abs(count - samples / 2) < samples / 6
    angle = np.cumsum(np.where(middle, 3.0, 0.3) * np.sin(count / 40.0) ** 2) * turns * 2.0 * np.pi / samples
    lags = (0.8, 0.85)
    seen = np.sin(periods * angle)
    for keep in lags:
        seen = signal.lfilter([1.0 - keep], [1.0, -keep], seen)
    return ripple_search.RippleResidual(rng.normal(size=samples) + size * seen, angle, 0, lags)


def test_a_part_weighs_waves_as_the_whole_does_there():
    whole = made_up_residual(3000, 20, 7.3)
    part = whole.part(1000, 1400)
    assert 0 < part.before < 400 and len(part.angle) == part.before + 400
    expected = whole.weights(30)[10:14]  # blocks of 100 samples
    for (there, w), (here, v) in zip(expected, part.weights(4), strict=True):
        wave, same = np.exp(7.3j * whole.angle), np.exp(7.3j * part.angle)
        assert abs(same[here] @ v - wave[there] @ w) < 1e-9 * np.abs(w).sum()


def test_the_busiest_stretch_is_where_the_port_travels_and_no_longer_than_can_be_searched(monkeypatch):
    record = made_up_residual(9000, 30, 7.3)
    assert record.busiest() == (0, 9000)
    monkeypatch.setattr(ripple_search, "MAX_SEARCHED_SAMPLES", 1500)
    begin, end = record.busiest()
    assert end - begin == 1500 and begin >= 3000 and end <= 6000
    monkeypatch.setattr(ripple_search, "MAX_SEARCHED_SPAN", 10.0)
    begin, end = record.busiest()
    assert 5.0 < np.ptp(record.angle[begin:end]) <= 10.0 and end - begin < 1500


def test_a_period_found_in_a_part_is_followed_to_the_sharpness_of_the_whole_log(monkeypatch):
    record = made_up_residual(60_000, 100, 7.31)
    monkeypatch.setattr(ripple_search, "ripple_residual", lambda *given: record)
    problem = SimpleNamespace(data=SimpleNamespace(estimation=[None]))
    sharp = 2.0 / record.span
    found, trials = ripple_search.strongest_ripple(problem, None, "drive", 0.03)
    assert found == pytest.approx(7.31, abs=sharp)
    monkeypatch.setattr(ripple_search, "MAX_SEARCHED_SAMPLES", 2_000)
    followed, further = ripple_search.strongest_ripple(problem, None, "drive", 0.03)
    assert followed == pytest.approx(7.31, abs=sharp) and 1 < further < trials + 200
    monkeypatch.setattr(
        ripple_search, "_followed", lambda records, stretches, parts, periods, trials: (periods, trials)
    )
    alone, _ = ripple_search.strongest_ripple(problem, None, "drive", 0.03)
    assert sharp < abs(alone - 7.31) < 0.2


def test_a_port_that_turns_too_far_between_samples_shows_no_ripple(monkeypatch):
    rng = np.random.default_rng(2)
    fast = ripple_search.RippleResidual(rng.normal(size=260), np.cumsum(rng.normal(size=260) * 2000.0), 0, (0.8, 0.85))
    monkeypatch.setattr(ripple_search, "ripple_residual", lambda *asked: fast)
    problem = SimpleNamespace(data=SimpleNamespace(estimation=[None]))
    assert ripple_search.strongest_ripple(problem, None, "drive", 0.01) == (1.0, 1)
