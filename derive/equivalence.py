"""What no data can tell apart, found from the equations: effects inside the model's own parameters, twins, and effects
that contain others.

To first order in its size an effect changes what the sensors read and adds a force to each row. Both together, as
functions of the motion, are its *trace*. A shift or a scaling of the coordinates has a trace too, but changes no log.
So traces count up to those of such changes and of the model's own parameters, with weights that are constant in time.
Constants get generic values, so that a relation is one that holds whatever the machine's numbers are.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from functools import lru_cache
from itertools import combinations
from typing import NamedTuple

import sympy as sp

from derive import effects as library
from derive import plants
from derive.algebra import combination, generic, modulo, replaced, slope, terms
from derive.effects import Deformation, Effect, InnerForce, InnerPlay, InputDelay, InputLag, PathForce, SensorDelay
from derive.functions import TIME, symbol
from derive.grouping import NotExpressibleError
from derive.model import driven_by, dry_surfaces, forces, group_and_deform, input_map, sensor_maps
from derive.records import Plant, Relations

UNTRACED = (InputDelay, InputLag, SensorDelay, PathForce, InnerForce, InnerPlay)  # act with a memory or a delay
Trace = tuple[sp.Expr, ...]  # change of each reading, then of each row
Terms = dict[tuple[int, sp.Expr], sp.Expr]  # (entry, function of the motion) → constant


class Ground(NamedTuple):
    """What the traces of effects are compared with."""

    plant: Plant
    rows: Trace  # of the plant without any effect
    parameters: dict[str, Terms]  # of the model's own parameters
    changes: tuple[Terms, ...]  # of coordinates


def relations(plant: str, assumptions: dict, names: Sequence[str]) -> Relations:
    """What the equations say about these effects on a plant."""
    settled = plants.settle(plant, assumptions)
    chosen = [library.find(n) for n in names]
    inside = {e.name: absorbed(plant, settled, e.name) for e in chosen}
    weights = {f"{e}.{p}": w for e, found in inside.items() for p, w in found.items()}
    others = [e.name for e in chosen if not inside[e.name]]
    return Relations(weights, twins(plant, settled, others), contained(plant, settled, others))


def absorbed(plant: str, assumptions: dict, effect: str) -> dict[str, dict[str, float]]:
    """Weights on the model's own parameters, per parameter of an effect that is part of them; else empty.

    A size s of the effect is the same as adding s times the weight to each parameter.
    """
    row, ground = library.find(effect), ground_of(plant, assumptions)
    found = traces(plant, assumptions, effect)
    if not found or any(p.scope != "shared" for p in row.linear) or len(row.linear) < len(row.parameters):
        return {}
    table = {}
    for parameter, trace in zip(row.linear, found, strict=True):
        weights = combination(at_primes(ground.parameters.values()), *at_primes([trace]))
        if weights is None or any(constant.free_symbols for constant in trace.values()):
            return {}  # it is not, or by weights that change with the machine
        pairs = zip(ground.parameters, weights, strict=True)
        table[parameter.name] = {name: float(w) for name, w in pairs if w != 0}
    return table


def twins(plant: str, assumptions: dict, names: Sequence[str]) -> dict[str, tuple[str, ...]]:
    """Effects whose traces are the same up to the model's own parameters and changes of coordinates."""
    ground = ground_of(plant, assumptions)
    found = {n: t for n in names if (t := traces(plant, assumptions, n))}
    known = [*ground.parameters.values(), *ground.changes]
    rest = iter(modulo(at_primes(known), at_primes([t for own in found.values() for t in own])))
    left = {name: [next(rest) for _ in own] for name, own in found.items()}
    same = {frozenset((a, b)) for a, b in combinations(left, 2) if spans(left[a], left[b]) and spans(left[b], left[a])}
    table = {name: tuple(sorted(o for o in found if {o, name} in same)) for name in found}
    return {name: others for name, others in table.items() if others}


def contained(plant: str, assumptions: dict, names: Sequence[str]) -> dict[str, dict[str, tuple]]:
    """Per effect the smaller ones that it contains, each as a matrix: its linear parameters by those of the smaller."""
    found = {n: t for n in names if (t := traces(plant, assumptions, n))}
    table: dict[str, dict[str, tuple]] = {}
    for name, own in found.items():
        for other, smaller in found.items():
            if len(smaller) < len(own) and spans(at_primes(own), at_primes(smaller)):
                columns = [combination(at_primes(own), t) or () for t in at_primes(smaller)]
                rows = tuple(tuple(float(w) for w in row) for row in zip(*columns, strict=True))
                table.setdefault(name, {})[other] = rows
    return table


