"""The laws of the effects on a plant: input map, generalised forces, dry surfaces, hysteresis, sensor maps.

Forces enter by virtual work on their ports. A resistance opposes the motion of its port: Q = −law · ∂port/∂q.
"""

from __future__ import annotations

from collections.abc import Mapping

import sympy as sp

from derive.algebra import derivative, expand, substitute
from derive.effects import (
    DryForce,
    Effect,
    Force,
    HysteresisForce,
    InputMap,
    InternalForce,
    InternalPlay,
    SensorFilter,
    SensorMap,
)
from derive.functions import INPUT_SYMBOL, LOAD_SYMBOL, TIME_SYMBOL, Magnitude, Ramp, Sign, symbol
from derive.grouping import Grouping, rewrite
from derive.records import Coordinate, DrySurface, Hysteresis, Plant


def input_map(plant: Plant, chosen: tuple[Effect, ...]) -> sp.Expr:
    """The voltage that reaches the motor, as the actuator effects make it from the commanded one."""
    voltage: sp.Expr = plant.input
    for effect in chosen:
        if isinstance(effect.enters, InputMap):
            voltage = effect.enters.law(voltage, TIME_SYMBOL, **effect.symbols)
    return voltage


def input_substitution(plant: Plant, acting: sp.Expr) -> dict[sp.Symbol, sp.Expr]:
    """Acting value of each input: the law that acts on the first, applied to every one."""
    return {u: acting.subs(plant.input, u) for u in plant.inputs}


def motor_load_by_port(plant: Plant, grouping: Grouping, acting: sp.Expr) -> dict[str, sp.Expr]:
    """Load of the motor on each port: the plant's own loads on it, in volt-equivalents, under the acting input."""
    carried = {p.name: [load.force for load in plant.loads if load.port == p.name] for p in plant.ports}
    scaled = [expand(sp.Add(*f).subs(plant.substitutions) / plant.scale) for f in carried.values()]
    return {
        name: substitute(
            rewrite(plant, (force,), grouping.definitions, grouping.names)[0], input_substitution(plant, acting)
        )
        for name, force in zip(carried, scaled, strict=True)
    }


def generalised_forces(plant: Plant, chosen: tuple[Effect, ...]) -> list[sp.Expr]:
    """Generalised forces of the effects on each row, by virtual work on their ports."""
    resistances = [(internal.q, internal_force_law(internal, name, chosen)) for name, internal in plant.internal.items()
                   if name in plant.free]  # fmt: skip
    for effect in chosen:
        if isinstance(effect.enters, Force):
            angle = plant.port(effect.enters.port).coordinate
            law = sp.sympify(effect.enters.law(angle, rate_of(angle, plant), **effect.symbols))
            resistances.append((angle, law.subs(INPUT_SYMBOL, plant.input)))
        elif isinstance(effect.enters, HysteresisForce):
            resistances.append((plant.port(effect.enters.port).coordinate, hysteresis_symbol(effect)))
    return [
        -sp.Add(*(f * along for angle, f in resistances if (along := derivative(angle, c.q)))) for c in plant.moving
    ]


def internal_force_law(internal: Coordinate, name: str, chosen: tuple[Effect, ...]) -> sp.Expr:
    """Resistance along an internal coordinate: the effects' laws, beyond the free play where there is one."""
    laws = [(e.enters.law, e.symbols) for e in chosen if isinstance(e.enters, InternalForce) and e.releases == name]
    beyond = internal.q
    for effect in chosen:
        if isinstance(effect.enters, InternalPlay) and effect.releases == name:
            laws = laws or [(effect.enters.contact, {})]
            beyond = Sign(internal.q) * Ramp(Magnitude(internal.q) - effect.enters.width(**effect.symbols) / 2)
    return sp.Add(*(law(beyond, internal.dq, **parameters) for law, parameters in laws))


def hysteresis_symbol(effect: Effect) -> sp.Symbol:
    """Symbol of an effect's hysteresis force, which is a state."""
    return symbol(f"{effect.name}_force")


def hysteresis_forces(plant: Plant, chosen: tuple[Effect, ...]) -> tuple[Hysteresis, ...]:
    """The hysteresis forces, each with its law along a path of slip."""
    found = []
    for effect in chosen:
        if isinstance(effect.enters, HysteresisForce):
            before, path = symbol(f"{effect.name}_before"), symbol(f"{effect.name}_path")
            law = effect.enters.law(before, path, **effect.symbols)
            found.append(Hysteresis(hysteresis_symbol(effect), before, path, law, slip_row(plant, effect.enters.port)))
    return tuple(found)


def dry_surfaces(
    plant: Plant, chosen: tuple[Effect, ...], loads: Mapping[str, sp.Expr] | None = None
) -> tuple[DrySurface, ...]:
    """Ports with dry friction, each with the sum of the laws that act there.

    A law may depend on the motor's load on its port, given by ``loads``; without them that load is the input.
    """
    laws: dict[str, sp.Expr] = {}
    for effect in chosen:
        if isinstance(effect.enters, DryForce):
            port = effect.enters.port
            speed = rate_of(plant.port(port).coordinate, plant)
            law = sp.sympify(effect.enters.law(direction_of(port), speed, **effect.symbols))
            law = law.subs(LOAD_SYMBOL, (loads or {}).get(port, plant.input))
            laws[port] = laws.get(port, sp.Integer(0)) + law
    return tuple(DrySurface(port, slip_row(plant, port), law, direction_of(port)) for port, law in laws.items())


def direction_of(port: str) -> sp.Symbol:
    """Symbol of the direction in which a port slips."""
    return symbol(f"direction_{port}")


def slip_row(plant: Plant, port: str) -> tuple[float, ...]:
    """Slip speed of a port as constant weights on the coordinates' rates."""
    weights = tuple(derivative(plant.port(port).coordinate, c.q) for c in plant.moving)
    if any(w.free_symbols for w in weights):
        raise ValueError(f"Dry friction needs a port whose angle is linear in the coordinates; {port} is not")
    return tuple(float(w) for w in weights)


def rate_of(angle: sp.Expr, plant: Plant) -> sp.Expr:
    """Time derivative of a function of the coordinates."""
    return sp.Add(*(derivative(angle, c.q) * c.dq for c in plant.moving))


def sensor_maps(plant: Plant, chosen: tuple[Effect, ...]) -> tuple[sp.Expr, ...]:
    """Readings of the sensors: the true motion through the sensor effects' maps, one after the other."""
    readings = {c.name: c.reading for c in plant.channels}
    for effect in chosen:
        if isinstance(effect.enters, SensorMap):
            channel = plant.plant_signature.channel_of(effect.enters.channel, effect.enters.kind)
            readings[channel] = effect.enters.law(readings[channel], **effect.symbols)
        elif isinstance(effect.enters, SensorFilter):
            channel, state = effect.enters.channel, plant.internal[effect.releases].dq
            speed = plant.coordinates[0].dq
            readings[channel] = effect.enters.law(readings[channel], speed, state, **effect.symbols)
    return tuple(readings.values())


def filter_rows(plant: Plant, chosen: tuple[Effect, ...]) -> dict[int, sp.Expr]:
    """The row of each internal coordinate whose rate is a sensor's filter, by its place among those that move."""
    found = {}
    for effect in chosen:
        if isinstance(effect.enters, SensorFilter):
            state = plant.internal[effect.releases]
            place = [c.q for c in plant.moving].index(state.q)
            found[place] = state.ddq - effect.enters.follows(plant.coordinates[0].dq, state.dq, **effect.symbols)
    return found
