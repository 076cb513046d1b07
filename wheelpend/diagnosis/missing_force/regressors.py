"""Regressors of a law's terms along a motion, and the rows of the equations on which they act."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import lru_cache

import numpy as np

from derive.effects.row import DIRECTION_ARGUMENT
from derive.lazy import sp, symbol
from derive.plant_signature import PlantSignature
from wheelpend.diagnosis.missing_force.law_terms import Term

NUMERIC_FUNCTIONS = {
    "Sign": np.sign,
    "Step": lambda x: 1.0 * (x > 0),
    "Magnitude": np.abs,
    "Ramp": lambda x: np.maximum(x, 0.0),
}  # of the functions that SymPy does not know


def term_regressors(term: Term, motion: Mapping[str, np.ndarray], plant: PlantSignature) -> np.ndarray:
    """Regressors (N, sizes) of a term's coefficients along a motion, from the very text of the term."""
    rates = [c.dq for c in plant.coordinates]
    speed = sum(w * motion[n] for w, n in zip(plant.port(term.port).weights, rates, strict=True))
    known = {**{n: v for n, v in motion.items() if n.isidentifier()}, DIRECTION_ARGUMENT: np.sign(speed)}
    columns = [function(*(known[n] for n in inputs)) for inputs, function in compiled_regressors(term, tuple(known))]
    return np.column_stack([np.broadcast_to(np.asarray(c, dtype=float), np.shape(speed)) for c in columns])


@lru_cache(maxsize=4096)
def compiled_regressors(term: Term, known: tuple[str, ...]) -> tuple[tuple[tuple[str, ...], Callable], ...]:
    """For each coefficient the inputs of its regressor, and the function of them."""
    from derive.grammar import parse  # imported late: it takes SymPy

    names = [*known, *(n for n, _ in term.sizes), *(s.name for s in term.shapes)]
    expression = parse(term.text, {n: symbol(n) for n in names})
    expression = expression.subs({symbol(s.name): s.value for s in term.shapes})
    found = []
    for size, _ in term.sizes:
        column = expression.diff(symbol(size))
        inputs = tuple(n for n in known if column.has(symbol(n)))
        found.append((inputs, sp.lambdify([symbol(n) for n in inputs], column, [NUMERIC_FUNCTIONS, "numpy"])))
    return tuple(found)


def term_directions(term: Term, plant: PlantSignature) -> np.ndarray:
    """Direction (sizes, rows) in which a term acts on the rows: a resistance opposes its port."""
    return np.tile(-np.array(plant.port(term.port).weights), (len(term.sizes), 1))
