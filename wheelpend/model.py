"""model.toml: plant, assumptions, effects, numbers, sensors, controller and columns of a workspace.

A Model is read from the text of a model.toml and never changes; what changes it returns a new one, whose text is the
old one with the fewest edits, so that a person's comments and order survive. Nothing in the file is ever executed.
"""

from __future__ import annotations

import math
import os
import re
import tomllib
from collections.abc import Callable, Collection, Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Annotated, Any, Literal, TypeVar

import tomlkit
import tomlkit.items
from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, ValidationError, model_validator

from derive import effects as library
from derive import plants
from derive.records import Plant
from wheelpend.failures import Failure, did_you_mean
from wheelpend.logs import ColumnMap, ColumnTable
from wheelpend.own_effects import read_own

FILE = "model.toml"
NOISE_KEYS = {"theta_p": "pitch_noise", "dtheta_p": "rate_noise"}  # of [sensors] and [simulation], by channel
UNION_BRANCHES = ("literal['auto']", "constrained-float", "float")  # what pydantic adds to a place; nothing to readers
BASE_PARAMETER = re.compile(r"X[1-9]\d*")
Number = Annotated[float, Field(strict=True, allow_inf_nan=False)]
Size = Annotated[float, Field(strict=True, allow_inf_nan=False, ge=0)]
Noise = Annotated[float, Field(strict=True, allow_inf_nan=False, gt=0)] | Literal["auto"]
T = TypeVar("T")


# ---- what a model.toml may hold


