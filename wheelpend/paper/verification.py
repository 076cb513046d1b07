"""Every numbered equation of the paper as printed against the derivation from geometry."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import sympy as sp

import derive
from wheelpend.paper.assumptions import (
    Alternative,
    alternatives,
    consequence,
    derived_letters,
    drive_train,
    rotor_inertia_in_wheel_row,
    single_motor,
)
from wheelpend.paper.derivation import LEAST_SQUARES_EXAMPLE, PLANT, Derived, derive_all
from wheelpend.paper.differences import describe, equal
from wheelpend.paper.equations import NUMBERS, PRINTED, Printed
from wheelpend.paper.filtering import FILTER
from wheelpend.paper.letters import MOVING, Expression, F_w, phi0_s, phi_a, phi_b
from wheelpend.paper.notation import text
from wheelpend.paper.parameters import NumberCheck, check_numbers
from wheelpend.paper.relations import witnesses

STATUSES = ("match", "misprint", "assumption", "definition", "not_available")


@dataclass(frozen=True)
class Checked:
    """One finding on one numbered equation; an equation may have several."""

    number: str
    name: str  # left side of what was compared
    status: str  # one of STATUSES
    printed: str
    derived: str
    note: str
    how: str = ""  # symbolic, numeric, or empty where nothing could be compared
    assumption: str = ""  # name of the choice the equation makes
    shows: tuple[str, ...] = ()  # how equations fit together once a misprint is corrected
    agrees_with: tuple[str, ...] = ()  # right equations that agree with the correct form only


@dataclass(frozen=True)
class Verification:
    """What became of every equation and number of the paper."""

    equations: tuple[Checked, ...]
    parameters: tuple[NumberCheck, ...]

    def of(self, status: str) -> tuple[Checked, ...]:
        """The findings with a status."""
        return tuple(c for c in self.equations if c.status == status)


def verify(printed: Printed = PRINTED) -> Verification:
    """Compare the printed equations with the derivation, and the printed numbers with each other."""
    derived = as_assumed(printed, derive_all())
    wrong = {number for number in printed if misprinted(number, printed, derived)}
    checked = [c for number in NUMBERS for c in check(number, printed, derived, wrong)]
    return Verification(tuple(checked), check_numbers(sp.sympify(printed["18"]["X2"])))


def check(number: str, printed: Printed, derived: Derived, wrong: set[str]) -> Iterator[Checked]:
    """All findings on one equation: what it is, then the assumptions that enter with it."""
    if number not in printed:
        yield unreadable(number)
        return
    if number == "10":
        yield unstated_step(printed, derived)
    elif number not in derived:
        yield definition(number, printed)
    elif number in wrong:
        for name in misprinted(number, printed, derived):
            yield misprint(number, name, printed, derived, wrong)
    else:
        yield match(number, printed, derived)
    if number == "26":
        yield from lost_columns(printed, derived)
    for choice in alternatives():
        if choice.first == number:
            yield assumption(choice, printed)


def as_assumed(printed: Printed, derived: Derived) -> Derived:
    """The derivation under the assumptions with which the paper's own equations begin."""
    for choice in alternatives():
        if takes_other(choice, printed):
            derived = {**derived, **{number: choice.derived[number] for number in choice.changed}}
    return derived


def takes_other(choice: Alternative, printed: Printed) -> bool:
    """Whether the first equation with which an assumption enters is printed with the other choice."""
    components = printed.get(choice.first, {})
    other = choice.derived[choice.first]
    return all(
        n in components and n in other and agrees(choice.first, components[n], readable(components[n], other[n]))
        for n in choice.changed[choice.first]
    )


def misprinted(number: str, printed: Printed, derived: Derived) -> tuple[str, ...]:
    """Components of an equation that do not agree with the derivation."""
    components = derived.get(number, {})
    return tuple(
        name
        for name, e in printed[number].items()
        if name in components and not agrees(number, e, readable(e, components[name]))
    )


def agrees(number: str, printed: Expression, derived: Expression) -> bool:
    """Whether a printed component is the derived one; of a Lagrangian (1) a constant makes no difference."""
    if number == "1":
        return not sp.expand(printed - derived).has(*MOVING)
    return equal(printed, derived)


def readable(printed: Expression, derived: Expression) -> Expression:
    """The derived matrix without as many of its last columns as cannot be read in the printed one."""
    if isinstance(derived, sp.MatrixBase) and isinstance(printed, sp.MatrixBase) and printed.cols < derived.cols:
        return derived[:, : printed.cols]
    return derived


def equation(name: str, expression: Expression) -> str:
    """An equation as text."""
    return f"{name} = {text(expression)}"


def together(components: Mapping[str, Expression]) -> str:
    """Several equations as text."""
    return "; ".join(equation(name, e) for name, e in components.items())


