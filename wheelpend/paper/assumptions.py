"""Assumptions behind the paper's equations: each choice made otherwise, and the equations that then change."""

from __future__ import annotations

from collections.abc import Iterator
from functools import lru_cache
from typing import NamedTuple

import sympy as sp

import derive
from wheelpend.paper.derivation import PLANT_NAME, Derived, derive_all, derive_dynamics
from wheelpend.paper.differences import is_equal
from wheelpend.paper.letters import (  # fmt: skip
    T_L,
    TIME_VARYING_SYMBOLS,
    B_m,
    Expression,
    J_b,
    J_m,
    K,
    K_b,
    K_e,
    K_t,
    L,
    M,
    R_m,
    alpha,
    beta,
    ddw,
    dw,
    f_m,
    f_w,
    speed,
)
from wheelpend.paper.notation import expression_text

PREDICTION_EQUATIONS = ("19", "20", "22", "23", "26")  # equations in X1 ... X7, from which data are predicted


class Alternative(NamedTuple):
    """One assumption made otherwise."""

    assumption: str
    choice: str  # what the derivation takes
    other: str
    derived: Derived  # with the other choice
    changed: dict[str, tuple[str, ...]]  # equations, and their components, that differ then

    @property
    def first(self) -> str:
        """Number of the equation with which the assumption enters."""
        return min(self.changed, key=int, default="")


def changed_equations(derived: Derived, other: Derived) -> dict[str, tuple[str, ...]]:
    """Equations, and their components, that another choice changes."""
    found = {
        number: tuple(n for n, e in derived[number].items() if n not in parts or not is_equal(e, parts[n]))
        for number, parts in sorted(other.items(), key=lambda item: int(item[0]))
    }
    return {number: names for number, names in found.items() if names}


EXCLUDED_ASSUMPTIONS = (  # no other choices for the paper's equations
    "motor_circuit",  # treated below
    "planar",  # a robot that turns has a row that the paper has not
    "range",  # which logs are usable, no equation
    "gyro",  # it has one
    "rate_sensor",  # the paper's robot has none
    "ground_friction",  # without it f_w is zero, and nothing else is otherwise
)


@lru_cache
def alternatives() -> tuple[Alternative, ...]:
    """Every assumption made otherwise, with what changes then."""
    derived = derive_all()
    return tuple(
        Alternative(name, choice, other, changed, changed_equations(derived, changed))
        for name, choice, other, changed in other_choices(derived)
    )


def other_choices(derived: Derived) -> Iterator[tuple[str, str, str, Derived]]:
    """Assumption, choice, other choice and derivation of every alternative, with two that the plant does not offer."""
    for assumption in derive.plants.assumptions_of(PLANT_NAME):
        for other in assumption.choices:
            if other != assumption.default and assumption.name not in EXCLUDED_ASSUMPTIONS:
                changed = derive_dynamics(**{assumption.name: other})
                yield assumption.name, choice_text(assumption.default), choice_text(other), changed
    dynamic = {"7": {"V_in": derived["5"]["V_in"].subs(K_e, K)}}
    yield "motor_circuit", "static", "dynamic", dynamic
    about_axle = {
        n: {k: with_inertia_about_axle(e) for k, e in derived[n].items()} for n in ("1", "3", "4", "14", "15", "18")
    }
    yield "body_inertia", "about the centre of mass", "about the axle", about_axle


def choice_text(choice: object) -> str:
    """A choice in the spelling of model.toml."""
    return str(choice).lower() if isinstance(choice, bool) else str(choice)


def with_inertia_about_axle(expression: Expression) -> Expression:
    """The same expression with J_b taken about the axle."""
    return sp.expand(expression.subs(J_b, J_b - M * L**2))


def consequence_text(alternative: Alternative, derived: Derived) -> str:
    """The change of the first equation that the other choice alters, and the numbers of the others."""
    number, changed = alternative.first, alternative.changed
    parts = [
        f"{name} changes by {difference_text(derived[number][name], alternative.derived[number].get(name))}"
        for name in changed[number]
    ]
    others = [f"({n})" for n in changed if n != number]
    reach = f"; it reaches {', '.join(others)}" if others else "; it reaches no other equation"
    predictions = "" if set(changed) & set(PREDICTION_EQUATIONS) else "; equations in X1...X7 stay as they are"
    return f"{'; '.join(parts)}{reach}{predictions}"


def difference_text(here: Expression, there: Expression | None) -> str:
    """The other expression less this one; for matrices entry by entry, "vanishing" where there is no other."""
    if there is None:
        return "vanishing"
    if not isinstance(here, sp.MatrixBase):
        return expression_text(sp.factor(there - here))
    entries = [(k, sp.factor(e)) for k, e in enumerate((there - here).applyfunc(sp.expand)) if e != 0]
    return ", ".join(f"{expression_text(e)} in entry ({k // here.cols + 1}, {k % here.cols + 1})" for k, e in entries)


def single_motor_torque(derived: Derived) -> sp.Expr:
    """The torque that (8) with (9) gives, with the motor's speed at the wheel and without the motor's viscosity."""
    torque = sp.expand(derived["8"]["J_m dw/dt"].subs({B_m: 0, T_L: derived["9"]["T_L"], speed: dw}))
    squared, once, rest = (torque.coeff(K, power) for power in (2, 1, 0))  # K stands for K_t and, times it, for K_b
    return sp.expand(squared * K_t * K_b + once * K_t + rest)


def drive_train_differences(derived: Derived) -> list[str]:
    """Differences of the force on the wheels, (11) with (12), from the one that (8) with (9) give, term by term."""
    wheels = sp.expand(derived["11"]["F_θw"].subs(derived_letters(derived)))
    one, two = (coefficients_by_product(e) for e in (single_motor_torque(derived), wheels))
    found = []
    for product in sorted({*one, *two}, key=expression_text):
        if product not in one:
            found.append(f"{expression_text(two[product] * product)} added")
        elif one[product] != two.get(product, 0):
            found.append(f"factor {expression_text(two.get(product, 0) / one[product])} at {expression_text(product)}")
    return found


def derived_letters(derived: Derived) -> dict[sp.Symbol, sp.Expr]:
    """α and β spelled out."""
    return {alpha: derived["12"]["α"], beta: derived["12"]["β"]}


def coefficients_by_product(expression: sp.Expr) -> dict[sp.Expr, sp.Expr]:
    """Split an expression into products of motion and motor constants, each with its coefficient."""
    table: dict[sp.Expr, sp.Expr] = {}
    for term in sp.Add.make_args(sp.expand(expression)):
        factor, product = term.as_independent(*TIME_VARYING_SYMBOLS, K_t, K_b, R_m, f_m, f_w, as_Add=False)
        table[product] = table.get(product, sp.Integer(0)) + factor
    return table


def rotor_inertia_in_wheel_row(derived: Derived) -> sp.Expr:
    """The term of (3) with the rotors' inertia, which stands in (10) too."""
    row = sp.expand(derived["3"]["F_θw"])
    return row.coeff(ddw).coeff(J_m) * J_m * ddw
