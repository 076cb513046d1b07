"""Composition: plant, assumptions and effects become one residual per coordinate, with nothing left to choose."""

from __future__ import annotations

from collections.abc import Sequence

import sympy as sp

from derive import effects as library
from derive import plants
from derive.algebra import expand, substitute, symbols_in
from derive.base_equations import base_parameters, group_and_deform
from derive.effect_laws import (
    dry_surfaces,
    filter_rows,
    generalised_forces,
    hysteresis_forces,
    input_map,
    input_substitution,
    motor_load_by_port,
    sensor_maps,
)
from derive.effects import Effect, InputDelay, InputLag, SensorDelay
from derive.functions import symbol
from derive.grouping import Grouping
from derive.parameter_name import MISSING_FORCE, full_name
from derive.records import Model, Parameter, Plant, Regressor
from derive.regressor import derive_regressor

ORIGIN_CONSTANT = "origin"  # of a tether: first coordinate at the log's first sample


def compose(plant_name: str, assumptions: dict, effect_names: Sequence[str], missing_force: bool = False) -> Model:
    """Derive the complete model.

    ``missing_force`` adds one unknown generalised force per row, named missing.<row>, with which a residual can be
    turned into the force that the model lacks.

    Raises KeyError for unknown names and NotExpressibleError when an effect needs constants that the plant lacks.
    """
    complete = plants.complete_assumptions(plant_name, assumptions)
    chosen = in_library_order((*effect_names, *plants.implied_effects(plant_name, complete)))
    plant = plants.build(plant_name, complete, released_coordinates(chosen))
    chosen = tuple(library.in_plant_units(e, plant.plant_signature) for e in chosen)
    grouping, rows = group_and_deform(plant, complete, chosen)
    lag, voltage = parameter_of_kind(InputLag, chosen), input_map(plant, chosen)
    acting = plant.input if lag else voltage  # a lagging input is a state of its own
    unknown = missing_forces(plant) if missing_force else []
    residual = residual_of(plant, chosen, rows, acting, unknown)
    fitted = (*base_parameters(plant, grouping), *effect_parameters(chosen), *unknown)
    hystereses, readings = hysteresis_forces(plant, chosen), sensor_maps(plant, chosen)
    surfaces = dry_surfaces(plant, chosen, motor_load_by_port(plant, grouping, acting))
    return Model(
        plant=plant,
        assumptions=complete,
        effects=chosen,
        grouping=grouping,
        residual=residual,
        surfaces=surfaces,
        readings=readings,
        fitted=fitted,
        constants=constants_in(plant, (*residual, *readings, *(m.law for m in hystereses))),
        delay=parameter_of_kind(InputDelay, chosen),
        lag=lag,
        drive=voltage,
        regressor=regressor_of(plant, complete, residual, surfaces, hystereses, grouping, fitted),
        absent=absent_values(fitted, chosen),
        hystereses=hystereses,
        sensor_delay=parameter_of_kind(SensorDelay, chosen),
        delayed_channels=next((e.enters.channels for e in chosen if isinstance(e.enters, SensorDelay)), ()),
        event_times=tuple(e.name_of(p) for e in chosen for p in e.parameters if p.event_time),
    )


def residual_of(
    plant: Plant, chosen: tuple[Effect, ...], rows: tuple, acting: sp.Expr, unknown: Sequence[Parameter]
) -> tuple[sp.Expr, ...]:
    """The rows under the acting input, less the effects' forces and the unknown one on each coordinate's row."""
    driven, count = input_substitution(plant, acting), len(plant.coordinates)
    forces = generalised_forces(plant, chosen)
    residual = [substitute(row, driven) - substitute(f, driven) for row, f in zip(rows, forces, strict=True)]
    filters = filter_rows(plant, chosen)
    residual = [divided_by_size(filters.get(n, row), chosen) if n >= count else row for n, row in enumerate(residual)]
    return tuple(r - symbol(unknown[n].name) if n < len(unknown) else r for n, r in enumerate(residual))


def missing_forces(plant: Plant) -> list[Parameter]:
    """One unknown generalised force for each row."""
    unit = plant.plant_signature.force_unit
    return [Parameter(full_name(MISSING_FORCE, c.row), unit(c.unit), "missing force") for c in plant.coordinates]


def effect_parameters(chosen: tuple[Effect, ...]) -> list[Parameter]:
    """The parameters of all effects, under their full names."""
    return [Parameter(e.name_of(p), p.unit, e.sentence) for e in chosen for p in e.parameters]


def absent_values(fitted: tuple[Parameter, ...], chosen: tuple[Effect, ...]) -> tuple[float, ...]:
    """Value of each parameter while its effect is absent."""
    stated = {e.name_of(p): p.absent for e in chosen for p in e.parameters}
    return tuple(stated.get(p.name, 0.0) for p in fitted)


def constants_in(plant: Plant, expressions: Sequence[sp.Expr]) -> tuple[Parameter, ...]:
    """The known numbers that these expressions use."""
    used = set().union(*map(symbols_in, expressions))
    return tuple(c for c in (*plant.constants, origin_of(plant)) if symbol(c.name) in used)


def released_coordinates(chosen: tuple[Effect, ...]) -> tuple[str, ...]:
    """Names of the internal coordinates that the effects release, sorted."""
    return tuple(sorted({e.releases for e in chosen} - {""}))


def divided_by_size(row: sp.Expr, chosen: tuple[Effect, ...]) -> sp.Expr:
    """A row divided by an effect's size that is a factor of all its terms, as the mass of what hangs in the body is."""
    for size in (e.symbols[p.name] for e in chosen if e.releases for p in e.linear):
        if row != 0 and expand(row.subs(size, 0)) == 0:
            row = expand(expand(row) / size)
    return row


def origin_of(plant: Plant) -> Parameter:
    """The constant that says where the first coordinate was at the log's first sample."""
    first = plant.coordinates[0]
    return Parameter(ORIGIN_CONSTANT, first.unit, f"{first.name} at the log's first sample")


def regressor_of(plant: Plant, complete: dict, residual, surfaces, hystereses, grouping: Grouping, fitted) -> Regressor:
    """The regressor with added states at zero: no sensor reads internal coordinates and hysteresis forces."""
    added = {s: sp.Integer(0) for c in plant.moving[len(plant.coordinates) :] for s in (c.q, c.dq, c.ddq)}
    added |= {m.force: sp.Integer(0) for m in hystereses}
    rows = tuple(substitute(r, added) for r in residual[: len(plant.coordinates)])
    rigid = plants.build(plant.name, complete)
    flat = tuple(s._replace(slip=s.slip[: len(plant.coordinates)], law=substitute(s.law, added)) for s in surfaces)
    return derive_regressor(rigid, rows, flat, grouping, fitted)


def parameter_of_kind(kind: type, chosen: tuple[Effect, ...]) -> str:
    """Full name of the parameter of the effect that enters in this way, or an empty string."""
    return next((e.full_names[0] for e in chosen if isinstance(e.enters, kind)), "")


def in_library_order(effect_names: Sequence[str]) -> tuple[Effect, ...]:
    """The effects in the library's order, in which input and sensor maps are applied one after the other."""
    wanted = {library.find(name).name for name in effect_names}
    return tuple(e for e in library.all_with(sorted(wanted - set(library.EFFECT_LIBRARY))) if e.name in wanted)
