"""Equivalent parameters: which combinations of physical constants the equations really contain.

The scaled equations are sums of (constant) × (function of the motion). The constants are grouped so that as few as
possible remain: a constant inertia −k between two coordinates is an inertia k on their relative speed and is taken off
both diagonal entries (it is the geared rotor), and constants that differ in sign only are one.
"""

from __future__ import annotations

from functools import lru_cache

import sympy as sp

from derive.algebra import are_proportional, collect_terms, expand, linear_combination, substitute, symbols_in
from derive.functions import symbol
from derive.records import Equations, Grouping, Plant

Term = tuple[int, sp.Expr]  # row, function of the motion


def scaled_rows(plant: Plant, equations: Equations) -> tuple[sp.Expr, ...]:
    """Inertia − force of each row, divided by the plant's scale: volt-equivalents."""
    pairs = zip(equations.inertia, equations.force, strict=True)
    return tuple(expand((i - f).subs(plant.substitutions) / plant.scale) for i, f in pairs)


def find_parameters(plant: Plant, rows: tuple[sp.Expr, ...]) -> tuple[sp.Expr, ...]:
    """Find the equivalent parameters, inertias first, then gravity, then damping (paper eq. 18)."""
    coefficients = coefficients_of(plant, rows)
    found: list[sp.Expr] = []
    relative = relative_inertias(plant, coefficients)
    for row, own in enumerate(plant.coordinates):
        shared = sp.Add(*(k for pair, k in relative.items() if row in pair))
        candidates = [coefficients.get((row, own.ddq), sp.Integer(0)) - shared]
        candidates += [k for pair, k in relative.items() if min(pair) == row]
        candidates += [c for (r, basis), c in coefficients.items() if r == row and _couples(plant, row, basis)]
        found += _independent(candidates, found)
    known = relative_span(found, relative)
    given = {sp.Symbol(c.name, positive=True) for c in plant.constants}
    rest = [(term, c) for term, c in coefficients.items()
            if not _has_acceleration(plant, term[1]) and not c.free_symbols <= given]  # fmt: skip
    for (_, _basis), coefficient in sorted(rest, key=lambda item: _order(plant, item[0])):
        found += _independent([coefficient], found + known)
    return tuple(found)


def coefficients_of(plant: Plant, rows: tuple[sp.Expr, ...]) -> dict[Term, sp.Expr]:
    """Split each row into terms: {(row, function of the motion): constant}, in a fixed order."""
    moving = frozenset(_motion_symbols(plant))
    table: dict[Term, sp.Expr] = {}
    for number, row in enumerate(rows):
        table |= {(number, basis): constant for basis, constant in collect_terms(row, moving).items()}
    return {key: table[key] for key in sorted(table, key=lambda k: (k[0], sp.default_sort_key(k[1])))}


def relative_inertias(plant: Plant, coefficients: dict[Term, sp.Expr]) -> dict[tuple[int, int], sp.Expr]:
    """Constant inertias −k between two coordinates: inertia k on their relative speed."""
    pairs = {}
    for i in range(len(plant.coordinates)):
        for j in range(i + 1, len(plant.coordinates)):
            coupling = -coefficients.get((i, plant.coordinates[j].ddq), sp.Integer(0))
            if coupling.subs(dict.fromkeys(coupling.free_symbols, 2)).is_positive:
                pairs[i, j] = expand(coupling)
    return pairs


def relative_span(found: list[sp.Expr], relative: dict[tuple[int, int], sp.Expr]) -> list[sp.Expr]:
    """Sums of a diagonal inertia and a relative one, which are no parameters of their own."""
    return [expand(f + k) for f in found for k in relative.values()]


@lru_cache(maxsize=4096)
def express_in_parameters(
    target: sp.Expr, basis: tuple[sp.Expr, ...], names: tuple[sp.Symbol, ...], known: frozenset[sp.Symbol]
) -> sp.Expr | None:
    """Write a physical constant as a combination of parameters with coefficients in the known constants.

    A parameter up to its sign comes first, then a combination with plain numbers, then one with known constants: a
    slope, for instance, needs (2m + M) g R / α, which is (g/R) X1 − 2 J_w g / (R α). None where all fail.
    """
    for definition, name in zip(basis, names, strict=True):
        for sign in (1, -1):
            if expand(target) == expand(sign * definition):
                return sign * name
    plain = _combine(target, basis, names, frozenset())
    return plain if plain is not None else _combine(target, basis, names, known)


def _combine(target: sp.Expr, basis: tuple, names: tuple, known: frozenset[sp.Symbol]) -> sp.Expr | None:
    """Solve target = Σ weight · parameter + constant for weights in the known constants."""
    unknown = set().union(*map(symbols_in, (target, *basis))) - known
    *columns, wanted = (collect_terms(e, unknown) for e in without_denominators(*basis, sp.Integer(1), target))
    weights = linear_combination(columns, wanted)
    return None if weights is None else sp.Add(*(w * n for w, n in zip(weights, (*names, 1), strict=True)))


