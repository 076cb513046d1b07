"""Tests of residuals: as many false alarms as promised, and real ones found, also where the residual is coloured."""

import numpy as np
import pytest

from wheelpend.estimation.residual_statistics import (
    autocorrelation,
    excess_kurtosis,
    normal_quantiles,
    past_input_p_value,
    spread_lags,
)

LONGEST = 100  # samples


def record(seed, colour=0.0, swelling=0.0, count=3000):
    """A residual with a pole and a size that swells, and an input that a controller makes of it and of a reference."""
    random = np.random.default_rng(seed)
    shocks = random.normal(size=count) * np.exp(swelling * np.sin(np.arange(count) / 200))
    reference, residual, command = random.normal(size=count), np.zeros(count), np.zeros(count)
    for k in range(1, count):
        residual[k] = colour * residual[k - 1] + shocks[k]
        command[k] = 0.95 * command[k - 1] + 0.3 * reference[k] - 0.5 * residual[k]
    return residual, command


@pytest.mark.parametrize("swelling", [0.0, 1.0])
def test_white_noise_is_called_coloured_as_often_as_the_level_says(swelling):
    lags = spread_lags(LONGEST)
    p = [autocorrelation([record(s, swelling=swelling)[0]], lags).p_value for s in range(200)]
    assert 0.01 < np.mean(np.array(p) < 0.05) < 0.10


@pytest.mark.parametrize("colour", [0.0, 0.8])
def test_an_input_that_answers_to_the_residual_does_not_predict_it(colour):
    p = []
    for seed in range(200):
        residual, command = record(seed, colour)
        p.append(past_input_p_value([residual], [command[None]], LONGEST))
    assert 0.01 < np.mean(np.array(p) < 0.05) < 0.11


def test_an_input_that_acts_late_is_found():
    residual, command = record(1)
    late = residual + 0.1 * np.r_[np.zeros(5), command[:-5]]
    assert past_input_p_value([late], [command[None]], LONGEST) < 1e-6


def test_colour_is_found_and_its_value_and_band_are_right():
    found = autocorrelation([record(2, 0.5, count=20000)[0]], np.array([1, 2, 400]))
    assert found.values[:2] == pytest.approx([0.5, 0.25], abs=0.03) and abs(found.values[2]) < found.band[2] * 2
    assert found.p_value < 1e-12
    white = autocorrelation([record(3, count=10000)[0]], np.array([1]))
    assert white.band == pytest.approx(1.96 / 100, rel=0.1)


def test_no_product_reaches_over_a_gap_or_a_missing_value():
    residual = record(4)[0]
    whole = autocorrelation([residual[:1000], residual[2000:]], np.array([10]))
    by_hand = np.r_[residual[10:1000] * residual[:990], residual[2010:] * residual[2000:-10]]
    assert whole.deviates == pytest.approx(by_hand.sum() / np.sqrt((by_hand**2).sum()))
    assert np.isfinite(autocorrelation([np.where(residual > 2, np.nan, residual)], np.array([1])).p_value)


def test_too_little_says_nothing():
    assert autocorrelation([np.ones(5)], spread_lags(3)).p_value == 1.0
    assert past_input_p_value([np.ones(5)], [np.ones((1, 5))], 3) == 1.0
    assert past_input_p_value([record(5)[0]], [np.ones((1, 3000))], LONGEST) == 1.0
    assert normal_quantiles(np.array([np.nan])) == [] and excess_kurtosis(np.array([np.nan])) == 0.0


def test_quantiles_and_tails_are_those_of_the_distribution():
    random = np.random.default_rng(6)
    normal, heavy = random.normal(size=50_000), random.standard_t(5, size=50_000)
    assert all(abs(own - of_normal) < 0.2 for of_normal, own in normal_quantiles(normal))
    assert abs(excess_kurtosis(normal)) < 0.1 < 1.0 < excess_kurtosis(heavy)
