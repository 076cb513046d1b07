"""The library of physical effects: one row each, grouped by family."""

from __future__ import annotations

from collections.abc import Sequence

from derive.effects import actuator, body, drive, ground, joint, sensor, suit
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
from derive.effects.suit import fits, joined, possible
from derive.plant_signature import Nameplate

LIBRARY: dict[str, Effect] = {
    row.name: row
    for rows in (drive.ROWS, joint.ROWS, ground.ROWS, body.ROWS, actuator.ROWS, sensor.ROWS)
    for row in rows
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


def suited(effect: Effect, plant: Nameplate) -> Effect:
    """A row as it reads on a plant; a user's own is in the plant's units already."""
    return effect if OWN.get(effect.name) is effect else suit.suited(effect, plant)


def possible_on(plant: Nameplate, own: Sequence[str] = ()) -> tuple[Effect, ...]:
    """Effects that make sense on a plant: it has the port, the deformation or the channel they act on."""
    return possible(all_with(own), plant)


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
    "joined",
    "possible_on",
    "register",
    "suited",
]
