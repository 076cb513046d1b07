"""The signature of a plant: coordinates, ports, channels, inputs and constants in names, units and numbers.

It is all that estimation and simulation need of a plant once its equations are derived; it holds no expressions and is
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
    """A plant under its assumptions, with no internal coordinate released."""

    name: str
    sentence: str
    coordinates: tuple[CoordinateSpec, ...]
    ports: tuple[PortSpec, ...]
    channels: tuple[ChannelSpec, ...]
    inputs: tuple[str, ...]  # in the order of their columns
    input_unit: str
    driven: bool  # True where an input acts; a plant that swings freely has one in name only
    constants: tuple[Parameter, ...]
    scale: str  # the constant that turns volt-equivalents into N m or N, where it is one
    geometry: tuple[str, ...]  # deformations that effects may use
    internal: tuple[str, ...]  # internal coordinates that effects may release
    controlled: tuple[str, str]
    reference: str
    range_channel: str

    @classmethod
    def from_json(cls, text: str) -> PlantSignature:
        """The signature that ``to_json`` has written."""
        found: dict[str, Any] = {name: tuple(v) if isinstance(v, list) else v for name, v in json.loads(text).items()}
        for name, kind in (("coordinates", CoordinateSpec), ("channels", ChannelSpec), ("constants", Parameter)):
            found[name] = tuple(kind(*row) for row in found[name])
        found["ports"] = tuple(PortSpec(*row)._replace(weights=tuple(row[-1])) for row in found["ports"])
        return cls(**found)

    def to_json(self) -> str:
        """The signature as JSON text."""
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
