"""The records that pass between the stages of the derivation.

Angles in rad, times in s, lengths in m, masses in kg. Every record is frozen; a stage reads the record before it and
nothing else.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import NamedTuple

from derive.lazy import sp
from derive.plant_signature import (
    LEADS,
    WORDS_FOR_ANY,
    ChannelSpec,
    CoordinateSpec,
    Parameter,
    PlantSignature,
    PlantWords,
    PortSpec,
    Reversal,
    Sensor,
)


class Coordinate(NamedTuple):
    """A generalised coordinate with its rate and acceleration, plain real symbols of one name."""

    name: str  # column name of its angle, for instance theta_w
    row: str  # name of its equation of motion, for instance wheel
    q: sp.Symbol  # rad or m
    dq: sp.Symbol  # rad/s or m/s
    ddq: sp.Symbol  # rad/s² or m/s²
    unit: str  # of q


def coordinate(name: str, row: str, unit: str = "rad") -> Coordinate:
    """Make a coordinate; its rate is called d<name>, its acceleration dd<name>."""
    q, dq, ddq = sp.symbols(f"{name} d{name} dd{name}", real=True)
    return Coordinate(name, row, q, dq, ddq, unit)


class Body(NamedTuple):
    """A rigid body: where its centre of mass is and how fast it turns."""

    name: str
    mass: sp.Expr  # kg
    position: sp.Matrix  # m, of the centre of mass
    inertia: sp.Expr  # kg m², about the centre of mass
    rate: sp.Expr  # rad/s


class Port(NamedTuple):
    """A place where a force does work: the coordinate along which it acts, positive where it pushes."""

    name: str
    coordinate: sp.Expr  # rad or m, in the generalised coordinates
    sentence: str
    length_per_radian: float = (
        1.0  # motion along the coordinate that counts as one rad where a law's numbers are in rad
    )


class Load(NamedTuple):
    """A generalised force in physical units that does work on a port."""

    name: str
    port: str
    force: sp.Expr  # N m, or N along a length


class Channel(NamedTuple):
    """Reading of an ideal sensor."""

    name: str  # column in a measurement file
    reading: sp.Expr
    unit: str
    sensor: Sensor = Sensor()  # what more is known of it


class ModelTemplate(NamedTuple):
    """Texts for a plant's first model.toml, in place of those that are made from the plant."""

    numbers: str = ""  # where the plant's own numbers are from
    sensors: str = ""  # the section [sensors]
    column: str = ""  # an example of a mapped column
    simulation: str = ""  # further lines of [simulation]


class Assumption(NamedTuple):
    """A choice that the derivation makes, named so that it can be switched in model.toml."""

    name: str
    default: object
    choices: tuple
    sentence: str
    implies: tuple[tuple[object, str], ...] = ()  # (choice, effect): a choice that is the presence of an effect
    section: str = "assumptions"  # of model.toml where it is switched; "sensors" where it describes one
    needs: tuple[tuple[object, str, object], ...] = ()  # (choice, other assumption, what that must then be)


class Heading(NamedTuple):
    """A frame that turns about the vertical with the machine, and rolls forward along its own x axis.

    Positions are then in it: the x of ``origin`` is the way rolled, whatever the heading.
    """

    coordinate: Coordinate  # yaw, counted from x to y
    origin: sp.Matrix  # m, the point that rolls without slipping sideways


