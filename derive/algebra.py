"""Expanding, differentiating and comparing, term by term: what the derivation does most.

Equations are sums of many terms of which a step touches few, and models of one plant share most of them. So
results for a term are cached, and a derivative looks only at the terms that contain the symbol.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence, Set
from functools import lru_cache

import sympy as sp
from sympy.polys.matrices import DomainMatrix

CACHED_TERM_COUNT = 1 << 16  # those of a library several times over


@lru_cache(CACHED_TERM_COUNT)
def symbols_in(expression: sp.Expr) -> frozenset[sp.Symbol]:
    """The symbols of an expression."""
    return frozenset(expression.free_symbols)


@lru_cache(CACHED_TERM_COUNT)
def expand(expression: sp.Expr) -> sp.Expr:
    """Expand an expression into a sum of products."""
    if expression.is_Add:
        return sp.Add(*map(expand, expression.args))
    if expression.is_Mul and (factor := next((f for f in expression.args if f.is_Add), None)):
        others = sp.Mul(*(f for f in expression.args if f is not factor))
        return sp.Add(*(expand(others * term) for term in factor.args))
    return expression if is_product(expression) else sp.expand(expression, power_exp=False)


@lru_cache(CACHED_TERM_COUNT)
def is_product(expression: sp.Expr) -> bool:
    """True for a product of powers of symbols and of functions, in which nothing expands."""
    if isinstance(expression, sp.sin | sp.cos):
        return all(is_product(term) for term in sp.Add.make_args(expression.args[0]))
    if isinstance(expression, sp.exp):
        return is_product(expression.args[0])
    if expression.is_Pow:
        return expression.exp.is_Integer and not expression.base.is_Mul and is_product(expression.base)
    return expression.is_Atom or (expression.is_Mul and all(map(is_product, expression.args)))


@lru_cache(CACHED_TERM_COUNT)
def derivative(expression: sp.Expr, variable: sp.Symbol) -> sp.Expr:
    """Derivative in a symbol, by the chain rule."""
    if variable not in symbols_in(expression):
        return sp.Integer(0)
    if expression == variable:
        return sp.Integer(1)
    if expression.is_Add:
        return sp.Add(*(derivative(term, variable) for term in expression.args))
    if expression.is_Mul:
        factors = expression.args
        changes = ((n, derivative(f, variable)) for n, f in enumerate(factors) if variable in symbols_in(f))
        return sp.Add(*(sp.Mul(*factors[:n], change, *factors[n + 1 :]) for n, change in changes))
    if expression.is_Pow and variable not in symbols_in(expression.exp):
        return expression * (derivative(expression.base, variable) * expression.exp / expression.base)
    if isinstance(expression, sp.Function) and not isinstance(expression, sp.Piecewise):
        return sp.Add(*(expression.fdiff(n) * derivative(a, variable) for n, a in enumerate(expression.args, 1)))
    return expression.diff(variable)


def jacobian(rows: Sequence[sp.Expr], variables: Sequence[sp.Symbol]) -> sp.Matrix:
    """Derivatives of each row in each symbol."""
    return sp.Matrix(len(rows), len(variables), [derivative(row, v) for row in rows for v in variables])


def adjugate_of(matrix: sp.Matrix) -> tuple[sp.Matrix, sp.Expr]:
    """Adjugate and determinant of a matrix, whose quotient is its inverse in closed form.

    Of more than three rows by minors without expanding them: what SymPy does else would not end.
    """
    if matrix.rows <= 3:
        return matrix.adjugate(), matrix.det()
    adjugate = matrix.adjugate(method="laplace")
    return adjugate, matrix[0, :].dot(adjugate[:, 0])


def terms_containing(expression: sp.Expr, symbols: Iterable[sp.Symbol]) -> sp.Expr:
    """The terms of a sum that contain one of these symbols."""
    wanted = frozenset(symbols)
    return sp.Add(*(t for t in sp.Add.make_args(expression) if not wanted.isdisjoint(symbols_in(t))))


def substitute(expression: sp.Expr, values: Mapping[sp.Symbol, sp.Expr]) -> sp.Expr:
    """Substitute values for symbols, all at once."""
    if symbols_in(expression).isdisjoint(values):
        return expression
    if expression.is_Add:
        return sp.Add(*(substitute(term, values) for term in expression.args))
    return expression.xreplace(values)


def collect_terms(expression: sp.Expr, variables: Set[sp.Symbol]) -> dict[sp.Expr, sp.Expr]:
    """Coefficients of a sum by function of some variables: {function: constant}."""
    table: dict[sp.Expr, sp.Expr] = {}
    for term in sp.Add.make_args(expand(expression)):
        constant, function = term.as_independent(*(variables & symbols_in(term)), as_Add=False)
        table[function] = table.get(function, sp.Integer(0)) + constant
    return {function: constant for function, constant in table.items() if constant != 0}


def linear_combination(columns: Sequence[Mapping], wanted: Mapping) -> tuple[sp.Expr, ...] | None:
    """Weights with which the columns add up to the wanted one, undetermined ones at zero; None where there are none.

    A column is a table of entries under any keys; keys that it lacks are zero.
    """
    if not wanted.keys() <= {key for table in columns for key in table}:
        return None
    reduced, pivots = row_echelon_form((*columns, wanted))
    if len(columns) in pivots:
        return None
    found = dict(zip(pivots, reduced[:, len(columns)].to_Matrix(), strict=False))
    return tuple(found.get(n, sp.Integer(0)) for n in range(len(columns)))


def reduce_modulo_span(known: Sequence[Mapping], tables: Sequence[Mapping]) -> list[dict[int, sp.Expr]]:
    """Residue of each table modulo the span of the known ones, in coordinates common to all."""
    reduced, pivots = row_echelon_form((*known, *tables))
    rank = sum(p < len(known) for p in pivots)
    left = reduced[rank:, len(known) :].to_Matrix()
    return [{n: value for n, value in enumerate(left[:, k]) if value != 0} for k in range(len(tables))]


def row_echelon_form(columns: Sequence[Mapping]) -> tuple[DomainMatrix, tuple[int, ...]]:
    """Reduced row echelon form of a matrix of these columns, and its pivots."""
    places = dict.fromkeys(key for table in columns for key in table)
    rows = [[table.get(key, sp.Integer(0)) for table in columns] for key in places]
    return DomainMatrix.from_list_sympy(len(rows), len(columns), rows).to_field().rref()


def are_proportional(one: sp.Expr, other: sp.Expr) -> bool:
    """True where one is a number times the other.

    Where their ratio differs between two points it is none, which saves most of the exact comparisons.
    """
    ratios = [at_generic_point(one, k) / at_generic_point(other, k) for k in range(2)]
    if all(r.is_Rational for r in ratios) and ratios[0] != ratios[1]:
        return False
    return bool(sp.cancel(one / other).is_number)


@lru_cache(CACHED_TERM_COUNT)
def at_generic_point(constant: sp.Expr, point: int = 0) -> sp.Expr:
    """A constant with a prime for each of its symbols, the same everywhere; ``point`` chooses between several."""
    exact = sp.nsimplify(constant, rational=True) if constant.has(sp.Float) else constant
    return substitute(exact, {s: prime_of_name(s.name, point) for s in symbols_in(constant)})


@lru_cache(CACHED_TERM_COUNT)
def prime_of_name(name: str, point: int = 0) -> sp.Integer:
    """A prime that belongs to a name."""
    number = (int.from_bytes(name.encode(), "big") + 7919 * point) % 1_000_003
    return sp.Integer(sp.nextprime(number))  # nextprime may return an int, and a quotient of two is no fraction