class Table(BaseModel):
    """A table whose keys are all known."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    @model_validator(mode="before")
    @classmethod
    def refuse_unknown_keys(cls, data: Any) -> Any:
        """Name the known keys when one is unknown."""
        if isinstance(data, Mapping):
            check_known("key", data, cls.model_fields)
        return data


class Value(Table):
    """A parameter: what it should be, and what the data said."""

    nominal: Number | None = None
    identified: Number | None = None
    sigma: Size | None = None  # standard error of identified

    @property
    def best(self) -> float | None:
        """The identified value, or else the nominal one."""
        return self.nominal if self.identified is None else self.identified


class Sensors(Table):
    """What is known about the sensors."""

    encoder: Literal["absolute", "relative"] = "absolute"  # relative: theta_w is wheel minus body
    encoder_counts: Size | None = None  # per revolution; 0 or nothing where unknown
    pitch_noise: Noise = "auto"  # standard deviation of theta_p [rad]
    rate_noise: Noise = "auto"  # standard deviation of dtheta_p [rad/s]
    noise: dict[str, Noise] = Field(default_factory=dict)  # standard deviation of any channel, in its unit
    step: dict[str, Size] = Field(default_factory=dict)  # of a quantised channel, in its unit; 0 where unknown

    def noise_of(self, channel: str) -> float | None:
        """Standard deviation of a channel as stated [its unit]; None where it is to be found from the data."""
        stated = self.noise.get(channel, getattr(self, NOISE_KEYS.get(channel, ""), "auto"))
        return None if stated == "auto" else float(stated)

    def step_of(self, channel: str) -> float | None:
        """Step of a quantised channel as stated [its unit]; None where nothing is known."""
        counts = self.encoder_counts if channel == "theta_w" else None
        return self.step.get(channel) or (2 * math.pi / counts if counts else None)


class Controller(Table):
    """The feedback law that made the voltage, where it is known."""

    kind: Literal["pid"]
    gains: tuple[Number, Number, Number]  # on the pitch error, its integral and its rate [V/rad, V/(rad s), V s/rad]


class Column(Table):
    """Where a log keeps a quantity."""

    column: str
    unit: str = ""
    sign: Literal[1, -1] = 1
    scale: Annotated[float, Field(strict=True, allow_inf_nan=False, gt=0)] = 1.0


def plain(key: str) -> BeforeValidator:
    """Accept a plain number for a Value and take it as the given key."""
    return BeforeValidator(lambda v: {key: v} if isinstance(v, int | float) and not isinstance(v, bool) else v)


class File(Table):
    """The tables of a model.toml."""

    plant: str
    effects: tuple[str, ...] = ()
    assumptions: dict[str, Any] = Field(default_factory=dict)
    constants: dict[str, Number] = Field(default_factory=dict)
    parameters: dict[str, Annotated[Value, plain("nominal")]] = Field(default_factory=dict)
    effect: dict[str, dict[str, Annotated[Value, plain("identified")]]] = Field(default_factory=dict)
    sensors: Sensors = Field(default_factory=lambda: Sensors())
    controller: Controller | None = None
    columns: dict[str, Column] = Field(default_factory=dict)
    simulation: dict[str, Number] | None = None


# ---- the model


@dataclass(frozen=True)
class Model:
    """A model.toml that has been checked: every name in it is known and every number finite."""

    path: Path | None  # of the file; None until saved
    plant: str
    effects: tuple[str, ...]  # in the order they were added, then those that assumptions stand for
    assumptions: dict[str, Any]  # every one of the plant's, encoder included
    constants: dict[str, float]
    parameters: dict[str, Value]  # X1, X2, ...
    effect_values: dict[str, Value]  # by effect.parameter, of the effects in the model
    sensors: Sensors
    controller: Controller | None
    columns: dict[str, ColumnMap]
    simulation: dict[str, float] | None  # true parameters and noises of the machine that simulations play
    text: str  # of the file
    table: ColumnTable  # columns that its plant's logs have
    own: tuple[str, ...] = ()  # names of the effects that effects.toml beside it adds to the library

    @classmethod
    def open(cls, path: str | os.PathLike = FILE) -> Model:
        """Read a model from its file or its workspace; raises Failure when it is not there or not valid."""
        path = Path(path)
        path = path / FILE if path.is_dir() else path
        try:
            text = path.read_bytes().decode("utf-8-sig")
        except FileNotFoundError:
            raise Failure(f"There is no model at {path}. Start one with: wheelpend new {path.parent}") from None
        except UnicodeDecodeError as error:
            raise Failure(f"{path} must be UTF-8 text; byte {error.start} is not. Save it as UTF-8.") from error
        except OSError as error:
            raise Failure(f"{path} cannot be read: {error.strerror or error}.") from error
        return cls.parse(text, path)

    @classmethod
    def parse(cls, text: str, path: Path | None = None) -> Model:
        """Make a model from the text of a model.toml; raises Failure saying what in it is wrong."""
        try:
            return build(read(text), text, path)
        except Failure as failure:
            raise Failure(f"{path or FILE}: {failure}") from failure

    @classmethod
    def default(cls, plant: str = "wheel_pendulum") -> Model:
        """A first model of a plant, with nominal values a tenth below its reference: the paper's unless one is named.

        Raises Failure where there is no plant of that name.
        """
        from wheelpend.first_model import text_of  # imported late: it makes the text that a Model is read from

        return cls.parse(ask(text_of, plant))

    @cached_property
    def built(self) -> Plant:
        """The plant under the model's assumptions."""
        return plants.build(self.plant, self.assumptions)

    @property
    def workspace(self) -> Path:
        """Folder of the model and of the code generated from it."""
        return self.path.parent if self.path else Path()

    def value(self, name: str) -> float | None:
        """Best known value of X1, or of coulomb_drive.torque; None where there is none."""
        known = self.parameters.get(name) or self.effect_values.get(name)
        return known.best if known else None

    def with_fit(self, values: Mapping[str, tuple[float, float | None]]) -> Model:
        """Return the model with identified values and standard errors, by X1 or effect.parameter."""
        text = self.text
        for name, (value, sigma) in values.items():
            if not math.isfinite(value):
                raise Failure(f"An identified value must be finite; {name} came out as {value}.")
            text = with_value(text, name, float(value), sigma)
        return Model.parse(text, self.path)

    def with_effects(self, effects: Iterable[str]) -> Model:
        """Return the model with exactly these effects; the tables of those that leave go with them.

        Raises Failure when one is to leave that an assumption stands for.
        """
        wanted = tuple(effects)
        brought = plants.brought(self.plant, self.assumptions)
        for name in brought:
            if name not in wanted:
                raise Failure("An effect that leaves must not be part of an assumption, but [assumptions] asks for "
                              f"{name}. Change the assumption in model.toml.")  # fmt: skip
        text = with_effect_list(self.text, tuple(e for e in wanted if e not in brought))
        for name in tomllib.loads(text).get("effect", {}):
            if name not in wanted:
                text = without_effect_table(text, name)
        return Model.parse(text, self.path)

    def dump(self) -> str:
        """Text of the model.toml."""
        return self.text

    def save(self, path: str | os.PathLike | None = None) -> Model:
        """Write model.toml, complete or not at all, and return the model at its new place."""
        target = Path(path) if path is not None else self.path
        if target is None:
            raise Failure("A model needs a path to be saved at; this one has none yet.")
        target = target / FILE if target.is_dir() else target
        beside = target.with_name(f".{target.name}.{os.getpid()}.partial")
        try:
            beside.write_bytes(self.text.encode())
            os.replace(beside, target.resolve())  # through a link, to the file it stands for
        except OSError as error:
            raise Failure(f"{target} cannot be written: {error.strerror or error}.") from error
        finally:
            beside.unlink(missing_ok=True)
        return Model.parse(self.text, target)


