"""The 43 numbered equations of the paper, typed by hand as printed: misprints are kept, nothing is corrected here.

``PRINTED_EQUATIONS[number][name]`` is the right-hand side of ``name =``. Equation (33) is unreadable in the copy at
hand, and one column of φ2 in (26); dots that the copy shows as hats, as in (19) and (20), are read as dots.
"""

from __future__ import annotations

from collections.abc import Mapping

import sympy as sp

from wheelpend.paper import letters
from wheelpend.paper.letters import (  # fmt: skip
    FILTER_STATE_NAMES,
    FILTER_STATE_RATES,
    FILTER_STATES,
    PHI,
    T_L,
    B_m,
    F_w,
    I_o,
    J_b,
    J_m,
    J_w,
    K,
    K_b,
    K_e,
    K_t,
    L,
    L_i,
    M,
    R,
    R_m,
    V,
    X,
    Y,
    alpha,
    beta,
    current,
    dcurrent,
    ddp,
    ddphi2_t,
    ddw,
    dp,
    dphi1_t,
    dphi2_0,
    dw,
    epsilon,
    f_m,
    f_w,
    g,
    m,
    momentum_rate,
    nu1,
    nu2,
    nu3,
    p,
    phi0_s,
    phi0_t,
    phi1_0,
    phi1_s,
    phi1_t,
    phi2_0,
    phi2_part_t,
    phi2_s,
    phi2_t,
    phi13,
    phi23,
    phi25,
    phi_a,
    phi_b,
    phi_c,
    s,
    slope_of_L,
    speed,
    tau1,
    tau2,
    tau_s,
    tau_t,
    w,
)

Printed = Mapping[str, Mapping[str, letters.Expression]]

cos, sin = sp.cos, sp.sin
X1, X2, X3, X4, X5, X6, X7 = X


def stacked_samples(name: str) -> sp.Matrix:
    """Column of the samples of a quantity at T, 2T, ..., NT (paper eqs. 16, 24 and 43)."""
    return sp.Matrix(
        [*(sp.Symbol(f"{name}({time})") for time in ("T", "2 T")), sp.Symbol("..."), sp.Symbol(f"{name}(N T)")]
    )


PRINTED_DYNAMICS: Printed = {
    "1": {"L": (
        m * R**2 * dw**2 + M * R**2 * dw**2 / 2 + M * R * dw * dp * L * cos(p) + M * dp**2 * L**2 / 2 + J_w * dw**2
        + J_b * dp**2 / 2 + epsilon**2 * J_m * dw**2 - 2 * epsilon**2 * J_m * dw * dp + epsilon**2 * J_m * dp**2
        - M * g * R - M * g * L * cos(p))},
    "2": {"F_q": momentum_rate - slope_of_L},
    "3": {"F_θw": (
        ((2 * m + M) * R**2 + 2 * J_w + 2 * epsilon**2 * J_m) * ddw
        + (M * L * R * cos(p) - 2 * epsilon**2 * J_m) * ddp - M * L * R * dp**2 * sin(p))},
    "4": {"F_θp": (
        (M * L * R * cos(p) - 2 * epsilon**2 * J_m) * ddw + (M * L**2 + J_b + 2 * epsilon**2 * J_m) * ddp
        - M * g * L * sin(p))},
    "5": {"V_in": L_i * dcurrent + current * R_m + K_e * speed},
    "6": {"J_m dw/dt": K_t * current - B_m * speed - T_L},
    "7": {"V_in": current * R_m + K * speed},
    "8": {"J_m dw/dt": K / R_m * V - (K**2 / R_m + B_m) * speed - T_L},
    "9": {"T_L": f_m * (dp - dw)},
    "10": {"J_m dw/dt": F_w},
    "11": {"F_θw": alpha * V - 2 * (beta + f_w) * dw + 2 * beta * dp},
    "12": {"α": 2 * epsilon * K_t / R_m, "β": epsilon * K_t * K_b / R_m + f_m},
    "13": {"F_θp": -alpha * V + 2 * (beta + f_w) * w - 2 * beta * p},
    "14": {"α V_in": (
        2 * (beta + f_w) * dw - 2 * beta * dp - M * L * R * dp**2 * sin(p)
        + ((2 * m + M) * R**2 + 2 * J_w + 2 * epsilon**2 * J_m) * ddw
        + (M * L * R * cos(p) - 2 * epsilon**2 * J_m) * ddp)},
    "15": {"α V_in": (
        2 * (beta + f_w) * dw - 2 * beta * dp - (M * L**2 + J_b + 2 * epsilon**2 * J_m) * ddp + M * g * L * sin(p)
        - (M * L * R * cos(p) - 2 * epsilon**2 * J_m) * ddw)},
}  # fmt: skip

