"""Composition: plant, assumptions and effects become one residual per coordinate, with nothing left to choose."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import lru_cache
from typing import NamedTuple

import sympy as sp

from derive import effects as library
from derive import plants
from derive.algebra import derivative, expand, substitute, symbols_in
from derive.effects import (
    Deformation,
    DryForce,
    Effect,
    Force,
    HysteresisForce,
    InputDelay,
    InputLag,
    InputMap,
    InternalForce,
    InternalPlay,
    SensorDelay,
    SensorMap,
)
from derive.functions import LOAD_SYMBOL, TIME_SYMBOL, Magnitude, Ramp, Sign, symbol
from derive.grouping import Grouping, group_parameters, regressor_columns, rewrite, scaled_rows
from derive.lagrange import derive_equations
from derive.records import Coordinate, DrySurface, Hysteresis, Model, Parameter, Plant, Regressor
from derive.regressor import derive_regressor

ORIGIN_CONSTANT = "origin"  # of a tether: where what it holds was at the log's first sample


class PlantConfiguration(NamedTuple):
    """What the equations of a plant follow from, before any effect acts."""

    name: str
    fingerprint: str  # of its file
    assumptions: tuple  # settled, as sorted pairs
    free: tuple[str, ...] = ()

    @property
    def plant(self) -> Plant:
        """The plant itself."""
        return plants.build(self.name, dict(self.assumptions), self.free)


def compose(plant_name: str, assumptions: dict, effect_names: Sequence[str], missing_force: bool = False) -> Model:
    """Derive the complete model.

    ``missing_force`` adds one unknown generalised force per row, named missing.<row>, with which a residual can be
    turned into the force that the model lacks.

    Raises KeyError for unknown names and NotExpressibleError when an effect needs constants that the plant lacks.
    """
    settled = plants.complete_assumptions(plant_name, assumptions)
    chosen = in_library_order((*effect_names, *plants.implied_effects(plant_name, settled)))
    plant = plants.build(plant_name, settled, released_coordinates(chosen))
    chosen = tuple(library.in_plant_units(e, plant.plant_signature) for e in chosen)
    grouping, rows = group_and_deform(plant, settled, chosen)
    lag, voltage = parameter_of_kind(InputLag, chosen), input_map(plant, chosen)
    acting = plant.input if lag else voltage  # a lagging input is a state of its own
    unknown = missing_forces(plant) if missing_force else []
    residual = residual_of(plant, chosen, rows, acting, unknown)
    fitted = (*base_parameters(plant, grouping), *effect_parameters(chosen), *unknown)
    memories, readings = hysteresis_forces(plant, chosen), sensor_maps(plant, chosen)
    surfaces = dry_surfaces(plant, chosen, motor_load_by_port(plant, grouping, acting))
    return Model(
        plant=plant,
        assumptions=settled,
        effects=chosen,
        grouping=grouping,
        residual=residual,
        surfaces=surfaces,
        readings=readings,
        fitted=fitted,
        constants=constants_in(plant, (*residual, *readings, *(m.law for m in memories))),
        delay=parameter_of_kind(InputDelay, chosen),
        lag=lag,
        drive=voltage,
        regressor=regressor_of(plant, settled, residual, surfaces, memories, grouping, fitted),
        absent=absent_values(fitted, chosen),
        memories=memories,
        sensor_delay=parameter_of_kind(SensorDelay, chosen),
        delayed_channels=next((e.enters.channels for e in chosen if isinstance(e.enters, SensorDelay)), ()),
        event_times=tuple(f"{e.name}.{p.name}" for e in chosen for p in e.parameters if p.event_time),
    )


def residual_of(
    plant: Plant, chosen: tuple[Effect, ...], rows: tuple, acting: sp.Expr, unknown: Sequence[Parameter]
) -> tuple[sp.Expr, ...]:
    """The rows under the acting input, less the effects' forces and the unknown one on each coordinate's row."""
    driven, count = input_substitution(plant, acting), len(plant.coordinates)
    residual = [
        substitute(row, driven) - force for row, force in zip(rows, generalised_forces(plant, chosen), strict=True)
    ]
    residual = [divided_by_size(row, chosen) if n >= count else row for n, row in enumerate(residual)]
    return tuple(r - symbol(unknown[n].name) if n < len(unknown) else r for n, r in enumerate(residual))


def missing_forces(plant: Plant) -> list[Parameter]:
    """One unknown generalised force for each row."""
    return [Parameter(f"missing.{c.row}", plant.input_unit, "missing force") for c in plant.coordinates]


def base_parameters(plant: Plant, grouping: Grouping) -> list[Parameter]:
    """The plant's own parameters X1, X2, ..., each with what it is in physical symbols."""
    return [Parameter(n, base_parameter_unit(plant, n, grouping), str(d)) for n, d in parameter_definitions(grouping)]


