"""What an effect is: a row of data that says how a piece of physics enters a model.

A row enters in one of seven ways, each a small record below. Forces act on a port that the plant offers ("drive",
"ground", ...), so the same row serves every plant that has such a port. Laws are written in volt-equivalents: a
generalised force divided by the plant's scale. Resistances oppose the motion of their port: Q = −law · ∂port/∂q.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import NamedTuple

import sympy as sp

from derive.functions import symbol

INPUT = "input"  # in Quantiles: the commanded input


class Quantiles(NamedTuple):
    """Starting values from a log: quantiles of the magnitude of the input, or of a port's speed."""

    of: str  # INPUT or the name of a port
    at: tuple[float, ...]


class Values(NamedTuple):
    """Starting values that somebody gave."""

    at: tuple[float, ...]


class Ripple(NamedTuple):
    """A starting value from a log: how often per turn of a port the missing force repeats."""

    of: str  # name of a port


class EffectParameter(NamedTuple):
    """One number of an effect."""

    name: str
    unit: str  # "V rad/s" style, in the plant's units
    scope: str = "shared"  # by all logs of one machine, or "per log"
    minimum: float = -float("inf")  # physically possible range
    maximum: float = float("inf")
    grid: tuple[float, ...] = ()  # starting values to profile, where the problem is not locally linear
    typical: float = 0.1  # a moderate size, for documentation and tests
    absent: float = 0.0  # its value while the effect is absent; a shape, which has no size, may be neither 0 nor inf
    starts: Quantiles | Ripple | Values | None = None  # starting values that only a log can tell; every shape has them
    bounded: bool = False  # whether the range is also what a simulation needs, so that no fit may leave it


class Force(NamedTuple):
    """A resistance on a port: law(port angle, port speed, parameters)."""

    port: str
    law: Callable[..., sp.Expr]


class DryForce(NamedTuple):
    """Dry friction on a port: law(direction, port speed, parameters); it may also hold at standstill."""

    port: str
    law: Callable[..., sp.Expr]


class Deformation(NamedTuple):
    """A change of the plant's geometry: re-derived, not added."""

    symbol: str  # of Plant.geometry


class InputMap(NamedTuple):
    """The voltage that reaches the motor, from the one that came before: law(voltage, time, parameters)."""

    law: Callable[..., sp.Expr]


class InputDelay(NamedTuple):
    """The input acts later than it was commanded, by any fraction of a sample."""


class InputLag(NamedTuple):
    """The input reaches the motor through a first-order lag of the effect's time constant: T dU/dt = V − U."""


class SensorMap(NamedTuple):
    """What a sensor reports instead of the truth: law(reading, parameters)."""

    channel: str
    law: Callable[..., sp.Expr]


@dataclass(frozen=True)
class Effect:
    """A physical effect: name, family, sentence, parameters, and how it enters."""

    name: str
    family: str
    sentence: str
    equation: str
    parameters: tuple[EffectParameter, ...]
    enters: Force | DryForce | Deformation | InputMap | InputDelay | InputLag | SensorMap
    dissipates: bool = False
    means: str = ""  # what it means for the machine, in a sentence
    needs: tuple[str, ...] = field(default=())  # constants without which it cannot be judged
    ordered: tuple[str, ...] = field(default=())  # parameters that physically never fall in this order
    phased: tuple[str, ...] = field(default=())  # sine and cosine: their amplitude is shared, their phase per log

    @property
    def symbols(self) -> dict[str, sp.Symbol]:
        """Symbols of the parameters, named effect.parameter."""
        return {p.name: symbol(f"{self.name}.{p.name}") for p in self.parameters}

    @property
    def full_names(self) -> tuple[str, ...]:
        """Names of the parameters in the parameter vector."""
        return tuple(f"{self.name}.{p.name}" for p in self.parameters)

    def scope_of(self, parameter: EffectParameter) -> str:
        """Whose a parameter is, in words."""
        return "amplitude shared, phase per log" if parameter.name in self.phased else parameter.scope

    @property
    def linear(self) -> tuple[EffectParameter, ...]:
        """Parameters whose absence is a zero, where the equations can be linearised in them."""
        return tuple(p for p in self.parameters if p.absent == 0.0)

    @property
    def sizes(self) -> tuple[EffectParameter, ...]:
        """Parameters that say how large the effect is: their absence is a zero, or infinite."""
        return tuple(p for p in self.parameters if p.absent == 0.0 or math.isinf(p.absent))

    @property
    def profiled(self) -> EffectParameter | None:
        """The parameter whose starting values only a log can tell, if there is one."""
        return next((p for p in self.parameters if p.starts is not None), None)