# ---- reading


def read(text: str) -> File:
    """Parse and validate the shape of a model.toml."""
    try:
        data = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise Failure(f"this is not valid TOML: {error}. Correct that line.") from error
    assumptions = data.get("assumptions")
    if isinstance(assumptions, dict) and "encoder" in assumptions:
        raise Failure("[assumptions] must not hold encoder. It describes a sensor: set encoder in [sensors].")
    try:
        return File.model_validate(data)
    except ValidationError as error:
        raise Failure("; ".join(describe(e) for e in error.errors()) + ".") from error


def describe(error: Any) -> str:
    """One of pydantic's errors as a phrase: where, what must hold, what came."""
    place = ".".join(str(part) for part in error["loc"] if part not in UNION_BRANCHES)
    if error["type"] == "value_error":
        return f"{'[' + place + ']: ' if place else ''}{error['ctx']['error']}".rstrip(".")
    message = error["msg"][0].lower() + error["msg"][1:]
    if error["type"] == "missing":
        return f"{place} is missing"
    return f"{place}: {message}, not {error['input']!r}"


def build(file: File, text: str, path: Path | None) -> Model:
    """Check every name against plant and library."""
    assumptions = settle(file)
    plant = plants.build(file.plant, assumptions)
    brought = plants.brought(file.plant, assumptions)
    own = library.register(read_own(path.parent, plant)) if path else ()
    effects = (*check_effects(file.effects, plant, own), *(e for e in brought if e not in file.effects))
    check_known("constant", file.constants, [c.name for c in plant.constants], " in [constants]")
    table = columns_of(plant)
    check_known("quantity", file.columns, table.names, " in [columns]")
    for place, stated in (("noise", file.sensors.noise), ("step", file.sensors.step)):
        check_known("channel", stated, table.channels, f" in [sensors.{place}]")
    check_base(file.parameters, "[parameters]")
    further = (*NOISE_KEYS.values(), *(str(s) for c in plant.coordinates for s in (c.q, c.dq)))
    check_base([k for k in file.simulation or () if k not in further], "[simulation]", further)
    for name, values in file.effect.items():
        known = [p.name for p in ask(library.find, name).parameters]
        check_known("parameter", values, known, f" in [effect.{name}]")
    return Model(
        path=path,
        plant=file.plant,
        effects=effects,
        assumptions=assumptions,
        constants=file.constants,
        parameters=file.parameters,
        effect_values={f"{e}.{p}": v for e in effects for p, v in file.effect.get(e, {}).items()},
        sensors=file.sensors.model_copy(update={"encoder_counts": file.sensors.encoder_counts or None}),
        controller=file.controller,
        columns={name: ColumnMap(c.column, c.unit, c.sign, c.scale) for name, c in file.columns.items()},
        simulation=file.simulation,
        own=own,
        text=text,
        table=table,
    )


