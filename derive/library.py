"""The library's model: a plant with every applicable effect."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from derive import effects, plants
from derive.algebra import jacobian
from derive.base_equations import group_and_deform
from derive.effect_laws import motor_load_by_port
from derive.effects import Deformation, InternalForce, InternalPlay
from derive.equivalence import relations
from derive.grouping import NotExpressibleError
from derive.model import compose, released_coordinates
from derive.records import Model


def library_model(plant: str, assumptions: dict, own: Sequence[str] = (), free: Sequence[str] = ()) -> Model:
    """The model with every effect that the plant and its assumptions allow, and a missing force on each row.

    ``own`` are names of a user's registered effects. Effects that release an internal coordinate cannot be
    absent while it is released: only those are in it whose coordinate is named in ``free``.

    Effects that are part of the plant's own parameters are left out, and named among the relations.
    """
    complete = plants.complete_assumptions(plant, assumptions)
    fitting = effects.applicable_to(plants.build(plant, complete).plant_signature, own)
    possible = [e for e in fitting if (not e.releases or e.releases in free) and is_derivable(plant, complete, e)]
    found = relations(plant, complete, [e.name for e in possible])
    chosen = [e.name for e in possible if e.full_names[0] not in found.absorbed]
    return replace(compose(plant, complete, chosen, missing_force=True), relations=found)


def is_derivable(plant: str, assumptions: dict, effect: effects.Effect) -> bool:
    """True where an effect can be written with the plant's parameters and constants under these assumptions."""
    if not isinstance(effect.enters, Deformation | InternalForce | InternalPlay):
        return True
    complete = plants.complete_assumptions(plant, assumptions)
    machine = plants.build(plant, complete, released_coordinates((effect,)))
    try:
        grouping, rows = group_and_deform(machine, complete, (effects.in_plant_units(effect, machine.plant_signature),))
        motor_load_by_port(machine, grouping, machine.input)
    except NotExpressibleError:
        return False
    return jacobian(rows, [c.ddq for c in machine.moving]).det() != 0  # a coordinate without inertia is none
