"""Composition: plant, assumptions and effects become one residual per coordinate, with nothing left to choose."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache

import sympy as sp

from derive import effects as library
from derive import plants
from derive.effects import Deformation, DryForce, Effect, Force, InputDelay, InputLag, InputMap, SensorMap
from derive.functions import TIME, symbol
from derive.grouping import Grouping, columns, group, rewrite, scaled_rows
from derive.lagrange import derive_equations
from derive.records import DrySurface, Model, Parameter, Plant
from derive.regressor import derive_regressor

ORIGIN = Parameter("origin", "rad", "wheel angle at the log's first sample")


def compose(plant_name: str, assumptions: dict, effect_names: Sequence[str], missing_force: bool = False) -> Model:
    """Derive the complete model.

    ``missing_force`` adds one unknown generalised force per row, named missing.<row>, with which a residual can be
    turned into the force that the model lacks.

    Raises KeyError for unknown names and NotExpressibleError when an effect needs constants that the plant lacks.
    """
    settled = plants.settle(plant_name, assumptions)
    plant = plants.find(plant_name).build(settled)
    chosen = in_library_order((*effect_names, *plants.brought(plant_name, settled)))
    grouping, rows = group_and_deform(plant, settled, chosen)
    lag, voltage = parameter_of(InputLag, chosen), input_map(plant, chosen)
    acting = plant.input if lag else voltage  # a lagging input is a state of its own
    residual = [row.subs(plant.input, acting) - force for row, force in zip(rows, forces(plant, chosen), strict=True)]
    fitted = [Parameter(n, x_unit(plant, n, grouping), str(d)) for n, d in named(grouping)]
    fitted += [Parameter(f"{e.name}.{p.name}", p.unit, e.sentence) for e in chosen for p in e.parameters]
    absent = [0.0] * len(grouping.names) + [p.absent for e in chosen for p in e.parameters]
    if missing_force:
        absent += [0.0] * len(plant.coordinates)
        residual = [r - symbol(f"missing.{c.row}") for r, c in zip(residual, plant.coordinates, strict=True)]
        fitted += [Parameter(f"missing.{c.row}", plant.input_unit, "missing force") for c in plant.coordinates]
    readings = sensor_maps(plant, chosen)
    used = set().union(*(e.free_symbols for e in (*residual, *readings)))
    constants = [c for c in (*plant.constants, ORIGIN) if symbol(c.name) in used]
    return Model(
        plant=plant,
        assumptions=settled,
        effects=chosen,
        grouping=grouping,
        residual=tuple(residual),
        surfaces=dry_surfaces(plant, chosen),
        readings=readings,
        fitted=tuple(fitted),
        constants=tuple(constants),
        delay=parameter_of(InputDelay, chosen),
        lag=lag,
        drive=voltage,
        regressor=derive_regressor(plant, tuple(residual), dry_surfaces(plant, chosen), grouping, tuple(fitted)),
        absent=tuple(absent),
    )


def parameter_of(kind: type, chosen: tuple[Effect, ...]) -> str:
    """Full name of the parameter of the effect that enters in this way, or an empty string."""
    return next((e.full_names[0] for e in chosen if isinstance(e.enters, kind)), "")


def in_library_order(effect_names: Sequence[str]) -> tuple[Effect, ...]:
    """The effects in the library's order, in which input and sensor maps are applied one after the other."""
    wanted = {library.find(name).name for name in effect_names}
    return tuple(e for e in library.all_with(sorted(wanted - set(library.LIBRARY))) if e.name in wanted)


def group_and_deform(plant: Plant, assumptions: dict, chosen: tuple[Effect, ...]) -> tuple[Grouping, tuple]:
    """Find the equivalent parameters on the undeformed plant, then re-derive with the chosen deformations."""
    absent = {s: sp.Integer(0) for s in plant.geometry.values()}
    deformed = scaled_rows(plant, derive_equations(plant))
    grouping = group(plant, tuple(r.subs(absent) for r in deformed), default_columns(plant.name))
    present = {plant.geometry[e.enters.symbol]: e for e in chosen if isinstance(e.enters, Deformation)}
    rows = tuple(r.subs({s: 0 for s in absent if s not in present}) for r in deformed)
    rows = rewrite(plant, rows, grouping.definitions, grouping.names)
    return grouping, tuple(r.subs({s: symbol(e.full_names[0]) for s, e in present.items()}) for r in rows)


