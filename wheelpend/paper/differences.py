"""Equality of two expressions, and the kind of difference where the printed one is wrong."""

from __future__ import annotations

from functools import cache
from itertools import combinations
from typing import NamedTuple

import sympy as sp

from wheelpend.paper.derivation import LEAST_SQUARES_EXAMPLE
from wheelpend.paper.filtering import FILTER_ABBREVIATIONS
from wheelpend.paper.letters import GENERALISED_COORDINATES, RATE_OF, TIME_VARYING_SYMBOLS, Expression
from wheelpend.paper.notation import expression_text


class Difference(NamedTuple):
    """Difference of a printed expression from the derived one."""

    kind: str  # sign, factor, dots, term or shape
    sentence: str


def expand_abbreviations(expression: Expression) -> sp.Expr | sp.MatrixBase:
    """An expression with its abbreviations written out, and matrices of any shape as an example."""
    if isinstance(expression, sp.MatrixExpr):
        return sp.Matrix(expression.subs(LEAST_SQUARES_EXAMPLE).doit())
    return expression.subs(FILTER_ABBREVIATIONS)


@cache
def is_zero(expression: sp.Expr) -> bool:
    """True if an expression is identically zero."""
    expanded = sp.expand(expression)
    return expanded == 0 or sp.cancel(sp.together(expanded)) == 0


def is_equal(one: Expression, other: Expression) -> bool:
    """True if two expressions are identically equal; matrices also in shape."""
    a, b = expand_abbreviations(one), expand_abbreviations(other)
    if isinstance(a, sp.MatrixBase) or isinstance(b, sp.MatrixBase):
        return getattr(a, "shape", None) == getattr(b, "shape", None) and all(
            is_zero(x - y) for x, y in zip(a, b, strict=True)
        )
    return is_zero(a - b)


def describe_difference(printed: Expression, derived: Expression) -> Difference:
    """Difference of two expressions that are not equal: sign, dots of rates, or term by term."""
    a, b = expand_abbreviations(printed), expand_abbreviations(derived)
    if isinstance(a, sp.MatrixBase):
        return describe_entries(a, b)
    if is_zero(a + b):
        return Difference("sign", "the sign is reversed")
    undotted = missing_dots(a, b)
    if undotted:
        return Difference("dots", f"printed without the dot of a rate: {', '.join(map(expression_text, undotted))}")
    found = [describe_term(*term) for term in differing_terms(a, b)]
    return Difference(found[0].kind, "; ".join(f.sentence for f in found))


def describe_entries(printed: sp.MatrixBase, derived: sp.MatrixBase) -> Difference:
    """Difference of two matrices, entry by entry; its kind is that of the first differing entry."""
    if printed.shape != derived.shape:
        return Difference("shape", f"{printed.shape} printed, {derived.shape} derived")
    found = [
        (row, column, describe_difference(printed[row, column], derived[row, column]))
        for row in range(printed.rows)
        for column in range(printed.cols)
        if not is_equal(printed[row, column], derived[row, column])
    ]
    return Difference(found[0][2].kind, "; ".join(f"entry ({r + 1}, {c + 1}): {d.sentence}" for r, c, d in found))


def missing_dots(printed: sp.Expr, derived: sp.Expr) -> tuple[sp.Symbol, ...]:
    """Angles in the printed expression that must be rates to make it the derived one."""
    present = [q for q in GENERALISED_COORDINATES if printed.has(q)]
    for count in range(1, len(present) + 1):
        for chosen in combinations(present, count):
            if is_zero(printed.subs({q: RATE_OF[q] for q in chosen}) - derived):
                return chosen
    return ()


def coefficients_by_term(expression: sp.Expr) -> dict[sp.Expr, sp.Expr]:
    """Split an expression into {product of time-varying symbols: its constant}."""
    table: dict[sp.Expr, sp.Expr] = {}
    for term in sp.Add.make_args(sp.expand(expression)):
        constant, moving = term.as_independent(*TIME_VARYING_SYMBOLS, as_Add=False)
        table[moving] = table.get(moving, sp.Integer(0)) + constant
    return {moving: reduced for moving, c in table.items() if (reduced := sp.cancel(sp.together(c))) != 0}


def differing_terms(printed: sp.Expr, derived: sp.Expr) -> list[tuple[sp.Expr, sp.Expr, sp.Expr]]:
    """(time-varying product, printed constant, derived constant) wherever the constants differ."""
    a, b = coefficients_by_term(printed), coefficients_by_term(derived)
    zero = sp.Integer(0)
    every = [(moving, a.get(moving, zero), b.get(moving, zero)) for moving in sorted({*a, *b}, key=expression_text)]
    return [(moving, x, y) for moving, x, y in every if not is_zero(x - y)]


def describe_term(moving: sp.Expr, printed: sp.Expr, derived: sp.Expr) -> Difference:
    """Difference of the constants in front of one time-varying product."""
    place = "" if moving == 1 else f" at {expression_text(moving)}"
    if printed == 0:
        return Difference("term", f"the term {expression_text(derived * moving)} is missing")
    if derived == 0:
        return Difference("term", f"the term {expression_text(printed * moving)} does not belong")
    ratio = sp.factor(sp.cancel(sp.together(derived / printed)))
    if ratio == -1:
        return Difference("sign", f"the sign{place} is reversed")
    above, below = sp.fraction(ratio)
    if not below.has(sp.Add):
        return Difference("factor", f"the factor {expression_text(sp.expand(ratio))} is missing{place}")
    if not above.has(sp.Add):
        return Difference("factor", f"the factor {expression_text(sp.expand(1 / ratio))}{place} is too much")
    return describe_summand(moving, printed, derived)


def describe_summand(moving: sp.Expr, printed: sp.Expr, derived: sp.Expr) -> Difference:
    """Difference of two sums in front of one time-varying product: a reversed sign, or a missing summand."""
    lacking = sp.expand(derived - printed)
    if -lacking / 2 in sp.Add.make_args(sp.expand(printed)):
        return Difference("sign", f"the sign of {expression_text(-lacking / 2 * moving)} is reversed")
    return Difference("term", f"{expression_text(sp.factor(lacking) * moving)} is missing")
