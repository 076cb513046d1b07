"""Residuals of printed equations put together: expressions that vanish where the equations agree."""

from __future__ import annotations

from collections.abc import Callable

import sympy as sp

from derive.lagrange import lagrange_row
from derive.records import coordinate
from wheelpend.paper.derivation import time_derivative
from wheelpend.paper.differences import coefficients_by_term
from wheelpend.paper.equations import Printed
from wheelpend.paper.filtering import FILTER_ABBREVIATIONS
from wheelpend.paper.letters import (  # fmt: skip
    FILTER_STATE_RATES,
    FILTER_STATES,
    I_o,
    K,
    K_b,
    K_e,
    K_t,
    L_i,
    V,
    X,
    alpha,
    beta,
    current,
    f_w,
    nfc,
    phi0_s,
    phi0_t,
    phi1_s,
    phi1_t,
    phi2_s,
    phi2_t,
    phi13,
    phi23,
    phi25,
    s,
    tau_s,
    tau_t,
)
from wheelpend.paper.notation import expression_text

Residuals = dict[str, sp.Expr]  # by the term or entry in which they stand
LAPLACE_TRANSFORMS = {tau_t: tau_s, phi2_t: phi2_s, phi1_t: phi1_s, phi0_t: phi0_s}


def residual_terms(expression: sp.Expr, prefix: str = "") -> Residuals:
    """Split a residual into {time-varying product: its constant}."""
    return {
        prefix + expression_text(moving): c
        for moving, c in coefficients_by_term(expression.subs(FILTER_ABBREVIATIONS)).items()
    }


def lagrange(number: str, row: int) -> Callable[[Printed], Residuals]:
    """(1) in (2) against a row of inertia."""
    coordinates = (coordinate("theta_w", "wheel"), coordinate("theta_p", "body"))

    def residuals(equations: Printed) -> Residuals:
        (printed,) = equations[number].values()
        return residual_terms(lagrange_row(equations["1"]["L"], coordinates[row], coordinates) - printed)

    return residuals


def circuit(equations: Printed) -> Residuals:
    """(5) without its inductance against (7)."""
    return residual_terms(equations["5"]["V_in"].subs({L_i: 0, K_e: K}) - equations["7"]["V_in"])


def actuator(equations: Printed) -> Residuals:
    """(7) in (6) against (8)."""
    settled = sp.solve(equations["7"]["V_in"] - V, current)[0]
    rotor = equations["6"]["J_m dw/dt"].subs(K_t, K).subs(current, settled)
    return residual_terms(rotor - equations["8"]["J_m dw/dt"])


def friction(equations: Printed) -> Residuals:
    """The load (9) of two motors against what (11) and (12) take from the wheels."""
    drag = equations["11"]["F_θw"].subs(beta, equations["12"]["β"]).subs({V: 0, K_b: 0, f_w: 0})
    return residual_terms(-2 * equations["9"]["T_L"] - drag)


def opposite_forces(equations: Printed) -> Residuals:
    """The text's F_θp = −F_θw."""
    return residual_terms(equations["13"]["F_θp"] + equations["11"]["F_θw"])


def wheel_row(equations: Printed) -> Residuals:
    """(3) and (11) against (14)."""
    force = equations["3"]["F_θw"] - equations["11"]["F_θw"] + alpha * V
    return residual_terms(force - equations["14"]["α V_in"])


def body_row(equations: Printed) -> Residuals:
    """(4) and (13) against (15)."""
    force = equations["13"]["F_θp"] - equations["4"]["F_θp"] + alpha * V
    return residual_terms(force - equations["15"]["α V_in"])


def with_parameters(linear: str, physical: str) -> Callable[[Printed], Residuals]:
    """An equation in X1 ... X7, with (18), against the same in physical constants."""

    def residuals(equations: Printed) -> Residuals:
        values = {x: equations["18"][str(x)] for x in X}
        return residual_terms(alpha * equations[linear]["V_in"].subs(values) - equations[physical]["α V_in"])

    return residuals


