"""Reversals of a part: the sign of every effect once the part is turned round, from the laws.

The same machine is recorded once more with one part turned, as its plant says: a robot on its track, the pitch sensor
in its holder, the two leads of the motors. What belongs to the turned part is then mirrored; everything else stays.
So an effect's size changes its sign, keeps it, or (a phase) is another one altogether.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache

import numpy as np
import sympy as sp

import derive
from derive.effects import Deformation, Effect, InputMap, SensorMap
from derive.functions import TIME_SYMBOL
from derive.parameter_name import effect_of
from derive.plant_signature import Reversal

NUMERIC_FUNCTIONS = {
    "Sign": np.sign,
    "Magnitude": np.abs,
    "Step": lambda x: np.heaviside(x, 0.0),
    "Ramp": lambda x: np.maximum(x, 0.0),
}  # of the functions that SymPy does not know


def sign_after_reversal(reversal: Reversal, name: str) -> int:
    """Sign of a parameter effect.parameter after a reversal: 1 or -1; 0 where it takes another value altogether."""
    if not effect_of(name):
        return 1
    effect = derive.effects.find(effect_of(name))
    if sum(p.scope == "per log" for p in effect.parameters) > 1:
        return 0  # amplitude and phase: every log begins elsewhere
    return _effect_sign(reversal, effect)


def changes_sign(reversal: Reversal, effect: str) -> bool:
    """An effect whose size changes its sign."""
    return any(sign_after_reversal(reversal, n) == -1 for n in derive.effects.find(effect).full_names)


@lru_cache(maxsize=256)
def _effect_sign(reversal: Reversal, effect: Effect) -> int:
    match effect.enters:
        case Deformation(symbol=name) if name in reversal.geometry:
            return -1
        case SensorMap(channel=channel, law=law) if channel in reversal.channels:
            return _law_parity(lambda reading, **p: law(reading, **p), effect)
        case InputMap(law=law) if reversal.input:
            return _law_parity(lambda voltage, **p: law(voltage, TIME_SYMBOL, **p), effect)
    return 1


def _law_parity(law: Callable[..., sp.Expr], effect: Effect) -> int:
    """1 where the mirrored law, −law(−x), is the law itself, -1 where that with the opposite size, else 0."""
    x, sizes = sp.Symbol("x", real=True), effect.symbols
    mirrored = -law(-x, **sizes)
    for found in (1, -1):
        rest = mirrored - law(x, **{n: found * s for n, s in sizes.items()})
        if _is_zero(rest, [x, TIME_SYMBOL, *sizes.values()]):
            return found
    return 0


def _is_zero(rest: sp.Expr, symbols: list[sp.Symbol]) -> bool:
    """An expression that is zero at many generic points; laws with corners do not simplify."""
    value = sp.lambdify(symbols, rest, [NUMERIC_FUNCTIONS, "numpy"])
    points = np.random.default_rng(0).uniform(0.1, 1.0, size=(len(symbols), 40))
    points[0] *= np.where(np.arange(40) % 2, 3.0, -3.0)
    return bool(np.all(np.abs(value(*points)) < 1e-9))
