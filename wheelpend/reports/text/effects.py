"""The library of effects as text and as JSON."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import derive
from derive.effects import Effect
from wheelpend.errors import Failure
from wheelpend.reports.text.table import Table, TextBlocks

if TYPE_CHECKING:
    from wheelpend.model.record import Model

EFFECT_COLUMNS = ("effect", "what it is", "parameters", "law")


def listed_effects(model: Model | None, name: str | None) -> list[Effect]:
    """The effects that a model's plant may have, in its units, or all; only the named one where there is a name.

    Raises Failure for an unknown name.
    """
    effects = derive.effects
    known = effects.all_with() if model is None else effects.applicable_to(model.plant_signature, model.own)
    try:
        rows = [effects.find(name)] if name else list(known)
    except KeyError as error:
        raise Failure(error.args[0]) from None
    return rows if model is None else [effects.in_plant_units(row, model.plant_signature) for row in rows]


def effect_json(effect: Effect) -> dict[str, Any]:
    """An effect as a dict of JSON."""
    return {
        "effect": effect.name,
        "family": effect.family,
        "sentence": effect.sentence,
        "equation": effect.equation,
        "means": effect.means,
        "parameters": [{"name": p.name, "unit": p.unit, "scope": effect.scope_of(p)} for p in effect.parameters],
    }


def _effect_cells(effect: Effect) -> tuple[str, ...]:
    units = ", ".join(f"{p.name} [{p.unit}]" for p in effect.parameters)
    return effect.name, effect.sentence, units, effect.equation


def effects_text(effects: Sequence[Effect], *, in_detail: bool) -> TextBlocks:
    """A table of effects for each family; in detail also what the first means for the machine."""
    for family in dict.fromkeys(e.family for e in effects):
        rows = [_effect_cells(e) for e in effects if e.family == family]
        yield Table(f"Effects of the family {family}", EFFECT_COLUMNS, rows, holds_text=True)
    if in_detail and effects[0].means:
        yield effects[0].means
