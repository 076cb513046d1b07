"""The record of an effect: a row of data that states how a piece of physics enters a model.

A row enters in one of eleven ways, each a small record below. Forces act on a port that the plant offers ("drive",
"ground", ...), so the same row serves every plant that has such a port. Laws are written in volt-equivalents: a
generalised force divided by the plant's scale. Resistances oppose the motion of their port: Q = −law · ∂port/∂q.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import NamedTuple

from derive.lazy import sp, symbol
from derive.parameter_name import full_name

DIRECTION_ARGUMENT = "direction"  # in laws: −1 or 1 while a port slips; a law in it may also stick at rest
INPUT_SIGNAL = "input"  # in Quantiles: the commanded input
LAG_MEMORY_TIME_CONSTANTS = 3.0  # after which the slowest winding keeps e⁻³ = 5 % of an old command, others nothing


class Quantiles(NamedTuple):
    """Starting values from a log: quantiles of the magnitude of the input, or of a port's speed."""

    of: str  # INPUT_SIGNAL or the name of a port
    at: tuple[float, ...]


class Values(NamedTuple):
    """Starting values that somebody gave."""

    at: tuple[float, ...]


class Ripple(NamedTuple):
    """A starting value from a log: how often per turn of a port the missing force repeats."""

    of: str  # name of a port


class Onset(NamedTuple):
    """Starting values from a log: when a force that the model lacks begins, and when it ends."""


class EffectParameter(NamedTuple):
    """One number of an effect."""

    name: str
    unit: str  # "V rad/s" style, in the plant's units
    scope: str = "shared"  # by all logs of one machine, "per log", or of an "event" in one log
    minimum: float = -float("inf")  # physically possible range
    maximum: float = float("inf")
    grid: tuple[float, ...] = ()  # starting values to profile, where the problem is not locally linear
    typical: float = 0.1  # a moderate size, for documentation and tests
    absent: float = 0.0  # its value while the effect is absent; a shape, which has no size, may be neither 0 nor inf
    starts: Quantiles | Ripple | Values | Onset | None = (
        None  # starting values that only a log can tell; every shape has them
    )
    bounded: bool = False  # True where a simulation needs the range too, so that no fit may leave it
    event_time: bool = False  # True for a time at which an event begins or ends
    letter: str = ""  # its letter in the equation, where that is not the name


class Force(NamedTuple):
    """A resistance on a port: law(port angle, port speed, parameters).

    A ``follows_input`` law depends on INPUT_SYMBOL, the voltage that reaches the motor.
    """

    port: str
    law: Callable[..., sp.Expr]
    follows_input: bool = False


class DryForce(NamedTuple):
    """Dry friction on a port: law(direction, port speed, parameters); it may also stick.

    A ``loaded`` law depends on LOAD_SYMBOL, the motor's load on the port.
    """

    port: str
    law: Callable[..., sp.Expr]
    loaded: bool = False


class HysteresisForce(NamedTuple):
    """A rate-independent hysteresis on a port: law(force before, path, parameters).

    The force follows from the path of slip and from the force where the path began, whatever the speed.
    """

    port: str
    law: Callable[..., sp.Expr]


def first_parameter(t: sp.Expr, **parameters: sp.Expr) -> sp.Expr:
    """A law that is the first parameter."""
    return next(iter(parameters.values()))


class Deformation(NamedTuple):
    """A change of the plant's geometry: re-derived, not added; by how much is law(time, parameters)."""

    symbol: str  # of Plant.geometry
    law: Callable[..., sp.Expr] = first_parameter


class InternalForce(NamedTuple):
    """A released internal coordinate and the resistance along it: law(coordinate, rate, parameters).

    ``geometry`` are deformations that come with it, each a function of the effect's parameters and the constants.
    """

    coordinate: str  # of Plant.internal
    law: Callable[..., sp.Expr]
    geometry: tuple[tuple[str, Callable[..., sp.Expr]], ...] = ()


class InternalPlay(NamedTuple):
    """Free play along an internal coordinate, of full width(parameters); other resistances act beyond the play."""

    coordinate: str  # of Plant.internal
    width: Callable[..., sp.Expr]
    contact: Callable[..., sp.Expr]  # law(coordinate beyond the play, rate) where nothing else resists it


class InputMap(NamedTuple):
    """The voltage that reaches the motor, from the one that came before: law(voltage, time, parameters)."""

    law: Callable[..., sp.Expr]


class InputDelay(NamedTuple):
    """The input acts later than it was commanded, by any fraction of a sample."""


class InputLag(NamedTuple):
    """The input reaches the motor through a first-order lag of the effect's time constant: T dU/dt = V − U."""


class SensorDelay(NamedTuple):
    """Sensors report what was true earlier, by any fraction of a sample."""

    channels: tuple[str, ...]


