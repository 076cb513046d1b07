"""Sources of a kernel's symbols: entries of arrays, or scalars under their own names."""

from __future__ import annotations

import sympy as sp

from derive.functions import TIME_SYMBOL, symbol
from derive.printing import Target, local_name
from derive.records import Model


def variables_of(model: Model) -> tuple[str, ...]:
    """Names of the time-varying quantities: coordinates and rates, then added states."""
    return tuple(s.name for s in (*model.states, *model.added_states))


def sources(model: Model, **extra: str) -> dict[str, str]:
    """Source of each symbol among the arguments of a kernel of arrays: {symbol: expression}."""
    table = {"t": "t", **input_sources(model, "voltage")}
    table |= {name: f"state[{n}]" for n, name in enumerate(variables_of(model))}
    table |= {c.ddq.name: f"rate[{n}]" for n, c in enumerate(model.plant.moving)}
    table |= {s.direction.name: f"direction[{n}]" for n, s in enumerate(model.surfaces)}
    return table | {name: f"parameters[{n}]" for n, name in enumerate(model.parameters)} | extra


def input_argument(model: Model) -> str:
    """Name of the input argument in the integrator's kernels: the input's own, or that of a row of several."""
    return local_name(model.plant.input.name) if len(model.plant.inputs) == 1 else "voltages"


def input_sources(model: Model, argument: str) -> dict[str, str]:
    """Source of each input in an argument."""
    inputs = model.plant.inputs
    if len(inputs) == 1:
        return {inputs[0].name: argument}
    return {u.name: f"{argument}[{k}]" for k, u in enumerate(inputs)}


def scalar_sources(model: Model) -> dict[str, str]:
    """Sources for a kernel of the integrator, whose arguments are scalars under their own names."""
    plant, surfaces = model.plant, model.surfaces
    accelerations = (c.ddq for c in plant.moving)
    scalars = (*model.states, *model.added_states, *accelerations, *(s.direction for s in surfaces))
    return sources(
        model, **{s.name: local_name(s.name) for s in scalars}, **input_sources(model, input_argument(model))
    )


def trig_arguments_of(model: Model) -> dict[sp.Expr, str]:
    """Time-varying arguments of the sines and cosines in the equations of motion: {expression: name}."""
    varying = {TIME_SYMBOL, *model.states, *model.added_states}
    found = {f.args[0] for row in model.residual for f in row.atoms(sp.sin, sp.cos)}
    ordered = sorted((a for a in found if a.free_symbols & varying), key=sp.default_sort_key)
    return {a: local_name(a.name) if a.is_Symbol else f"sum_{n}" for n, a in enumerate(ordered)}


def with_trig_arguments(model: Model, targets: list[Target]) -> list[Target]:
    """Targets with those sines and cosines as symbols, which are arguments of the kernel."""
    trig = trig_arguments_of(model).items()
    known = {f(a): symbol(f"{f.__name__}_{name}") for a, name in trig for f in (sp.sin, sp.cos)}
    return [Target(t.place, sp.sympify(t.value).xreplace(known)) for t in targets]


def trig_sources(model: Model) -> dict[str, str]:
    """Sources for a kernel that is handed sines and cosines."""
    names = [f"{f}_{name}" for name in trig_arguments_of(model).values() for f in ("sin", "cos")]
    return {**scalar_sources(model), **{name: name for name in names}}


def regressor_sources(model: Model) -> dict[str, str]:
    """Sources for the regressor, in which dry friction has the sign of the slip."""
    slips = {}
    for surface in model.surfaces:
        weights = zip(surface.slip, range(len(model.states) // 2, len(model.states)), strict=False)
        slip = " + ".join(f"{w} * state[{n}]" for w, n in weights if w)
        slips[surface.direction.name] = f"_sign({slip})"
    return sources(model, **slips)


def index_of(names: tuple[str, ...], name: str) -> int:
    """Index of a name, -1 for none."""
    return names.index(name) if name else -1


def nonzero(array: str, matrix: sp.Matrix, *outer: str) -> list[Target]:
    """Targets for the entries of a matrix that are not always zero; ``outer`` are indices before row and column."""
    rows, columns = matrix.shape
    entries = [(i, j) for i in range(rows) for j in range(columns) if matrix[i, j] != 0]
    return [Target(f"{array}[{', '.join([*outer, str(i), str(j)])}]", matrix[i, j]) for i, j in entries]


def nonzero_entries(array: str, row: sp.Matrix) -> list[Target]:
    """Targets for the entries of a row that are not always zero."""
    return [Target(f"{array}[{i}]", entry) for i, entry in enumerate(row) if entry != 0]