def effect_parameters(chosen: tuple[Effect, ...]) -> list[Parameter]:
    """The parameters of all effects, under their full names."""
    return [Parameter(f"{e.name}.{p.name}", p.unit, e.sentence) for e in chosen for p in e.parameters]


def absent_values(fitted: tuple[Parameter, ...], chosen: tuple[Effect, ...]) -> tuple[float, ...]:
    """Value of each parameter while its effect is absent."""
    stated = {f"{e.name}.{p.name}": p.absent for e in chosen for p in e.parameters}
    return tuple(stated.get(p.name, 0.0) for p in fitted)


def constants_in(plant: Plant, expressions: Sequence[sp.Expr]) -> tuple[Parameter, ...]:
    """The known numbers that these expressions use."""
    used = set().union(*map(symbols_in, expressions))
    return tuple(c for c in (*plant.constants, origin_of(plant)) if symbol(c.name) in used)


def released_coordinates(chosen: tuple[Effect, ...]) -> tuple[str, ...]:
    """What the effects free inside the machine, in a fixed order."""
    return tuple(sorted({e.releases for e in chosen} - {""}))


def divided_by_size(row: sp.Expr, chosen: tuple[Effect, ...]) -> sp.Expr:
    """A row divided by the size that all of its terms share: what hangs in a machine moves, however light it is."""
    for size in (e.symbols[p.name] for e in chosen if e.releases for p in e.linear):
        if row != 0 and expand(row.subs(size, 0)) == 0:
            row = expand(expand(row) / size)
    return row


def origin_of(plant: Plant) -> Parameter:
    """The constant that says where the first coordinate was at the log's first sample."""
    first = plant.coordinates[0]
    return Parameter(ORIGIN_CONSTANT, first.unit, f"{first.name} at the log's first sample")


def motor_load_by_port(plant: Plant, grouping: Grouping, acting: sp.Expr) -> dict[str, sp.Expr]:
    """What each port carries of the motor: the plant's own loads on it, in volt-equivalents, under the acting input."""
    carried = {p.name: [load.force for load in plant.loads if load.port == p.name] for p in plant.ports}
    scaled = [expand(sp.Add(*f).subs(plant.substitutions) / plant.scale) for f in carried.values()]
    return {
        name: substitute(
            rewrite(plant, (force,), grouping.definitions, grouping.names)[0], input_substitution(plant, acting)
        )
        for name, force in zip(carried, scaled, strict=True)
    }


def regressor_of(plant: Plant, settled: dict, residual, surfaces, memories, grouping: Grouping, fitted) -> Regressor:
    """The regressor, for which what moves inside the machine and what remembers stand still: no sensor reads them."""
    inside = {s: sp.Integer(0) for c in plant.moving[len(plant.coordinates) :] for s in (c.q, c.dq, c.ddq)}
    inside |= {m.force: sp.Integer(0) for m in memories}
    rows = tuple(substitute(r, inside) for r in residual[: len(plant.coordinates)])
    rigid = plants.build(plant.name, settled)
    flat = tuple(s._replace(slip=s.slip[: len(plant.coordinates)], law=substitute(s.law, inside)) for s in surfaces)
    return derive_regressor(rigid, rows, flat, grouping, fitted)


