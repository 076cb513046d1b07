"""The table of a model's numbers."""

from __future__ import annotations

import math
from typing import NamedTuple

import sympy as sp

from derive.algebra import derivative, substitute, symbols_in, terms_containing
from derive.base_equations import parameter_definitions
from derive.effects import HysteresisForce, InternalForce
from derive.functions import symbol
from derive.model import ORIGIN_CONSTANT, missing_forces
from derive.records import Model, Relations

UNKNOWN_CONSTANT = 2.0  # stands for one that no effect in force needs: of a gear ratio 1 would make 0/0 of some terms


class Parameters(NamedTuple):
    """The parameters in the order of their vector."""

    names: tuple[str, ...]
    units: tuple[str, ...]
    absent: tuple[str, ...]  # value of each while it has no influence, as an expression
    own: int  # so many, from the first, are the plant's own
    fitted: int  # so many, from the first, have sensitivities
    missing_forces: tuple[str, ...]  # unknown forces, one for each row, where they were asked for
    origin: int  # index of the angle at the log's first sample, or -1
    event_times: tuple[int, ...]  # indices of those that are times
    linear: tuple[str, ...]  # those of the regressor
    signed: tuple[str, ...]  # own ones that may be negative: differences of physical constants
    needs: dict[str, tuple[str, ...]]  # constants without which one has no meaning
    relations: Relations
    carrying: tuple[str, ...]  # effects with states that carry over from one fitted segment to the next
    hysteresis_sizes: tuple[int, ...]  # indices of parameters; no force has a memory where these are zero
    internal: tuple[str, ...]  # parameters of the forces along internal coordinates
    stiffest: dict[str, float]  # largest values of those that are infinite where an internal coordinate is rigid


def parameters_of(model: Model) -> Parameters:
    """Names, units, absent values, indices and relations of the model's parameters."""
    names = model.parameters
    absent = (*model.absent, *(UNKNOWN_CONSTANT for _ in model.constants))
    unknown = tuple(f.name for f in missing_forces(model.plant) if f.name in names)
    return Parameters(
        names=names,
        units=tuple(p.unit for p in (*model.fitted, *model.constants)),
        absent=tuple("math.inf" if math.isinf(v) else repr(v) for v in absent),
        own=len(model.fitted) - sum(len(e.parameters) for e in model.effects) - len(unknown),
        fitted=len(model.fitted),
        missing_forces=unknown,
        origin=names.index(ORIGIN_CONSTANT) if ORIGIN_CONSTANT in names else -1,
        event_times=tuple(names.index(name) for name in model.event_times),
        linear=tuple(s.name for s in model.regressor.parameters),
        signed=tuple(n for n, d in parameter_definitions(model.grouping) if not is_positive(d)),
        needs=needed_constants(model),
        relations=model.relations or Relations({}, {}, {}),
        carrying=tuple(e.name for e in model.effects if e.carries),
        hysteresis_sizes=tuple(names.index(n) for n in first_parameters(model, HysteresisForce)),
        internal=tuple(n for e in model.effects if isinstance(e.enters, InternalForce) for n in e.full_names),
        stiffest=stiffest_values(model),
    )


def first_parameters(model: Model, kind: type) -> tuple[str, ...]:
    """Full names of the first parameter of each effect that enters in this way."""
    return tuple(e.full_names[0] for e in model.effects if isinstance(e.enters, kind))


def stiffest_values(model: Model) -> dict[str, float]:
    """Largest values, by full name, of parameters that are infinite where an internal coordinate is rigid."""
    pairs = [(n, p) for e in model.effects if e.releases for n, p in zip(e.full_names, e.parameters, strict=True)]
    return {n: p.maximum for n, p in pairs if math.isinf(p.absent) and math.isfinite(p.maximum)}


def is_positive(definition: sp.Expr) -> bool:
    """True where a parameter is a sum of products of physical constants, all of which are positive."""
    return all(term.is_positive for term in sp.Add.make_args(sp.expand(definition)))


def needed_constants(model: Model) -> dict[str, tuple[str, ...]]:
    """Known constants in the factors of each effect's parameters, or of the coordinate that it releases."""
    known = [c.name for c in model.constants if c.name != ORIGIN_CONSTANT]
    table: dict[str, tuple[str, ...]] = {}
    for effect in model.effects:
        own = set(effect.symbols.values())
        others = {s: sp.Integer(0) for e in model.effects for p, s in zip(e.parameters, e.symbols.values(), strict=True)
                  if p.absent == 0.0 and s not in own}  # fmt: skip
        inner = model.plant.internal.get(effect.releases)
        touched = (*own, *((inner.q, inner.dq, inner.ddq) if inner else ()))
        parts = [substitute(terms_containing(row, touched), others) for row in model.residual]
        inside = set().union(*(symbols_in(derivative(part, s)) for part in parts for s in touched))
        wanted = tuple(c for c in known if symbol(c) in inside)
        table |= {name: wanted for name in effect.full_names if wanted}
    return table