PRINTED_REGRESSION: Printed = {
    "16": {"Y": stacked_samples("y"), "Φ": stacked_samples("φ")},
    "17": {"X": (PHI.T * PHI).inverse() * PHI.T * Y},
    "18": {
        "X1": ((2 * m + M) * R**2 + 2 * J_w) / alpha,
        "X2": 2 * epsilon * J_m / alpha,
        "X3": M * L * R / alpha,
        "X4": (M * L**2 + J_b) / alpha,
        "X5": M * g * L / alpha,
        "X6": 2 * (beta + f_w) / alpha,
        "X7": 2 * beta / alpha,
    },
    "19": {"V_in": (
        (X1 + X2) * ddw + (X3 * cos(p) - X2) * ddp - X3 * dp**2 * sin(p) + X6 * dw - X7 * dp)},
    "20": {"V_in": (
        -(X3 * cos(p) - X2) * ddw - (X4 + X2) * ddp - X5 * sin(p) + X6 * dw - X7 * dp)},
    "21": {"τ(t)": sp.Matrix([V, V])},
    "22": {"φ(t)": sp.Matrix([
        [ddw, ddw - ddp, phi13, 0, 0, dw, -dp],
        [0, ddw - ddp, phi23, -ddp, phi25, dw, -dp]])},
    "23": {"φ13": cos(p) * ddp - sin(p) * dp**2, "φ23": -cos(p) * ddw, "φ25": sin(p)},
    "24": {"Y": stacked_samples("τ"), "Φ": stacked_samples("φ")},
    "25": {"φ(t)": ddphi2_t + dphi1_t + phi0_t},
    "26": {
        "φ2(t)": sp.Matrix([[w, w - p, 0, 0, 0, 0], [0, w - p, 0, -p, 0, 0]]),  # six of seven columns can be read
        "φ1(t)": sp.Matrix([[0, 0, cos(p) * dp, 0, 0, w, -p], [0, 0, -cos(p) * dw, 0, 0, w, -p]]),
        "φ0(t)": sp.Matrix([[0, 0, 0, 0, 0, 0, 0], [0, 0, -sin(p) * dp * dw, 0, sin(p), 0, 0]]),
    },
}  # fmt: skip

_gain = 1 / (tau1 * tau2)  # stands in front of most pieces of the filter
_tau, _y21, _y22, _y11, _y12, _phi0 = (FILTER_STATES[name] for name in FILTER_STATE_NAMES)

