"""What a plant has, in names, units and numbers.

That is all of a plant that its users need once it has been derived. There are no expressions in it: it can be kept, and
read without SymPy.
"""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass
from typing import Any, NamedTuple


class CoordinateSpec(NamedTuple):
    """A generalised coordinate; its symbols by name."""

    name: str
    row: str  # name of its equation of motion
    unit: str  # rad or m
    q: str
    dq: str
    ddq: str


class PortSpec(NamedTuple):
    """A port: where a force does work."""

    name: str
    sentence: str
    unit: str  # of motion along it, rad or m
    length_per_radian: float  # motion that counts as one rad where a law's numbers are in rad
    weights: tuple[float, ...]  # motion along it as a combination of the coordinates


class ChannelSpec(NamedTuple):
    """A sensor's channel."""

    name: str
    unit: str


class Parameter(NamedTuple):
    """A number that is identified from data, or a known constant."""

    name: str
    unit: str
    sentence: str


@dataclass(frozen=True)
class PlantSignature:
    """A plant under its assumptions, with nothing inside it free."""

    name: str
    sentence: str
    coordinates: tuple[CoordinateSpec, ...]
    ports: tuple[PortSpec, ...]
    channels: tuple[ChannelSpec, ...]
    inputs: tuple[str, ...]  # in the order of their columns
    input_unit: str
    driven: bool  # whether an input acts; a plant that swings freely has one in name only
    constants: tuple[Parameter, ...]
    scale: str  # the constant that turns volt-equivalents into N m or N, where it is one
    geometry: tuple[str, ...]  # deformations that effects may use
    internal: tuple[str, ...]  # give inside the machine that effects may free
    controlled: tuple[str, str]
    reference: str
    range_channel: str

    @classmethod
    def from_json(cls, text: str) -> PlantSignature:
        """The nameplate whose JSON this is."""
        found: dict[str, Any] = {name: tuple(v) if isinstance(v, list) else v for name, v in json.loads(text).items()}
        for name, kind in (("coordinates", CoordinateSpec), ("channels", ChannelSpec), ("constants", Parameter)):
            found[name] = tuple(kind(*row) for row in found[name])
        found["ports"] = tuple(PortSpec(*row)._replace(weights=tuple(row[-1])) for row in found["ports"])
        return cls(**found)

    def to_json(self) -> str:
        """The nameplate as JSON."""
        return json.dumps(asdict(self), ensure_ascii=False, indent=1)

    @property
    def input(self) -> str:
        """The first input."""
        return self.inputs[0]

    @property
    def further(self) -> tuple[str, ...]:
        """Inputs beside the first."""
        return self.inputs[1:]

    @property
    def scale_constant(self) -> Parameter | None:
        """The known constant that turns volt-equivalents into N m or N, where the scale is one."""
        return next((c for c in self.constants if c.name == self.scale), None)

    def force_unit(self, along: str) -> str:
        """Unit of a generalised force along a coordinate in rad or m: that of the input, with a lever where need be."""
        own = self.coordinates[0].unit  # the scale turns forces along the first coordinate into those of the input
        lever = "" if along == own else " m" if own == "m" else "/m"
        return f"{self.input_unit}{lever}"

    def port(self, name: str) -> PortSpec:
        """Return the port of that name; raises KeyError with the known ones."""
        for port in self.ports:
            if port.name == name:
                return port
        raise KeyError(f"{self.name} has no port '{name}'; it has {', '.join(p.name for p in self.ports)}")