def settle(file: File) -> dict[str, Any]:
    """Every assumption of the plant, with the encoder as [sensors] has it."""
    known = [a.name for a in ask(plants.assumptions_of, file.plant)]
    encoder = {"encoder": file.sensors.encoder} if "encoder" in known else {}
    check_known("assumption", file.assumptions, [k for k in known if k != "encoder"], " in [assumptions]")
    return ask(plants.settle, file.plant, {**file.assumptions, **encoder})


def check_effects(names: tuple[str, ...], plant: Plant, own: tuple[str, ...]) -> tuple[str, ...]:
    """Return the names; raises Failure when one is unknown, there twice, or acts on a part that the plant lacks."""
    for k, name in enumerate(names):
        check_known("effect", [name], sorted([*library.LIBRARY, *own]))
        if name in names[:k]:
            raise Failure(f"effects must name each effect once; {name} is there twice. Remove one.")
        if not library.fits(library.find(name), plant):
            raise Failure(f"{name} acts on a part that {plant.name} does not have. Remove it from effects.")
    return names


def check_base(names: Iterable[str], place: str, further: tuple[str, ...] = ()) -> None:
    """Raise Failure unless every name is X1, X2, ..."""
    for name in names:
        if not BASE_PARAMETER.fullmatch(name):
            others = "".join(f", {f}" for f in further)
            raise Failure(f"{place} holds X1, X2, ...{others}; '{name}' is none of them. Rename or remove it.")


def check_known(what: str, names: Iterable[str], known: Collection[str], place: str = "") -> None:
    """Raise Failure naming the known names when one is not among them."""
    for name in names:
        if name not in known:
            plural = "quantities" if what == "quantity" else what + "s"
            hint = did_you_mean(name, known)
            raise Failure(f"No {what} named '{name}'{place}. Known {plural}: {', '.join(known)}.{hint}")


def columns_of(plant: Plant) -> ColumnTable:
    """The columns that a log of this plant has."""
    units = {"t": "s", **{c.name: c.unit for c in plant.channels}}
    if plant.driven:
        units |= {u.name: plant.input_unit for u in plant.inputs}
    if plant.reference:
        units[plant.reference] = next(c.unit for c in plant.channels if c.name == plant.controlled[0])
    channels = tuple(c.name for c in plant.channels)
    driven = plant.input.name if plant.driven else ""
    further = tuple(u.name for u in plant.further)
    return ColumnTable(driven, channels, units, plant.reference, plant.falls, further)


def ask(look_up: Callable[..., T], *arguments: Any) -> T:
    """Call a look-up; its KeyError, whose text names the choices, becomes a Failure."""
    try:
        return look_up(*arguments)
    except KeyError as error:
        raise Failure(error.args[0]) from error


# ---- editing the text


def with_value(text: str, name: str, value: float, sigma: float | None) -> str:
    """Text with an identified value, kept in the place and form that the file has for it."""
    effect, _, parameter = name.rpartition(".")
    header = ("effect", effect) if effect else ("parameters",)
    document = tomlkit.parse(text)
    table: Any = document
    for key in header:
        table = table.get(key, {})
    entry = table.get(parameter)
    numbers = {"identified": value}
    if sigma is not None and math.isfinite(sigma):
        numbers["sigma"] = float(sigma)
    if entry is None and (not table or find_table(text.splitlines(), header)):
        return insert_line(text, header, f"{parameter} = {inline(numbers).as_string()}")
    if entry is None:  # the table is there without a header of its own, in dotted keys
        table[parameter] = inline(numbers)
    elif isinstance(entry, tomlkit.items.Table):
        entry.pop("sigma", None)
        entry.update(numbers)
    else:  # a plain number is the nominal value of a base parameter, the identified one of an effect's
        old = entry if isinstance(entry, Mapping) else {} if effect else {"nominal": entry}
        table[parameter] = inline({**{k: v for k, v in old.items() if k != "sigma"}, **numbers})
    return tomlkit.dumps(document)


