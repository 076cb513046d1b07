"""Normal equations against least squares on the rows that they stand for."""

import numpy as np
import pytest

from wheelpend.estimation.normal_equations import NormalEquations, without_states
from wheelpend.estimation.parameters import FreeParameter, ParameterLayout

PARTS, ROWS, STATES, COUNT = 4, 30, 2, 3
LAYOUT = ParameterLayout.of([FreeParameter(f"p{k}") for k in range(COUNT)], 1)


@pytest.fixture(scope="module")
def rows():
    """Columns of the states of each part, of the parameters, and the residual, (parts, rows, columns)."""
    scale = np.array([1.0, 1e3, 1e-3, 1.0, 1e2, 1.0])
    return np.random.default_rng(2).normal(size=(PARTS, ROWS, STATES + COUNT + 1)) * scale


def grams(rows):
    return np.einsum("pri,prj->pij", rows, rows)


def equations_of(rows):
    gram = grams(rows)
    return NormalEquations(LAYOUT, gram[:, :-1, :-1], gram[:, :-1, -1], gram[:, -1, -1])


def test_what_is_left_without_states_is_what_least_squares_on_the_rows_leaves(rows):
    reduced = without_states(grams(rows), STATES, LAYOUT)[0].sum()
    stacked = np.zeros((PARTS * ROWS, PARTS * STATES + COUNT))
    for k, part in enumerate(rows):
        stacked[k * ROWS : (k + 1) * ROWS, k * STATES : (k + 1) * STATES] = part[:, :STATES]
        stacked[k * ROWS : (k + 1) * ROWS, PARTS * STATES :] = part[:, STATES:-1]
    target = rows[:, :, -1].ravel()
    answer = np.linalg.lstsq(stacked, target, rcond=None)[0]
    change, _ = reduced.solve(range(COUNT))
    assert change == pytest.approx(answer[-COUNT:], rel=1e-7)
    left = reduced.cost - reduced.gain(range(COUNT), change)
    assert left == pytest.approx(np.sum((target - stacked @ answer) ** 2), rel=1e-7)


def test_projecting_out_a_column_is_fitting_it_along(rows):
    whole = equations_of(rows[:, :, STATES:]).sum()
    rest = whole.project([0])
    together, _ = whole.solve(range(COUNT))
    beside, _ = rest.solve([1, 2])
    assert beside == pytest.approx(together[1:], rel=1e-9)
    assert rest.cost - rest.gain([1, 2], beside) == pytest.approx(whole.cost - whole.gain(range(COUNT), together))
    assert np.abs(rest.information[0]).max() < 1e-9 * whole.information[0, 0]


def test_folds_add_up_to_all_parts(rows):
    parts = equations_of(rows[:, :, STATES:])
    folds = parts.fold(np.array([0, 1, 1, 0]))
    both = folds.part(0).add(folds.part(1))
    assert both.information == pytest.approx(parts.sum().information) and both.score == pytest.approx(parts.sum().score)
    assert float(both.cost) == pytest.approx(float(parts.sum().cost))


def test_a_parameter_without_influence_does_not_move(rows):
    silent = rows[:, :, STATES:].copy()
    silent[:, :, 1] = 0.0
    change, covariance = equations_of(silent).sum().solve(range(COUNT))
    assert change[1] == 0.0 and covariance[1, 1] == 0.0 and np.abs(change[[0, 2]]).min() > 0.0
