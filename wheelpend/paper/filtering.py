"""The filtered regression model as Laplace algebra gives it (paper eqs. 28, 29, 34-38 and 40-42).

The filter I_o is taken from (30), the pieces to be filtered from (25). A piece with s in its numerator is split by
polynomial division, so that neither part needs a derivative of what is filtered.
"""

from __future__ import annotations

from functools import lru_cache

import sympy as sp

from wheelpend.paper.combination import combination
from wheelpend.paper.letters import (  # fmt: skip
    FILTER_STATE_NAMES,
    FILTER_STATE_RATES,
    FILTER_STATES,
    Expression,
    dphi2_0,
    nfc,
    nu1,
    nu2,
    nu3,
    phi0_s,
    phi0_t,
    phi1_0,
    phi1_s,
    phi1_t,
    phi2_0,
    phi2_part_t,
    phi2_s,
    phi2_t,
    phi_a,
    phi_b,
    phi_c,
    s,
    tau1,
    tau2,
    tau_s,
    tau_t,
)

FILTER_GAIN = 1 / (tau1 * tau2)
FILTER_TRANSFER_FUNCTION = 1 / ((tau1 * s + 1) * (tau2 * s + 1))  # (30), a definition
INVERSE_LAPLACE_TRANSFORMS = {phi2_s: phi2_t, phi1_s: phi1_t, phi0_s: phi0_t, tau_s: tau_t}
FILTER_ABBREVIATIONS = {nu1: (s + 1 / tau1) * (s + 1 / tau2), nu2: 1 / tau1 + 1 / tau2, nu3: 1 / tau1 + 1 / tau2}


@lru_cache
def derive_filter() -> dict[str, dict[str, Expression]]:
    """Every equation of the filter that can be derived (paper eqs. 28, 29, 34-38 and 40-42)."""
    derivatives = laplace_of_derivatives()
    parts = {**split_filtered_derivative(derivatives["φa(s)"], 2), **split_filtered_derivative(derivatives["φb(s)"], 1)}
    return {
        "28": {"φ(s)": sum_of_pieces(derivatives)},
        "29": derivatives,
        "36": abbreviations(),
        **decompositions(parts, derivatives),
        "40": {"φ2f(t)": sum_of_filtered(parts, derivatives), "φ2′(t)": parts["φ2′"].subs(INVERSE_LAPLACE_TRANSFORMS)},
        **differential_equations(parts),
    }


def decompositions(
    parts: dict[str, Expression], derivatives: dict[str, Expression]
) -> dict[str, dict[str, Expression]]:
    """The filtered derivatives in lines of the paper, and their parts by name (paper eqs. 34, 35, 37, 38)."""
    return {
        "34": {
            "φ2,2f(s), first line": FILTER_GAIN / nu1 * derivatives["φa(s)"],
            "φ2,2f(s), second line, first term": parts["φ2′"],
            "φ2,2f(s), second line, second term": parts["Y2,1"] * (s + 1 / tau2) * (s + 1 / tau1) / nu1,
            "φ2,2f(s), third line": parts["Y2,2"],
        },
        "35": {f"{name}(s)": parts[name] for name in ("φ2′", "Y2,1", "Y2,2")},
        "37": {
            "φ1,2f(s), first line": FILTER_TRANSFER_FUNCTION * derivatives["φb(s)"],
            "φ1,2f(s), second line, first term": parts["Y1,1"],
            "φ1,2f(s), second line, second term": parts["Y1,2"],
        },
        "38": {f"{name}(s)": parts[name] for name in ("Y1,1", "Y1,2")},
    }


def differential_equations(parts: dict[str, Expression]) -> dict[str, dict[str, Expression]]:
    """Differential equations of the filter's states in the paper's order, and initial values (paper eqs. 41, 42)."""
    transforms = {
        **parts,
        "τ2f": FILTER_TRANSFER_FUNCTION * tau_s,
        "φ0,2f": FILTER_TRANSFER_FUNCTION * phi0_s,
    }
    ordered = [differential_equation(name, transforms[name]) for name in FILTER_STATE_NAMES]
    return {
        "41": {**{name: rhs for rates, _ in ordered for name, rhs in rates.items()}, "ν3": abbreviations()["ν2"]},
        "42": {name: value for _, initial in ordered for name, value in initial.items()},
    }


