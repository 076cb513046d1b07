"""Coefficients of a linear combination of expressions that equals another expression."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import sympy as sp


def combination(pieces: Mapping[sp.Symbol, sp.Expr], whole: sp.Expr, moving: Sequence[sp.Expr]) -> sp.Expr:
    """Σ number · name of piece, with numbers such that the pieces add up to the whole for any value of ``moving``.

    Raises ValueError where there are no such numbers.
    """
    numbers = sp.symbols(f"number_0:{len(pieces)}")
    stand_in = {e: sp.Dummy(f"m{k}") for k, e in enumerate(moving) if not e.is_Symbol}
    difference = sp.Add(*(n * e for n, e in zip(numbers, pieces.values(), strict=True))) - whole
    difference = sp.expand(sp.numer(sp.together(difference.subs(stand_in))))
    functions = {f: sp.Dummy(str(f)) for f in sorted(difference.atoms(sp.cos, sp.sin), key=str)}
    generators = [stand_in.get(e, e) for e in moving] + list(functions.values())
    conditions = sp.Poly(difference.subs(functions), *generators).coeffs()
    solutions = sp.solve(conditions, numbers, dict=True)
    if not solutions:
        raise ValueError(f"No sum of {', '.join(map(str, pieces))} makes {whole}")
    return sp.Add(*(solutions[0][n] * name for n, name in zip(numbers, pieces, strict=True)))
