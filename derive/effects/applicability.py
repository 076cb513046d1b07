"""Applicability of effects to a plant, and their numbers in its units: its input's, and its lengths.

The rows of the library are written in V and rad. On a part that moves along a length, or in a machine whose input is
not a voltage, the same law has other units, and starting values and bounds in rad become lengths.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace

from derive.effects.row import (
    Deformation,
    DryForce,
    Effect,
    EffectParameter,
    Force,
    HysteresisForce,
    InputDelay,
    InputLag,
    InputMap,
    InternalForce,
    InternalPlay,
    SensorDelay,
    SensorFilter,
    SensorMap,
    Values,
)
from derive.plant_signature import PlantSignature, combination_text

ANGLE_UNIT_PATTERN = re.compile(r"rad([²³]?)")
EXPONENT_OF_SUPERSCRIPT = {"": 1, "²": 2, "³": 3}


def is_applicable(effect: Effect, plant: PlantSignature) -> bool:
    """True where a plant has the port, geometry, coordinate, input or channel that an effect acts on."""
    match effect.enters:
        case DryForce(port=port, loaded=True) | Force(port=port, follows_input=True) if port not in plant.driven_ports:
            return False
        case Force(port=port) | DryForce(port=port) | HysteresisForce(port=port) if (
            effect.needs_motor and port not in plant.driven_ports
        ):
            return False
        case Force(follows_input=True) if plant.input_unit != "V" or plant.further:
            return False  # what is commanded a current is no PWM's; several have an input each
        case Force(port=port) | DryForce(port=port) | HysteresisForce(port=port):
            return any(p.name == port for p in plant.ports)
        case Deformation(symbol=name):
            return name in plant.geometry
        case InternalForce(coordinate=name) | InternalPlay(coordinate=name):
            return name in plant.internal
        case InputLag():
            return plant.driven and not plant.further  # of several inputs each would lag by itself
        case InputMap() | InputDelay():
            return plant.driven
        case SensorDelay(channels=channels):
            return {c.name for c in plant.channels} >= set(channels)
        case SensorFilter(channel=channel, coordinate=name):
            return name in plant.internal and any(c.name == channel for c in plant.channels)
        case SensorMap(channel=channel, kind=kind):
            return bool(plant.channel_of(channel, kind))
    raise TypeError(f"{effect.name} enters in a way that no plant knows: {effect.enters}")


def in_plant_units(effect: Effect, plant: PlantSignature) -> Effect:
    """The row as it reads on a plant: units of its input and of the part's motion, numbers in those."""
    unit, length = motion_unit(effect, plant)
    force = (
        plant.force_unit(unit) if isinstance(effect.enters, Force | DryForce | HysteresisForce) else plant.input_unit
    )
    if unit == "rad" and length == 1.0 and force == "V":
        return effect
    return replace(effect, parameters=tuple(_parameter_in_units(p, unit, length, force) for p in effect.parameters))


WORDS_OF_ROWS = ("robot", "pitch", "voltage")  # machine, what is controlled, input: words in which the rows are written
ROWS_SLIP = "θw − θp"  # the motion of their drive
ROWS_GYRO_READING = "θ̇p"  # what their gyro reads
ROWS_COORDINATE, ROWS_SYMBOLS = "theta_w", ("Q_w", "θw")  # their first coordinate; its force and itself in equations


def in_plant_words(effect: Effect, plant: PlantSignature) -> Effect:
    """The row in words that fit a plant: its machine, what is controlled, its input and its coordinate."""
    effect = on_plant_channel(effect, plant)
    if not plant.driven and all(effect.undriven):
        effect = replace(effect, sentence=effect.undriven[0], means=effect.undriven[1])
    first, own = plant.coordinates[0].name, (plant.words.machine, plant.controlled_word, plant.input_word)
    words = dict(zip(WORDS_OF_ROWS, own, strict=True))
    words |= dict(zip(ROWS_SYMBOLS, ROWS_SYMBOLS if first == ROWS_COORDINATE else ("Q", first), strict=True))
    if all(word == fitting for word, fitting in words.items()):
        return effect
    pattern = re.compile(r"\b(" + "|".join(words) + r")(?=s?\b)")
    sentence, means, equation = (
        pattern.sub(lambda m: words[m[0]], text)
        for text in (effect.sentence, effect.means, effect.equation.replace(ROWS_SLIP, port_motion_text(effect, plant)))
    )
    return replace(effect, sentence=sentence, means=means, equation=equation)