def without_denominators(*expressions: sp.Expr) -> tuple[sp.Expr, ...]:
    """Expressions as sums of products, multiplied by what makes them so where one is divided by a sum."""
    expanded = tuple(map(expand, expressions))
    if not any(term.has(sp.Add) for e in expanded for term in sp.Add.make_args(e)):
        return expanded
    common = sp.lcm_list([sp.denom(sp.together(e)) for e in expanded])
    return tuple(expand(sp.cancel(e * common)) for e in expanded)


class NotExpressibleError(ValueError):
    """A term's constant cannot be written with the equivalent parameters and the known constants."""


def rewrite(plant: Plant, rows: tuple[sp.Expr, ...], basis: tuple[sp.Expr, ...], names: tuple[str, ...]) -> tuple:
    """Write the scaled rows in terms of the equivalent parameters and the known constants."""
    known = frozenset(sp.Symbol(c.name, positive=True) for c in plant.constants)
    symbols = tuple(symbol(n) for n in names)
    rewritten = [sp.Integer(0)] * len(rows)
    for (row, motion), constant in coefficients_of(plant, rows).items():
        expressed = express_in_parameters(constant, basis, symbols, known)
        if expressed is None:
            raise NotExpressibleError(
                f"{plant.name}: the constant {constant} of {motion} is no combination of {', '.join(names)} "
                f"and {', '.join(sorted(c.name for c in plant.constants))}"
            )
        rewritten[row] += expressed * motion
    plain = {k: symbol(k.name) for k in known}
    return tuple(substitute(expand(r), plain) for r in rewritten)


def group_parameters(
    plant: Plant, rows: tuple[sp.Expr, ...], default_phi: dict[str, sp.Matrix] | None = None
) -> Grouping:
    """Find, name and substitute the equivalent parameters of the scaled rows.

    With ``default_phi``, the regressor columns under the default assumptions, a parameter keeps the name it has there.
    """
    definitions = find_parameters(plant, rows)
    names = tuple(f"X{k + 1}" for k in range(len(definitions)))
    if default_phi is not None:
        names = names_by_regressor_column(plant, rewrite(plant, rows, definitions, names), names, default_phi)
        order = sorted(range(len(names)), key=lambda k: int(names[k][1:]))
        definitions, names = tuple(definitions[k] for k in order), tuple(names[k] for k in order)
    return Grouping(names, definitions, rewrite(plant, rows, definitions, names))


def regressor_columns(rows: tuple[sp.Expr, ...], names: tuple[str, ...]) -> dict[str, sp.Matrix]:
    """Regressor columns: the factor of each parameter in each row."""
    return {n: sp.Matrix([expand(r).coeff(symbol(n)) for r in rows]) for n in names}


def names_by_regressor_column(
    plant: Plant, rows: tuple, names: tuple[str, ...], default: dict[str, sp.Matrix]
) -> tuple:
    """Rename parameters so that each has the name of the default model's column it shares most entries with."""
    own = regressor_columns(rows, names)
    free = dict(default)
    renamed: list[str] = []
    for name in names:
        overlap = {  # other assumptions may have other rows
            d: sum(a == b != 0 for a, b in zip(own[name], column, strict=False)) for d, column in free.items()
        }
        best = max(overlap, key=lambda d: overlap[d], default=None)
        if best is None or overlap[best] == 0:
            best = f"X{len(default) + 1 + sum(r not in default for r in renamed)}"
        free.pop(best, None)
        renamed.append(best)
    return tuple(renamed)


def _motion_symbols(plant: Plant) -> tuple[sp.Symbol, ...]:
    states = [s for c in plant.moving for s in (c.q, c.dq, c.ddq)]
    return (*states, *plant.inputs, *plant.geometry.values())


def _has_acceleration(plant: Plant, basis: sp.Expr) -> bool:
    return any(basis.has(c.ddq) for c in plant.coordinates)


def _couples(plant: Plant, row: int, basis: sp.Expr) -> bool:
    """True for an inertia that depends on the configuration."""
    return _has_acceleration(plant, basis) and all(basis != c.ddq for c in plant.coordinates)


def _order(plant: Plant, term: Term) -> tuple:
    row, basis = term
    rates = [n for n, c in enumerate(plant.coordinates) if basis.has(c.dq)]
    return (bool(rates), row, rates, sp.default_sort_key(basis))


def _independent(candidates: list[sp.Expr], known: list[sp.Expr]) -> list[sp.Expr]:
    """Candidates that are neither numbers nor multiples of a known one; of positive sign."""
    fresh: list[sp.Expr] = []
    for candidate in map(expand, candidates):
        if not candidate.free_symbols:
            continue
        if not any(are_proportional(candidate, k) for k in known + fresh):
            fresh.append(
                -candidate if candidate.subs(dict.fromkeys(candidate.free_symbols, 2)).is_negative else candidate
            )
    return fresh
