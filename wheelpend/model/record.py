"""The Model: the content of a model.toml, checked and immutable.

Methods that change a Model return a new one, whose text is the old one with the fewest edits, so that a person's
comments and order survive. Nothing in the file is ever executed.
"""

from __future__ import annotations

import math
import os
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

from derive import plants
from derive.parameter_name import full_name
from derive.plant_signature import PlantSignature
from wheelpend.errors import Failure
from wheelpend.files import read_text, write_text
from wheelpend.kernels.plant_signature import plant_signature
from wheelpend.logs.columns import ColumnMap, ColumnTable
from wheelpend.model.entries import Controller, ModelFile, ParameterValue, RandomForce, SensorNoise, Sensors
from wheelpend.model.name_checks import resolve_names
from wheelpend.model.toml_checks import call_look_up
from wheelpend.model.toml_file import MODEL_FILE, parse_model_file, parse_toml
from wheelpend.model.transaction import finish_change


@dataclass(frozen=True)
class Model:
    """A checked model.toml: every name in it is known to plant and library, and every number is finite."""

    path: Path | None  # of the file; None until saved
    plant: str
    effects: tuple[str, ...]  # in the order they were added, then those that assumptions imply
    assumptions: dict[str, Any]  # every one of the plant's, encoder included
    constants: dict[str, float]
    parameters: dict[str, ParameterValue]  # X1, X2, ...
    effect_values: dict[str, ParameterValue]  # by effect.parameter, of the effects in the model
    sensors: Sensors
    controller: Controller | None
    columns: dict[str, ColumnMap]
    simulation: dict[str, float] | None  # true parameters and noises of the simulated machine
    text: str  # of the file
    table: ColumnTable  # columns that its plant's logs have
    own: tuple[str, ...] = ()  # names of the effects that effects.toml beside it adds to the library
    random_force: Mapping[str, RandomForce] = field(default_factory=dict)  # by row, as the identified values leave it
    sensor_error: Mapping[str, SensorNoise] = field(default_factory=dict)  # by channel, likewise

    def __repr__(self) -> str:
        known = sum(v.best is not None for v in self.all_parameters.values())
        effects = ", ".join(self.effects) or "no effects"
        return f"<Model {str(self.path or 'not saved')!r}: {self.plant} with {effects}; {known} values>"

    @classmethod
    def open(cls, path: str | os.PathLike = MODEL_FILE) -> Model:
        """Read a model from its file or its workspace; raises Failure when it is not there or not valid."""
        path = Path(path)
        path = path / MODEL_FILE if path.is_dir() and path.name != MODEL_FILE else path
        finish_change(path.parent)
        try:
            text = read_text(path)
        except FileNotFoundError:
            raise Failure(f"There is no model at {path}. Start one with: wheelpend new {path.parent}") from None
        return cls.parse(text, path)

    @classmethod
    def parse(cls, text: str, path: Path | None = None) -> Model:
        """Make a model from the text of a model.toml; raises Failure saying what in it is wrong."""
        try:
            return model_from_tables(parse_model_file(text), text, path)
        except Failure as failure:
            raise Failure(f"{path or MODEL_FILE}: {failure}") from failure

    @classmethod
    def default(cls, plant: str = plants.DEFAULT_PLANT) -> Model:
        """A first model of a plant, with nominal values a tenth below the plant's own.

        Raises Failure where there is no plant of that name.
        """
        from wheelpend.model.template import model_file_text  # imported late: tomlkit is slow to load

        return cls.parse(call_look_up(model_file_text, plant))

    @cached_property
    def plant_signature(self) -> PlantSignature:
        """Names, units and numbers of the plant under the model's assumptions."""
        return plant_signature(self.plant, self.assumptions)

    @property
    def workspace(self) -> Path:
        """Folder of the model and of the code generated from it."""
        return self.path.parent if self.path else Path()

    @property
    def all_parameters(self) -> dict[str, ParameterValue]:
        """Parameters of the plant, then those of the effects in the model by effect.parameter."""
        return {**self.parameters, **self.effect_values}

    def estimates(self) -> dict[str, dict[str, float | None]]:
        """Identified values and their standard errors under the keys of JSON; null where nothing was identified."""
        return {n: {"value": v.identified, "sigma": v.sigma} for n, v in self.all_parameters.items()}

    def value(self, name: str) -> float | None:
        """Best known value of X1, or of coulomb_drive.torque; None where there is none."""
        known = self.parameters.get(name) or self.effect_values.get(name)
        return known.best if known else None

    def with_fit(self, values: Mapping[str, tuple[float, float | None]]) -> Model:
        """Return the model with identified values and standard errors, by X1 or effect.parameter."""
        from wheelpend.model.toml_edits import with_value  # imported late: tomlkit is slow to load

        text = self.text
        for name, (value, sigma) in values.items():
            check_finite(name, value)
            text = with_value(text, name, float(value), sigma)
        return Model.parse(text, self.path)

    def with_random_sources(self, forces: Mapping[str, RandomForce], errors: Mapping[str, SensorNoise]) -> Model:
        """Return the model with exactly these random forces, by row, and random errors of sensors, by channel."""
        from wheelpend.model.toml_edits import with_tables  # imported late: as above

        text = with_tables(self.text, "random_force", {row: _stated(f) for row, f in forces.items()})
        text = with_tables(text, "sensor_error", {channel: _stated(e) for channel, e in errors.items()})
        return self if text == self.text else Model.parse(text, self.path)

    def predict(self, log: Any, **options: Any) -> Any:
        """Predict a log, sample by sample: ``wheelpend.predict``, whose ``options`` these are."""
        from wheelpend import predict  # the public one, found as it is used: it stands above this record

        return predict(self, log, **options)

    def linearize(self, near: Mapping[str, float] | None = None) -> Any:
        """Linearise the model at rest: ``wheelpend.linearize``."""
        from wheelpend import linearize  # likewise

        return linearize(self, near)

    def with_effects(self, effects: Iterable[str]) -> Model:
        """Return the model with exactly these effects; the tables of those that leave go with them.

        What was left to chance belongs to the effects that were there: where these change it goes.
        Raises Failure when one is to leave that an assumption implies.
        """
        from wheelpend.model.toml_edits import with_effect_list, without_table  # imported late: as above

        wanted = tuple(effects)
        implied = plants.implied_effects(self.plant, self.assumptions)
        for name in implied:
            if name not in wanted:
                raise Failure("An effect that leaves must not be part of an assumption, but [assumptions] asks for "
                              f"{name}. Change the assumption in model.toml.")  # fmt: skip
        text = with_effect_list(self.text, tuple(e for e in wanted if e not in implied))
        for name in parse_toml(text).get("effect", {}):
            if name not in wanted:
                text = without_table(text, "effect", name)
        changed = Model.parse(text, self.path)
        return changed if set(changed.effects) == set(self.effects) else changed.with_random_sources({}, {})

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


def _stated(source: RandomForce | SensorNoise) -> dict[str, Any]:
    """The entries of a random source that say something."""
    return {key: value for key, value in vars(source).items() if value not in ("", 0.0) or key == "rms"}


def check_finite(name: str, value: float) -> None:
    """Raise Failure where an identified value is no number."""
    if not math.isfinite(value):
        raise Failure(f"An identified value must be finite; {name} came out as {value}.")


def model_from_tables(file: ModelFile, text: str, path: Path | None) -> Model:
    """The model of a file's tables; raises Failure where a name in them is not known to plant or library."""
    names = resolve_names(file, path.parent if path else None)
    return Model(
        path=path,
        plant=file.plant,
        effects=names.effects,
        assumptions=names.assumptions,
        constants=file.constants,
        parameters=file.parameters,
        effect_values={full_name(e, p): v for e in names.effects for p, v in file.effect.get(e, {}).items()},
        sensors=file.sensors,
        controller=file.controller,
        columns={name: ColumnMap(**vars(c)) for name, c in file.columns.items()},
        simulation=file.simulation,
        own=names.user_effects,
        text=text,
        table=names.table,
        random_force=file.random_force,
        sensor_error=file.sensor_error,
    )
