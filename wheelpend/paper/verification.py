"""Every numbered equation of the paper as printed against the derivation from geometry."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import sympy as sp

import derive
from wheelpend.paper.assumptions import (
    Alternative,
    alternatives,
    consequence_text,
    derived_letters,
    drive_train_differences,
    rotor_inertia_in_wheel_row,
    single_motor_torque,
)
from wheelpend.paper.derivation import LEAST_SQUARES_EXAMPLE, PLANT_NAME, Derived, derive_all
from wheelpend.paper.differences import describe_difference, is_equal
from wheelpend.paper.equations import EQUATION_NUMBERS, PRINTED_EQUATIONS, Printed
from wheelpend.paper.filtering import FILTER_TRANSFER_FUNCTION
from wheelpend.paper.findings import EquationFinding, Verification, equation_text, equations_text
from wheelpend.paper.letters import TIME_VARYING_SYMBOLS, Expression, F_w, phi0_s, phi_a, phi_b
from wheelpend.paper.notation import expression_text
from wheelpend.paper.parameters import check_numbers
from wheelpend.paper.relations import violated_relations


def verify(printed: Printed = PRINTED_EQUATIONS) -> Verification:
    """Compare the printed equations with the derivation, and the printed numbers with each other."""
    derived = under_printed_assumptions(printed, derive_all())
    wrong = {number for number in printed if misprinted_components(number, printed, derived)}
    checked = [c for number in EQUATION_NUMBERS for c in check_equation(number, printed, derived, wrong)]
    return Verification(tuple(checked), check_numbers(sp.sympify(printed["18"]["X2"])))


def check_equation(number: str, printed: Printed, derived: Derived, wrong: set[str]) -> Iterator[EquationFinding]:
    """All findings on one equation: what it is, then the assumptions that enter with it."""
    if number not in printed:
        yield unreadable(number)
        return
    if number == "10":
        yield unstated_step(printed, derived)
    elif number not in derived:
        yield definition(number, printed)
    elif number in wrong:
        for name in misprinted_components(number, printed, derived):
            yield misprint(number, name, printed, derived, wrong)
    else:
        yield match(number, printed, derived)
    if number == "26":
        yield from unreadable_columns(printed, derived)
    for choice in alternatives():
        if choice.first == number:
            yield assumption(choice, printed)


def under_printed_assumptions(printed: Printed, derived: Derived) -> Derived:
    """The derivation under the assumptions with which the paper's own equations begin."""
    for choice in alternatives():
        if is_other_choice_printed(choice, printed):
            derived = {**derived, **{number: choice.derived[number] for number in choice.changed}}
    return derived


def is_other_choice_printed(choice: Alternative, printed: Printed) -> bool:
    """True if the first equation with which an assumption enters is printed with the other choice."""
    components = printed.get(choice.first, {})
    other = choice.derived[choice.first]
    return all(
        n in components
        and n in other
        and is_equivalent(choice.first, components[n], readable_columns(components[n], other[n]))
        for n in choice.changed[choice.first]
    )


def misprinted_components(number: str, printed: Printed, derived: Derived) -> tuple[str, ...]:
    """Components of an equation that do not agree with the derivation."""
    components = derived.get(number, {})
    return tuple(
        name
        for name, e in printed[number].items()
        if name in components and not is_equivalent(number, e, readable_columns(e, components[name]))
    )


def is_equivalent(number: str, printed: Expression, derived: Expression) -> bool:
    """True if a printed component is the derived one; the Lagrangian (1) is determined up to a constant."""
    if number == "1":
        return not sp.expand(printed - derived).has(*TIME_VARYING_SYMBOLS)
    return is_equal(printed, derived)


def readable_columns(printed: Expression, derived: Expression) -> Expression:
    """The derived matrix without its last columns, as many as are unreadable in the printed one."""
    if isinstance(derived, sp.MatrixBase) and isinstance(printed, sp.MatrixBase) and printed.cols < derived.cols:
        return derived[:, : printed.cols]
    return derived


def match(number: str, printed: Printed, derived: Derived) -> EquationFinding:
    """An equation that agrees with the derivation."""
    compared = {n: e for n, e in printed[number].items() if n in derived[number]}
    correct = {n: readable_columns(e, derived[number][n]) for n, e in compared.items()}
    name = "; ".join(compared)
    notes = [
        f"printed less derived is the constant {expression_text(sp.expand(e - correct[n]))}, "
        "which no equation of motion sees"
        for n, e in compared.items()
        if not is_equal(e, correct[n])
    ]
    notes += unmeasured_notes(printed[number]) if number == "26" else []
    how = comparison_method(*compared.values())
    notes += (
        [f"at {', '.join(equation_text(k.name, e) for k, e in LEAST_SQUARES_EXAMPLE.items())}"]
        if how == "numeric"
        else []
    )
    return EquationFinding(
        number, name, "match", equations_text(compared), equations_text(correct), "; ".join(notes), how
    )


