"""Names of states and signals with Greek letters and dots, for axes and sentences."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from wheelpend.model.units import PlantUnits

TYPESET_NAMES = (("ddtheta_", "θ̈"), ("dtheta_", "θ̇"), ("theta_", "θ"), ("v_in", "V"), (" - ", " − "))


def display_text(text: str) -> str:
    """An expression with Greek letters and dots: ddtheta_w becomes θ̈w."""
    for plain, shown in TYPESET_NAMES:
        text = text.replace(plain, shown)
    return text


def axis_name_text(name: str, quantities: PlantUnits) -> str:
    """A state, the input or time, as an axis names it."""
    if name in quantities.inputs:
        return f"commanded {quantities.input_word}" + (f" {name}" if len(quantities.inputs) > 1 else "")
    return "time" if name == "t" else display_text(name)
