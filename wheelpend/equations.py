"""The derived equations as text or LaTeX, and what differs between two models."""

from __future__ import annotations

import difflib

import sympy as sp

import derive
from derive.grouping import NotExpressibleError
from wheelpend.failures import Failure
from wheelpend.model import Model


def composed(model: Model) -> derive.Model:
    """The derived model behind a model file."""
    try:
        return derive.compose(model.plant, model.assumptions, model.effects)
    except NotExpressibleError as error:
        raise Failure(f"{model.path}: {error}") from None


def describe(model: Model, latex: bool = False) -> str:
    """Assumptions, parameters, equations of motion, sensors, regressor and its filtered pieces."""
    derived = composed(model)
    write = (lambda e: sp.latex(e)) if latex else str
    lines = [f"plant {derived.plant.name}; effects {', '.join(e.name for e in derived.effects) or 'none'}"]
    lines += [f"assumption {k} = {v}" for k, v in derived.assumptions.items()]
    lines += ["", "Equivalent parameters"]
    names = zip(derived.grouping.names, derived.grouping.definitions, strict=True)
    lines += [f"  {n} = {write(sp.together(d))}" for n, d in names]
    lines += ["", "Equations of motion, each row = 0 [V]"]
    for coordinate, row in zip(derived.plant.coordinates, derived.residual, strict=True):
        lines += [f"  {coordinate.row} row:"] + [f"    {signed(t, write)}" for t in sp.Add.make_args(row)]
    for surface in derived.surfaces:
        lines.append(
            f"  dry friction at the {surface.port}, against its slip: {write(surface.law)}, or what holds it still"
        )
    lines += ["", "Sensors"]
    lines += [f"  {c.name} = {write(r)}" for c, r in zip(derived.plant.channels, derived.readings, strict=True)]
    if derived.delay:
        lines.append(f"  the input acts {derived.delay} later")
    return "\n".join([*lines, *regressor_lines(derived, write)])


def signed(term: sp.Expr, write) -> str:
    """A term with its sign set apart."""
    negative = sp.sympify(term).could_extract_minus_sign()
    return f"{'-' if negative else '+'} {write(-term if negative else term)}"


def regressor_lines(derived: derive.Model, write) -> list[str]:
    """The regressor and its split, column by column."""
    regressor = derived.regressor
    lines = ["", "Regressor: tau = phi X, phi = d²/dt² phi2 + d/dt phi1 + phi0"]
    lines += [f"  tau = {[write(e) for e in regressor.tau]}"]
    for column, name in enumerate(regressor.parameters):
        for piece in ("phi", "phi2", "phi1", "phi0"):
            entries = list(getattr(regressor, piece)[:, column])
            if any(entries):
                lines.append(f"  {piece + '[' + str(name) + ']':<12} = {', '.join(write(e) for e in entries)}")
    return lines


def difference(one: Model, other: Model) -> str:
    """Unified diff of two models' descriptions, term by term."""
    before, after = describe(one).splitlines(), describe(other).splitlines()
    lines = list(difflib.unified_diff(before, after, str(one.path), str(other.path), lineterm="", n=1))
    return "\n".join(lines) if lines else "The two models derive to the same equations."