@dataclass(frozen=True)
class Plant:
    """A machine as its geometry states it. Nothing in it has been derived yet."""

    name: str
    sentence: str
    coordinates: tuple[Coordinate, ...]
    bodies: tuple[Body, ...]
    gravity: sp.Matrix  # m/s², in the frame of the positions
    loads: tuple[Load, ...]
    ports: tuple[Port, ...]
    channels: tuple[Channel, ...]
    input: sp.Symbol  # the voltage that reaches the motor [V]
    input_unit: str
    scale: sp.Expr  # the equations are divided by it, which turns N m into volt-equivalents
    substitutions: dict  # physical symbols rewritten so that the scale appears in them
    constants: tuple[Parameter, ...]  # known numbers, never identified
    geometry: dict[str, sp.Symbol] = field(default_factory=dict)  # deformations that effects may use, 0 when absent
    internal: dict[str, Coordinate] = field(default_factory=dict)  # internal coordinates that effects may release
    free: tuple[str, ...] = ()  # names of the released ones; the others are rigid
    controlled: tuple[str, str] = ("", "")  # channels of what is controlled and of its rate, where there are any
    reference: str = ""  # column of the commanded value of what is controlled
    further: tuple[sp.Symbol, ...] = ()  # inputs beside the first, in the same unit
    heading: Heading | None = None  # None where the machine keeps its heading
    range_channel: str = ""  # channel that must stay within ±π/2; empty where the machine may be at any angle
    words: PlantWords = WORDS_FOR_ANY  # for sentences
    usual_limits: tuple[float, float] | None = None  # of the range channel [rad] and of the input, in ordinary use
    reversals: tuple[Reversal, ...] = (LEADS,)  # parts that may be turned round between two logs
    wiring_check: str = ""  # check of the inspection that knows how such a machine is wired, in place of those for any

    @property
    def moving(self) -> tuple[Coordinate, ...]:
        """The coordinates, then the released internal ones."""
        return (*self.coordinates, *(self.internal[n] for n in self.free))

    @property
    def driven(self) -> bool:
        """True where a load depends on an input; logs of a machine that swings freely need no input column."""
        return any(sp.sympify(load.force).has(*self.inputs) for load in self.loads)

    @property
    def driven_ports(self) -> tuple[str, ...]:
        """Ports on which a motor acts."""
        acting = {load.port for load in self.loads if sp.sympify(load.force).has(*self.inputs)}
        return tuple(p.name for p in self.ports if p.name in acting)

    @property
    def inputs(self) -> tuple[sp.Symbol, ...]:
        """All inputs, in the order of their columns."""
        return (self.input, *self.further)

    @cached_property
    def plant_signature(self) -> PlantSignature:
        """The plant in names, units and numbers; ports and channels are linear in the coordinates."""
        return PlantSignature(
            name=self.name,
            sentence=self.sentence,
            coordinates=tuple(
                CoordinateSpec(c.name, c.row, c.unit, str(c.q), str(c.dq), str(c.ddq)) for c in self.coordinates
            ),
            ports=tuple(self.port_spec(port) for port in self.ports),
            channels=tuple(ChannelSpec(c.name, c.unit, self.integral_of(c), c.sensor) for c in self.channels),
            inputs=tuple(map(str, self.inputs)),
            input_unit=self.input_unit,
            driven=self.driven,
            driven_ports=self.driven_ports,
            pulled=not self.gravity.is_zero_matrix,
            constants=self.constants,
            scale=str(self.scale),
            geometry=tuple(self.geometry),
            internal=tuple(self.internal),
            controlled=self.controlled,
            reference=self.reference,
            range_channel=self.range_channel,
            words=self.words,
            usual_limits=self.usual_limits,
            reversals=self.reversals,
            wiring_check=self.wiring_check,
        )

    def integral_of(self, channel: Channel) -> str:
        """Name of the channel whose derivative a channel reads; an empty string where there is none."""
        rates = {c.q: c.dq for c in self.coordinates}
        derivatives = {o.name: sp.sympify(o.reading).subs(rates, simultaneous=True) for o in self.channels}
        own = sp.sympify(channel.reading)
        return next((n for n, slope in derivatives.items() if n != channel.name and slope == own and own != 0), "")

    def port_spec(self, port: Port) -> PortSpec:
        """A port in names, units and numbers."""
        weights = tuple(float(sp.diff(port.coordinate, c.q)) for c in self.coordinates)
        return PortSpec(port.name, port.sentence, self.unit_along(port.coordinate), port.length_per_radian, weights)

    def unit_along(self, expression: sp.Expr) -> str:
        """Unit of a function of the coordinates that is linear in them."""
        units = {c.unit for c in self.moving if sp.sympify(expression).has(c.q, c.dq)}
        return "rad" if "rad" in units or not units else units.pop()

    def port(self, name: str) -> Port:
        """Return the port of that name; raises KeyError with the known ones."""
        for port in self.ports:
            if port.name == name:
                return port
        raise KeyError(f"{self.name} has no port '{name}'; it has {', '.join(p.name for p in self.ports)}")


class Equations(NamedTuple):
    """Equations of motion from the Lagrangian: each row reads inertia − force = 0."""

    lagrangian: sp.Expr  # J (paper eq. 1)
    inertia: tuple[sp.Expr, ...]  # left sides of Lagrange's equations (paper eqs. 3, 4)
    force: tuple[sp.Expr, ...]  # generalised forces (paper eqs. 11, 13)


