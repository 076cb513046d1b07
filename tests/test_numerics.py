"""What SciPy has too comes out as SciPy has it."""

import numpy as np
import pytest
from scipy import linalg, ndimage, signal
from scipy.stats import beta

from wheelpend import numerics
from wheelpend.proportion import Proportion, proportion_of


def test_what_a_matrix_turns_into_zero():
    matrix = np.random.default_rng(0).normal(size=(2, 5))
    np.testing.assert_allclose(numerics.null_space(matrix), linalg.null_space(matrix), atol=1e-14)
    assert numerics.null_space(np.zeros((2, 3))).shape == (3, 3)


def test_smoothing_and_thinning():
    walk = np.cumsum(np.random.default_rng(0).normal(size=(2000, 2)), axis=0)
    smooth = numerics.gaussian_smoothed(walk[:, 0], 5.3)
    np.testing.assert_allclose(smooth, ndimage.gaussian_filter1d(walk[:, 0], 5.3, mode="nearest"), atol=1e-10)
    thin, expected = numerics.decimated(walk, 4), signal.decimate(walk, 4, axis=0)
    assert thin.shape == expected.shape and np.abs(thin - expected)[20:-20].max() < 1e-3 * walk.std()


@pytest.mark.parametrize("thin", [2, 7])
def test_a_long_signal_is_thinned_piece_by_piece_as_the_whole_is(thin, monkeypatch):
    walk = np.cumsum(np.random.default_rng(1).normal(size=(1800 * thin + 3, 2)), axis=0)
    whole = numerics.decimated(walk, thin)
    monkeypatch.setattr(numerics, "DECIMATED_PIECE", 400)
    pieces = numerics.decimated(walk, thin)
    assert pieces.shape == whole.shape == (1800 + -(-3 // thin), 2)
    assert np.abs(pieces - whole).max() < 1e-11 * np.abs(walk).max()


def test_a_constant_stays_a_constant():
    np.testing.assert_allclose(numerics.gaussian_smoothed(np.full(50, 3.0), 4.0), 3.0)


def test_a_proportion_has_the_interval_of_clopper_and_pearson():
    low, high = Proportion(3, 20).interval
    np.testing.assert_allclose([low, high], [beta.ppf(0.025, 3, 18), beta.ppf(0.975, 4, 17)], rtol=1e-6)
    assert proportion_of([True, False, True, True]) == (3, 4) and Proportion(3, 4).share == 0.75
