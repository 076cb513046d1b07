"""Names of parameters as text: X1 of a plant, coulomb_drive.torque of an effect. They are made and read here alone."""

from __future__ import annotations

from typing import NamedTuple

MISSING_FORCE = "missing"  # in an effect's place in the names of unknown forces, missing.<row>; no effect is called so
SEPARATOR = "."  # between effect and parameter


class ParameterName(NamedTuple):
    """A parameter's name in its parts."""

    effect: str  # "" for a plant's own parameters and constants
    parameter: str

    @classmethod
    def parse(cls, text: str) -> ParameterName:
        """The parts of a name."""
        effect, _, parameter = text.rpartition(SEPARATOR)
        return cls(effect, parameter)

    def __str__(self) -> str:
        return f"{self.effect}{SEPARATOR}{self.parameter}" if self.effect else self.parameter


def full_name(effect: str, parameter: str) -> str:
    """Name of an effect's parameter in the parameter vector."""
    return str(ParameterName(effect, parameter))


def effect_of(name: str) -> str:
    """Effect that a parameter belongs to; "" for a plant's own parameters and constants."""
    return ParameterName.parse(name).effect


def short_name(name: str) -> str:
    """A parameter's name within its effect."""
    return ParameterName.parse(name).parameter
