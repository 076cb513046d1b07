"""Relations between the printed equations: some of them, put together, give another.

A misprint shows where a relation fails with the equation as printed and holds with the equation as derived.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import NamedTuple

import sympy as sp

from wheelpend.paper.differences import is_zero
from wheelpend.paper.equations import Printed
from wheelpend.paper.letters import FILTER_STATE_NAMES
from wheelpend.paper.residuals import (
    actuator,
    body_row,
    circuit,
    filter_solution,
    filtered_derivative,
    first_derivative,
    friction,
    lagrange,
    opposite_forces,
    regressor_decomposition,
    regressor_row,
    second_derivative,
    sum_of_parts,
    wheel_row,
    with_parameters,
)


class Relation(NamedTuple):
    """Printed equations that must agree when put together: all their residuals vanish."""

    sentence: str
    equations: tuple[str, ...]
    residuals: Callable[[Printed], Mapping[str, sp.Expr]]


EQUATION_RELATIONS = (
    Relation("(1) in (2) gives (3)", ("1", "3"), lagrange("3", 0)),
    Relation("(1) in (2) gives (4)", ("1", "4"), lagrange("4", 1)),
    Relation("(5) without inductance is (7)", ("5", "7"), circuit),
    Relation("(7) in (6) gives (8)", ("6", "7", "8"), actuator),
    Relation("(9) is the friction that (11) with (12) takes out", ("9", "11", "12"), friction),
    Relation("(13) is (11) with the opposite sign", ("11", "13"), opposite_forces),
    Relation("(3) with (11) gives (14)", ("3", "11", "14"), wheel_row),
    Relation("(4) with (13) gives (15)", ("4", "13", "15"), body_row),
    Relation("(18) in (19) gives (14)", ("14", "18", "19"), with_parameters("19", "14")),
    Relation("(18) in (20) gives (15)", ("15", "18", "20"), with_parameters("20", "15")),
    Relation("(22) with (23) times X is (19)", ("19", "22", "23"), regressor_row("19", 0)),
    Relation("(22) with (23) times X is (20)", ("20", "22", "23"), regressor_row("20", 1)),
    Relation("(26) in (25) gives (22) with (23)", ("22", "23", "26"), regressor_decomposition),
    Relation("(30) on (29) gives the first line of (34)", ("29", "30", "34"), filtered_derivative("34", "φa(s)")),
    Relation("(30) on (29) gives the first line of (37)", ("29", "30", "37"), filtered_derivative("37", "φb(s)")),
    Relation("the lines of (34) are the parts in (35)", ("34", "35"), second_derivative),
    Relation("the lines of (37) are the parts in (38)", ("37", "38"), first_derivative),
    Relation("the parts in (35) add up to (30) on (29)", ("29", "30", "35"), sum_of_parts("35", "φa(s)")),
    Relation("the parts in (38) add up to (30) on (29)", ("29", "30", "38"), sum_of_parts("38", "φb(s)")),
    *(Relation(f"{name} from (41) with (42) has the transform in ({number})", ("41", "42", number),
               filter_solution(name, number))
      for name, number in zip(FILTER_STATE_NAMES, ("32", "35", "35", "38", "38", "32"), strict=True)),
)  # fmt: skip


class ViolatedRelation(NamedTuple):
    """A relation that fails with an equation as printed and holds with it corrected."""

    sentence: str
    equations: tuple[str, ...]  # numbers of the other equations in it


def violated_relations(printed: Printed, number: str, name: str, correct: sp.Expr) -> Iterator[ViolatedRelation]:
    """The relations in which a misprint shows: a residual that vanishes only with the correct form."""
    corrected = {**printed, number: {**printed[number], name: correct}}
    for relation in EQUATION_RELATIONS:
        if number not in relation.equations:
            continue
        before, after = relation.residuals(printed), relation.residuals(corrected)
        cured = [k for k, v in before.items() if not is_zero(v) and is_zero(after.get(k, sp.Integer(0)))]
        if cured:
            yield ViolatedRelation(
                f"{relation.sentence}, at {', '.join(cured)}", tuple(n for n in relation.equations if n != number)
            )
