"""The Model: what a model.toml says, checked, and immutable.

What changes a Model returns a new one, whose text is the old one with the fewest edits, so that a person's comments and
order survive. Nothing in the file is ever executed.
"""

from __future__ import annotations

import math
import os
import re
import tomllib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

from derive import effects as library
from derive import plants
from derive.plant_signature import PlantSignature
from wheelpend.errors import Failure
from wheelpend.files import write_text
from wheelpend.kernels.plant_signature import plant_signature
from wheelpend.logs.columns import ColumnMap, ColumnTable
from wheelpend.model.entries import NOISE_KEYS, Controller, ModelFile, ParameterValue, Sensors
from wheelpend.model.toml_checks import call_look_up, check_known
from wheelpend.model.toml_file import parse_model_file
from wheelpend.model.user_effects import USER_EFFECTS_FILE

MODEL_FILE = "model.toml"
BASE_PARAMETER_PATTERN = re.compile(r"X[1-9]\d*")


@dataclass(frozen=True)
class Model:
    """A model.toml that has been checked: every name in it is known and every number finite."""

    path: Path | None  # of the file; None until saved
    plant: str
    effects: tuple[str, ...]  # in the order they were added, then those that assumptions stand for
    assumptions: dict[str, Any]  # every one of the plant's, encoder included
    constants: dict[str, float]
    parameters: dict[str, ParameterValue]  # X1, X2, ...
    effect_values: dict[str, ParameterValue]  # by effect.parameter, of the effects in the model
    sensors: Sensors
    controller: Controller | None
    columns: dict[str, ColumnMap]
    simulation: dict[str, float] | None  # true parameters and noises of the machine that simulations play
    text: str  # of the file
    table: ColumnTable  # columns that its plant's logs have
    own: tuple[str, ...] = ()  # names of the effects that effects.toml beside it adds to the library

    @classmethod
    def open(cls, path: str | os.PathLike = MODEL_FILE) -> Model:
        """Read a model from its file or its workspace; raises Failure when it is not there or not valid."""
        path = Path(path)
        path = path / MODEL_FILE if path.is_dir() else path
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
            return checked_model(parse_model_file(text), text, path)
        except Failure as failure:
            raise Failure(f"{path or MODEL_FILE}: {failure}") from failure

    @classmethod
    def default(cls, plant: str = "wheel_pendulum") -> Model:
        """A first model of a plant, with nominal values a tenth below its reference: the paper's unless one is named.

        Raises Failure where there is no plant of that name.
        """
        from wheelpend.model.template import (
            model_file_text,  # imported late: it makes the text that a Model is read from
        )

        return cls.parse(call_look_up(model_file_text, plant))

    @cached_property
    def plant_signature(self) -> PlantSignature:
        """What the plant has under the model's assumptions."""
        return plant_signature(self.plant, self.assumptions)

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
        from wheelpend.model.toml_edits import with_value  # imported late: only edits need it

        text = self.text
        for name, (value, sigma) in values.items():
            check_finite(name, value)
            text = with_value(text, name, float(value), sigma)
        return Model.parse(text, self.path)

    def with_effects(self, effects: Iterable[str]) -> Model:
        """Return the model with exactly these effects; the tables of those that leave go with them.

        Raises Failure when one is to leave that an assumption stands for.
        """
        from wheelpend.model.toml_edits import (  # imported late: only edits need them
            with_effect_list,
            without_effect_table,
        )

        wanted = tuple(effects)
        brought = plants.implied_effects(self.plant, self.assumptions)
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
        target = target / MODEL_FILE if target.is_dir() else target
        write_text(target, self.text)
        return Model.parse(self.text, target)


def check_finite(name: str, value: float) -> None:
    """Raise Failure where an identified value is no number."""
    if not math.isfinite(value):
        raise Failure(f"An identified value must be finite; {name} came out as {value}.")


