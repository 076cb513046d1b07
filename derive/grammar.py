"""Expressions that users write: a small strict grammar, read without executing anything.

    sum      = term { ("+" | "-") term }
    term     = factor { ("*" | "/") factor }
    factor   = ("+" | "-") factor | power
    power    = atom [ ("^" | "**") factor ]
    atom     = number | name | name "(" sum ")" | "(" sum ")"

Names are those that the caller offers, functions those of KNOWN_FUNCTIONS. Everything else is refused, and so is what
is too long to be a law of physics, nests too deeply, or would become too long where it is expanded: how large it can
become is counted beside each piece, before SymPy sees it.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping
from typing import NamedTuple

import sympy as sp

from derive.functions import Magnitude, Ramp, Sign

MAX_TEXT_LENGTH, MAX_NESTING_DEPTH, MAX_EXPONENT = 1000, 50, 20
MAX_FUNCTIONS_IN_EACH_OTHER = 6
MAX_TERMS = 100  # of the sum that an expression becomes when it is expanded
MAX_NUMBER = 10**12  # of a number; no law of physics in SI units needs a larger one
KNOWN_FUNCTIONS = {
    "sin": sp.sin, "cos": sp.cos, "tan": sp.tan, "exp": sp.exp, "log": sp.log, "sqrt": sp.sqrt, "tanh": sp.tanh,
    "atan": sp.atan, "abs": Magnitude, "sign": Sign, "positive": Ramp,
}  # fmt: skip
FLOAT_FUNCTIONS: dict[type, Callable[[float], float]] = {
    sp.sin: math.sin, sp.cos: math.cos, sp.tan: math.tan, sp.exp: math.exp, sp.log: math.log, sp.tanh: math.tanh,
    sp.atan: math.atan, sp.Abs: abs, Magnitude: abs, Sign: lambda x: float((x > 0) - (x < 0)),
    Ramp: lambda x: max(x, 0.0),
}  # fmt: skip
BOUNDED_FUNCTIONS = (sp.sin, sp.cos)  # near whose zeros rounding counts as beside 1
TOKEN_PATTERN = re.compile(r"\s*(?:(?P<number>(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d{1,3})?)"
                           r"|(?P<name>[A-Za-z_][A-Za-z0-9_]*)|(?P<sign>\*\*|[-+*/^()]))")  # fmt: skip


class GrammarError(ValueError):
    """A text that is no expression of the grammar; the message says what and where."""


class Token(NamedTuple):
    """A piece of text."""

    kind: str  # number, name, sign or end
    text: str
    place: int


def parse(text: str, names: Mapping[str, sp.Expr]) -> sp.Expr:
    """Parse a text into its expression; ``names`` are the only symbols it may use. Raises GrammarError."""
    if not isinstance(text, str) or len(text) > MAX_TEXT_LENGTH:
        raise GrammarError(f"An expression must be a text of at most {MAX_TEXT_LENGTH} characters.")
    parser = _Parser(text, names)
    found = parser.sum(0).value.replace(sp.Abs, Magnitude)  # which SymPy makes of the root of a square
    if parser.next.kind != "end":
        raise parser.refuse("an operator or the end")
    if found.has(sp.I, sp.zoo, sp.nan, sp.oo, -sp.oo):
        raise GrammarError(f"An expression must have a finite real value, but {text} is {found}.")
    return found


def tokenise(text: str) -> list[Token]:
    """The pieces of a text, the end among them."""
    found, place = [], 0
    while text[place:].strip():
        match = TOKEN_PATTERN.match(text, place)
        if match is None:
            at = place + len(text[place:]) - len(text[place:].lstrip())
            raise GrammarError(f"'{text[at]}' at character {at + 1} is not part of an expression. "
                               f"Use numbers, names, + - * / ^ ( ) and {', '.join(KNOWN_FUNCTIONS)}.")  # fmt: skip
        kind = str(match.lastgroup)
        found.append(Token(kind, match[kind], match.start(kind)))
        place = match.end()
    return [*found, Token("end", "the end", len(text))]


class Piece(NamedTuple):
    """An expression, and how large it is where it is expanded."""

    value: sp.Expr
    terms: int  # of the sum
    degree: int  # of the highest product of powers in it


def piece(value: sp.Expr, terms: int, degree: int) -> Piece:
    """A piece; raises GrammarError where it becomes too large."""
    if terms > MAX_TERMS:
        raise GrammarError(f"An expression must not have more than {MAX_TERMS} terms when its products are multiplied "
                           "out.")  # fmt: skip
    return Piece(value, terms, degree)


class _Parser:
    """Recursive descent; every rule takes how deep it is and returns its piece."""

    def __init__(self, text: str, names: Mapping[str, sp.Expr]) -> None:
        self.names, self.left = names, tokenise(text)[::-1]
        self.functions = 0  # that are open

    @property
    def next(self) -> Token:
        return self.left[-1]

    def take(self, *signs: str) -> str:
        """Take the next piece if it is one of these signs, else nothing."""
        if self.next.kind == "sign" and self.next.text in signs:
            return self.left.pop().text
        return ""

    def refuse(self, wanted: str) -> GrammarError:
        found = self.next
        return GrammarError(f"{wanted[0].upper()}{wanted[1:]} must stand at character {found.place + 1}, "
                            f"but {found.text} does.")  # fmt: skip

    def sum(self, depth: int) -> Piece:
        if depth > MAX_NESTING_DEPTH:
            raise GrammarError(f"An expression must not nest more than {MAX_NESTING_DEPTH} deep.")
        total = self.term(depth)
        while sign := self.take("+", "-"):
            term = self.term(depth)
            value = total.value + term.value if sign == "+" else total.value - term.value
            total = piece(value, total.terms + term.terms, max(total.degree, term.degree))
        return total

    def term(self, depth: int) -> Piece:
        product = self.factor(depth)
        while sign := self.take("*", "/"):
            factor = self.factor(depth)
            if sign == "/" and factor.value == 0:
                raise GrammarError("An expression must not divide by zero.")
            value = product.value * factor.value if sign == "*" else product.value / factor.value
            product = piece(value, product.terms * factor.terms, product.degree + factor.degree)
        return product

    def factor(self, depth: int) -> Piece:
        if depth > MAX_NESTING_DEPTH:
            raise GrammarError(f"An expression must not nest more than {MAX_NESTING_DEPTH} deep.")
        sign = self.take("+", "-")
        if sign:
            factor = self.factor(depth + 1)
            return factor._replace(value=-factor.value) if sign == "-" else factor
        return self.power(depth)

    def power(self, depth: int) -> Piece:
        base = self.atom(depth)
        if not self.take("^", "**"):
            return base
        exponent = self.factor(depth + 1).value
        if not (exponent.is_Rational or exponent.is_Float) or abs(exponent) > MAX_EXPONENT:
            raise GrammarError(f"An exponent must be a number of at most {MAX_EXPONENT}, not {exponent}. "
                               "Write exp(b*log(a)) for a^b.")  # fmt: skip
        if base.value == 0 and exponent < 0:
            raise GrammarError("An expression must not divide by zero.")
        times = math.ceil(abs(exponent))
        if times * base.degree > MAX_EXPONENT:
            raise GrammarError(f"A power of powers must have an exponent of at most {MAX_EXPONENT} in all, not "
                               f"{times * base.degree}.")  # fmt: skip
        terms = math.comb(base.terms + times - 1, times) if exponent.is_Integer and times else base.terms
        size = piece(base.value, terms, times * base.degree)  # refused before SymPy raises anything to this power
        return size._replace(value=self.sized(self.sized(base.value) ** exponent))

    def atom(self, depth: int) -> Piece:
        token = self.next
        if self.take("("):
            return self.closed(self.sum(depth + 1))
        if token.kind == "number":
            self.left.pop()
            return Piece(self.number(token), 1, 0)
        if token.kind == "name":
            self.left.pop()
            return self.call(token, depth) if self.take("(") else Piece(self.named(token), 1, 1)
        raise self.refuse("a number, a name or (")

    def call(self, token: Token, depth: int) -> Piece:
        if token.text not in KNOWN_FUNCTIONS:
            raise GrammarError(f"No function named '{token.text}'. Known functions: {', '.join(KNOWN_FUNCTIONS)}.")
        self.functions += 1
        if self.functions > MAX_FUNCTIONS_IN_EACH_OTHER:
            raise GrammarError(f"Functions must not stand more than {MAX_FUNCTIONS_IN_EACH_OTHER} deep in each other.")
        argument = self.closed(self.sum(depth + 1))
        self.functions -= 1
        return Piece(KNOWN_FUNCTIONS[token.text](argument.value), 1, max(argument.degree, 1))

    def named(self, token: Token) -> sp.Expr:
        if token.text not in self.names:
            raise GrammarError(f"No name '{token.text}' here. Known names: {', '.join(self.names)}.")
        return self.names[token.text]

    def number(self, token: Token) -> sp.Expr:
        value = float(token.text)
        if value > MAX_NUMBER:
            raise GrammarError(f"A number must be at most {MAX_NUMBER:.0e} in size, not {token.text:.20}.")
        return sp.Rational(repr(value))

    def sized(self, value: sp.Expr) -> sp.Expr:
        """A value whose factor in front is of a sensible size."""
        factor = value.as_coeff_Mul()[0]
        if factor.is_Rational and abs(factor) > MAX_NUMBER:
            raise GrammarError(f"A number must be at most {MAX_NUMBER:.0e} in size.")
        return value

    def closed(self, inside: Piece) -> Piece:
        if not self.take(")"):
            raise self.refuse(")")
        return inside


def float_value(expression: sp.Expr, values: Mapping[sp.Symbol, float]) -> tuple[float, float]:
    """Value of an expression of this grammar in floating point, and the size of the terms that it is the sum of.

    NaN where it has no finite real value, or a number on the way to it is too large: what SymPy would calculate with
    ever more digits.
    """
    try:
        value, size = _float_value(expression, values)
    except (ArithmeticError, ValueError):
        return math.nan, math.nan
    return (value, size) if math.isfinite(value) else (math.nan, math.nan)


def _float_value(expression: sp.Expr, values: Mapping[sp.Symbol, float]) -> tuple[float, float]:
    if expression.is_Symbol:
        return values[expression], abs(values[expression])
    if expression.is_Number or expression.is_NumberSymbol:
        return float(expression), abs(float(expression))
    parts = [_float_value(a, values) for a in expression.args]
    if expression.is_Add:
        return sum(v for v, _ in parts), sum(size for _, size in parts)
    if expression.is_Mul:
        return math.prod(v for v, _ in parts), math.prod(size for _, size in parts)
    if expression.is_Pow:
        (base, _), (exponent, _) = parts
        value = math.pow(base, exponent)
    elif expression.func in FLOAT_FUNCTIONS:
        value = FLOAT_FUNCTIONS[expression.func](parts[0][0])
    else:  # what SymPy has made of it is outside of this grammar: an infinity, say
        return math.nan, math.nan
    return value, max(abs(value), 1.0 if expression.func in BOUNDED_FUNCTIONS else 0.0)
