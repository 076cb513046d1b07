"""The inverse without flat directions."""

import numpy as np
import pytest

from wheelpend.estimation.scaled_inverse import ScaledInverse


@pytest.mark.parametrize("odd", [np.nan, np.inf])
def test_a_matrix_that_is_not_finite_identifies_nothing(odd):
    inverse = ScaledInverse.of(np.array([[2.0, odd], [odd, 3.0]]))
    assert not inverse.kept.any()
    assert inverse.solve(np.array([1.0, 2.0])).tolist() == [0.0, 0.0]
    assert inverse.matrix.tolist() == [[0.0, 0.0], [0.0, 0.0]]
    assert inverse.lost.tolist() == [1.0, 1.0]
    assert inverse.condition == np.inf


def test_a_sound_matrix_is_inverted():
    matrix = np.array([[2.0, 0.5], [0.5, 3.0]])
    np.testing.assert_allclose(ScaledInverse.of(matrix).matrix, np.linalg.inv(matrix), rtol=1e-12)


def test_a_parameter_of_vanishing_influence_has_no_infinite_variance():
    inverse = ScaledInverse.of(np.diag([4.0, 1e-304]))
    assert inverse.matrix.tolist() == [[0.25, 0.0], [0.0, 0.0]]
    assert inverse.solve(np.array([2.0, 1.0])).tolist() == [0.5, 0.0]