def laplace_of_derivatives() -> dict[str, Expression]:
    """Transforms of φ̈2, φ̇1 and φ0 (paper eq. 29)."""
    t, function = sp.Symbol("t"), sp.Function("f")(sp.Symbol("t"))
    first, second = (sp.laplace_transform(function.diff(t, n), t, s, noconds=True) for n in (1, 2))
    transform = sp.LaplaceTransform(function, t, s)
    start, rate = function.subs(t, 0), function.diff(t).subs(t, 0)
    return {
        "φa(s)": second.subs(rate, dphi2_0).subs(transform, phi2_s).subs(start, phi2_0),
        "φb(s)": first.subs(transform, phi1_s).subs(start, phi1_0),
        "φc(s)": phi0_s,
    }


def sum_of_pieces(derivatives: dict[str, Expression]) -> sp.Expr:
    """Combination of the transforms of the three pieces that gives that of φ (paper eq. 28)."""
    pieces = dict(zip((phi_a, phi_b, phi_c), derivatives.values(), strict=True))
    return combination(pieces, sp.Add(*derivatives.values()), (phi2_s, phi1_s, phi0_s, phi2_0, dphi2_0, phi1_0, s))


def abbreviations() -> dict[str, Expression]:
    """The filter's denominator with leading coefficient one, and its coefficient of s (paper eq. 36)."""
    denominator = sp.expand(FILTER_GAIN / FILTER_TRANSFER_FUNCTION)
    return {"ν1": sp.factor(denominator), "ν2": sp.expand(denominator.coeff(s, 1))}


def split_filtered_derivative(derivative: sp.Expr, order: int) -> dict[str, Expression]:
    """Filter a derivative: a part that needs no filter, and two parts without s in front of the filtered signal.

    The numerator is divided by ν1 and what remains by s + 1/τ1 (paper eqs. 35, 38).
    """
    moved, start = (phi2_s, phi2_0) if order == 2 else (phi1_s, phi1_0)
    direct, rest = sp.div(sp.expand(derivative), s**2 + nu2 * s + FILTER_GAIN, s)
    once, twice = sp.div(sp.expand(rest), s + 1 / tau1, s)
    twice = sp.expand(twice.subs(nu2, FILTER_ABBREVIATIONS[nu2]))
    parts = {
        f"Y{order},1": FILTER_GAIN * once / (s + 1 / tau2),
        f"Y{order},2": FILTER_GAIN / nu1 * sp.collect(twice, (moved, start)),
    }
    return parts if order == 1 else {f"φ{order}′": FILTER_GAIN * direct, **parts}


def sum_of_filtered(parts: dict[str, Expression], derivatives: dict[str, Expression]) -> sp.Expr:
    """Combination of the filtered pieces that gives the filtered regressor (paper eq. 40)."""
    pieces = {
        phi2_part_t: parts["φ2′"],
        **{FILTER_STATES[n]: parts[n] for n in FILTER_STATE_NAMES[1:5]},
        FILTER_STATES["φ0,2f"]: FILTER_TRANSFER_FUNCTION * phi0_s,
    }
    pieces = {name: sp.sympify(piece).subs(FILTER_ABBREVIATIONS) for name, piece in pieces.items()}
    moving = (phi2_s, phi1_s, phi0_s, phi2_0, dphi2_0, phi1_0, s)
    return combination(pieces, FILTER_TRANSFER_FUNCTION * sp.Add(*derivatives.values()), moving)


def differential_equation(name: str, transform: Expression) -> tuple[dict[str, Expression], dict[str, Expression]]:
    """The differential equation that a transform solves, and the initial values it implies (paper eqs. 41, 42)."""
    letter, rest = name[0], name[1:]
    plain = sp.cancel(sp.sympify(transform).subs(FILTER_ABBREVIATIONS))
    order = sp.degree(sp.denom(plain), s)
    poles = s + 1 / tau2 if order == 1 else FILTER_ABBREVIATIONS[nu1]
    numerator = sp.expand(sp.cancel(plain * poles))
    driving = sp.Add(*(numerator.coeff(f) * g for f, g in INVERSE_LAPLACE_TRANSFORMS.items()))
    values = sp.expand(numerator.subs(dict.fromkeys(INVERSE_LAPLACE_TRANSFORMS, 0)))
    if order == 1:
        rates = {nfc(f"{letter}̇{rest}(t)"): -FILTER_STATES[name] / tau2 + driving}
        return rates, {f"{name}(0)": values}
    start = values.coeff(s, 1)
    rate = sp.expand(values.coeff(s, 0) - FILTER_ABBREVIATIONS[nu2] * start)
    rates = {nfc(f"{letter}̈{rest}(t)"): -nu3 * FILTER_STATE_RATES[name] - FILTER_GAIN * FILTER_STATES[name] + driving}
    return rates, {f"{name}(0)": start, nfc(f"{letter}̇{rest}(0)"): rate}
