"""Dry friction on surfaces, and rate-independent hysteresis."""

from __future__ import annotations

from typing import NamedTuple

import sympy as sp

from derive.algebra import derivative, symbols_in
from derive.functions import symbol
from derive.kernels.arguments import scalar_sources, sources, variables_of
from derive.printing import Kernel, Target, kernel, local_name
from derive.records import Hysteresis, Model


class HysteresisCode(NamedTuple):
    """A hysteresis force: its name, its index among the variables, and its path by the moving coordinates."""

    name: str
    variable_index: int
    path: tuple[tuple[float, str, int], ...]  # weight, coordinate, its index among the variables
    value: Kernel
    jacobian: Kernel


class Friction(NamedTuple):
    """Surfaces that stick or slip, and hysteresis forces."""

    directions: tuple[str, ...]  # of the surfaces
    slip_matrix: tuple[tuple[float, ...], ...]  # slip speed of each as weights on the rates
    sizes: tuple[int, ...]  # indices of parameters; all surfaces are smooth where these are zero
    parameters: tuple[int, ...]  # indices of all fitted parameters that the dry laws have in them
    hysteresis: tuple[HysteresisCode, ...]


def friction_of(model: Model) -> Friction:
    """Slip directions, slip matrix, sizes and hysteresis forces of a model."""
    return Friction(
        directions=tuple(local_name(s.direction.name) for s in model.surfaces),
        slip_matrix=tuple(s.slip for s in model.surfaces),
        sizes=tuple(model.parameters.index(name) for name in dry_sizes(model)),
        parameters=tuple(model.parameters.index(name) for name in dry_parameters(model)),
        hysteresis=tuple(hysteresis_code(model, m) for m in model.hystereses),
    )


def hysteresis_code(model: Model, memory: Hysteresis) -> HysteresisCode:
    """A hysteresis force as text, with derivatives in the force before, in the path, then in the parameters."""
    variables = variables_of(model)
    pairs = zip(memory.weights, model.plant.moving, strict=True)
    table = sources(model, **{s.name: s.name for s in (memory.before, memory.path)})
    slopes = [
        Target("by_before", derivative(memory.law, memory.before)),
        Target("by_path", derivative(memory.law, memory.path)),
    ]
    own = [(n, derivative(memory.law, symbol(p.name))) for n, p in enumerate(model.fitted)]
    return HysteresisCode(
        memory.force.name,
        variables.index(memory.force.name),
        tuple((w, local_name(c.q.name), variables.index(c.q.name)) for w, c in pairs if w),
        kernel([Target("force", memory.law)], table),
        kernel([*slopes, *(Target(f"by_parameter[stage, row, {n}]", s) for n, s in own if s != 0)], table),
    )


def dry_law(model: Model) -> Kernel:
    """Dry friction on each surface against its direction of slip [V]."""
    return kernel([Target(f"force_{n}", s.law) for n, s in enumerate(model.surfaces)], scalar_sources(model))


def dry_sizes(model: Model) -> tuple[str, ...]:
    """Parameters in which the dry laws are linear; no surface has friction where all of them are zero.

    What only scales another one, as a plant's own parameter does in a friction that grows with the load, is left out.
    """
    laws, sizes = [s.law for s in model.surfaces], dry_parameters(model)
    sizes = [n for n in sizes if all(derivative(derivative(f, symbol(n)), symbol(n)) == 0 for f in laws)]

    for name in sorted(sizes, key=lambda n: "." in n):  # the plant's own ones first
        others = [n for n in sizes if n != name]
        sizes = sizes if any(f != 0 for f in _without(laws, others)) else others
    rest = _without(laws, sizes)
    if any(f != 0 for f in rest):
        raise ValueError(f"Dry friction must vanish where its linear parameters {sizes} are zero; it leaves {rest}")
    return tuple(sizes)


def dry_parameters(model: Model) -> list[str]:
    """Fitted parameters that the dry laws have in them."""
    return [p.name for p in model.fitted if any(symbol(p.name) in symbols_in(s.law) for s in model.surfaces)]


def _without(laws: list[sp.Expr], names: list[str]) -> list[sp.Expr]:
    return [f.subs({symbol(n): 0 for n in names}) for f in laws]