def parameter_of_kind(kind: type, chosen: tuple[Effect, ...]) -> str:
    """Full name of the parameter of the effect that enters in this way, or an empty string."""
    return next((e.full_names[0] for e in chosen if isinstance(e.enters, kind)), "")


def in_library_order(effect_names: Sequence[str]) -> tuple[Effect, ...]:
    """The effects in the library's order, in which input and sensor maps are applied one after the other."""
    wanted = {library.find(name).name for name in effect_names}
    return tuple(e for e in library.all_with(sorted(wanted - set(library.EFFECT_LIBRARY))) if e.name in wanted)


def group_and_deform(plant: Plant, assumptions: dict, chosen: tuple[Effect, ...]) -> tuple[Grouping, tuple]:
    """Find the equivalent parameters on the undeformed, rigid plant, then write the rows with the deformations."""
    form = PlantConfiguration(plant.name, plants.fingerprint(plant.name), tuple(sorted(assumptions.items())))
    present = geometry_deviations(plant, chosen)
    rows = deformed_rows(form._replace(free=plant.free), tuple(present))
    return grouping_of(form), tuple(substitute(r, present) for r in rows)


@lru_cache(maxsize=64)
def equations_of(form: PlantConfiguration) -> tuple[sp.Expr, ...]:
    """Scaled rows in physical symbols, with every deformation."""
    plant = form.plant
    return scaled_rows(plant, derive_equations(plant))


@lru_cache(maxsize=64)
def grouping_of(form: PlantConfiguration) -> Grouping:
    """Equivalent parameters of a rigid plant, undeformed; they keep the names they have by default."""
    settled = tuple(sorted(plants.complete_assumptions(form.name, {}).items()))
    usual = None if form.assumptions == settled else grouping_of(form._replace(assumptions=settled))
    absent = dict.fromkeys(form.plant.geometry.values(), sp.Integer(0))
    rows = tuple(substitute(r, absent) for r in equations_of(form))
    return group_parameters(form.plant, rows, usual and regressor_columns(usual.rows, usual.names))


@lru_cache(maxsize=256)
def deformed_rows(form: PlantConfiguration, present: tuple[sp.Symbol, ...]) -> tuple[sp.Expr, ...]:
    """Rows in the equivalent parameters, with some of the deformations."""
    grouping = grouping_of(form._replace(free=()))
    absent = {s: sp.Integer(0) for s in form.plant.geometry.values() if s not in present}
    rows = tuple(substitute(r, absent) for r in equations_of(form))
    return rewrite(form.plant, rows, grouping.definitions, grouping.names)


def geometry_deviations(plant: Plant, chosen: tuple[Effect, ...]) -> dict[sp.Symbol, sp.Expr]:
    """What the effects make of the plant's geometry."""
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


def input_substitution(plant: Plant, acting: sp.Expr) -> dict[sp.Symbol, sp.Expr]:
    """What acts for each input: the same for all that acts for the first."""
    return {u: acting.subs(plant.input, u) for u in plant.inputs}


def input_map(plant: Plant, chosen: tuple[Effect, ...]) -> sp.Expr:
    """The voltage that reaches the motor, as the actuator effects make it from the commanded one."""
    voltage: sp.Expr = plant.input
    for effect in chosen:
        if isinstance(effect.enters, InputMap):
            voltage = effect.enters.law(voltage, TIME_SYMBOL, **effect.symbols)
    return voltage


def generalised_forces(plant: Plant, chosen: tuple[Effect, ...]) -> list[sp.Expr]:
    """Generalised forces of the effects on each row, by virtual work on their ports."""
    resistances = [(inner.q, internal_force_law(inner, name, chosen)) for name, inner in plant.internal.items()
                   if name in plant.free]  # fmt: skip
    for effect in chosen:
        if isinstance(effect.enters, Force):
            angle = plant.port(effect.enters.port).coordinate
            resistances.append((angle, effect.enters.law(angle, rate_of(angle, plant), **effect.symbols)))
        elif isinstance(effect.enters, HysteresisForce):
            resistances.append((plant.port(effect.enters.port).coordinate, hysteresis_symbol(effect)))
    return [
        -sp.Add(*(f * along for angle, f in resistances if (along := derivative(angle, c.q)))) for c in plant.moving
    ]