def full_regressor(equations: Printed) -> sp.MatrixBase:
    """(22) with the entries of (23)."""
    entries = {name: equations["23"][name.name] for name in (phi13, phi23, phi25)}
    return sp.Matrix(equations["22"]["φ(t)"]).subs(entries)


def regressor_row(number: str, row: int) -> Callable[[Printed], Residuals]:
    """A row of (22), with (23), times X against the equation of that row."""

    def residuals(equations: Printed) -> Residuals:
        return residual_terms((full_regressor(equations) * sp.Matrix(X))[row] - equations[number]["V_in"])

    return residuals


def regressor_decomposition(equations: Printed) -> Residuals:
    """(26) in (25) against (22) with (23); the column of φ2 that cannot be read holds zeros."""
    printed = sp.Matrix(equations["26"]["φ2(t)"])
    phi2 = printed.row_join(sp.zeros(2, 7 - printed.cols))
    phi1, phi0 = (sp.Matrix(equations["26"][name]) for name in ("φ1(t)", "φ0(t)"))
    whole = time_derivative(time_derivative(phi2)) + time_derivative(phi1) + phi0
    differing = whole - full_regressor(equations)
    return {f"entry ({k // 7 + 1}, {k % 7 + 1})": entry for k, entry in enumerate(differing)}


def second_derivative(equations: Printed) -> Residuals:
    """The second and third line of (34) against (35)."""
    lines, parts = equations["34"], equations["35"]
    pairs = zip(list(lines.values())[1:], parts.values(), strict=True)
    return {k: v for line, part in pairs for k, v in residual_terms(line - part, f"{expression_text(part)}: ").items()}


def filtered_derivative(number: str, derivative: str) -> Callable[[Printed], Residuals]:
    """The filter (30) on (29) against the first line of (34) or (37)."""

    def residuals(equations: Printed) -> Residuals:
        first = next(iter(equations[number].values()))
        return residual_terms(equations["30"]["I_o(s)"] * equations["29"][derivative] - first)

    return residuals


def sum_of_parts(parts: str, derivative: str) -> Callable[[Printed], Residuals]:
    """The parts of (35) or (38) against the filter (30) on (29)."""

    def residuals(equations: Printed) -> Residuals:
        whole = equations["30"]["I_o(s)"] * equations["29"][derivative]
        return residual_terms(sp.Add(*equations[parts].values()) - whole)

    return residuals


def first_derivative(equations: Printed) -> Residuals:
    """The second line of (37) against (38)."""
    pairs = zip(list(equations["37"].values())[1:], equations["38"].values(), strict=True)
    return {k: v for line, part in pairs for k, v in residual_terms(line - part, f"{expression_text(part)}: ").items()}


def filter_solution(name: str, number: str) -> Callable[[Printed], Residuals]:
    """The transform of an equation of (41), with its initial values from (42), against (32), (35) or (38)."""

    def residuals(equations: Printed) -> Residuals:
        transform = equations[number].get(f"{name}(s)", I_o * phi0_s).subs(I_o, equations["30"]["I_o(s)"])
        return residual_terms(transform_of_solution(name, equations) - transform)

    return residuals


def transform_of_solution(name: str, equations: Printed) -> sp.Expr:
    """Laplace transform of the solution of one equation of (41) with (42)."""
    letter, rest = name[0], name[1:]
    first, second = (nfc(f"{letter}{dot}{rest}(t)") for dot in "̇̈")
    order = 1 if first in equations["41"] else 2
    right = sp.expand(equations["41"][first if order == 1 else second])
    value, rate = right.coeff(FILTER_STATES[name]), right.coeff(FILTER_STATE_RATES[name])
    driving = right.subs({FILTER_STATES[name]: 0, FILTER_STATE_RATES[name]: 0}).subs(LAPLACE_TRANSFORMS)
    start = equations["42"][f"{name}(0)"]
    if order == 1:
        return (driving + start) / (s - value)
    start_rate = equations["42"][nfc(f"{letter}̇{rest}(0)")]
    return (driving + s * start + start_rate - rate * start) / (s**2 - rate * s - value)
