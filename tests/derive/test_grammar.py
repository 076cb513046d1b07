"""Expressions of users: read exactly, or refused with a reason; nothing is ever executed."""

import pytest
import sympy as sp

from derive.functions import Magnitude, Ramp, Sign, symbol
from derive.grammar import GrammarError, parse

S, F, V = (symbol(n) for n in ("s", "F", "v"))
NAMES = {"s": S, "F": F, "v": V}


@pytest.mark.parametrize(("text", "meant"), [
    ("F*tanh(s/v)", F * sp.tanh(S / V)),
    ("-2*s^2*sign(s)", -2 * S**2 * Sign(S)),
    ("-s^2", -(S**2)),
    ("2^-2*s", S / 4),
    ("s**2/v/2", S**2 / V / 2),
    ("1e-3 + .5*abs(s)", sp.Rational(1, 1000) + Magnitude(S) / 2),
    ("(s - v)*(s + v)", (S - V) * (S + V)),
    ("sqrt(s*s)*v", Magnitude(S) * V),
    ("F*exp(-(s/v)^2)", F * sp.exp(-((S / V) ** 2))),
])  # fmt: skip
def test_an_expression_means_what_it_says(text, meant):
    assert sp.expand(parse(text, NAMES) - meant) == 0


@pytest.mark.parametrize(("text", "why"), [
    ("__import__('os').system('true')", "not part of an expression"),
    ("__import__(s)", "No function named '__import__'"),
    ("eval(s)", "No function named 'eval'"),
    ("s.__class__", "not part of an expression"),
    ("(lambda: 1)()", "not part of an expression"),
    ("[s for s in s]", "not part of an expression"),
    ("s; F", "not part of an expression"),
    ("theta", "Known names: s, F, v"),
    ("s s", "must stand at character 3"),
    ("F*(1 + s", "must stand at character 9"),
    ("", "must stand at character 1"),
    ("9^9^9^9", "exponent"),
    ("s^s", "exponent"),
    ("((99^6)^20)^20", "at most 1e\\+12"),
    ("1e999*s", "at most 1e\\+12"),
    ("1/(s - s)", "divide by zero"),
    ("sqrt(-1)*s", "finite real"),
    ("((((2*s)^20)^20)^20)^20", "exponent of at most 20 in all"),
    ("(1000*s)^20", "at most 1e\\+12"),
    ("*".join(f"(s + {k})" for k in range(60)), "100 terms"),
    ("(s + F + v)^20", "100 terms"),
    ("exp(" * 20 + "s" + ")" * 20, "6 deep in each other"),
    ("(" * 200 + "s" + ")" * 200, "nest"),
    ("-" * 200 + "s", "nest"),
    ("s+" * 1000 + "s", "at most 1000 characters"),
    (b"s", "must be a text"),
])  # fmt: skip
def test_anything_else_is_refused_with_a_reason(text, why):
    with pytest.raises(GrammarError, match=why):
        parse(text, NAMES)


@pytest.mark.parametrize("name", ["sympify", "lambdify", "Function", "gamma", "Integer", "Symbol", "besselj", "Abs"])
def test_no_function_of_sympy_can_be_called_but_those_of_the_grammar(name):
    with pytest.raises(GrammarError, match=f"No function named '{name}'"):
        parse(f"{name}(s)", NAMES)


def test_a_function_of_the_grammar_is_the_one_of_its_name():
    found = {name: parse(f"{name}(s)", NAMES) for name in ("sin", "cos", "tan", "exp", "log", "sqrt", "tanh", "atan")}
    assert found == {name: getattr(sp, name)(S) for name in found}
    assert (parse("abs(s)", NAMES), parse("sign(s)", NAMES), parse("positive(s)", NAMES)) == (
        Magnitude(S), Sign(S), Ramp(S))  # fmt: skip