def checked_model(file: ModelFile, text: str, path: Path | None) -> Model:
    """Check every name against plant and library."""
    assumptions = settled_assumptions(file)
    plant = plant_signature(file.plant, assumptions)
    brought = plants.implied_effects(file.plant, assumptions)
    own = user_effect_names(path.parent, plant) if path else ()
    effects = (*check_effects(file.effects, plant, own), *(e for e in brought if e not in file.effects))
    check_known("constant", file.constants, [c.name for c in plant.constants], " in [constants]")
    table = column_table(plant)
    check_known("quantity", file.columns, table.names, " in [columns]")
    for place, stated in (("noise", file.sensors.noise), ("step", file.sensors.step)):
        check_known("channel", stated, table.channels, f" in [sensors.{place}]")
    check_base_parameters(file.parameters, "[parameters]")
    further = (*NOISE_KEYS.values(), *(n for c in plant.coordinates for n in (c.q, c.dq)))
    check_base_parameters([k for k in file.simulation or () if k not in further], "[simulation]", further)
    for name, values in file.effect.items():
        known = [p.name for p in call_look_up(library.find, name).parameters]
        check_known("parameter", values, known, f" in [effect.{name}]")
    return Model(
        path=path,
        plant=file.plant,
        effects=effects,
        assumptions=assumptions,
        constants=file.constants,
        parameters=file.parameters,
        effect_values={f"{e}.{p}": v for e in effects for p, v in file.effect.get(e, {}).items()},
        sensors=replace(file.sensors, encoder_counts=file.sensors.encoder_counts or None),
        controller=file.controller,
        columns={name: ColumnMap(c.column, c.unit, c.sign, c.scale) for name, c in file.columns.items()},
        simulation=file.simulation,
        own=own,
        text=text,
        table=table,
    )


def settled_assumptions(file: ModelFile) -> dict[str, Any]:
    """Every assumption of the plant, with the encoder as [sensors] has it."""
    known = [a.name for a in call_look_up(plants.assumptions_of, file.plant)]
    encoder = {"encoder": file.sensors.encoder} if "encoder" in known else {}
    check_known("assumption", file.assumptions, [k for k in known if k != "encoder"], " in [assumptions]")
    return call_look_up(plants.complete_assumptions, file.plant, {**file.assumptions, **encoder})


def user_effect_names(workspace: Path, plant: PlantSignature) -> tuple[str, ...]:
    """Names of the effects that a workspace's effects.toml adds, which are known from then on."""
    if not os.path.exists(workspace / USER_EFFECTS_FILE):
        return ()
    from wheelpend.model.user_effects import read_user_effects  # imported late: reading laws takes SymPy

    return library.register(read_user_effects(workspace, plant))


def check_effects(names: tuple[str, ...], plant: PlantSignature, own: tuple[str, ...]) -> tuple[str, ...]:
    """Return the names; raises Failure when one is unknown, there twice, or acts on a part that the plant lacks."""
    for k, name in enumerate(names):
        check_known("effect", [name], sorted([*library.EFFECT_LIBRARY, *own]))
        if name in names[:k]:
            raise Failure(f"effects must name each effect once; {name} is there twice. Remove one.")
        if not library.is_applicable(library.find(name), plant):
            raise Failure(f"{name} acts on a part that {plant.name} does not have. Remove it from effects.")
    return names


def check_base_parameters(names: Iterable[str], place: str, further: tuple[str, ...] = ()) -> None:
    """Raise Failure unless every name is X1, X2, ..."""
    for name in names:
        if not BASE_PARAMETER_PATTERN.fullmatch(name):
            others = "".join(f", {f}" for f in further)
            raise Failure(f"{place} holds X1, X2, ...{others}; '{name}' is none of them. Rename or remove it.")


def column_table(plant: PlantSignature) -> ColumnTable:
    """The columns that a log of this plant has."""
    units = {"t": "s", **{c.name: c.unit for c in plant.channels}}
    if plant.driven:
        units |= dict.fromkeys(plant.inputs, plant.input_unit)
    if plant.reference:
        units[plant.reference] = next(c.unit for c in plant.channels if c.name == plant.controlled[0])
    channels = tuple(c.name for c in plant.channels)
    driven = plant.input if plant.driven else ""
    return ColumnTable(driven, channels, units, plant.reference, plant.range_channel, plant.further)
