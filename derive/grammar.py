"""Expressions that users write: a small strict grammar, read without executing anything.

    sum      = term { ("+" | "-") term }
    term     = factor { ("*" | "/") factor }
    factor   = ("+" | "-") factor | power
    power    = atom [ ("^" | "**") factor ]
    atom     = number | name | name "(" sum ")" | "(" sum ")"

Names are those that the caller offers, functions those of FUNCTIONS. Everything else is refused, and so are texts that
are too long or nest too deeply to be a law of physics.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import NamedTuple

import sympy as sp

from derive.functions import Magnitude, Ramp, Sign

MAX_TEXT_LENGTH, MAX_NESTING_DEPTH, MAX_EXPONENT = 1000, 50, 20
MAX_NUMBER = 10**12  # of a number; no law of physics in SI units needs a larger one
KNOWN_FUNCTIONS = {
    "sin": sp.sin, "cos": sp.cos, "tan": sp.tan, "exp": sp.exp, "log": sp.log, "sqrt": sp.sqrt, "tanh": sp.tanh,
    "atan": sp.atan, "abs": Magnitude, "sign": Sign, "positive": Ramp,
}  # fmt: skip
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
    found = parser.sum(0)
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


class _Parser:
    """Recursive descent; every rule takes how deep it is and returns its expression."""

    def __init__(self, text: str, names: Mapping[str, sp.Expr]) -> None:
        self.names, self.left = names, tokenise(text)[::-1]

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

    def sum(self, depth: int) -> sp.Expr:
        if depth > MAX_NESTING_DEPTH:
            raise GrammarError(f"An expression must not nest more than {MAX_NESTING_DEPTH} deep.")
        total = self.term(depth)
        while sign := self.take("+", "-"):
            term = self.term(depth)
            total = total + term if sign == "+" else total - term
        return total

    def term(self, depth: int) -> sp.Expr:
        product = self.factor(depth)
        while sign := self.take("*", "/"):
            factor = self.factor(depth)
            if sign == "/" and factor == 0:
                raise GrammarError("An expression must not divide by zero.")
            product = product * factor if sign == "*" else product / factor
        return product

    def factor(self, depth: int) -> sp.Expr:
        if depth > MAX_NESTING_DEPTH:
            raise GrammarError(f"An expression must not nest more than {MAX_NESTING_DEPTH} deep.")
        sign = self.take("+", "-")
        if sign:
            factor = self.factor(depth + 1)
            return -factor if sign == "-" else factor
        return self.power(depth)

    def power(self, depth: int) -> sp.Expr:
        base = self.atom(depth)
        if not self.take("^", "**"):
            return base
        exponent = self.factor(depth + 1)
        if not (exponent.is_Rational or exponent.is_Float) or abs(exponent) > MAX_EXPONENT:
            raise GrammarError(f"An exponent must be a number of at most {MAX_EXPONENT}, not {exponent}. "
                               "Write exp(b*log(a)) for a^b.")  # fmt: skip
        if base == 0 and exponent < 0:
            raise GrammarError("An expression must not divide by zero.")
        return self.sized(base**exponent)

    def atom(self, depth: int) -> sp.Expr:
        token = self.next
        if self.take("("):
            return self.closed(self.sum(depth + 1))
        if token.kind == "number":
            self.left.pop()
            return self.number(token)
        if token.kind == "name":
            self.left.pop()
            return self.call(token, depth) if self.take("(") else self.named(token)
        raise self.refuse("a number, a name or (")

    def call(self, token: Token, depth: int) -> sp.Expr:
        if token.text not in KNOWN_FUNCTIONS:
            raise GrammarError(f"No function named '{token.text}'. Known functions: {', '.join(KNOWN_FUNCTIONS)}.")
        return KNOWN_FUNCTIONS[token.text](self.closed(self.sum(depth + 1)))

    def named(self, token: Token) -> sp.Expr:
        if token.text not in self.names:
            raise GrammarError(f"No name '{token.text}' here. Known names: {', '.join(self.names)}.")
        return self.names[token.text]

    def number(self, token: Token) -> sp.Expr:
        value = float(token.text)
        if value > MAX_NUMBER:
            raise GrammarError(f"A number must be at most {MAX_NUMBER:.0e} in size, not {token.text}.")
        return sp.Rational(repr(value))

    def sized(self, value: sp.Expr) -> sp.Expr:
        """A value that is no number or one of a sensible size."""
        if value.is_Rational and abs(value) > MAX_NUMBER:
            raise GrammarError(f"A number must be at most {MAX_NUMBER:.0e} in size.")
        return value

    def closed(self, inside: sp.Expr) -> sp.Expr:
        if not self.take(")"):
            raise self.refuse(")")
        return inside