def internal_force_law(inner: Coordinate, name: str, chosen: tuple[Effect, ...]) -> sp.Expr:
    """What resists a give inside the machine: the effects' laws, outside of a play where there is one."""
    laws = [(e.enters.law, e.symbols) for e in chosen if isinstance(e.enters, InternalForce) and e.releases == name]
    beyond = inner.q
    for effect in chosen:
        if isinstance(effect.enters, InternalPlay) and effect.releases == name:
            laws = laws or [(effect.enters.contact, {})]
            beyond = Sign(inner.q) * Ramp(Magnitude(inner.q) - effect.enters.width(**effect.symbols) / 2)
    return sp.Add(*(law(beyond, inner.dq, **parameters) for law, parameters in laws))


def hysteresis_symbol(effect: Effect) -> sp.Symbol:
    """Symbol of the force of an effect with a memory."""
    return symbol(f"{effect.name}_force")


def hysteresis_forces(plant: Plant, chosen: tuple[Effect, ...]) -> tuple[Hysteresis, ...]:
    """The forces with a memory, each with its law along a path of slip."""
    found = []
    for effect in chosen:
        if isinstance(effect.enters, HysteresisForce):
            before, path = symbol(f"{effect.name}_before"), symbol(f"{effect.name}_path")
            law = effect.enters.law(before, path, **effect.symbols)
            found.append(Hysteresis(hysteresis_symbol(effect), before, path, law, slip_row(plant, effect.enters.port)))
    return tuple(found)


def dry_surfaces(
    plant: Plant, chosen: tuple[Effect, ...], loads: Mapping[str, sp.Expr] | None = None
) -> tuple[DrySurface, ...]:
    """Ports with dry friction, each with the sum of the laws that act there.

    A law may depend on what its port carries of the motor, which ``loads`` says; without them that is the input.
    """
    laws: dict[str, sp.Expr] = {}
    for effect in chosen:
        if isinstance(effect.enters, DryForce):
            port = effect.enters.port
            speed = rate_of(plant.port(port).coordinate, plant)
            law = sp.sympify(effect.enters.law(direction_of(port), speed, **effect.symbols))
            law = law.subs(LOAD_SYMBOL, (loads or {}).get(port, plant.input))
            laws[port] = laws.get(port, sp.Integer(0)) + law
    return tuple(DrySurface(port, slip_row(plant, port), law, direction_of(port)) for port, law in laws.items())


def direction_of(port: str) -> sp.Symbol:
    """Symbol of the direction in which a port slips."""
    return symbol(f"direction_{port}")


def slip_row(plant: Plant, port: str) -> tuple[float, ...]:
    """Slip speed of a port as constant weights on the coordinates' rates."""
    weights = tuple(derivative(plant.port(port).coordinate, c.q) for c in plant.moving)
    if any(w.free_symbols for w in weights):
        raise ValueError(f"Dry friction needs a port whose angle is linear in the coordinates; {port} is not")
    return tuple(float(w) for w in weights)


def rate_of(angle: sp.Expr, plant: Plant) -> sp.Expr:
    """Time derivative of a function of the coordinates."""
    return sp.Add(*(derivative(angle, c.q) * c.dq for c in plant.moving))


def sensor_maps(plant: Plant, chosen: tuple[Effect, ...]) -> tuple[sp.Expr, ...]:
    """What the sensors report, as the sensor effects make it from the true motion."""
    readings = {c.name: c.reading for c in plant.channels}
    for effect in chosen:
        if isinstance(effect.enters, SensorMap):
            readings[effect.enters.channel] = effect.enters.law(readings[effect.enters.channel], **effect.symbols)
    return tuple(readings.values())
