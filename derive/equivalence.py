"""Effects that no log can distinguish, by the equations: parts of base parameters, twins, and effects within others.

To first order in its size an effect changes what the sensors read and adds a force to each row. Both together, as
functions of the motion, are its *trace*. A shift or a scaling of the coordinates has a trace too, but changes no log.
So traces count up to those of such changes and of the model's own parameters, with weights that are constant in time.
Constants get generic values, so that a relation is valid for almost all numbers of the machine.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from functools import lru_cache
from itertools import combinations
from typing import NamedTuple

import sympy as sp

from derive import effects as library
from derive import plants
from derive.algebra import (
    at_generic_point,
    collect_terms,
    derivative,
    linear_combination,
    reduce_modulo_span,
    substitute,
)
from derive.base_equations import group_and_deform
from derive.effect_laws import dry_surfaces, generalised_forces, input_map, input_substitution, sensor_maps
from derive.effects import (
    Deformation,
    Effect,
    HysteresisForce,
    InputDelay,
    InputLag,
    InternalForce,
    InternalPlay,
    SensorDelay,
    SensorFilter,
)
from derive.functions import TIME_SYMBOL, symbol
from derive.grouping import NotExpressibleError
from derive.parameter_name import full_name
from derive.records import Plant, Relations

KINDS_WITHOUT_TRACE = (
    InputDelay,
    InputLag,
    SensorDelay,
    SensorFilter,
    HysteresisForce,
    InternalForce,
    InternalPlay,
)  # act with a memory or a delay
Trace = tuple[sp.Expr, ...]  # change of each reading, then of each row
TermTable = dict[tuple[int, sp.Expr], sp.Expr]  # (entry, function of the motion) → constant


class PlantTraces(NamedTuple):
    """Traces of a plant's base parameters and coordinate changes, modulo which effects are compared."""

    plant: Plant
    rows: Trace  # of the plant without any effect
    parameters: dict[str, TermTable]  # of the model's own parameters
    changes: tuple[TermTable, ...]  # of coordinates


def relations(plant: str, assumptions: dict, names: Sequence[str]) -> Relations:
    """Relations among these effects on a plant: absorbed, twins and contained."""
    complete = plants.complete_assumptions(plant, assumptions)
    chosen = [library.find(n) for n in names]
    inside = {e.name: absorbed(plant, complete, e.name) for e in chosen}
    weights = {full_name(e, p): w for e, found in inside.items() for p, w in found.items()}
    others = [e.name for e in chosen if not inside[e.name]]
    return Relations(weights, twins(plant, complete, others), contained(plant, complete, others))


def absorbed(plant: str, assumptions: dict, effect: str) -> dict[str, dict[str, float]]:
    """Weights on the model's own parameters, per parameter of an effect that is part of them; else empty.

    A size s of the effect is the same as adding s times the weight to each parameter.
    """
    row, base = library.find(effect), plant_traces(plant, assumptions)
    found = traces(plant, assumptions, effect)
    if not found or any(p.scope != "shared" for p in row.linear) or len(row.linear) < len(row.parameters):
        return {}
    table = {}
    for parameter, trace in zip(row.linear, found, strict=True):
        weights = linear_combination(at_generic_points(base.parameters.values()), *at_generic_points([trace]))
        if weights is None or any(constant.free_symbols for constant in trace.values()):
            return {}  # it is not, or by weights that change with the machine
        pairs = zip(base.parameters, weights, strict=True)
        table[parameter.name] = {name: float(w) for name, w in pairs if w != 0}
    return table


def twins(plant: str, assumptions: dict, names: Sequence[str]) -> dict[str, tuple[str, ...]]:
    """Effects whose traces are the same up to the model's own parameters and changes of coordinates."""
    base = plant_traces(plant, assumptions)
    found = {n: t for n in names if (t := traces(plant, assumptions, n))}
    known = [*base.parameters.values(), *base.changes]
    rest = iter(
        reduce_modulo_span(at_generic_points(known), at_generic_points([t for own in found.values() for t in own]))
    )
    left = {name: [next(rest) for _ in own] for name, own in found.items()}
    same = {
        frozenset((a, b)) for a, b in combinations(left, 2) if in_span(left[a], left[b]) and in_span(left[b], left[a])
    }
    table = {name: tuple(sorted(o for o in found if {o, name} in same)) for name in found}
    return {name: others for name, others in table.items() if others}


