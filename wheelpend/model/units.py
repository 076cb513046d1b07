"""Units of a plant's states, channels and generalised forces, for texts and pictures."""

from __future__ import annotations

import re
from dataclasses import dataclass, field

from derive import effects
from derive.parameter_name import effect_of, full_name
from derive.plant_signature import WORDS_FOR_ANY, PlantSignature, PlantWords
from wheelpend.model.record import Model

NAME_PATTERN = re.compile(r"[A-Za-z_]\w*")


@dataclass(frozen=True)
class PlantUnits:
    """Units of a plant, and the physical force per unit of its input where that is known."""

    units: dict[str, str]  # of time, input, coordinates, rates and channels, by name
    force: str  # unit of a generalised force, V for one in volt-equivalents
    force_per_unit: float | None = None  # N m, or N, per unit of `force`
    physical: str = ""  # N·m or N
    forces: dict[str, str] = field(default_factory=dict)  # units of the forces on rows, and between parts by their port
    input_word: str = ""  # what the input is: voltage
    inputs: tuple[str, ...] = ()
    words: PlantWords = WORDS_FOR_ANY

    def force_on(self, row: str) -> str:
        """Unit of a force on a row, or between two parts."""
        return self.forces.get(row, self.force)

    def unit(self, name: str) -> str:
        """Unit of a quantity, or of a sum of some: dtheta_w - dtheta_p."""
        first = NAME_PATTERN.search(name)
        return self.units.get(first[0], "") if first else ""

    def in_physical(self, value: float, unit: str) -> tuple[float, str] | None:
        """A coefficient in N m, or N, with its unit; None where it is no force or the conversion is not known."""
        if self.force_per_unit is None or not re.match(rf"{re.escape(self.force)}(?!\w)", unit):
            return None
        return value * self.force_per_unit, self.physical + unit[len(self.force) :]


def plant_units_of(model: Model) -> PlantUnits:
    """Units of a model's plant, with the physical force per unit of input that its constants give."""
    plant = model.plant_signature
    scale = plant.scale_constant
    force_per_unit = model.constants.get(scale.name) if scale else None
    physical = scale.unit.partition("/")[0].replace(" ", "·") if scale else ""
    forces = {c.row: plant.force_unit(c.unit) for c in plant.coordinates}
    forces |= {name: plant.force_unit(port.unit) for name, port in plant.couplings.items()}
    return PlantUnits(
        units_of(plant), plant.input_unit, force_per_unit, physical, forces, plant.input_word, plant.inputs, plant.words
    )


def units_of(plant: PlantSignature) -> dict[str, str]:
    """Units of time, inputs, coordinates, rates, accelerations and channels of a plant, by name."""
    units = {"t": "s", **dict.fromkeys(plant.inputs, plant.input_unit)}
    for c in plant.coordinates:
        units |= {c.q: c.unit, c.dq: f"{c.unit}/s", c.ddq: f"{c.unit}/s²"}
    return units | {c.name: c.unit for c in plant.channels}


def effect_unit(model: Model, name: str) -> str:
    """Unit of an effect's parameter, by effect.parameter; nothing of another."""
    effect = effect_of(name)
    if not effect:
        return ""
    row = effects.in_plant_units(effects.find(effect), model.plant_signature)
    return next((p.unit for p in row.parameters if full_name(effect, p.name) == name), "")
