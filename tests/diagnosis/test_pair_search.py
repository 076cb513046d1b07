"""All singles and pairs from the normal equations of folds, against fits to the rows themselves."""

from __future__ import annotations

import numpy as np
import pytest

from wheelpend.diagnosis.pair_search import search_pairs

ROWS, BASE, FOLDS = 600, 3, 5
GROUPS = [[3], [4, 5], [6], [7], [8, 9]]


@pytest.fixture(scope="module")
def data():
    rng = np.random.default_rng(5)
    matrix = rng.normal(size=(ROWS, 10)) @ (np.eye(10) + 0.4 * rng.normal(size=(10, 10))) * np.logspace(-3, 3, 10)
    target = matrix[:, [0, 4, 5, 6]] @ [2.0, 1.0, -0.5, 0.3] / 10 + rng.normal(size=ROWS)
    return matrix, target


def folds_of(matrix, target):
    rows = np.column_stack([matrix, target]).reshape(FOLDS, -1, matrix.shape[1] + 1)
    return np.einsum("fri,frj->fij", rows, rows)


def left_by(matrix, target, columns):
    """The held-out sum of squares by least squares on the rows of the other folds."""
    total = 0.0
    for fold in range(FOLDS):
        held = np.arange(ROWS) // (ROWS // FOLDS) == fold
        answer = np.linalg.lstsq(matrix[~held][:, columns], target[~held], rcond=None)[0]
        total += float(np.sum((target[held] - matrix[held][:, columns] @ answer) ** 2))
    return total


def test_every_single_and_every_pair_leaves_what_fits_to_the_rows_leave(data):
    matrix, target = data
    found = search_pairs(folds_of(matrix, target), BASE, GROUPS)
    own = list(range(BASE))
    assert found.base == pytest.approx(left_by(matrix, target, own), rel=1e-7)
    for a, one in enumerate(GROUPS):
        assert found.singles[a] == pytest.approx(left_by(matrix, target, [*own, *one]), rel=1e-7)
        for b in range(a):
            assert found.pairs[a, b] == pytest.approx(left_by(matrix, target, [*own, *one, *GROUPS[b]]), rel=1e-7)


def test_the_pair_that_is_there_is_the_best(data):
    assert set(search_pairs(folds_of(*data), BASE, GROUPS).best_pair()) == {1, 2}


def test_a_column_that_the_base_explains_lowers_nothing(data):
    matrix, target = data
    doubled = np.column_stack([matrix, matrix[:, 0] + matrix[:, 1]])
    found = search_pairs(folds_of(doubled, target), BASE, [*GROUPS, [10]])
    assert found.singles[-1] == pytest.approx(found.base, rel=1e-9)
