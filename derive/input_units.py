"""The input of a plant in the unit in which its actuator is commanded: a voltage, a current, a torque or a force.

A plant's file states one unit. Where the machine is commanded otherwise the equations keep their form: the constant by
which they are divided has another unit, or is 1 by definition where the input is itself the force on the first
coordinate. A motor that is commanded no voltage has no back-EMF; what the file calls that is viscous friction of the
drive.
"""

from __future__ import annotations

import re
from dataclasses import replace

from derive.lazy import sp
from derive.plant_signature import INPUT_WORDS, Parameter
from derive.records import Assumption, Plant

INPUT_UNIT = "input_unit"  # beside the assumptions, where it differs from what the plant's file states
UNIT_WORDS = {"V": "volt", "A": "ampere", "N m": "newton metre", "N": "newton"}
INPUT_UNIT_CHOICE = Assumption(INPUT_UNIT, "V", tuple(UNIT_WORDS), "Unit of the input.", section="input")
FORCE_UNITS = {"rad": "N m", "m": "N"}  # along an angle, along a length
DRIVE_FRICTIONS = {"K_b": "f_d", "K_2": "f_2"}  # by letter of a motor's back-EMF [V s/rad]: what stands there else


def with_input_unit(plant: Plant, unit: str) -> Plant:
    """The plant with its input in another unit; raises ValueError where its equations have no constant for that."""
    if unit == plant.input_unit:
        return plant
    physical = FORCE_UNITS[plant.coordinates[0].unit]
    direct = unit == physical
    if not (direct or isinstance(plant.scale, sp.Symbol)):
        raise ValueError(
            f"the input of {plant.name} is in {plant.input_unit}: its equations have no constant per {unit}"
        )
    scale = sp.Integer(1) if direct else plant.scale
    values = {plant.scale: scale} if direct else {}
    if plant.input_unit == "V":
        frictions = {a: sp.Symbol(b, positive=True) for a, b in DRIVE_FRICTIONS.items()}
        values |= {sp.Symbol(a, positive=True): b / scale for a, b in frictions.items()}
    words = (INPUT_WORDS[plant.input_unit], INPUT_WORDS[unit])
    return replace(
        plant,
        input_unit=unit,
        scale=scale,
        loads=tuple(load._replace(force=sp.sympify(load.force).subs(values)) for load in plant.loads),
        substitutions={letter: sp.sympify(e).subs(values) for letter, e in plant.substitutions.items()},
        constants=tuple(constants_per_unit(plant, unit, physical, direct)),
        words=plant.words._replace(input=""),
        usual_limits=plant.usual_limits and (plant.usual_limits[0], 0.0),
        reversals=tuple(r._replace(instruction=r.instruction.replace(*words)) for r in plant.reversals),
    )


def constants_per_unit(plant: Plant, unit: str, physical: str, direct: bool) -> list[Parameter]:
    """The known constants; that by which the equations are divided per the new unit, or left out where it is 1."""
    others = [c for c in plant.constants if c.name != str(plant.scale)]
    scale = [c for c in plant.constants if c.name == str(plant.scale) and not direct]
    per = f"({unit})" if " " in unit else unit
    old, new = rf"\b{UNIT_WORDS.get(plant.input_unit, plant.input_unit)}\b", UNIT_WORDS[unit]
    return [
        *(c._replace(unit=f"{physical}/{per}", sentence=re.sub(old, new, c.sentence)) for c in scale),
        *others,
    ]