PRINTED_FILTER: Printed = {
    "27": {"τ(s)": sp.Symbol("φ(s) X")},
    "28": {"φ(s)": phi_a + phi_b + phi_c},
    "29": {"φa(s)": s**2 * phi2_s - s * phi2_0 - dphi2_0, "φb(s)": s * phi1_s - phi1_0, "φc(s)": phi0_s},
    "30": {"I_o(s)": 1 / ((tau1 * s + 1) * (tau2 * s + 1))},
    "31": {"τ2f(s)": sp.Symbol("φ2f(s) X")},
    "32": {"τ2f(s)": I_o * tau_s, "φ2f(s)": sp.Add(*(sp.Symbol(f"φ{k},2f(s)") for k in (2, 1, 0)))},
    "34": {
        "φ2,2f(s), first line": _gain / nu1 * (s**2 * phi2_s - s * phi2_0 - dphi2_0),
        "φ2,2f(s), second line, first term": _gain * phi2_s,
        "φ2,2f(s), second line, second term": _gain / nu1 * (-nu2 * phi2_s - (s + 1 / tau1) * phi2_0),
        "φ2,2f(s), third line": (
            _gain / nu1 * ((nu2 / tau1 - 1 / (tau1 * tau2)) * phi2_s + phi2_0 / tau1 - dphi2_0)),
    },
    "35": {
        "φ2′(s)": _gain * phi2_s,
        "Y2,1(s)": _gain * tau2 / (tau2 * s + 1) * (-nu2 * phi2_s - phi2_0),
        "Y2,2(s)": _gain / nu1 * (phi2_s / tau1**2 + phi2_0 / tau1 - dphi2_0),
    },
    "36": {"ν1": (s + 1 / tau1) * (s + 1 / tau2), "ν2": 1 / tau1 + 1 / tau2},
    "37": {
        "φ1,2f(s), first line": (s * phi1_s - phi1_0) / ((tau1 * s + 1) * (tau2 * s + 1)),
        "φ1,2f(s), second line, first term": _gain * (tau1 * s + 1) / (nu1 * tau1) * phi1_s,
        "φ1,2f(s), second line, second term": _gain / nu1 * (-phi1_s / tau1 - phi1_0),
    },
    "38": {
        "Y1,1(s)": _gain * tau2 / (tau2 * s + 1) * phi1_s,
        "Y1,2(s)": _gain / nu1 * (-phi1_s / tau1 - phi1_0),
    },
    "39": {"τ2f(t)": sp.Symbol("φ2f(t) X")},
    "40": {"φ2f(t)": phi2_part_t + _y21 + _y22 + _y11 + _y12 + _phi0, "φ2′(t)": phi2_t / (tau1 * tau2)},
    "41": {
        "τ̈2f(t)": -nu3 * FILTER_STATE_RATES["τ2f"] - _gain * _tau + _gain * tau_t,
        "Ẏ2,1(t)": -_y21 / tau2 - nu2 / (tau1 * tau2) * phi2_t,
        "Ÿ2,2(t)": -nu3 * FILTER_STATE_RATES["Y2,2"] - _gain * _y22 + phi2_t / (tau1 * tau2 * tau1**2),
        "Ẏ1,1(t)": -_y11 / tau2 + _gain * phi1_t,
        "Ÿ1,2(t)": -nu3 * FILTER_STATE_RATES["Y1,2"] - _gain * _y12 - _gain * phi1_t,
        "φ̈0,2f(t)": -nu3 * FILTER_STATE_RATES["φ0,2f"] - _gain * _phi0 + _gain * phi0_t,
        "ν3": 1 / tau1 + 1 / tau2,
    },
    "42": {
        "τ2f(0)": sp.Integer(0), "τ̇2f(0)": sp.Integer(0),
        "Y2,1(0)": -_gain * phi2_0,
        "Y2,2(0)": sp.Integer(0), "Ẏ2,2(0)": _gain * (phi2_0 / tau1 - dphi2_0),
        "Y1,1(0)": sp.Integer(0),
        "Y1,2(0)": sp.Integer(0), "Ẏ1,2(0)": -_gain * phi1_0,
        "φ0,2f(0)": sp.Integer(0), "φ̇0,2f(0)": sp.Integer(0),
    },
    "43": {"Y2f": stacked_samples("τ2f"), "Φ2f": stacked_samples("φ2f")},
}  # fmt: skip

PRINTED_EQUATIONS: Printed = {**PRINTED_DYNAMICS, **PRINTED_REGRESSION, **PRINTED_FILTER}
EQUATION_NUMBERS = tuple(str(k) for k in range(1, 44))
