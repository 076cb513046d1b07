"""The signature of a plant: coordinates, ports, channels, inputs and constants in names, units and numbers.

It is all that estimation and simulation need of a plant once its equations are derived; it holds no expressions and is
read without SymPy.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
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

    @property
    def place(self) -> str:
        """Where it is, in few words: between wheel and body."""
        return self.sentence.partition(",")[0]


class Sensor(NamedTuple):
    """The sensor of a channel, where more is known of it than what it reads."""

    noise: float = 0.0  # standard deviation [unit of the channel] where nobody states one; 0 where nothing is known
    step: float = 0.0  # the same of its quantisation
    noise_key: str = ""  # key of its noise in [sensors] and [simulation], beside [sensors.noise]
    counts_key: str = ""  # key of its counts per revolution in [sensors], beside [sensors.step]
    aliases: tuple[str, ...] = ()  # other names of its column in files
    finer: str = ""  # a sensor with a tenth of the noise, in words
    truer: str = ""  # one beside it that has none of its faults
    still: str = ""  # what its standing still means: "The wheel stands still"
    kind: str = ""  # GYRO, where the effects of one act on it whatever the name of its channel


GYRO = "gyro"  # kind of a sensor that reads a rate against the world


class ChannelSpec(NamedTuple):
    """A sensor's channel."""

    name: str
    unit: str
    rate_of: str = ""  # the channel whose derivative it reads, where there is one
    sensor: Sensor = Sensor()

    @property
    def finer(self) -> str:
        """A finer sensor in words."""
        return self.sensor.finer or f"a sensor of {self.name} with a tenth of the noise"

    @property
    def truer(self) -> str:
        """A second sensor in words, without the faults of the present one."""
        return self.sensor.truer or f"a second sensor of {self.name} that is known to be true"


class Reversal(NamedTuple):
    """A part that may be turned round between two logs: what belongs to it is then mirrored."""

    part: str  # "with the sensor turned round"
    instruction: str  # begins a sentence
    geometry: tuple[str, ...] = ()  # deformations that change their sign
    channels: tuple[str, ...] = ()  # channels whose sensor is turned
    input: bool = False  # True where the motors' leads are


LEADS = Reversal(
    "leads",
    "Swap the two leads of every motor, the input negated behind the controller but not in the log,",
    input=True,
)


class PlantWords(NamedTuple):
    """Words for a machine in sentences; those given here fit any."""

    machine: str = "machine"
    stay: str = "stay within its range"  # what it must do: "The robot must stay up"
    leaves: str = "leaves it"  # what it does instead: "but it falls"
    left: str = "left its range"  # what it did: "the robot fell over"
    failed: str = "left it"  # the same after what it must do: "must stay up, but it fell"
    strays: str = "leaves its range"  # what a simulation does: "it falls over"
    stands: str = "is within its range"  # "a stretch in which the robot stands"
    anywhere: str = ""  # how to say that it may leave its range: "set range = "any" in [assumptions]"
    works: str = "the motor works"  # a log in which something happens
    controlled: str = ""  # what is controlled; the channel's name where there is no word
    sensed: str = ""  # what its sensors read: "angle, pitch or rate"; the channels' names where there are no words
    travels: str = ""  # motion of the first coordinate that is not controlled: "wheels turn"
    input: str = ""  # what the input is; by its unit where there is no word

    def upright(self) -> PlantWords:
        """The words where it must stay up and its assumption ``range`` says so."""
        return self._replace(
            stay="stay up", leaves="falls", left="fell over", failed="fell", strays="falls over", stands="stands",
            anywhere='set range = "any" in [assumptions]',
        )  # fmt: skip


