"""Names in a model.toml, resolved against plant and library; an unknown one is refused with those that are known."""

from __future__ import annotations

import os
import re
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any, NamedTuple

from derive import effects as library
from derive import plants
from derive.input_units import INPUT_UNIT
from derive.plant_signature import PlantSignature
from wheelpend.errors import Failure
from wheelpend.kernels.plant_signature import plant_signature
from wheelpend.logs.columns import ColumnTable
from wheelpend.model.entries import ModelFile
from wheelpend.model.toml_checks import call_look_up, check_known, checked, nonnegative, one_of
from wheelpend.model.toml_file import NOISE_CHECK, USER_EFFECTS_FILE

BASE_PARAMETER_PATTERN = re.compile(r"X[1-9]\d*")
CONSTANT_SIZES = 1e-12, 1e12  # in SI units
UNITS_OF_ZERO_CONSTANTS = ("rad", "1", "m/s²")  # of an angle, a share and gravity, which may be zero


class ResolvedNames(NamedTuple):
    """Names of a model.toml, complete and known to plant and library."""

    assumptions: dict[str, Any]  # every one of the plant's, encoder included
    effects: tuple[str, ...]  # those of the file, then those that assumptions imply
    user_effects: tuple[str, ...]  # names that effects.toml adds to the library
    table: ColumnTable  # columns that the plant's logs have


def resolve_names(file: ModelFile, workspace: Path | None) -> ResolvedNames:
    """Resolve plant, assumptions and effects, and check every other name; raises Failure at the first unknown one.

    ``workspace`` is the folder of an effects.toml, whose effects are registered; None where there is no folder.
    """
    assumptions = settled_assumptions(file)
    plant = plant_signature(file.plant, assumptions)
    user_effects = user_effect_names(workspace, plant) if workspace is not None else ()
    implied = plants.implied_effects(file.plant, assumptions)
    effects = (*check_effects(file.effects, plant, user_effects), *(e for e in implied if e not in file.effects))
    table = ColumnTable.of(plant)
    check_table_keys(file, plant, table)
    return ResolvedNames(assumptions, effects, user_effects, table)


def settled_assumptions(file: ModelFile) -> dict[str, Any]:
    """Every assumption of the plant, with those on sensors as [sensors] has them."""
    known = call_look_up(plants.assumptions_of, file.plant)
    of_sensors = {a.name: one_of(*a.choices) for a in known if a.section == "sensors"}
    for name in of_sensors:
        if name in file.assumptions:
            raise Failure(f"[assumptions] must not hold {name}. It describes a sensor: set {name} in [sensors].")
    check_known(
        "assumption", file.assumptions, [a.name for a in known if a.name not in of_sensors], " in [assumptions]"
    )
    given = file.sensors.of_plant
    stated = {n: checked(check, given[n], f"sensors.{n}") for n, check in of_sensors.items() if n in given}
    settled = call_look_up(plants.complete_assumptions, file.plant, {**file.assumptions, **stated})
    return settled if file.input is None else with_input_unit_of(file.input.unit, file.plant, settled)


def with_input_unit_of(unit: str, plant: str, assumptions: dict[str, Any]) -> dict[str, Any]:
    """The assumptions with the unit that [input] states, where that differs from the one of the plant's file.

    Raises Failure where nothing drives the plant, or where its equations have no constant for that unit.
    """
    own = plant_signature(plant, assumptions)
    if not own.driven:
        raise Failure(f"[input] states the unit of an input, but nothing drives this {own.words.machine}. Remove it, "
                      "or choose assumptions under which a motor does.")  # fmt: skip
    if unit == own.input_unit:
        return assumptions
    stated = {**assumptions, INPUT_UNIT: unit}
    try:
        plant_signature(plant, stated)
    except ValueError as error:
        raise Failure(f"[input] must fit the plant, but {error}. Change the unit, or the plant's file.") from error
    return stated


def user_effect_names(workspace: Path, plant: PlantSignature) -> tuple[str, ...]:
    """Names of the effects that a workspace's effects.toml adds, which are known from then on."""
    if not os.path.exists(workspace / USER_EFFECTS_FILE):
        return ()
    from wheelpend.model.user_effects import read_user_effects  # imported late: reading laws takes SymPy

    return library.register(read_user_effects(workspace, plant))