class Grouping(NamedTuple):
    """Equivalent parameters found in the scaled equations."""

    names: tuple[str, ...]  # X1, X2, ...
    definitions: tuple[sp.Expr, ...]  # each in physical symbols (paper eq. 18)
    rows: tuple[sp.Expr, ...]  # inertia − force in volt-equivalents, in terms of the names (paper eqs. 19, 20)


class EnergyBalance(NamedTuple):
    """The rows times their rates, summed: supplied = (d stored/dt + taken) · X, without accelerations."""

    stored: sp.Matrix  # energy per parameter, 1 x parameters [rad² ... so that stored · X is in V rad]
    taken: sp.Matrix  # power that is not stored, 1 x parameters
    supplied: sp.Expr  # power of the input and of what is known [V rad/s]


class Regressor(NamedTuple):
    """A model that is linear in its parameters: tau = phi · X, and phi = d²/dt² phi2 + d/dt phi1 + phi0."""

    parameters: tuple[sp.Symbol, ...]
    tau: sp.Matrix  # left sides (paper eq. 21), rows x 1
    phi: sp.Matrix  # rows x parameters (paper eq. 22)
    phi2: sp.Matrix  # (paper eq. 26)
    phi1: sp.Matrix
    phi0: sp.Matrix
    energy: EnergyBalance


class Hysteresis(NamedTuple):
    """A rate-independent hysteresis force on a port: a function of the path of slip and of the force at its start."""

    force: sp.Symbol  # [V], against the slip
    before: sp.Symbol  # the force where the path begins
    path: sp.Symbol  # slip since then [rad]
    law: sp.Expr  # the force at the end of the path, in the two and the parameters
    weights: tuple[float, ...]  # the path as a combination of the moving coordinates


class Relations(NamedTuple):
    """Effects that no log can distinguish, by the equations alone."""

    absorbed: dict  # effect.parameter → {own parameter: weight}, of effects that are part of those
    twins: dict  # effect → effects that change every log in the same way
    contained: dict  # effect → {smaller effect: its linear parameters by those of the smaller}


class DrySurface(NamedTuple):
    """A surface with dry friction: it slips with a given force in either direction, or sticks."""

    port: str
    slip: tuple[float, ...]  # slip speed as a combination of the coordinates' rates
    law: sp.Expr  # friction against the slip [V], a function of the direction symbol (−1, 0 when stuck, +1)
    direction: sp.Symbol


@dataclass(frozen=True)
class Model:
    """A complete model: plant, assumptions and effects, ready to be turned into code.

    Each row reads ``residual = inertia − generalised force = 0`` in volt-equivalents and holds for the accelerations
    among its symbols; the dry forces are separate in ``surfaces`` because a surface may stick instead of slip.
    """

    plant: Plant
    assumptions: dict
    effects: tuple  # of derive.effects.Effect
    grouping: Grouping
    residual: tuple[sp.Expr, ...]  # of the coordinates, then of the released internal ones
    surfaces: tuple[DrySurface, ...]
    readings: tuple[sp.Expr, ...]  # of the sensors, in the states
    fitted: tuple[Parameter, ...]  # parameters that may be identified, base first
    constants: tuple[Parameter, ...]  # known numbers the equations use
    delay: str  # name of the parameter that delays the input, or ""
    lag: str  # name of the time constant of the input's first-order lag, or ""
    drive: sp.Expr  # the commanded input through the input maps, before the lag
    regressor: Regressor
    absent: tuple[float, ...]  # value of each fitted parameter while its effect is absent
    relations: Relations | None = None  # found for the library
    hystereses: tuple[Hysteresis, ...] = ()
    sensor_delay: str = ""  # name of the parameter that delays sensors, or ""
    delayed_channels: tuple[str, ...] = ()  # channels that it delays
    event_times: tuple[str, ...] = ()  # names of the parameters that are times at which something begins or ends

    @property
    def states(self) -> tuple[sp.Symbol, ...]:
        """Coordinates, then their rates."""
        return tuple(c.q for c in self.plant.coordinates) + tuple(c.dq for c in self.plant.coordinates)

    @property
    def added_states(self) -> tuple[sp.Symbol, ...]:
        """States beside coordinates and rates: internal coordinates with their rates, then hysteresis forces."""
        free = self.plant.moving[len(self.plant.coordinates) :]
        return (*(s for c in free for s in (c.q, c.dq)), *(m.force for m in self.hystereses))

    @property
    def parameters(self) -> tuple[str, ...]:
        """Names in the order of the parameter vector of the generated code."""
        return tuple(p.name for p in self.fitted) + tuple(c.name for c in self.constants)