WORDS_FOR_ANY = PlantWords()
INPUT_WORDS = {"V": "voltage", "A": "current", "N m": "torque", "N": "force"}  # by unit


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
    words: PlantWords = WORDS_FOR_ANY
    usual_limits: tuple[float, float] | None = None  # of the range channel [rad] and of the input, in ordinary use
    reversals: tuple[Reversal, ...] = (LEADS,)
    wiring_check: str = ""  # check of the inspection that knows how such a machine is wired, beside those for any
    driven_ports: tuple[str, ...] = ()  # ports on which a motor acts
    pulled: bool = True  # True where gravity acts on it

    @classmethod
    def from_json(cls, text: str) -> PlantSignature:
        """The signature that ``to_json`` has written."""
        found: dict[str, Any] = {name: tuple(v) if isinstance(v, list) else v for name, v in json.loads(text).items()}
        for name, kind in (("coordinates", CoordinateSpec), ("constants", Parameter)):
            found[name] = tuple(kind(*row) for row in found[name])
        found["channels"] = tuple(_record(ChannelSpec, [*r[:-1], _record(Sensor, r[-1])]) for r in found["channels"])
        found["reversals"] = tuple(_record(Reversal, row) for row in found["reversals"])
        found["words"] = PlantWords(*found["words"])
        found["ports"] = tuple(PortSpec(*row)._replace(weights=tuple(row[-1])) for row in found["ports"])
        return cls(**found)

    def to_json(self) -> str:
        """The signature as JSON text."""
        return json.dumps(asdict(self), ensure_ascii=False, indent=1)

    def channel(self, name: str) -> ChannelSpec:
        """The channel of that name; one of which nothing is known where the plant has none."""
        return next((c for c in self.channels if c.name == name), ChannelSpec(name, ""))

    def channel_of(self, name: str, kind: str = "") -> str:
        """The channel of that name, else the first whose sensor is of the kind; empty where there is neither."""
        if any(c.name == name for c in self.channels):
            return name
        return next((c.name for c in self.channels if kind and c.sensor.kind == kind), "")

    @property
    def input_word(self) -> str:
        """What the input is, in a word; of a plant without one, what moves it."""
        undriven = "torque" if self.coordinates[0].unit == "rad" else "force"
        return self.words.input or (INPUT_WORDS.get(self.input_unit, self.input) if self.driven else undriven)

    @property
    def drive_words(self) -> str:
        """What a force is a share of, in words: what moves the machine, an input or, without one, all that acts."""
        return "the drive" if self.driven else "what acts on it"

    @property
    def inputs_phrase(self) -> str:
        """Inputs with their unit, in words: voltages in V."""
        word = INPUT_WORDS.get(self.input_unit)
        return f"{f'{word}s' if word else self.input} in {self.input_unit}"

    @property
    def controlled_word(self) -> str:
        """What is controlled, in a word: pitch."""
        return self.words.controlled or self.controlled[0] or self.range_channel

    @property
    def what_is_controlled(self) -> str:
        """The same within a sentence: the pitch."""
        return f"the {self.words.controlled}" if self.words.controlled else self.controlled_word

    @property
    def travel_words(self) -> str:
        """Motion of the first coordinate, in words: wheels turn."""
        return self.words.travels or f"{self.coordinates[0].name} moves"

    @property
    def force_phrase(self) -> str:
        """The unit of forces in the equations of motion, in words: in volts at the motor."""
        if self.input_unit == "1":
            return f"in units of {self.scale}"
        return {"V": "in volts at the motor", "A": "in amperes at the motor"}.get(
            self.input_unit, f"in {self.input_unit}"
        )

    @property
    def sensed_words(self) -> str:
        """What its sensors read, in words: angle, pitch or rate."""
        *some, last = (c.name for c in self.channels)
        return self.words.sensed or " or ".join([*([", ".join(some)] if some else []), last])

    @property
    def input(self) -> str:
        """The first input."""
        return self.inputs[0]

    @property
    def further(self) -> tuple[str, ...]:
        """Inputs beside the first."""
        return self.inputs[1:]

    @property
    def is_balanced(self) -> bool:
        """True of a plant with one input that is held upright: commands can be rehearsed and designed for it."""
        return bool(self.range_channel) and not self.further

    @property
    def scale_constant(self) -> Parameter | None:
        """The known constant that turns volt-equivalents into N m or N, where the scale is one."""
        return next((c for c in self.constants if c.name == self.scale), None)

    def force_unit(self, along: str) -> str:
        """Unit of a generalised force along a coordinate in rad or m: that of the input, with a lever where need be."""
        own = self.coordinates[0].unit  # the scale turns forces along the first coordinate into those of the input
        lever = "" if along == own else " m" if own == "m" else "/m"
        return f"{self.input_unit}{lever}"

    @property
    def positions(self) -> dict[str, str]:
        """Units of the coordinates and of the motions of ports that are none's own, by name."""
        names = [c.q for c in self.coordinates]
        found = {c.q: c.unit for c in self.coordinates}
        return found | {t: p.unit for p in self.ports if (t := combination_text(names, p.weights)) not in found}

    @property
    def speeds(self) -> dict[str, str]:
        """Units of the rates of the coordinates and of the ports, by name."""
        names = [c.dq for c in self.coordinates]
        found = {c.dq: f"{c.unit}/s" for c in self.coordinates}
        return found | {t: f"{p.unit}/s" for p in self.ports if (t := combination_text(names, p.weights)) not in found}

    @property
    def couplings(self) -> dict[str, PortSpec]:
        """Ports between two moving parts, each direction of force once: a force there acts on several rows."""
        between = [p for p in self.ports if sum(map(bool, p.weights)) > 1]
        first = {p.weights: p for p in reversed(between)}
        return {p.name: p for p in between if first[p.weights] is p}

    def port(self, name: str) -> PortSpec:
        """Return the port of that name; raises KeyError with the known ones."""
        for port in self.ports:
            if port.name == name:
                return port
        raise KeyError(f"{self.name} has no port '{name}'; it has {', '.join(p.name for p in self.ports)}")


def combination_text(names: Sequence[str], weights: Sequence[float]) -> str:
    """A combination of names as text: theta_w - theta_p."""
    parts = [(n, w) for n, w in zip(names, weights, strict=True) if w]
    return "".join((" - " if w < 0 else " + " if k else "") + n for k, (n, w) in enumerate(parts)).strip()


def _record(kind: Any, row: list) -> Any:
    """A record of a list of values; lists in it are tuples."""
    return kind(*(tuple(v) if type(v) is list else v for v in row))