@lru_cache
def default_columns(plant_name: str) -> dict[str, sp.Matrix]:
    """Regressor columns under the default assumptions, which give the parameters their names."""
    plant = plants.find(plant_name).build(plants.settle(plant_name, {}))
    absent = {s: sp.Integer(0) for s in plant.geometry.values()}
    grouping = group(plant, tuple(r.subs(absent) for r in scaled_rows(plant, derive_equations(plant))))
    return columns(grouping.rows, grouping.names)


def named(grouping: Grouping):
    """Pairs of name and definition."""
    return zip(grouping.names, grouping.definitions, strict=True)


def x_unit(plant: Plant, name: str, grouping: Grouping) -> str:
    """Unit of an equivalent parameter, from what it multiplies."""
    column = columns(grouping.rows, (name,))[name]
    for c in plant.coordinates:
        if any(entry.has(c.ddq) for entry in column):
            return f"{plant.input_unit} s²/{c.unit}"
        if any(entry.has(c.dq) for entry in column):
            return f"{plant.input_unit} s/{c.unit}"
    return plant.input_unit


def input_map(plant: Plant, chosen: tuple[Effect, ...]) -> sp.Expr:
    """The voltage that reaches the motor, as the actuator effects make it from the commanded one."""
    voltage: sp.Expr = plant.input
    for effect in chosen:
        if isinstance(effect.enters, InputMap):
            voltage = effect.enters.law(voltage, TIME, **effect.symbols)
    return voltage


def forces(plant: Plant, chosen: tuple[Effect, ...]) -> list[sp.Expr]:
    """Generalised forces of the effects on each row, by virtual work on their ports."""
    total = [sp.Integer(0)] * len(plant.coordinates)
    for effect in chosen:
        if isinstance(effect.enters, Force):
            angle = plant.port(effect.enters.port).coordinate
            resistance = effect.enters.law(angle, rate_of(angle, plant), **effect.symbols)
            for row, c in enumerate(plant.coordinates):
                total[row] -= resistance * angle.diff(c.q)
    return total


def dry_surfaces(plant: Plant, chosen: tuple[Effect, ...]) -> tuple[DrySurface, ...]:
    """Ports with dry friction, each with the sum of the laws that act there."""
    laws: dict[str, sp.Expr] = {}
    for effect in chosen:
        if isinstance(effect.enters, DryForce):
            port = effect.enters.port
            speed = rate_of(plant.port(port).coordinate, plant)
            law = effect.enters.law(direction_of(port), speed, **effect.symbols)
            laws[port] = laws.get(port, sp.Integer(0)) + law
    return tuple(DrySurface(port, slip_row(plant, port), law, direction_of(port)) for port, law in laws.items())


def direction_of(port: str) -> sp.Symbol:
    """Symbol of the direction in which a port slips."""
    return symbol(f"direction_{port}")


def slip_row(plant: Plant, port: str) -> tuple[float, ...]:
    """Slip speed of a port as constant weights on the coordinates' rates."""
    weights = tuple(plant.port(port).coordinate.diff(c.q) for c in plant.coordinates)
    if any(w.free_symbols for w in weights):
        raise ValueError(f"Dry friction needs a port whose angle is linear in the coordinates; {port} is not")
    return tuple(float(w) for w in weights)


def rate_of(angle: sp.Expr, plant: Plant) -> sp.Expr:
    """Time derivative of a function of the coordinates."""
    return sp.Add(*(angle.diff(c.q) * c.dq for c in plant.coordinates))


def sensor_maps(plant: Plant, chosen: tuple[Effect, ...]) -> tuple[sp.Expr, ...]:
    """What the sensors report, as the sensor effects make it from the true motion."""
    readings = {c.name: c.reading for c in plant.channels}
    for effect in chosen:
        if isinstance(effect.enters, SensorMap):
            readings[effect.enters.channel] = effect.enters.law(readings[effect.enters.channel], **effect.symbols)
    return tuple(readings.values())
