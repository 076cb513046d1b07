"""Names of states and signals with Greek letters and dots, for axes and sentences."""

from __future__ import annotations

TYPESET_NAMES = (("ddtheta_", "θ̈"), ("dtheta_", "θ̇"), ("theta_", "θ"), ("v_in", "V"), (" - ", " − "))
AXIS_NAMES = {"v_in": "commanded voltage", "t": "time"}


def display_text(text: str) -> str:
    """An expression with Greek letters and dots: ddtheta_w becomes θ̈w."""
    for plain, shown in TYPESET_NAMES:
        text = text.replace(plain, shown)
    return text


def axis_name_text(name: str) -> str:
    """A state, the input or time, as an axis names it."""
    return AXIS_NAMES.get(name, display_text(name))
