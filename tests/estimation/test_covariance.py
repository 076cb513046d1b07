"""Standard errors hold where noise has colour."""

import numpy as np
import pytest
from scipy.signal import lfilter

from wheelpend.estimation.covariance import block_numbers, correlated_samples, is_autocorrelated, jackknife_covariance
from wheelpend.estimation.normal_equations import NormalEquations
from wheelpend.estimation.parameters import FreeParameter, ParameterLayout


def autoregressive(shape, share, seed=0):
    noise = np.random.default_rng(seed).normal(size=shape) * np.sqrt(1 - share**2)
    return lfilter([1.0], [1.0, -share], noise, axis=-1)


def slopes_and_covariances(share, logs=200, segments=26, samples=50):
    """Slope of many logs of a line with noise of a colour, with its covariance by information and by blocks."""
    x = np.random.default_rng(1).normal(size=(segments, samples)).cumsum(axis=1)
    x -= x.mean(axis=1, keepdims=True)
    noise = autoregressive((logs, segments * samples), share).reshape(logs, segments, samples)
    information = (x**2).sum(axis=1)
    slopes = (x * noise).sum(axis=(1, 2)) / information.sum()
    scores = (x * (noise - slopes[:, None, None] * x)).sum(axis=2)
    plain, block = np.array([[1.0 / information.sum()]]), block_numbers([segments])
    slope, nothing = ParameterLayout.of([FreeParameter("slope")], 1), np.zeros(segments)
    equations = [NormalEquations(slope, information[:, None, None], s[:, None], nothing) for s in scores]
    robust = [jackknife_covariance(plain, e, block)[0, 0] for e in equations]
    return slopes, plain[0, 0], np.array(robust)


def test_blocks_tell_the_scatter_of_an_estimate_whatever_the_colour_of_the_noise():
    for share in (0.0, 0.95):
        slopes, plain, robust = slopes_and_covariances(share)
        assert 0.75 < np.mean(robust) / np.var(slopes) < 1.5
    assert np.var(slopes) > 5 * plain


def test_a_block_holds_several_segments_of_one_log():
    block = block_numbers([26, 13])
    assert np.bincount(block).min() >= 2
    assert not set(block[:26]) & set(block[26:])
    assert (np.diff(block) >= 0).all()


def test_colour_is_seen_where_there_is_some_and_hardly_ever_where_there_is_none():
    bounds = np.array([[k, k + 250] for k in range(0, 3000, 250)])
    white = [is_autocorrelated(autoregressive((3, 3000), 0.0, seed).T, bounds) for seed in range(40)]
    assert sum(white) <= 1
    assert all(is_autocorrelated(autoregressive((3, 3000), 0.3, seed).T, bounds) for seed in range(10))


def test_blocks_are_of_two_segments_at_least_where_a_log_has_enough():
    assert np.bincount(block_numbers([26])).tolist() == 13 * [2]
    assert np.bincount(block_numbers([200])).tolist() == 20 * [10]
    assert np.bincount(block_numbers([3])).tolist() == [1, 1, 1]


def test_a_block_moves_the_fit_by_as_much_as_a_fit_without_it():
    rng = np.random.default_rng(4)
    rows = rng.normal(size=(30, 2)) * np.where(np.arange(30) < 5, 3.0, 1.0)[:, None]  # the first block weighs most
    right, block = rows @ [1.0, -2.0] + rng.normal(size=30), np.arange(30) // 5
    whole = np.linalg.lstsq(rows, right, rcond=None)[0]
    moves = [np.linalg.lstsq(rows[block != k], right[block != k], rcond=None)[0] - whole for k in range(6)]
    informations, scores = np.einsum("si,sj->sij", rows, rows), rows * (right - rows @ whole)[:, None]
    layout = ParameterLayout.of(map(FreeParameter, "ab"), 1)
    segments = NormalEquations(layout, informations, scores, np.zeros(30))
    found = jackknife_covariance(np.linalg.inv(rows.T @ rows), segments, block)
    assert np.allclose(found, 5 / 6 * np.transpose(moves) @ moves, rtol=1e-9)


def test_a_sample_is_worth_as_many_as_it_is_correlated_with():
    bounds = np.array([[0, 4000]])
    assert correlated_samples(autoregressive((1, 4000), 0.0).T, bounds) == pytest.approx(1.0, abs=0.3)
    assert correlated_samples(autoregressive((1, 4000), 0.8).T, bounds) == pytest.approx(9.0, rel=0.3)
    assert correlated_samples(np.full((4000, 1), np.nan), bounds) == 1.0
