"""All single effects and all pairs at once: the cross-validated sum of squares that each would leave.

One pass over the data leaves, for each fold, the normal equations of every column and of the residual. From these alone
every model of some columns is fitted to the other folds and judged on its own: no row is touched again.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations
from typing import NamedTuple

import numpy as np

from wheelpend.diagnosis.score_test import FittedSegments, linear_names, shoot_with_candidates
from wheelpend.estimation.fit import Fit
from wheelpend.estimation.normal_equations import reduced_equations
from wheelpend.estimation.parameters import ParameterLayout
from wheelpend.estimation.problem import EstimationProblem
from wheelpend.estimation.scaled_inverse import MIN_EXPLAINING_RATIO, ScaledInverse, solve_damped
from wheelpend.estimation.shooting import ShootingLinearisation

FOLD_COUNT = 10


class PairSearch(NamedTuple):
    """Sums of squares left on the folds that were not fitted."""

    base: float  # by the base columns alone
    singles: np.ndarray  # (groups,) with one group of columns more
    pairs: np.ndarray  # (groups, groups) with two, symmetric; on the diagonal the singles

    def best_pair(self) -> tuple[int, int]:
        """The two groups that leave least together."""
        first, second = np.unravel_index(np.argmin(self.pairs), self.pairs.shape)
        return int(first), int(second)


def leading_pair(problem: EstimationProblem, fitted: Fit) -> tuple[str, ...]:
    """The two effects that would leave least together, as far as a fit's linearisation tells; none where it cannot."""
    effects = [e for e in problem.candidates() if not e.event and e.profiled is None and not e.releases]
    point = FittedSegments(problem, fitted, problem.data.estimation)
    layout, linearisations = shoot_with_candidates(point, [n for e in effects for n in linear_names(e)], {})
    names = [p.name for p in layout.elements]
    base = [k for k, n in enumerate(names) if n in fitted.names]
    order = [*base, *(k for k in range(len(names)) if k not in base), len(names)]
    grams = folded_grams(linearisations, problem.module.NX, layout)[:, order][:, :, order]
    if len(effects) < 2 or not np.isfinite(grams).all():
        return ()
    sorted_names = [names[k] for k in order[:-1]]
    groups = [[k for k, n in enumerate(sorted_names) if n in linear_names(e)] for e in effects]
    return tuple(effects[k].name for k in dict.fromkeys(search_pairs(grams, len(base), groups).best_pair()))


def folded_grams(
    linearisations: Sequence[ShootingLinearisation], nx: int, layout: ParameterLayout, folds: int = FOLD_COUNT
) -> np.ndarray:
    """Normal equations (folds, n + 1, n + 1) of the free parameters and, last, the residual, the states eliminated."""
    segments = reduced_equations(linearisations, nx, layout).segments
    edges = np.unique(np.arange(folds) * len(segments.score) // folds)
    folded = segments.fold(np.searchsorted(edges, np.arange(len(segments.score)), side="right") - 1)
    across = folded.score[:, :, None]
    return np.block([[folded.information, across], [across.swapaxes(1, 2), folded.cost[:, None, None]]])


def search_pairs(grams: np.ndarray, base: int, groups: Sequence[Sequence[int]]) -> PairSearch:
    """Fit every group of columns and every pair of groups, beside the first ``base`` columns, to all folds but one.

    grams (folds, n + 1, n + 1) have what is to be explained last. Each fold is judged by fits to the others, from their
    normal equations.
    """
    count = len(groups)
    models = [(a, a) for a in range(count)] + list(combinations(range(count), 2))
    columns = [sorted({*groups[a], *groups[b]}) for a, b in models]
    by_size: dict[int, list[int]] = {}
    for number, chosen in enumerate(columns):
        by_size.setdefault(len(chosen), []).append(number)
    both = [_project_out_base(grams.sum(axis=0) - fold, fold, base) for fold in grams]
    rest, judged = (np.array(each) for each in zip(*both, strict=True))
    left, left_base = np.zeros(len(models)), judged[:, -1, -1].sum()
    for size, numbers in by_size.items():
        places = np.array([columns[n] for n in numbers]).reshape(len(numbers), size) - base
        rows, across = places[:, :, None], places[:, None, :]
        step = solve_damped(rest[:, rows, across], rest[:, places, -1:])[..., 0]
        gain = np.einsum("fmi,fmi->m", step, 2.0 * judged[:, places, -1])
        left[numbers] = left_base - gain + np.einsum("fmi,fmij,fmj->m", step, judged[:, rows, across], step)
    pairs = np.zeros((count, count))
    for (a, b), value in zip(models, left, strict=True):
        pairs[a, b] = pairs[b, a] = value
    return PairSearch(float(left_base), left[:count].copy(), pairs)


def _project_out_base(fitted: np.ndarray, judged: np.ndarray, base: int) -> tuple[np.ndarray, np.ndarray]:
    """Both normal equations without what the base columns, fitted to the first, explain; the columns of unit length.

    What is to be explained keeps its own length.
    """
    own = np.sqrt(np.maximum(np.diag(fitted), 0.0))
    scale = np.where(own > 0.0, own, 1.0)
    scale[-1] = 1.0
    first, second = fitted / np.outer(scale, scale), judged / np.outer(scale, scale)
    answers = ScaledInverse.of(first[:base, :base], MIN_EXPLAINING_RATIO).solve(first[:base, base:])
    turn = np.vstack([-answers, np.eye(len(fitted) - base)])
    first, second = turn.T @ first @ turn, turn.T @ second @ turn
    length = np.sqrt(np.maximum(np.diag(first), 0.0))
    scale = np.where(length > 1e-6, length, np.inf)  # what the base explains has nothing left to explain with
    scale[-1] = 1.0
    return first / np.outer(scale, scale), second / np.outer(scale, scale)
