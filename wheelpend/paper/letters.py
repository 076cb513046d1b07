"""The paper's letters as symbols. Those that the derivation uses too are the same symbols there."""

from __future__ import annotations

import unicodedata

import sympy as sp

from derive.functions import symbol

Expression = sp.Expr | sp.MatrixBase | sp.MatrixExpr


def nfc(name: str) -> str:
    """Unicode normal form C of a name: dots joined to their letters, so that equal names are equal strings."""
    return unicodedata.normalize("NFC", name)


# The robot: masses, lengths, inertias, motor constants.
m, M, L, R, g = sp.symbols("m M L R g", positive=True)
J_w, J_b, J_m, epsilon = sp.symbols("J_w J_b J_m epsilon", positive=True)
K_t, K_b, R_m, f_m, f_w, alpha, beta = sp.symbols("K_t K_b R_m f_m f_w alpha beta", positive=True)
X = tuple(symbol(f"X{k}") for k in range(1, 8))

# Its motion, and the voltage.
w, dw, ddw = (symbol(f"{d}theta_w") for d in ("", "d", "dd"))
p, dp, ddp = (symbol(f"{d}theta_p") for d in ("", "d", "dd"))
V = symbol("v_in")
F_w, F_p = sp.symbols("F_θw F_θp", real=True)

# The motor by itself (equations 5 to 10). The paper's L is an inductance there.
L_i, K_e, K, B_m = sp.symbols("L K_e K B_m", nonnegative=True)
current, dcurrent, speed, T_L = sp.symbols("i di/dt w T_L", real=True)

# Lagrange's equation (2).
momentum_rate, slope_of_L = sp.symbols("d/dt(∂L/∂θ̇_q) ∂L/∂θ_q", real=True)

# Entries of the regressor that (22) names and (23) spells out.
phi13, phi23, phi25 = sp.symbols("φ13 φ23 φ25", real=True)

# The filter: Laplace variable, time constants, abbreviations (equations 27 to 43).
s = sp.Symbol("s", real=True)
tau1, tau2, nu1, nu2, nu3, I_o = sp.symbols("τ1 τ2 ν1 ν2 ν3 I_o", positive=True)
phi2_s, phi1_s, phi0_s, tau_s, phi_s = sp.symbols("φ2(s) φ1(s) φ0(s) τ(s) φ(s)", real=True)
phi2_t, phi1_t, phi0_t, tau_t = sp.symbols("φ2(t) φ1(t) φ0(t) τ(t)", real=True)
ddphi2_t, dphi1_t = sp.symbols("φ̈2(t) φ̇1(t)", real=True)
phi2_0, dphi2_0, phi1_0 = sp.symbols("φ2(0) φ̇2(0) φ1(0)", real=True)
phi_a, phi_b, phi_c = sp.symbols("φa(s) φb(s) φc(s)", real=True)
FILTER_STATE_NAMES = ("τ2f", "Y2,1", "Y2,2", "Y1,1", "Y1,2", "φ0,2f")  # what (41) integrates, in the paper's order
FILTER_STATES = {name: sp.Symbol(f"{name}(t)", real=True) for name in FILTER_STATE_NAMES}
FILTER_STATE_RATES = {name: sp.Symbol(nfc(f"{name[0]}̇{name[1:]}(t)"), real=True) for name in FILTER_STATE_NAMES}
phi2_part_t = sp.Symbol("φ2′(t)", real=True)

# Least squares (17), on any matrices of fitting shapes.
PHI, Y = sp.MatrixSymbol("Φ", 3, 2), sp.MatrixSymbol("Y", 3, 1)

GENERALISED_COORDINATES = (w, p)
RATE_OF = {w: dw, p: dp}
TIME_VARYING_SYMBOLS = (  # all other symbols are constants of the robot or of the filter
    w, dw, ddw, p, dp, ddp, V, F_w, F_p, current, dcurrent, speed, T_L, momentum_rate, slope_of_L, phi13, phi23, phi25,
    phi2_s, phi1_s, phi0_s, tau_s, phi_s, phi2_t, phi1_t, phi0_t, tau_t, ddphi2_t, dphi1_t, phi2_0, dphi2_0, phi1_0,
    phi_a, phi_b, phi_c, phi2_part_t, *FILTER_STATES.values(), *FILTER_STATE_RATES.values(),
)  # fmt: skip