def contained(plant: str, assumptions: dict, names: Sequence[str]) -> dict[str, dict[str, tuple]]:
    """Per effect the smaller ones that it contains, each as a matrix: its linear parameters by those of the smaller."""
    found = {n: t for n in names if (t := traces(plant, assumptions, n))}
    table: dict[str, dict[str, tuple]] = {}
    for name, own in found.items():
        for other, smaller in found.items():
            if len(smaller) < len(own) and in_span(at_generic_points(own), at_generic_points(smaller)):
                columns = [linear_combination(at_generic_points(own), t) or () for t in at_generic_points(smaller)]
                rows = tuple(tuple(float(w) for w in row) for row in zip(*columns, strict=True))
                table.setdefault(name, {})[other] = rows
    return table


def traces(plant: str, assumptions: dict, effect: str) -> list[TermTable]:
    """The trace of each of an effect's linear parameters; empty where it has none that can be written down."""
    return list(_traces(plant, tuple(sorted(assumptions.items())), library.find(effect)))


@lru_cache(maxsize=256)
def _traces(plant_name: str, assumptions: tuple, effect: Effect) -> tuple[TermTable, ...]:
    plant, rows, *_ = _plant_traces(plant_name, assumptions)
    if (
        effect.event
        or isinstance(effect.enters, KINDS_WITHOUT_TRACE)
        or not library.is_applicable(effect, plant.plant_signature)
    ):
        return ()
    if isinstance(effect.enters, Deformation):
        try:
            rows = group_and_deform(plant, dict(assumptions), (effect,))[1]
        except NotExpressibleError:
            return ()
    entries = readings_and_rows(plant, rows, (effect,))
    absent = {effect.symbols[p.name]: sp.nsimplify(p.absent) for p in effect.parameters}
    found = [
        tuple(derivative(e, effect.symbols[p.name]).subs(absent) for e in entries) for p in effect.linear
    ]  # fmt: skip
    return tuple(term_table(plant, trace) for trace in found)


def plant_traces(plant: str, assumptions: dict) -> PlantTraces:
    """Traces of the plant's own parameters and of the changes of its coordinates."""
    return _plant_traces(plant, tuple(sorted(assumptions.items())))


@lru_cache(maxsize=16)
def _plant_traces(plant_name: str, assumptions: tuple) -> PlantTraces:
    complete = dict(assumptions)
    plant = plants.build(plant_name, complete)
    grouping, rows = group_and_deform(plant, complete, ())
    entries = readings_and_rows(plant, rows, ())
    parameters = {n: term_table(plant, tuple(derivative(e, symbol(n)) for e in entries)) for n in grouping.names}
    return PlantTraces(plant, rows, parameters, tuple(term_table(plant, t) for t in coordinate_changes(plant, entries)))


def readings_and_rows(plant: Plant, rows: Trace, chosen: tuple[Effect, ...]) -> Trace:
    """Readings, then the rows with every force of the chosen effects.

    Of a dry force the part that does not turn with the direction of slip is a constant force, in slip and in stick.
    """
    driven = [substitute(r, input_substitution(plant, input_map(plant, chosen))) for r in rows]
    total = [r - f for r, f in zip(driven, generalised_forces(plant, chosen), strict=True)]
    for surface in dry_surfaces(plant, chosen):
        ahead, back = (surface.law.subs(surface.direction, d) for d in (1, -1))
        law = (ahead + back) / 2 + (ahead - back) / 2 * surface.direction
        total = [r + sp.nsimplify(w) * law if w else r for r, w in zip(total, surface.slip, strict=True)]
    return (*sensor_maps(plant, chosen), *total)


def coordinate_changes(plant: Plant, entries: Trace) -> list[Trace]:
    """Traces of shifting a coordinate by a constant, or by a multiple of one, with rate and acceleration."""
    one = (sp.Integer(1), sp.Integer(0), sp.Integer(0))
    shifts = [one, *((c.q, c.dq, c.ddq) for c in plant.coordinates)]
    return [
        tuple(derivative(e, c.q) * q + derivative(e, c.dq) * dq + derivative(e, c.ddq) * ddq for e in entries)
        for c in plant.coordinates
        for q, dq, ddq in shifts
    ]


def term_table(plant: Plant, trace: Trace) -> TermTable:
    """A trace as constants times functions of the motion."""
    moving = {s for c in plant.coordinates for s in (c.q, c.dq, c.ddq)} | {*plant.inputs, TIME_SYMBOL}
    moving |= {symbol(f"direction_{p.name}") for p in plant.ports}
    return {
        (n, motion): constant
        for n, entry in enumerate(trace)
        for motion, constant in collect_terms(entry, moving).items()
    }


def at_generic_points(traces: Iterable[TermTable]) -> list[TermTable]:
    """Traces with generic values for their constants."""
    return [{key: at_generic_point(constant) for key, constant in trace.items()} for trace in traces]


def in_span(known: Sequence[Mapping], wanted: Sequence[Mapping]) -> bool:
    """True where every wanted trace is a linear combination of the known ones."""
    return all(linear_combination(known, w) is not None for w in wanted)
