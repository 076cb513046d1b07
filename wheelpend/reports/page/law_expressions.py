"""Laws of effects as expressions and as functions of arrays, for every drawing of a law."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np
import sympy as sp

from derive.effects import DryForce, Effect
from derive.functions import Magnitude, Ramp, Sign, Step
from derive.parameter_name import full_name

LAMBDIFY_MODULES = [
    {Sign.__name__: np.sign, Step.__name__: lambda x: 1.0 * (x > 0), Magnitude.__name__: np.abs,
     Ramp.__name__: lambda x: np.maximum(x, 0.0)},
    "numpy",
]  # fmt: skip
EffectValues = Mapping[str, float]  # of an effect's parameters, by effect.parameter


def resistance_law(effect: Effect, angle: sp.Expr, speed: sp.Expr) -> sp.Expr:
    """The resistance of a force, or of dry friction, over the angle and the speed of its port."""
    if isinstance(effect.enters, DryForce):
        return effect.enters.law(Sign(speed), speed, **effect.symbols)
    return effect.enters.law(angle, speed, **effect.symbols)  # type: ignore[union-attr]


def numeric_law(effect: Effect, law: sp.Expr, free: Sequence[sp.Symbol]) -> Callable[..., np.ndarray]:
    """A law as a function of an effect's values and of arrays for its free symbols."""
    names = [p.name for p in effect.parameters]
    numeric = sp.lambdify([*(effect.symbols[n] for n in names), *free], law, LAMBDIFY_MODULES)

    def evaluate(values: EffectValues, *x: np.ndarray) -> np.ndarray:
        given = (values[full_name(effect.name, n)] for n in names)
        return np.broadcast_to(numeric(*given, *x), x[0].shape).astype(float)

    return evaluate
