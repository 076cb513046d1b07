"""Choosing the terms of a law on the linearised shooting problem, one after the other.

A term counts by what it predicts on folds of the segments that did not make its coefficients, while the model's own
parameters move along within their bounds.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from derive.plant_signature import PlantSignature, combination_text
from wheelpend.diagnosis.criteria import MIN_REMAINING_INFORMATION_SHARE
from wheelpend.diagnosis.missing_force.law_terms import CoveredRange, Term, covered_range
from wheelpend.diagnosis.missing_force.piecewise_force import (
    FoldedLeastSquares,
    LinearisedLogs,
    build_least_squares,
    force_columns,
    piece_means,
    values_in_segments,
)
from wheelpend.diagnosis.missing_force.regressors import term_directions, term_regressors
from wheelpend.estimation.scaled_inverse import ScaledInverse

MAX_SINGLE_TERM_STARTS = 4  # single terms at a point that are refitted
MAX_LAW_STARTS = 10  # sets of terms that are refitted
MAX_CROSS_VALIDATED_TERMS = 12  # terms with the largest expected gain that are judged on folds
MIN_TERM_EIGENVALUE_RATIO = 1e-6  # of the columns of one term
MIN_TERM_GAIN = 12.0  # noise variances that a term must explain


class LawStart(NamedTuple):
    """Terms, with the solution of the linearised problem for parameters and coefficients."""

    terms: tuple[Term, ...]
    values: tuple[dict[str, float], ...]  # of each log: the model's parameters
    sizes: tuple[dict[str, float], ...]  # of each log: coefficients by column
    cross_validated_cost: float  # sum of squares on folds that did not make the coefficients


def search_laws(
    linearisations: Sequence[LinearisedLogs],
    candidates: Sequence[Term],
    max_terms: int,
    plant: PlantSignature,
    min_gain_share: float,
) -> list[LawStart]:
    """Single terms, and sets of at most so many, that predict best from any point of linearisation; the best first.

    A term counts if it explains the share ``min_gain_share`` of what is left above the noise.
    """
    best: dict[frozenset[Term], LawStart] = {}
    for linearised in linearisations:
        for start in forward_selection(linearised, candidates, max_terms, plant, min_gain_share):
            key = frozenset(start.terms)
            if key not in best or start.cross_validated_cost < best[key].cross_validated_cost:
                best[key] = start
    return sorted(best.values(), key=lambda s: s.cross_validated_cost)[:MAX_LAW_STARTS]


def forward_selection(
    linearised: LinearisedLogs, candidates: Sequence[Term], max_terms: int, plant: PlantSignature, min_gain_share: float
) -> list[LawStart]:
    """The best single terms at one point, and the set that grows from the best, one term after the other."""
    least_squares, columns = full_least_squares(linearised, candidates, plant)
    chosen: list[Term] = []
    cost, found = least_squares.cross_validated_cost(linearised.own), []
    while len(chosen) < max_terms:
        leading = leading_terms(least_squares, linearised, columns, chosen)
        names = [[*linearised.own, *_column_names([*chosen, t])] for t in leading]
        trials = [(least_squares.cross_validated_cost(n), t) for n, t in zip(names, leading, strict=True)]
        least_gain = max(MIN_TERM_GAIN, min_gain_share * (cost - linearised.noise))
        paying = sorted(((x, t) for x, t in trials if cost - x >= least_gain), key=lambda pair: pair[0])
        if not paying:
            break
        if not chosen:
            found += [law_start(least_squares, linearised, [t], x) for x, t in paying[:MAX_SINGLE_TERM_STARTS]]
        cost, chosen = paying[0][0], [*chosen, paying[0][1]]
    return [*found, law_start(least_squares, linearised, chosen, cost)] if len(chosen) > 1 else found


def column_name(term: Term, size: str) -> str:
    """Name of a term's column."""
    return f"{term.key} {size}"


def _column_names(chosen: Sequence[Term]) -> list[str]:
    return [column_name(t, size) for t in chosen for size, _ in t.sizes]


def full_least_squares(
    linearised: LinearisedLogs, candidates: Sequence[Term], plant: PlantSignature
) -> tuple[FoldedLeastSquares, dict[Term, list[str]]]:
    """Least squares in the model's parameters and all terms, and the columns of each term."""
    directions = np.concatenate([term_directions(t, plant) for t in candidates])
    columns = [
        force_columns(
            piece_means(p, np.concatenate([term_regressors(t, p.motion, plant) for t in candidates], axis=1)),
            directions,
        )
        for p in linearised.pieces
    ]
    of_term = {t: _column_names([t]) for t in candidates}
    own_logs = [n for t in candidates if t.per_log for n in of_term[t]] if len(linearised.pieces) > 1 else []
    return build_least_squares(
        linearised, [n for names in of_term.values() for n in names], columns, per_log=own_logs
    ), of_term


def leading_terms(
    least_squares: FoldedLeastSquares,
    linearised: LinearisedLogs,
    columns: dict[Term, list[str]],
    chosen: Sequence[Term],
) -> list[Term]:
    """Terms with the largest expected gain beside the parameters and the terms chosen already."""
    equations = least_squares.folds.sum()
    rest_equations = equations.project(least_squares.indices([*linearised.own, *_column_names(chosen)]))
    information, score = rest_equations.information, rest_equations.score
    gains = {}
    for term, names in columns.items():
        own = [k for n in names for k in least_squares.index[n]]
        raw, rest = np.diag(equations.information)[own], np.diag(information)[own]
        if term in chosen or not np.all(rest > MIN_REMAINING_INFORMATION_SHARE * raw) or not np.all(raw > 0.0):
            continue
        inverse = ScaledInverse.of(information[np.ix_(own, own)], MIN_TERM_EIGENVALUE_RATIO)
        gains[term] = float(score[own] @ inverse.solve(score[own]))
    return sorted(gains, key=lambda t: -gains[t])[:MAX_CROSS_VALIDATED_TERMS]


def law_start(
    least_squares: FoldedLeastSquares, linearised: LinearisedLogs, chosen: Sequence[Term], cost: float
) -> LawStart:
    """Parameters and coefficients of the linearised problem with the chosen terms."""
    names = [*linearised.own, *_column_names(chosen)]
    moving = [least_squares.folds.layout.elements[k] for k in least_squares.indices(names)]
    changes = {(p.name, p.log): c for p, c in zip(moving, least_squares.solve(names), strict=True)}
    values, sizes = [], []
    for log in range(len(linearised.pieces)):
        moved = {n: changes.get((n, None), changes.get((n, log), 0.0)) for n in names}
        values.append({n: v + moved.get(n, 0.0) for n, v in linearised.fit.of_log(log).items()})
        sizes.append({n: moved[n] for n in _column_names(chosen)})
    return LawStart(tuple(chosen), tuple(values), tuple(sizes), cost)


def range_in_logs(linearised: LinearisedLogs, plant: PlantSignature) -> CoveredRange:
    """Ranges that the logs cover, of every variable that a term may depend on."""
    values = {n: values_in_segments(linearised, n) for n in linearised.pieces[0].motion}
    for port in plant.ports:
        names = [c.q for c in plant.coordinates]
        motion = np.sum([w * values[n] for n, w in zip(names, port.weights, strict=True)], axis=0)
        values.setdefault(combination_text(names, port.weights), motion)
    return covered_range(values)