def inline(numbers: Mapping[str, Any]) -> tomlkit.items.Item:
    """Numbers as an inline table, spaced as people write it."""
    return tomlkit.value(
        "{ " + ", ".join(f"{key} = {tomlkit.item(v).as_string()}" for key, v in numbers.items()) + " }"
    )


def with_effect_list(text: str, wanted: tuple[str, ...]) -> str:
    """Text whose list of effects is the wanted one."""
    document = tomlkit.parse(text)
    if "effects" not in document:
        array = tomlkit.array()
        array.extend(wanted)
        start = re.search(r"(?m)^\s*\[", text)
        at = start.start() if start else len(text)
        end = "\r\n" if "\r\n" in text else "\n"
        before = text[:at] if not at or text[:at].endswith("\n") else text[:at] + end
        return f"{before}effects = {array.as_string()}{end}{text[at:]}"
    array = document["effects"]  # type: ignore[assignment]
    for name in [n for n in array if n not in wanted]:
        array.remove(name)
    for name in [n for n in wanted if n not in array]:
        array.append(name)
    if list(array) != list(wanted):
        array.clear()
        array.extend(wanted)
    return tomlkit.dumps(document)


def insert_line(text: str, header: tuple[str, ...], line: str) -> str:
    """Text with a line after the last entry of a table, which is made at the end of the file where it is missing."""
    lines = text.splitlines(keepends=True)
    end = "\r\n" if "\r\n" in text else "\n"
    block = find_table(lines, header)
    if block is None:
        gap = "" if not text else end if text.endswith("\n") else 2 * end
        return f"{text}{gap}[{'.'.join(header)}]{end}{line}{end}"
    before, after = lines[: block[1]], lines[block[1] :]
    if not before[-1].endswith("\n"):
        before.append(end)
    return "".join([*before, line + end, *after])


def without_effect_table(text: str, name: str) -> str:
    """Text without [effect.name]; the comments that follow its last entry belong to what comes next and stay."""
    lines = text.splitlines(keepends=True)
    block = find_table(lines, ("effect", name))
    if block is not None:
        first, last = block
        if first and not lines[first - 1].strip() and not "".join(lines[last : last + 1]).strip():
            first -= 1  # of the blank lines before and after, one is enough
        text = "".join(lines[:first] + lines[last:])
    document = tomlkit.parse(text)
    tables: Any = document.get("effect", {})
    if name in tables:  # written in another form
        del tables[name]
        if not tables:
            document.remove("effect")
        text = tomlkit.dumps(document)
    return text


def find_table(lines: list[str], header: tuple[str, ...]) -> tuple[int, int] | None:
    """Lines of a table from its header to its last entry, half open; None where it has no header of its own."""
    quoted = r"\s*\.\s*".join(rf"[\"']?{re.escape(key)}[\"']?" for key in header)
    pattern = re.compile(rf"\s*\[\s*{quoted}\s*\]\s*(#.*)?\s*")
    first = next((k for k, line in enumerate(lines) if pattern.fullmatch(line)), None)
    if first is None:
        return None
    end = next((k for k in range(first + 1, len(lines)) if re.match(r"\s*\[", lines[k])), len(lines))
    while end > first + 1 and re.fullmatch(r"\s*(#.*)?\s*", lines[end - 1]):
        end -= 1
    return first, end