def traces(plant: str, assumptions: dict, effect: str) -> list[Terms]:
    """The trace of each of an effect's linear parameters; empty where it has none that can be written down."""
    return list(_traces(plant, tuple(sorted(assumptions.items())), library.find(effect)))


@lru_cache(maxsize=256)
def _traces(plant_name: str, assumptions: tuple, effect: Effect) -> tuple[Terms, ...]:
    plant, rows, *_ = _ground(plant_name, assumptions)
    if effect.event or isinstance(effect.enters, UNTRACED) or not library.fits(effect, plant.plant_signature):
        return ()
    if isinstance(effect.enters, Deformation):
        try:
            rows = group_and_deform(plant, dict(assumptions), (effect,))[1]
        except NotExpressibleError:
            return ()
    whole = whole_of(plant, rows, (effect,))
    absent = {effect.symbols[p.name]: sp.nsimplify(p.absent) for p in effect.parameters}
    found = [
        tuple(slope(e, effect.symbols[p.name]).subs(absent) for e in whole) for p in effect.linear
    ]  # fmt: skip
    return tuple(terms_of(plant, trace) for trace in found)


def ground_of(plant: str, assumptions: dict) -> Ground:
    """Traces of the plant's own parameters and of the changes of its coordinates."""
    return _ground(plant, tuple(sorted(assumptions.items())))


@lru_cache(maxsize=16)
def _ground(plant_name: str, assumptions: tuple) -> Ground:
    settled = dict(assumptions)
    plant = plants.build(plant_name, settled)
    grouping, rows = group_and_deform(plant, settled, ())
    whole = whole_of(plant, rows, ())
    parameters = {n: terms_of(plant, tuple(slope(e, symbol(n)) for e in whole)) for n in grouping.names}
    return Ground(plant, rows, parameters, tuple(terms_of(plant, t) for t in coordinate_changes(plant, whole)))


def whole_of(plant: Plant, rows: Trace, chosen: tuple[Effect, ...]) -> Trace:
    """Readings, then the rows with every force of the chosen effects.

    Of a dry force the part that does not turn with the direction of slip is a constant force, in slip and in stick.
    """
    driven = [replaced(r, driven_by(plant, input_map(plant, chosen))) for r in rows]
    total = [r - f for r, f in zip(driven, forces(plant, chosen), strict=True)]
    for surface in dry_surfaces(plant, chosen):
        ahead, back = (surface.law.subs(surface.direction, d) for d in (1, -1))
        law = (ahead + back) / 2 + (ahead - back) / 2 * surface.direction
        total = [r + sp.nsimplify(w) * law if w else r for r, w in zip(total, surface.slip, strict=True)]
    return (*sensor_maps(plant, chosen), *total)


def coordinate_changes(plant: Plant, whole: Trace) -> list[Trace]:
    """Traces of shifting a coordinate by a constant, or by a multiple of one, with rate and acceleration."""
    one = (sp.Integer(1), sp.Integer(0), sp.Integer(0))
    shifts = [one, *((c.q, c.dq, c.ddq) for c in plant.coordinates)]
    return [
        tuple(slope(e, c.q) * q + slope(e, c.dq) * dq + slope(e, c.ddq) * ddq for e in whole)
        for c in plant.coordinates
        for q, dq, ddq in shifts
    ]


def terms_of(plant: Plant, trace: Trace) -> Terms:
    """A trace as constants times functions of the motion."""
    moving = {s for c in plant.coordinates for s in (c.q, c.dq, c.ddq)} | {*plant.inputs, TIME}
    moving |= {symbol(f"direction_{p.name}") for p in plant.ports}
    return {(n, motion): constant for n, entry in enumerate(trace) for motion, constant in terms(entry, moving).items()}


def at_primes(traces: Iterable[Terms]) -> list[Terms]:
    """Traces with generic values for their constants."""
    return [{key: generic(constant) for key, constant in trace.items()} for trace in traces]


def spans(known: Sequence[Mapping], wanted: Sequence[Mapping]) -> bool:
    """Whether every wanted trace is a combination of the known ones."""
    return all(combination(known, w) is not None for w in wanted)
