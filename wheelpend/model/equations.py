"""The derived equations as text or LaTeX, and the difference of two models, term by term."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import sympy as sp

import derive
from derive.grouping import NotExpressibleError
from wheelpend.errors import Failure, did_you_mean
from wheelpend.model.record import Model

Writer = Callable[[sp.Expr], str]
UNIT_PATTERN = re.compile(r" \[.*?\]")  # behind the zero of an equation of motion
REGRESSOR_TITLE = "Regressor: tau = phi X, phi = d²/dt² phi2 + d/dt phi1 + phi0"


def derived_model(model: Model) -> derive.Model:
    """The derived model of a model file; raises Failure where a term cannot be expressed in its parameters."""
    try:
        return derive.compose(model.plant, model.assumptions, model.effects)
    except NotExpressibleError as error:
        raise Failure(f"{model.path}: {error}") from None


def equations_text(model: Model, latex: bool = False) -> str:
    """Assumptions, parameters, equations of motion, sensors, regressor and its filtered pieces."""
    lines = [f"plant {model.plant}; effects {', '.join(model.effects) or 'none'}"]
    for title, entries in equation_sections(derived_model(model), sp.latex if latex else str).items():
        lines += ["", title, *(f"  {entry}" for entry in entries)]
    return "\n".join(lines)


def equation_sections(derived: derive.Model, write: Writer) -> dict[str, list[str]]:
    """Titled lines of all that a model derives to: 'name = value', or a term of a sum with its sign."""
    names = zip(derived.grouping.names, derived.grouping.definitions, strict=True)
    found = {
        "Assumptions": [f"{k} = {v}" for k, v in derived.assumptions.items()],
        "Equivalent parameters": [f"{n} = {write(sp.together(d))}" for n, d in names],
    }
    for coordinate, row in zip(derived.plant.moving, derived.residual, strict=True):
        unit = derived.plant.plant_signature.force_unit(coordinate.unit)
        found[f"Equation of motion, {coordinate.row} row: 0{'' if unit == '1' else f' [{unit}]'} ="] = [
            signed_term_text(t, write) for t in sp.Add.make_args(sp.expand(row))
        ]
    for surface in derived.surfaces:
        found[f"Dry friction at the {surface.port}, against its slip, or what holds it still"] = [write(surface.law)]
    for h in derived.hystereses:
        found[f"Hysteresis force, {h.path} [rad] of slip after it was {h.before}: {h.force} ="] = [write(h.law)]
    found |= {"Input": input_lines(derived, write)} if input_lines(derived, write) else {}
    readings = zip(derived.plant.channels, derived.readings, strict=True)
    return found | {
        "Sensors": [f"{c.name} = {write(r)}" for c, r in readings],
        REGRESSOR_TITLE: regressor_lines(derived, write),
    }


def signed_term_text(term: sp.Expr, write: Writer) -> str:
    """A term with its sign set apart."""
    negative = sp.sympify(term).could_extract_minus_sign()
    return f"{'-' if negative else '+'} {write(-term if negative else term)}"


def input_lines(derived: derive.Model, write: Writer) -> list[str]:
    """Delay and lag between the command and what reaches the motor, which the equations of motion do not show."""
    lines = [f"the command acts {derived.delay} later"] if derived.delay else []
    if derived.lag:
        lines.append(f"U instead of {derived.plant.input} above: {derived.lag} dU/dt = {write(derived.drive)} - U")
    return lines


def regressor_lines(derived: derive.Model, write: Writer) -> list[str]:
    """The regressor and its split, column by column."""
    regressor = derived.regressor
    lines = [f"tau = {', '.join(write(e) for e in regressor.tau)}"]
    for column, name in enumerate(regressor.parameters):
        for piece in ("phi", "phi2", "phi1", "phi0"):
            entries = list(getattr(regressor, piece)[:, column])
            if any(entries):
                lines.append(f"{piece + '[' + str(name) + ']':<12} = {', '.join(write(e) for e in entries)}")
    return lines


def other_model(model: Model, other: str) -> Model:
    """The model to compare with: another model file, or this model with ASSUMPTION=CHOICE.

    Raises Failure for a path without a model and for an unknown assumption or choice.
    """
    name, equals, choice = other.partition("=")
    if not equals or Path(other).exists():
        return Model.open(other)
    known = {a.name: a for a in derive.plants.assumptions_of(model.plant)}
    if name not in known:
        raise Failure(f"No assumption named '{name}'. Known assumptions: {', '.join(known)}."
                      f"{did_you_mean(name, list(known))}")  # fmt: skip
    chosen = [c for c in known[name].choices if str(c).lower() == choice.strip().lower()]
    if not chosen:
        raise Failure(f"{name} must be one of {', '.join(map(str, known[name].choices))}, not '{choice}'.")
    assumptions = {**model.assumptions, name: chosen[0]}
    before, after = (derive.plants.implied_effects(model.plant, a) for a in (model.assumptions, assumptions))
    effects = (*(e for e in model.effects if e not in before or e in after), *after)
    return replace(model, assumptions=assumptions, effects=tuple(dict.fromkeys(effects)))


def difference_text(one: Model, other: Model, latex: bool = False) -> str:
    """Difference of two models: definitions from and to, terms that go (-) and come (+)."""
    write: Writer = sp.latex if latex else str
    before, after = (without_units(equation_sections(derived_model(m), write)) for m in (one, other))
    lines = changed_lines(*([f"effects = {', '.join(m.effects) or 'none'}"] for m in (one, other)))
    touched = set()
    for title in dict.fromkeys([*before, *after]):
        found = changed_lines(before.get(title, []), after.get(title, []))
        lines += ["", title, *found] if found else []
        touched |= {title} if found else set()
    if touched <= {"Assumptions"}:
        lines += ["", "The two models derive to the same equations."]
    elif touched <= {"Assumptions", "Equivalent parameters"}:
        lines += ["", "The equations of motion stay as they are: only what the parameters stand for changes."]
    return "\n".join(lines).strip()


def without_units(sections: dict[str, list[str]]) -> dict[str, list[str]]:
    """Sections whose titles are the same whatever the unit of the input."""
    return {UNIT_PATTERN.sub("", title): lines for title, lines in sections.items()}


def changed_lines(before: list[str], after: list[str]) -> list[str]:
    """Lines that differ: 'name: old -> new' where both have the name, else gone (-) and new (+)."""
    old, new = (dict(_name_and_value(line) for line in lines) for lines in (before, after))
    lines = []
    for key in dict.fromkeys([*old, *new]):
        if old.get(key) == new.get(key):
            continue
        if key in old and key in new:
            lines.append(f"  {key}: {old[key]}  ->  {new[key]}")
        else:
            entry = old.get(key) or new.get(key)
            lines.append(f"  {'gone' if key in old else 'new '}  {key}{f' = {entry}' if entry != key else ''}")
    return lines


def _name_and_value(line: str) -> tuple[str, str]:
    name, equals, value = line.partition(" = ")
    return (name.strip(), value) if equals else (line, line)