def check_effects(names: tuple[str, ...], plant: PlantSignature, user_effects: tuple[str, ...]) -> tuple[str, ...]:
    """Return the names; raises Failure when one is unknown, there twice, or acts on a part that the plant lacks."""
    for k, name in enumerate(names):
        check_known("effect", [name], sorted([*library.EFFECT_LIBRARY, *user_effects]))
        if name in names[:k]:
            raise Failure(f"effects must name each effect once; {name} is there twice. Remove one.")
        if not library.is_applicable(library.find(name), plant):
            raise Failure(f"{name} acts on a part that {plant.name} does not have. Remove it from effects.")
    return names


def check_table_keys(file: ModelFile, plant: PlantSignature, table: ColumnTable) -> None:
    """Raise Failure unless every key is known in constants, columns, sensors, parameters, simulation and effects."""
    check_known("constant", file.constants, constants_of_file(file, plant), " in [constants]")
    check_constant_sizes(file.constants, {c.name: c.unit for c in plant.constants})
    check_known("quantity", file.columns, table.names, " in [columns]")
    check_sensor_keys(file.sensors.of_plant, plant, file.plant)
    for place, stated in (("noise", file.sensors.noise), ("step", file.sensors.step)):
        check_known("channel", stated, table.channels, f" in [sensors.{place}]")
    check_known("row", file.random_force, [c.row for c in plant.coordinates], " in [random_force]")
    for row, force in file.random_force.items():
        if force.place:
            check_known("place", [force.place], places_on(row, plant), f" in [random_force.{row}]")
    check_known("channel", file.sensor_error, table.channels, " in [sensor_error]")
    check_base_parameters(file.parameters, "[parameters]")
    states = (n for c in plant.coordinates for n in (c.q, c.dq))
    further = (*(c.sensor.noise_key for c in plant.channels if c.sensor.noise_key), *states)
    check_base_parameters([k for k in file.simulation or () if k not in further], "[simulation]", further)
    for name, values in file.effect.items():
        known = [p.name for p in call_look_up(library.find, name).parameters]
        check_known("parameter", values, known, f" in [effect.{name}]")


def places_on(row: str, plant: PlantSignature) -> list[str]:
    """Where a force on a row may act: on the row itself, or along a port that reaches it."""
    number = [c.row for c in plant.coordinates].index(row)
    return [row, *(name for name, port in plant.couplings.items() if port.weights[number])]


def constants_of_file(file: ModelFile, plant: PlantSignature) -> list[str]:
    """Names of the plant's constants; raises Failure where the file states one that is 1 in the unit of its input."""
    known = [c.name for c in plant.constants]
    for name in file.constants:
        if file.input and name not in known and name in plants.constants_of(file.plant):
            raise Failure(f"[constants] must not hold {name}: with an input in {file.input.unit} it is 1. Remove it.")
    return known


def check_constant_sizes(constants: Mapping[str, float], units: Mapping[str, str]) -> None:
    """Raise Failure where a constant is so small or so large, or zero, that no machine has it."""
    least, most = CONSTANT_SIZES
    for name, value in constants.items():
        if not least <= abs(value) <= most and not (value == 0.0 and units[name] in UNITS_OF_ZERO_CONSTANTS):
            raise Failure(
                f"[constants] must hold numbers that a machine has, from {least:g} to {most:g} in size, but {name} is "
                f"{value:g} {units[name]}. Measure it, or remove it where it is unknown."
            )


def check_sensor_keys(stated: Mapping[str, Any], plant: PlantSignature, name: str) -> None:
    """Raise Failure unless the keys of [sensors] beside noise and step are the plant's, each with a fitting value."""
    assumptions = [a.name for a in plants.assumptions_of(name) if a.section == "sensors"]
    noise = {c.sensor.noise_key: NOISE_CHECK for c in plant.channels if c.sensor.noise_key}
    counts = {c.sensor.counts_key: nonnegative for c in plant.channels if c.sensor.counts_key}
    check_known("key", stated, [*assumptions, *noise, *counts, "noise", "step"], " in [sensors]")
    for key, check in (noise | counts).items():
        if key in stated:
            checked(check, stated[key], f"sensors.{key}")


def check_base_parameters(names: Iterable[str], place: str, further: tuple[str, ...] = ()) -> None:
    """Raise Failure unless every name is X1, X2, ..."""
    for name in names:
        if not BASE_PARAMETER_PATTERN.fullmatch(name):
            others = "".join(f", {f}" for f in further)
            raise Failure(f"{place} holds X1, X2, ...{others}; '{name}' is none of them. Rename or remove it.")
