"""The library of physical effects: one row each, grouped by family."""

from __future__ import annotations

from collections.abc import Sequence

from derive.effects import actuator, body, drive, ground, sensor
from derive.effects.row import (
    INPUT,
    Deformation,
    DryForce,
    Effect,
    EffectParameter,
    Force,
    InnerForce,
    InnerPlay,
    InputDelay,
    InputLag,
    InputMap,
    Onset,
    PathForce,
    Quantiles,
    Ripple,
    SensorDelay,
    SensorMap,
    Values,
)

LIBRARY: dict[str, Effect] = {
    row.name: row for rows in (drive.ROWS, ground.ROWS, body.ROWS, actuator.ROWS, sensor.ROWS) for row in rows
}


OWN: dict[str, Effect] = {}  # effects that users wrote; of one name the latest


def register(rows: Sequence[Effect]) -> tuple[str, ...]:
    """Make a user's effects known to ``find``, in place of earlier ones of their names; returns the names."""
    OWN.update((row.name, row) for row in rows)
    return tuple(row.name for row in rows)


def find(name: str) -> Effect:
    """Return the effect of that name; raises KeyError naming the known effects."""
    if name not in LIBRARY and name not in OWN:
        raise KeyError(f"No effect named '{name}'. Known effects: {', '.join(sorted(LIBRARY))}")
    return LIBRARY[name] if name in LIBRARY else OWN[name]


def all_with(own: Sequence[str] = ()) -> tuple[Effect, ...]:
    """The library's effects, then a user's own."""
    return (*LIBRARY.values(), *map(find, own))


def possible_on(plant, own: Sequence[str] = ()) -> tuple[Effect, ...]:
    """Effects that make sense on a plant: it has the port, the deformation or the channel they act on."""
    return tuple(e for e in all_with(own) if fits(e, plant))


def fits(effect: Effect, plant) -> bool:
    """Whether a plant has the part that an effect acts on."""
    match effect.enters:
        case Force(port=port) | DryForce(port=port) | PathForce(port=port):
            return any(p.name == port for p in plant.ports)
        case Deformation(symbol=name):
            return name in plant.geometry
        case InnerForce(coordinate=name) | InnerPlay(coordinate=name):
            return name in plant.inner
        case SensorDelay(channels=channels):
            return {c.name for c in plant.channels} >= set(channels)
        case SensorMap(channel=channel):
            return any(c.name == channel for c in plant.channels)
    return True


__all__ = [
    "INPUT",
    "LIBRARY",
    "Deformation",
    "DryForce",
    "Effect",
    "EffectParameter",
    "Force",
    "InnerForce",
    "InnerPlay",
    "InputDelay",
    "InputLag",
    "InputMap",
    "Onset",
    "PathForce",
    "Quantiles",
    "Ripple",
    "SensorDelay",
    "SensorMap",
    "Values",
    "all_with",
    "find",
    "fits",
    "possible_on",
    "register",
]