def match(number: str, printed: Printed, derived: Derived) -> Checked:
    """An equation that agrees with the derivation."""
    compared = {n: e for n, e in printed[number].items() if n in derived[number]}
    correct = {n: readable(e, derived[number][n]) for n, e in compared.items()}
    name = "; ".join(compared)
    notes = [
        f"printed less derived is the constant {text(sp.expand(e - correct[n]))}, which no equation of motion sees"
        for n, e in compared.items()
        if not equal(e, correct[n])
    ]
    notes += unmeasured(printed[number]) if number == "26" else []
    how = how_compared(*compared.values())
    notes += (
        [f"at {', '.join(equation(k.name, e) for k, e in LEAST_SQUARES_EXAMPLE.items())}"] if how == "numeric" else []
    )
    return Checked(number, name, "match", together(compared), together(correct), "; ".join(notes), how)


def unmeasured(components: Mapping[str, Expression]) -> list[str]:
    """Motion that an equation needs and no sensor reads."""
    plant = derive.plants.build(PLANT, derive.plants.settle(PLANT, {}))
    symbols = set().union(*(e.free_symbols for e in components.values()))
    missing = sorted((x for x in symbols if x.name not in {c.name for c in plant.channels}), key=str)
    return [f"needs {', '.join(map(text, missing))}, which no sensor reads"] if missing else []


def misprint(number: str, name: str, printed: Printed, derived: Derived, wrong: set[str]) -> Checked:
    """A component that is printed wrong: in what way, and which right equations tell."""
    expression = printed[number][name]
    correct = readable(expression, derived[number][name])
    found = tuple(witnesses(printed, number, name, derived[number][name]))
    others = len(printed[number]) - len(misprinted(number, printed, derived))
    rest = f"; its other {others} components are as derived" if others else ""
    right = sorted({n for w in found for n in w.equations if n not in wrong}, key=int)
    return Checked(
        number, name, "misprint", equation(name, expression), equation(name, correct),
        describe(expression, correct).sentence + rest, how_compared(expression), "",
        tuple(w.sentence for w in found), tuple(right),
    )  # fmt: skip


def how_compared(*expressions: Expression) -> str:
    """Matrices of any shape are compared on an example, everything else as it stands."""
    return "numeric" if any(isinstance(e, sp.MatrixExpr) for e in expressions) else "symbolic"


def definition(number: str, printed: Printed) -> Checked:
    """An equation that gives a name and claims nothing."""
    names = ", ".join(printed[number])
    return Checked(number, names, "definition", together(printed[number]), "", f"defines {names}")


def unreadable(number: str) -> Checked:
    """An equation that is not in the copy at hand; for (33) what must have stood there."""
    pieces = {"φ2,2f(s)": FILTER * phi_a, "φ1,2f(s)": FILTER * phi_b, "φ0,2f(s)": FILTER * phi0_s}
    must = together(pieces) if number == "33" else ""
    return Checked(number, ", ".join(pieces) if must else "", "not_available", "", must, "not in the copy at hand")


def lost_columns(printed: Printed, derived: Derived) -> Iterator[Checked]:
    """Columns of the regressor's pieces that cannot be read in the copy at hand."""
    for name, matrix in printed["26"].items():
        whole = sp.Matrix(derived["26"][name])
        if matrix.cols == whole.cols - 1:
            places = [f"{k + 1}" for k in range(whole.cols) if equal(without(whole, k), matrix)]
            note = f"one column of {whole.cols} cannot be read; the rest fits if it was column {' or '.join(places)}"
            derived_column = equation(name, whole)
            yield Checked("26", name, "not_available", equation(name, matrix), derived_column, note)


def without(matrix: sp.Matrix, column: int) -> sp.Matrix:
    """A matrix less one column."""
    shorter = matrix.copy()
    shorter.col_del(column)
    return shorter


def unstated_step(printed: Printed, derived: Derived) -> Checked:
    """(10) against (8) with (9): what (11) has beyond that comes in without a line."""
    claimed = printed["10"]["J_m dw/dt"].subs(F_w, derived["11"]["F_θw"].subs(derived_letters(derived)))
    follows = single_motor(derived)
    name, steps = "J_m dw/dt", drive_train(derived)
    if equal(claimed, follows):
        return match("10", printed, {**derived, "10": {name: printed["10"][name]}})
    note = (f"(11) does not follow from (8) with (9): {'; '.join(steps)}. The rotor's inertia stands on the left of "
            f"(10) and in (3), as {text(rotor_inertia_in_wheel_row(derived))}")  # fmt: skip
    return Checked("10", name, "assumption", equation(name, printed["10"][name]), equation(name, follows), note,
                   "symbolic", "two_geared_motors")  # fmt: skip


def assumption(choice: Alternative, printed: Printed) -> Checked:
    """A choice that enters with an equation, and what the other choice gives."""
    number = choice.first
    names = [n for n in choice.changed[number] if n in printed[number]]
    other = {n: choice.derived[number][n] for n in names if n in choice.derived[number]}
    here = choice.other if takes_other(choice, printed) else choice.choice
    note = f"the paper takes {here}; from {choice.choice} to {choice.other}, {consequence(choice, derive_all())}"
    shown = together({n: printed[number][n] for n in names})
    return Checked(number, "; ".join(names), "assumption", shown, together(other), note, "symbolic", choice.assumption)