def on_plant_channel(effect: Effect, plant: PlantSignature) -> Effect:
    """The row of a sensor on the channel that it acts on, whose name then stands in its equation."""
    if not isinstance(effect.enters, SensorMap):
        return effect
    channel = plant.channel_of(effect.enters.channel, effect.enters.kind)
    if channel in ("", effect.enters.channel):
        return effect
    equation = effect.equation.replace(ROWS_GYRO_READING, channel)
    return replace(effect, equation=equation, enters=effect.enters._replace(channel=channel))


def port_motion_text(effect: Effect, plant: PlantSignature) -> str:
    """Motion of the port that an effect acts on, in the plant's coordinates; as in the rows on the first plant."""
    names = [c.name for c in plant.coordinates]
    match effect.enters:
        case Force(port=name) | DryForce(port=name) | HysteresisForce(port=name) if names[0] != ROWS_COORDINATE:
            return combination_text(names, plant.port(name).weights)
    return ROWS_SLIP


def motion_unit(effect: Effect, plant: PlantSignature) -> tuple[str, float]:
    """Unit of the motion in an effect's law, and the length per radian along it (1 for an angle)."""
    match effect.enters:
        case Force(port=name) | DryForce(port=name) | HysteresisForce(port=name):
            if is_applicable(effect, plant):
                port = plant.port(name)
                return port.unit, port.length_per_radian
    return "rad", 1.0


def _parameter_in_units(p: EffectParameter, unit: str, length: float, force: str) -> EffectParameter:
    factor = length ** angle_exponent(p.unit)
    starts = Values(tuple(v * factor for v in p.starts.at)) if isinstance(p.starts, Values) else p.starts
    return p._replace(
        unit=plant_unit(p.unit, unit, force), minimum=p.minimum * factor, maximum=p.maximum * factor, starts=starts,
        grid=tuple(v * factor for v in p.grid), typical=p.typical * factor, absent=p.absent * factor,
    )  # fmt: skip


def angle_exponent(unit: str) -> int:
    """The power of rad in a unit such as V s²/rad²; a turn is an angle too."""
    above, _, below = unit.replace("turn", "rad").partition("/")
    return _exponent(above) - _exponent(below)


def _exponent(part: str) -> int:
    found = ANGLE_UNIT_PATTERN.search(part)
    return EXPONENT_OF_SUPERSCRIPT[found[1]] if found else 0


def plant_unit(unit: str, motion: str, force: str) -> str:
    """A unit of the library with the plant's own: V s/rad becomes V s/m on a carriage."""
    if motion != "rad":
        unit = f"rad/{motion}" if unit == "1/turn" else ANGLE_UNIT_PATTERN.sub(lambda found: motion + found[1], unit)
    if force == "V" or not re.match(r"V\b", unit):
        return unit
    return unit_product(force, unit[1:].lstrip())


def unit_product(force: str, rest: str) -> str:
    """A force's unit times another one; a force that is a plain number leaves no trace."""
    if force != "1":
        return f"{force}{'' if rest.startswith('/') else ' '}{rest}".strip()
    return f"1{rest}" if rest.startswith("/") else rest or "1"


def applicable_effects(rows: Sequence[Effect], plant: PlantSignature) -> tuple[Effect, ...]:
    """Effects that make sense on a plant: it has the port, the deformation or the channel they act on."""
    return tuple(e for e in rows if is_applicable(e, plant))
