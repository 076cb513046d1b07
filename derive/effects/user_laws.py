"""Effects that a user writes as text: they become rows like those of the library.

The law is an expression of ``grammar``; nothing in it is executed.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import sympy as sp

from derive.effects.row import DIRECTION_ARGUMENT, INPUT_SIGNAL, DryForce, EffectParameter, Force, InputMap, SensorMap
from derive.functions import symbol
from derive.grammar import GrammarError, float_value, parse, tokenise

SEVERAL_INPUTS = "v_in"  # in laws: each of several inputs, which such a law maps alike
LAW_ARGUMENTS = {
    Force: ("angle", "speed"),
    DryForce: (DIRECTION_ARGUMENT, "speed"),
    SensorMap: ("reading",),
}
CHECKED_VALUES = (0.0, 0.3, -1.7, 12.0)  # speeds, angles and the like where a law must be finite, standstill among them
AGREEMENT_POINTS = 16  # of which a law may have no value at some
ROUNDING = 1e-12  # of what cancels


@dataclass(frozen=True)
class TextLaw:
    """An expression as a row's law: called with the row's arguments and the symbols of its parameters."""

    text: str
    expression: sp.Expr
    arguments: tuple[str, ...]

    def __call__(self, /, *values: sp.Expr, **parameters: sp.Expr) -> sp.Expr:
        """The law at these values."""
        given = dict(zip(self.arguments, values, strict=True)) | parameters
        return self.expression.xreplace({symbol(n): sp.sympify(v) for n, v in given.items()})


def entry_from_text(
    on: str, text: str, parameters: Sequence[EffectParameter], plant
) -> Force | DryForce | InputMap | SensorMap:
    """Entry of an effect whose law is a text, on a port, the input or a sensor's channel of a plant.

    Raises GrammarError where the law cannot be read, does something while the effect is absent, or has no value at
    some motion.
    """
    ports, channels = [p.name for p in plant.ports], [c.name for c in plant.channels]
    if on not in (INPUT_SIGNAL, *ports, *channels):
        raise GrammarError(
            f"on must be {', '.join(ports)}, {INPUT_SIGNAL} or one of {', '.join(channels)}, not '{on}'."
        )
    if on == INPUT_SIGNAL:
        return InputMap(_parsed_law(text, InputMap, parameters, plant))
    if on in channels:
        return SensorMap(on, _parsed_law(text, SensorMap, parameters, plant))
    kind = DryForce if any(token.text == DIRECTION_ARGUMENT for token in tokenise(text)) else Force
    return kind(on, _parsed_law(text, kind, parameters, plant))


def law_arguments(kind: type, plant) -> tuple[str, ...]:
    """Arguments of a law: the input goes by its own name."""
    if kind is InputMap:
        return (SEVERAL_INPUTS if plant.further else str(plant.input), "t")
    return LAW_ARGUMENTS[kind]


def _parsed_law(text: str, kind: type, parameters: Sequence[EffectParameter], plant) -> TextLaw:
    own = law_arguments(kind, plant)
    names = list(dict.fromkeys((*own, *context_names(kind, plant))))
    for p in parameters:
        if p.name in names:
            raise GrammarError(f"A parameter must not be called {p.name}, which the law already knows. Rename it.")
    law = TextLaw(text, parse(text, {n: symbol(n) for n in (*names, *(p.name for p in parameters))}), own)
    _check_law(law, parameters, symbol(own[0]) if kind in (InputMap, SensorMap) else sp.Integer(0))
    return law


def context_names(kind: type, plant) -> tuple[str, ...]:
    """Names that a law may use besides its own: coordinates and rates, time, and the input that reaches the motor.

    Dry friction depends on the motion alone, so that its limits at rest are known, and the input on nothing else.
    """
    motion = tuple(str(s) for c in plant.coordinates for s in (c.q, c.dq))
    return {InputMap: (), DryForce: motion, SensorMap: (*motion, "t"), Force: (*motion, "t", str(plant.input))}[kind]


def _check_law(law: TextLaw, parameters: Sequence[EffectParameter], wanted: sp.Expr) -> None:
    absent = law.expression.xreplace({symbol(p.name): sp.nsimplify(p.absent) for p in parameters})
    if not _agree(absent, wanted):
        sizes = ", ".join(p.name for p in parameters if p.absent == 0.0) or "its sizes"
        found = absent if absent.is_finite is not False else "no finite number"
        raise GrammarError(f"The law must be {wanted} while {sizes} = 0, but {law.text} is then {found}.")
    typical = {symbol(p.name): p.typical for p in parameters}
    for value in CHECKED_VALUES:
        point, _ = float_value(law.expression, dict.fromkeys(law.expression.free_symbols, value) | typical)
        if not math.isfinite(point):
            raise GrammarError(f"The law must have a finite value at every motion, but {law.text} has none where "
                               f"everything it depends on is {value:g}.")  # fmt: skip


def _agree(one: sp.Expr, other: sp.Expr) -> bool:
    """True of expressions that have the same values wherever they have one; simplifying a user's might never end."""
    if one == other:
        return True
    symbols = sorted(one.free_symbols | other.free_symbols, key=str)
    generic = np.random.default_rng(0).uniform(-3.0, 3.0, (AGREEMENT_POINTS, len(symbols)))
    differences = [float_value(one - other, dict(zip(symbols, map(float, point), strict=True))) for point in generic]
    known = [(value, size) for value, size in differences if math.isfinite(value)]
    return bool(known) and all(abs(value) <= ROUNDING * size for value, size in known)
