"""The library of physical effects: one row each, grouped by family."""

from __future__ import annotations

from collections.abc import Sequence

from derive.effects import actuator, applicability, body, drive, ground, joint, sensor
from derive.effects.applicability import applicable_effects, is_applicable, unit_product
from derive.effects.row import (
    INPUT_SIGNAL,
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
    Onset,
    Quantiles,
    Ripple,
    SensorDelay,
    SensorFilter,
    SensorMap,
    Values,
)
from derive.plant_signature import PlantSignature

EFFECT_LIBRARY: dict[str, Effect] = {
    row.name: row
    for rows in (
        drive.EFFECT_ROWS,
        joint.EFFECT_ROWS,
        ground.EFFECT_ROWS,
        body.EFFECT_ROWS,
        actuator.EFFECT_ROWS,
        sensor.EFFECT_ROWS,
    )
    for row in rows
}


INPUT_MEMORY_S = max(row.input_memory for row in EFFECT_LIBRARY.values())  # s, the longest that any of them has
USER_EFFECTS: dict[str, Effect] = {}  # effects that users wrote; of one name the latest


def register(rows: Sequence[Effect]) -> tuple[str, ...]:
    """Make a user's effects known to ``find``, in place of earlier ones of their names; returns the names."""
    USER_EFFECTS.update((row.name, row) for row in rows)
    return tuple(row.name for row in rows)


def find(name: str) -> Effect:
    """Return the effect of that name; raises KeyError naming the known effects."""
    if name not in EFFECT_LIBRARY and name not in USER_EFFECTS:
        raise KeyError(f"No effect named '{name}'. Known effects: {', '.join(sorted(EFFECT_LIBRARY))}")
    return EFFECT_LIBRARY[name] if name in EFFECT_LIBRARY else USER_EFFECTS[name]


def all_with(own: Sequence[str] = ()) -> tuple[Effect, ...]:
    """The library's effects, then a user's own."""
    return (*EFFECT_LIBRARY.values(), *map(find, own))


def in_plant_units(effect: Effect, plant: PlantSignature) -> Effect:
    """A row in a plant's units and words; a user's own has them already."""
    if USER_EFFECTS.get(effect.name) is effect:
        return effect
    return applicability.in_plant_words(applicability.in_plant_units(effect, plant), plant)


def applicable_to(plant: PlantSignature, own: Sequence[str] = ()) -> tuple[Effect, ...]:
    """Effects that make sense on a plant: it has the port, the deformation or the channel they act on."""
    return applicable_effects(all_with(own), plant)


__all__ = [
    "EFFECT_LIBRARY",
    "INPUT_SIGNAL",
    "Deformation",
    "DryForce",
    "Effect",
    "EffectParameter",
    "Force",
    "HysteresisForce",
    "InputDelay",
    "InputLag",
    "InputMap",
    "InternalForce",
    "InternalPlay",
    "Onset",
    "Quantiles",
    "Ripple",
    "SensorDelay",
    "SensorFilter",
    "SensorMap",
    "Values",
    "all_with",
    "applicable_to",
    "find",
    "in_plant_units",
    "is_applicable",
    "register",
    "unit_product",
]
