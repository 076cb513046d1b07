"""Choosing the terms of a law on the linearised shooting problem, one after the other.

A term counts by what it predicts on folds of the segments that did not make its coefficients, while the model's own
parameters move along within their bounds.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from derive.plant_signature import PlantSignature

from wheelpend.diagnosis.missing_force.law_terms import (
    CoveredRange,
    Term,
    covered_range,
    term_directions,
    term_regressors,
)
from wheelpend.diagnosis.missing_force.piecewise_force import (
    FoldedLeastSquares,
    LinearisedLogs,
    build_least_squares,
    force_columns,
    piece_means,
    values_in_segments,
)
from wheelpend.diagnosis.score_test import project
from wheelpend.estimation.state_reconstruction import combination_text

MAX_SINGLE_TERM_STARTS = 4  # single terms of a view that are refitted
MAX_LAW_STARTS = 10  # sets of terms that are refitted
MAX_CROSS_VALIDATED_TERMS = 12  # terms with the largest expected gain that are judged on folds
MIN_TERM_GAIN = 12.0  # noise variances that a term must explain
MIN_REMAINING_INFORMATION_SHARE = (
    1e-3  # share of a term's information that must be left beside the parameters and terms that are there
)


class LawStart(NamedTuple):
    """Terms, and where the linearised problem puts parameters and coefficients."""

    terms: tuple[Term, ...]
    values: tuple[dict[str, float], ...]  # of each log: the model's parameters
    sizes: tuple[dict[str, float], ...]  # of each log: coefficients by column
    left: float  # sum of squares on folds that did not make the coefficients


def search_laws(
    views: Sequence[LinearisedLogs], candidates: Sequence[Term], max_terms: int, plant: PlantSignature, min_gain_share: float
) -> list[LawStart]:
    """Single terms, and sets of at most so many, that predict best in any view; the best first.

    A term pays if it explains the share ``pays`` of what is left above the noise.
    """
    best: dict[frozenset[Term], LawStart] = {}
    for view in views:
        for start in forward_selection(view, candidates, max_terms, plant, min_gain_share):
            key = frozenset(start.terms)
            if key not in best or start.left < best[key].left:
                best[key] = start
    return sorted(best.values(), key=lambda s: s.left)[:MAX_LAW_STARTS]


def forward_selection(
    view: LinearisedLogs, candidates: Sequence[Term], max_terms: int, plant: PlantSignature, min_gain_share: float
) -> list[LawStart]:
    """The best single terms in one view, and the set that grows from the best, one term after the other."""
    given, columns = full_least_squares(view, candidates, plant)
    chosen: list[Term] = []
    left, found = given.left(view.own), []
    while len(chosen) < max_terms:
        trials = [
            (given.left([*view.own, *_column_names([*chosen, t])]), t)
            for t in leading_terms(given, view, columns, chosen)
        ]
        paying = [(x, t) for x, t in trials if left - x >= max(MIN_TERM_GAIN, min_gain_share * (left - view.noise))]
        paying.sort(key=lambda pair: pair[0])
        if not paying:
            break
        if not chosen:
            found += [law_start(given, view, [t], x) for x, t in paying[:MAX_SINGLE_TERM_STARTS]]
        left, chosen = paying[0][0], [*chosen, paying[0][1]]
    return [*found, law_start(given, view, chosen, left)] if len(chosen) > 1 else found


def column_name(term: Term, size: str) -> str:
    """Name of a term's column."""
    return f"{term.key} {size}"


def _column_names(chosen: Sequence[Term]) -> list[str]:
    return [column_name(t, size) for t in chosen for size, _ in t.sizes]


def full_least_squares(
    view: LinearisedLogs, candidates: Sequence[Term], plant: PlantSignature
) -> tuple[FoldedLeastSquares, dict[Term, list[str]]]:
    """Least squares in a view's parameters and all terms, and the columns of each term."""
    directions = np.concatenate([term_directions(t, plant) for t in candidates])
    columns = [
        force_columns(
            piece_means(p, np.concatenate([term_regressors(t, p.motion, plant) for t in candidates], axis=1)),
            directions,
        )
        for p in view.pieces
    ]
    of_term = {t: _column_names([t]) for t in candidates}
    own_logs = [n for t in candidates if t.per_log for n in of_term[t]] if len(view.pieces) > 1 else []
    return build_least_squares(
        view, [n for names in of_term.values() for n in names], columns, per_log=own_logs
    ), of_term


def leading_terms(
    given: FoldedLeastSquares, view: LinearisedLogs, columns: dict[Term, list[str]], chosen: Sequence[Term]
) -> list[Term]:
    """Terms with the largest expected gain beside the parameters and the terms chosen already."""
    normal, right = given.normal.sum(axis=0), given.right.sum(axis=0)
    there = given.places([*view.own, *_column_names(chosen)])
    information, score = project(normal, right, there)
    gains = {}
    for term, names in columns.items():
        own = [k for n in names for k in given.index[n]]
        raw, rest = np.diag(normal)[own], np.diag(information)[own]
        if term in chosen or not np.all(rest > MIN_REMAINING_INFORMATION_SHARE * raw) or not np.all(raw > 0.0):
            continue
        block = information[np.ix_(own, own)]
        scale = np.sqrt(np.diag(block))
        inverse = np.linalg.pinv(block / np.outer(scale, scale), rcond=1e-6, hermitian=True)
        gains[term] = float((score[own] / scale) @ inverse @ (score[own] / scale))
    return sorted(gains, key=lambda t: -gains[t])[:MAX_CROSS_VALIDATED_TERMS]


def law_start(given: FoldedLeastSquares, view: LinearisedLogs, chosen: Sequence[Term], left: float) -> LawStart:
    """Parameters and coefficients of the linearised problem with the chosen terms."""
    names = [*view.own, *_column_names(chosen)]
    change = dict(zip((given.labels[k] for k in given.places(names)), given.solve(names), strict=True))
    values, sizes = [], []
    for log in range(len(view.pieces)):
        moved = {n: change.get(n, change.get(f"{n}@{log}", 0.0)) for n in names}
        values.append({n: v + moved.get(n, 0.0) for n, v in view.fit.of_log(log).items()})
        sizes.append({n: moved[n] for n in _column_names(chosen)})
    return LawStart(tuple(chosen), tuple(values), tuple(sizes), left)


def range_in_logs(view: LinearisedLogs, plant: PlantSignature) -> CoveredRange:
    """What the logs cover of every variable that a term may depend on."""
    values = {n: values_in_segments(view, n) for n in view.pieces[0].motion}
    for port in plant.ports:
        weights = dict(zip((c.q for c in plant.coordinates), port.weights, strict=True))
        values.setdefault(combination_text(weights), np.sum([w * values[n] for n, w in weights.items()], axis=0))
    return covered_range(values)
