"""The equations of a plant in its base parameters, before any effect acts on them, each derived once.

Equivalent parameters are found on the rigid, undeformed plant; its rows are then written with the deviations of the
geometry that the effects state.
"""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import sympy as sp

from derive import effects as library
from derive import plants
from derive.algebra import substitute
from derive.effects import Deformation, Effect, InternalForce
from derive.functions import TIME_SYMBOL
from derive.grouping import Grouping, group_parameters, regressor_columns, rewrite, scaled_rows
from derive.lagrange import derive_equations
from derive.records import Parameter, Plant


class PlantConfiguration(NamedTuple):
    """Key of a plant's equations before any effect acts: name, file, assumptions, released coordinates."""

    name: str
    fingerprint: str  # of its file
    assumptions: tuple  # complete, as sorted pairs
    free: tuple[str, ...] = ()

    @property
    def plant(self) -> Plant:
        """The plant itself."""
        return plants.build(self.name, dict(self.assumptions), self.free)


def group_and_deform(plant: Plant, assumptions: dict, chosen: tuple[Effect, ...]) -> tuple[Grouping, tuple]:
    """Find the equivalent parameters on the undeformed, rigid plant, then write the rows with the deformations."""
    configuration = PlantConfiguration(plant.name, plants.fingerprint(plant.name), tuple(sorted(assumptions.items())))
    present = geometry_deviations(plant, chosen)
    rows = deformed_rows(configuration._replace(free=plant.free), tuple(present))
    return grouping_of(configuration), tuple(substitute(r, present) for r in rows)


@lru_cache(maxsize=64)
def equations_of(configuration: PlantConfiguration) -> tuple[sp.Expr, ...]:
    """Scaled rows in physical symbols, with every deformation."""
    plant = configuration.plant
    return scaled_rows(plant, derive_equations(plant))


@lru_cache(maxsize=64)
def grouping_of(configuration: PlantConfiguration) -> Grouping:
    """Equivalent parameters of a rigid plant, undeformed; they keep the names they have by default."""
    complete = tuple(sorted(plants.complete_assumptions(configuration.name, {}).items()))
    default = (
        None if configuration.assumptions == complete else grouping_of(configuration._replace(assumptions=complete))
    )
    absent = dict.fromkeys(configuration.plant.geometry.values(), sp.Integer(0))
    rows = tuple(substitute(r, absent) for r in equations_of(configuration))
    return group_parameters(configuration.plant, rows, default and regressor_columns(default.rows, default.names))


@lru_cache(maxsize=256)
def deformed_rows(configuration: PlantConfiguration, present: tuple[sp.Symbol, ...]) -> tuple[sp.Expr, ...]:
    """Rows in the equivalent parameters, with some of the deformations."""
    grouping = grouping_of(configuration._replace(free=()))
    absent = {s: sp.Integer(0) for s in configuration.plant.geometry.values() if s not in present}
    rows = tuple(substitute(r, absent) for r in equations_of(configuration))
    return rewrite(configuration.plant, rows, grouping.definitions, grouping.names)


def geometry_deviations(plant: Plant, chosen: tuple[Effect, ...]) -> dict[sp.Symbol, sp.Expr]:
    """Deviation of each geometry symbol that the effects state: {symbol: expression}."""
    present: dict[sp.Symbol, sp.Expr] = {}
    for effect in chosen:
        if isinstance(effect.enters, Deformation):
            present[plant.geometry[effect.enters.symbol]] = effect.enters.law(TIME_SYMBOL, **effect.symbols)
        elif isinstance(effect.enters, InternalForce):
            present |= {plant.geometry[n]: law(**effect.symbols) for n, law in effect.enters.geometry}
    return present


def parameter_definitions(grouping: Grouping):
    """Pairs of name and definition."""
    return zip(grouping.names, grouping.definitions, strict=True)


def base_parameters(plant: Plant, grouping: Grouping) -> list[Parameter]:
    """Base parameters X1, X2, ..., each with its definition in physical symbols."""
    return [Parameter(n, base_parameter_unit(plant, n, grouping), str(d)) for n, d in parameter_definitions(grouping)]


def base_parameter_unit(plant: Plant, name: str, grouping: Grouping) -> str:
    """Unit of an equivalent parameter, from what it multiplies."""
    column = regressor_columns(grouping.rows, (name,))[name]
    found = [(c, e) for c, e in zip(plant.coordinates, column, strict=True) if e != 0]
    moving = [(c, e) for c, e in found if e.has(*(k.ddq for k in plant.coordinates))]
    row, entry = (moving or found)[0]
    force = plant.plant_signature.force_unit(row.unit)
    along = next((c.unit for c in plant.coordinates if entry.has(c.ddq)), "")
    if along:
        return library.unit_product(force, f"s²/{along}")
    along = next((c.unit for c in plant.coordinates if entry.has(c.dq)), "")
    return library.unit_product(force, f"s/{along}") if along else force
