"""The library's model: a plant with every effect that it may have."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from derive import effects, plants
from derive.algebra import jacobian
from derive.effects import Deformation, InnerForce, InnerPlay
from derive.equivalence import relations
from derive.grouping import NotExpressibleError
from derive.model import compose, freed, group_and_deform, load_in
from derive.records import Model


def library_model(plant: str, assumptions: dict, own: Sequence[str] = (), free: Sequence[str] = ()) -> Model:
    """The model with every effect that the plant and its assumptions allow, and a missing force on each row.

    ``own`` are names of a user's registered effects. Effects that free something inside the machine cannot be absent
    while it is free: only those are in it that free what is named in ``free``.

    Effects that are part of the plant's own parameters are left out, and named among the relations.
    """
    settled = plants.settle(plant, assumptions)
    fitting = effects.possible_on(plants.build(plant, settled).plant_signature, own)
    possible = [e for e in fitting if (not e.frees or e.frees in free) and derivable(plant, settled, e)]
    found = relations(plant, settled, [e.name for e in possible])
    chosen = [e.name for e in possible if e.full_names[0] not in found.absorbed]
    return replace(compose(plant, settled, chosen, missing_force=True), relations=found)


def derivable(plant: str, assumptions: dict, effect: effects.Effect) -> bool:
    """Whether an effect can be written with the plant's parameters and constants under these assumptions."""
    if not isinstance(effect.enters, Deformation | InnerForce | InnerPlay):
        return True
    settled = plants.settle(plant, assumptions)
    machine = plants.build(plant, settled, freed((effect,)))
    try:
        grouping, rows = group_and_deform(machine, settled, (effects.suited(effect, machine.plant_signature),))
        load_in(machine, grouping, machine.input)
    except NotExpressibleError:
        return False
    return jacobian(rows, [c.ddq for c in machine.moving]).det() != 0  # a give without inertia is none