class SensorFilter(NamedTuple):
    """A sensor behind a filter that follows the first coordinate's speed: its state is an internal coordinate's rate.

    ``follows`` is the state's time derivative: law(speed, state, parameters); nothing acts back on the machine.
    """

    channel: str
    law: Callable[..., sp.Expr]  # the reading: law(true reading, speed, state, parameters)
    coordinate: str
    follows: Callable[..., sp.Expr]


class SensorMap(NamedTuple):
    """A sensor's reading in place of the true one: law(reading, parameters)."""

    channel: str
    law: Callable[..., sp.Expr]
    kind: str = ""  # of the sensor: on a plant without the channel it acts on the first of this kind


@dataclass(frozen=True)
class Effect:
    """A physical effect: name, family, sentence, parameters, and how it enters."""

    name: str
    family: str
    sentence: str
    equation: str
    parameters: tuple[EffectParameter, ...]
    enters: (
        Force | DryForce | HysteresisForce | Deformation | InternalForce | InternalPlay
        | InputMap | InputDelay | InputLag | SensorMap | SensorDelay | SensorFilter
    )  # fmt: skip
    dissipates: bool = False
    means: str = ""  # consequence for the machine, in a sentence
    undriven: tuple[str, str] = ("", "")  # sentence and consequence on a machine that nothing drives, if others
    needs_motor: bool = False  # True where it is a motor's or its gearbox's, on a port that may be without
    needs: tuple[str, ...] = field(default=())  # constants without which it cannot be judged
    ordered: tuple[str, ...] = field(default=())  # parameters that physically never fall in this order
    approaches: str = ""  # a simpler effect that it becomes at an end of its range, with parameters of the same names
    covers: tuple[str, ...] = field(default=())  # simpler effects that it is at one of its shapes, and may stand beside
    varies: str = ""  # the friction that it makes larger one way than the other: it is not larger than that
    phased: tuple[str, ...] = field(default=())  # sine and cosine: their amplitude is shared, their phase per log
    law_text: str = ""  # this and what follows stand on docs/effects.md alone: sentences behind the equation
    residual: str = ""  # where the missing force shows
    resembles: str = ""  # what acts in a similar way and how to tell it apart
    remarks: tuple[str, ...] = field(default=())  # whatever else there is to know

    @property
    def symbols(self) -> dict[str, sp.Symbol]:
        """Symbols of the parameters, named effect.parameter."""
        return {p.name: symbol(self.name_of(p)) for p in self.parameters}

    @property
    def full_names(self) -> tuple[str, ...]:
        """Names of the parameters in the parameter vector."""
        return tuple(map(self.name_of, self.parameters))

    def name_of(self, parameter: EffectParameter) -> str:
        """Name of one of its parameters in the parameter vector."""
        return full_name(self.name, parameter.name)

    def scope_of(self, parameter: EffectParameter) -> str:
        """Scope of a parameter as text: shared, per log, or a shared amplitude with a phase per log."""
        return "amplitude shared, phase per log" if parameter.name in self.phased else parameter.scope

    @property
    def linear(self) -> tuple[EffectParameter, ...]:
        """Parameters whose absence is a zero, where the equations can be linearised in them."""
        return tuple(p for p in self.parameters if p.absent == 0.0 and not p.event_time)

    @property
    def sizes(self) -> tuple[EffectParameter, ...]:
        """Parameters that say how large the effect is: their absence is a zero, or infinite."""
        return tuple(p for p in self.parameters if (p.absent == 0.0 or math.isinf(p.absent)) and not p.event_time)

    @property
    def releases(self) -> str:
        """Name of the internal coordinate that it releases, or an empty string."""
        return self.enters.coordinate if isinstance(self.enters, InternalForce | InternalPlay | SensorFilter) else ""

    @property
    def carries(self) -> bool:
        """True where it adds states, which carry over from one fitted segment to the next."""
        return isinstance(self.enters, HysteresisForce | InternalForce | InternalPlay | SensorFilter)

    @property
    def input_memory(self) -> float:
        """Time [s] for which a command is remembered, at the largest value that a fit starts from; 0 without memory."""
        if not isinstance(self.enters, InputDelay | InputLag):
            return 0.0
        constants = LAG_MEMORY_TIME_CONSTANTS if isinstance(self.enters, InputLag) else 1.0
        return constants * max(self.parameters[0].grid)

    @property
    def event(self) -> bool:
        """True where it is an event in one log."""
        return any(p.scope == "event" for p in self.parameters)

    @property
    def profiled(self) -> EffectParameter | None:
        """The parameter whose starting values only a log can tell, if there is one."""
        return next((p for p in self.parameters if p.starts is not None), None)
