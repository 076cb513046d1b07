"""Expressions as one line of text that a terminal shows: θ̇w, ε², 2 ε² J_m θ̈w."""

from __future__ import annotations

import re

import sympy as sp
from sympy.printing.precedence import PRECEDENCE
from sympy.printing.str import StrPrinter

from wheelpend.paper.letters import TIME_VARYING_SYMBOLS, Expression

GREEK_LETTERS = {
    "theta_w": "θw", "dtheta_w": "θ̇w", "ddtheta_w": "θ̈w", "theta_p": "θp", "dtheta_p": "θ̇p", "ddtheta_p": "θ̈p",
    "v_in": "V_in", "epsilon": "ε", "alpha": "α", "beta": "β",
}  # fmt: skip
SUPERSCRIPT_DIGITS = {"2": "²", "3": "³", "4": "⁴"}
FACTOR_ORDER = ("alpha", "beta", "epsilon", "M", "m", "L", "R", "g", "J_w", "J_b", "J_m")  # in a product, then the rest


class TextPrinter(StrPrinter):
    """Prints the paper's letters, constants before time-varying factors, positive terms first."""

    def _print_Symbol(self, e: sp.Symbol) -> str:
        return GREEK_LETTERS.get(e.name, e.name)

    def _print_MatrixBase(self, e: sp.MatrixBase) -> str:
        rows = [", ".join(self._print(entry) for entry in e.row(k)) for k in range(e.rows)]
        return "[" + "; ".join(rows) + "]"

    def _print_Transpose(self, e) -> str:
        return f"{self._print(e.arg)}ᵀ"

    def _print_Add(self, e: sp.Add, order=None) -> str:
        terms = sorted(e.args, key=lambda term: (term.could_extract_minus_sign(), sp.default_sort_key(term)))
        printed = [self._print(term) for term in terms]
        rest = (f" - {t[1:]}" if t.startswith("-") else f" + {t}" for t in printed[1:])
        return printed[0] + "".join(rest)

    def _print_Mul(self, e: sp.Mul) -> str:
        if e.as_coeff_Mul()[0].is_negative:
            return "-" + self.parenthesize(-e, PRECEDENCE["Add"])
        numerator, denominator = sp.fraction(e)
        factors = sorted((f for f in sp.Mul.make_args(numerator) if f != 1), key=_factor_sort_key)
        above = " ".join(self.parenthesize(f, PRECEDENCE["Mul"]) for f in factors) or "1"
        if denominator == 1:
            return above
        below = self._print(denominator)
        return f"{above}/{below}" if denominator.is_Atom or denominator.is_Pow else f"{above}/({below})"


def _factor_sort_key(factor: sp.Expr) -> tuple:
    """Sort key of a factor in a product: numbers, constants in FACTOR_ORDER, time-varying symbols, functions."""
    moves = factor.has(*TIME_VARYING_SYMBOLS)
    base = str(factor.as_base_exp()[0])
    known = FACTOR_ORDER.index(base) if base in FACTOR_ORDER else len(FACTOR_ORDER)
    return (not factor.is_Number, moves, factor.is_Function, known if not factor.is_Add else -1, str(factor))


def expression_text(expression: Expression) -> str:
    """One line of text for an expression or a matrix."""
    line = TextPrinter().doprint(expression)
    line = re.sub(r"\*\*([234])(?![\d.])", lambda match: SUPERSCRIPT_DIGITS[match[1]], line)
    line = line.replace("**(-1)", "⁻¹").replace("*", " ")
    return line.replace("-", "−")
