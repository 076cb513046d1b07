"""Equations of motion for the page, with what an effect added or took away marked."""

from __future__ import annotations

from typing import NamedTuple

import sympy as sp

import derive
from wheelpend.diagnosis.explain import Ladder
from wheelpend.reports.names import display_text

TYPESET_OPERATORS = (("**2", "²"), ("**3", "³"), ("Magnitude", "abs"), ("Sign", "sign"), ("Ramp(", "max(0, "),
                     ("*", "·"), ("-", "−"))  # fmt: skip


class Term(NamedTuple):
    """A term of an equation; mark is "new", "gone" or nothing."""

    text: str
    mark: str


class Equation(NamedTuple):
    """A row's equation before and after."""

    row: str
    before: list[Term]
    after: list[Term]


def equation_rows(explanation: Ladder) -> list[Equation]:
    """The equations of motion before and after, with the difference marked; sensors and command where they changed."""
    plant, assumptions = explanation.model.plant, explanation.model.assumptions
    final = derive.compose(plant, assumptions, explanation.effects)
    old = equation_terms(derive.compose(plant, assumptions, explanation.first.problem.model.effects))
    new = equation_terms(final)
    moving = list(new)[: len(final.plant.moving)]
    return [
        Equation(
            display_text(row),
            [Term(term_text(t), "" if t in new.get(row, ()) else "gone") for t in old.get(row, ())],
            [Term(term_text(t), "" if t in old.get(row, ()) else "new") for t in new.get(row, ())],
        )
        for row in [*new, *(r for r in old if r not in new)]  # an effect may bring a part that moves, or take one away
        if row in moving or old.get(row) != new.get(row)
    ]


def equation_terms(model: derive.Model) -> dict[str, list[str]]:
    """Signed terms of each row, as equations_text prints them, dry friction included, then of each sensor."""
    found: dict[str, list[str]] = {}
    row = ""
    for line in derive.equations_text(model).splitlines():
        if line.startswith(" "):
            found[row].append(line.strip())
        else:
            row = line.rstrip(" 0=:") + ": 0 ="
            found[row] = []
    for surface in model.surfaces:
        weights = [sp.nsimplify(w) for w in surface.slip]
        slip = sum(w * c.dq for w, c in zip(weights, model.plant.moving, strict=True))
        for row, weight in zip(found, weights, strict=False):
            if weight:
                law = surface.law.subs(surface.direction, sp.Function("sign")(slip))
                found[row] += [_signed_text(t) for t in sp.Add.make_args(sp.expand(weight * law))]
    for channel, reading in zip(model.plant.channels, model.readings, strict=True):
        found[f"sensor {channel.name} ="] = [_signed_text(t) for t in sp.Add.make_args(sp.expand(reading))]
    found["command:"] = [f"+ v_in(t − {model.delay})" if model.delay else "+ v_in(t)"]
    found["command:"] += [f"− {model.lag} dU/dt"] if model.lag else []
    return found


def _signed_text(term: sp.Expr) -> str:
    text = str(term)
    return f"- {text[1:]}" if text.startswith("-") else f"+ {text}"


def term_text(term: str) -> str:
    """A term as SymPy prints it, typeset."""
    for plain, shown in TYPESET_OPERATORS:
        term = term.replace(plain, shown)
    return display_text(term)