def unmeasured_notes(components: Mapping[str, Expression]) -> list[str]:
    """Note on the motion in an equation that no sensor reads."""
    plant = derive.plants.build(PLANT_NAME, derive.plants.complete_assumptions(PLANT_NAME, {}))
    symbols = set().union(*(e.free_symbols for e in components.values()))
    missing = sorted((x for x in symbols if x.name not in {c.name for c in plant.channels}), key=str)
    return [f"needs {', '.join(map(expression_text, missing))}, which no sensor reads"] if missing else []


def misprint(number: str, name: str, printed: Printed, derived: Derived, wrong: set[str]) -> EquationFinding:
    """A component that is printed wrong, with the kind of difference and the equations that contradict it."""
    expression = printed[number][name]
    correct = readable_columns(expression, derived[number][name])
    found = tuple(violated_relations(printed, number, name, derived[number][name]))
    others = len(printed[number]) - len(misprinted_components(number, printed, derived))
    rest = f"; its other {others} components are as derived" if others else ""
    right = sorted({n for w in found for n in w.equations if n not in wrong}, key=int)
    return EquationFinding(
        number, name, "misprint", equation_text(name, expression), equation_text(name, correct),
        describe_difference(expression, correct).sentence + rest, comparison_method(expression), "",
        tuple(w.sentence for w in found), tuple(right),
    )  # fmt: skip


def comparison_method(*expressions: Expression) -> str:
    """ "numeric" for matrices of any shape, which are compared on an example, else "symbolic"."""
    return "numeric" if any(isinstance(e, sp.MatrixExpr) for e in expressions) else "symbolic"


def definition(number: str, printed: Printed) -> EquationFinding:
    """An equation that defines a quantity and claims nothing."""
    names = ", ".join(printed[number])
    return EquationFinding(number, names, "definition", equations_text(printed[number]), "", f"defines {names}")


def unreadable(number: str) -> EquationFinding:
    """An equation that is unreadable in the copy at hand; (33) follows from the others."""
    pieces = {
        "φ2,2f(s)": FILTER_TRANSFER_FUNCTION * phi_a,
        "φ1,2f(s)": FILTER_TRANSFER_FUNCTION * phi_b,
        "φ0,2f(s)": FILTER_TRANSFER_FUNCTION * phi0_s,
    }
    must = equations_text(pieces) if number == "33" else ""
    return EquationFinding(
        number, ", ".join(pieces) if must else "", "not_available", "", must, "not in the copy at hand"
    )


def unreadable_columns(printed: Printed, derived: Derived) -> Iterator[EquationFinding]:
    """Columns of the regressor's pieces that are unreadable in the copy at hand."""
    for name, matrix in printed["26"].items():
        whole = sp.Matrix(derived["26"][name])
        if matrix.cols == whole.cols - 1:
            places = [f"{k + 1}" for k in range(whole.cols) if is_equal(without_column(whole, k), matrix)]
            note = f"one column of {whole.cols} cannot be read; the rest fits if it was column {' or '.join(places)}"
            derived_column = equation_text(name, whole)
            yield EquationFinding("26", name, "not_available", equation_text(name, matrix), derived_column, note)


def without_column(matrix: sp.Matrix, column: int) -> sp.Matrix:
    """The matrix without one column."""
    shorter = matrix.copy()
    shorter.col_del(column)
    return shorter


def unstated_step(printed: Printed, derived: Derived) -> EquationFinding:
    """(10) against (8) with (9): the paper does not state what (11) has beyond them."""
    claimed = printed["10"]["J_m dw/dt"].subs(F_w, derived["11"]["F_θw"].subs(derived_letters(derived)))
    follows = single_motor_torque(derived)
    name, steps = "J_m dw/dt", drive_train_differences(derived)
    if is_equal(claimed, follows):
        return match("10", printed, {**derived, "10": {name: printed["10"][name]}})
    note = (f"(11) does not follow from (8) with (9): {'; '.join(steps)}. The rotor's inertia stands on the left of "
            f"(10) and in (3), as {expression_text(rotor_inertia_in_wheel_row(derived))}")  # fmt: skip
    return EquationFinding(
        "10",
        name,
        "assumption",
        equation_text(name, printed["10"][name]),
        equation_text(name, follows),
        note,
        "symbolic",
        "two_geared_motors",
    )


def assumption(choice: Alternative, printed: Printed) -> EquationFinding:
    """An assumption that enters with an equation, and the form of the other choice."""
    number = choice.first
    names = [n for n in choice.changed[number] if n in printed[number]]
    other = {n: choice.derived[number][n] for n in names if n in choice.derived[number]}
    here = choice.other if is_other_choice_printed(choice, printed) else choice.choice
    note = f"the paper takes {here}; from {choice.choice} to {choice.other}, {consequence_text(choice, derive_all())}"
    shown = equations_text({n: printed[number][n] for n in names})
    return EquationFinding(
        number, "; ".join(names), "assumption", shown, equations_text(other), note, "symbolic", choice.assumption
    )
