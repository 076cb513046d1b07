"""Values that are known before a program runs, beside expressions of it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from wheelpend.export.translate.idle import names_in
from wheelpend.export.translate.program import (
    REAL_NUMBER,
    TRUTH_VALUE,
    WHOLE_NUMBER,
    Expression,
    Kind,
    Number,
    Several,
)


@dataclass(frozen=True)
class Known:
    """A value that is known beforehand: a number, a table or a tuple of the module."""

    value: Any
    name: str = ""  # of a table, under which the program keeps it where it is read at places not known beforehand


@dataclass(frozen=True)
class RuntimeConstant:
    """A constant of the module whose value the language decides."""

    name: str


Value = Known | Expression
Argument = Kind | np.ndarray  # of a kernel: what it is, or what it is known to be


def is_switch(value: Value) -> bool:
    """True of a known argument for which a function of its own is made."""
    return isinstance(value, Known) and (isinstance(value.value, bool | np.ndarray) or value.value is None)


def is_empty_kind(kind: Kind) -> bool:
    """True of an array without entries."""
    return kind.base == "array" and 0 in kind.shape


def as_kind(value: Expression, kind: Kind) -> Expression:
    """A number written as a real one where a real one is wanted."""
    if isinstance(value, Number) and kind == REAL_NUMBER and value.kind != REAL_NUMBER:
        return Number(float(value.value), REAL_NUMBER)
    return value


def expression(value: Value) -> Expression:
    """A known number as one that is written out."""
    if not isinstance(value, Known):
        return value
    known = value.value
    if isinstance(known, bool | np.bool_):
        return Number(bool(known), TRUTH_VALUE)
    if isinstance(known, int | np.integer):
        return Number(int(known), WHOLE_NUMBER)
    if isinstance(known, float | np.floating):
        return Number(float(known), REAL_NUMBER)
    if isinstance(known, tuple):
        return Several(tuple(as_kind(expression(Known(v)), REAL_NUMBER) for v in known), Kind("tuple", (len(known),)))
    raise NotImplementedError(f"no number: {known!r}")


def joined(one: Kind, other: Kind) -> Kind:
    """The kind that holds both."""
    order = ("bool", "int", "real")
    if one == other:
        return one
    if one.base in order and other.base in order:
        return max(one, other, key=lambda k: order.index(k.base))
    raise NotImplementedError(f"a value that is now {one}, now {other}")


def computed(operator: str, left: Any, right: Any) -> Any:
    """Arithmetic and comparison of known numbers."""
    match operator:
        case "+":
            return left + right
        case "-":
            return left - right
        case "*":
            return left * right
        case "/":
            return left / right
        case "<":
            return left < right
        case "<=":
            return left <= right
        case ">":
            return left > right
        case ">=":
            return left >= right
        case "==":
            return left == right
        case _:
            return left != right


def read_by(value: Value) -> set[str]:
    """Variables that a value reads, and texts of the entries that it reads."""
    return set() if isinstance(value, Known) else {*names_in(value)}
