"""The paper's equations as the derivation gives them, from geometry and virtual work, component by component.

``derive_dynamics`` holds for a choice of assumptions; equation numbers and the names of the components are those of
``equations.PRINTED_EQUATIONS``.
"""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import sympy as sp
from sympy.calculus.euler import euler_equations

import derive
from derive.lagrange import derive_equations
from derive.records import Model, Plant, Regressor
from wheelpend.paper.combination import combination
from wheelpend.paper.filtering import derive_filter
from wheelpend.paper.letters import (  # fmt: skip
    GENERALISED_COORDINATES,
    PHI,
    RATE_OF,
    T_L,
    B_m,
    Expression,
    K,
    K_b,
    K_e,
    K_t,
    L_i,
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
    dw,
    epsilon,
    f_w,
    momentum_rate,
    phi0_t,
    phi13,
    phi23,
    phi25,
    slope_of_L,
    speed,
)

PLANT_NAME = "wheel_pendulum"
Derived = dict[str, dict[str, Expression]]


@lru_cache
def _derive_for(choices: tuple) -> Derived:
    model = derive.compose(PLANT_NAME, dict(choices), [])
    rows = mechanics(model.plant)
    return {**rows, **regression(model, rows["12"]["β"])}


def derive_dynamics(**assumptions) -> Derived:
    """Equations of the robot and of its regressor under the given assumptions and the defaults of the others."""
    return _derive_for(tuple(sorted(assumptions.items())))


@lru_cache
def derive_all() -> Derived:
    """Every equation that can be derived, under the default assumptions."""
    dynamics = derive_dynamics()
    return {**dynamics, **motor(dynamics), "2": {"F_q": stationary_action()}, "17": {"X": least_squares()},
            **derive_filter()}  # fmt: skip


def on_level_ground(plant: Plant) -> Plant:
    """The robot on level ground, without payload, with the centre of mass on the body's axis."""
    absent = dict.fromkeys(plant.geometry.values(), 0)
    bodies = tuple(b._replace(position=b.position.subs(absent), mass=b.mass.subs(absent)) for b in plant.bodies)
    return replace(plant, bodies=bodies, gravity=plant.gravity.subs(absent))


def mechanics(plant: Plant) -> Derived:
    """Lagrangian, inertia and generalised forces of the robot (paper eqs. 1-4 and 11-15)."""
    equations = derive_equations(on_level_ground(plant))
    inertia_w, inertia_p = equations.inertia
    force_w, force_p = equations.force
    drive = {"α": force_w.coeff(V), "β": sp.expand(force_w.coeff(dp) / 2)}
    force_w, force_p = in_drive_letters(force_w, drive, 1), in_drive_letters(force_p, drive, -1)
    rows = [inertia_w, inertia_p, inertia_w - force_w + alpha * V, -inertia_p + force_p + alpha * V]
    eq_3, eq_4, eq_14, eq_15 = (collect_by_motion(row) for row in rows)
    return {
        "1": {"L": equations.lagrangian},
        "3": {"F_θw": eq_3},
        "4": {"F_θp": eq_4},
        "11": {"F_θw": force_w},
        "12": drive,
        "13": {"F_θp": force_p},
        "14": {"α V_in": eq_14},
        "15": {"α V_in": eq_15},
    }


def collect_by_motion(row: sp.Expr) -> sp.Expr:
    """Collect a row by accelerations and rates."""
    return sp.collect(sp.expand(row), (ddw, ddp, dw, dp))


def in_drive_letters(force: sp.Expr, drive: dict[str, sp.Expr], direction: int) -> sp.Expr:
    """Write the part of a force that passes between wheel and body with α and β."""
    spelled = drive["α"] * V + 2 * drive["β"] * (dp - dw)
    return sp.expand(alpha * V + 2 * beta * (dp - dw)) * direction + sp.expand(force - direction * spelled)


def stationary_action() -> sp.Expr:
    """Combination of d/dt ∂L/∂q̇ and ∂L/∂q that Hamilton's principle balances with a force (paper eq. 2)."""
    t = sp.Symbol("t")
    mass, stiffness = sp.symbols("mass stiffness", positive=True)
    q = sp.Function("q")(t)
    lagrangian = mass * q.diff(t) ** 2 / 2 - stiffness * q**2 / 2
    force = -euler_equations(lagrangian, q, t)[0].lhs
    pieces = {momentum_rate: lagrangian.diff(q.diff(t)).diff(t), slope_of_L: lagrangian.diff(q)}
    return combination(pieces, force, (q.diff(t, 2), q))


def motor(dynamics: Derived) -> Derived:
    """The motor by itself, from its energies, and the gearbox's friction on it (paper eqs. 5-9)."""
    circuit = (
        dcurrent * sp.diff(L_i * current**2 / 2, current, 2) + sp.diff(R_m * current**2 / 2, current) + K_e * speed
    )
    rotor = K_t * current - sp.diff(B_m * speed**2 / 2, speed) - T_L
    static = circuit.subs(L_i, 0).subs(K_e, K)
    settled = (V - static.coeff(speed) * speed) / static.coeff(current)
    wheel = dynamics["11"]["F_θw"].subs(beta, dynamics["12"]["β"])
    friction = -wheel.subs({V: 0, K_b: 0, f_w: 0}) / 2  # one of the two motors
    return {
        "5": {"V_in": circuit},
        "6": {"J_m dw/dt": rotor},
        "7": {"V_in": static},
        "8": {"J_m dw/dt": sp.expand(rotor.subs(K_t, K).subs(current, settled))},
        "9": {"T_L": sp.factor(friction)},
    }


def regression(model: Model, drag: sp.Expr) -> Derived:
    """Equivalent parameters and the equations that are linear in them (paper eqs. 18-23, 25, 26)."""
    regressor = model.regressor
    rows = regressor.phi * sp.Matrix(regressor.parameters)
    named, entries = named_entries(regressor)
    pieces = {ddphi2_t: time_derivative(time_derivative(regressor.phi2)), dphi1_t: time_derivative(regressor.phi1),
              phi0_t: regressor.phi0}  # fmt: skip
    return {
        "18": parameter_definitions(model, drag),
        "19": {"V_in": collect_by_motion(rows[0] + V - regressor.tau[0])},
        "20": {"V_in": collect_by_motion(rows[1] + V - regressor.tau[1])},
        "21": {"τ(t)": regressor.tau},
        "22": {"φ(t)": named},
        "23": entries,
        "25": {"φ(t)": _sum_of_pieces(pieces, regressor)},
        "26": {f"φ{k}(t)": as_measured(model.plant, getattr(regressor, f"phi{k}")) for k in (2, 1, 0)},
    }


def parameter_definitions(model: Model, drag: sp.Expr) -> dict[str, Expression]:
    """Definitions of the equivalent parameters, written with α and β (paper eq. 18)."""
    spelled = sp.expand(drag.subs(K_t, alpha * R_m / (2 * epsilon)))
    back_emf = (beta - spelled.subs(K_b, 0)) / spelled.coeff(K_b)
    named = zip(model.grouping.names, model.grouping.definitions, strict=True)
    return {name: sp.factor(definition.subs(K_b, back_emf)) for name, definition in named}


def named_entries(regressor: Regressor) -> tuple[sp.Matrix, dict[str, Expression]]:
    """The regressor with the paper's names for three of its entries, and these entries (paper eqs. 22, 23)."""
    named, entries = sp.Matrix(regressor.phi), {}
    columns = [str(x) for x in regressor.parameters]
    for row, column, name in ((0, "X3", phi13), (1, "X3", phi23), (1, "X5", phi25)):
        if column in columns:
            entries[name.name] = named[row, columns.index(column)]
            named[row, columns.index(column)] = name
    return named, entries


def time_derivative(matrix: sp.Matrix) -> sp.Matrix:
    """Time derivative of a matrix of functions of the angles and rates."""
    rates = {**RATE_OF, **{rate: sp.Symbol(f"d{rate.name}", real=True) for rate in RATE_OF.values()}}
    return matrix.applyfunc(lambda e: sp.expand(sp.Add(*(e.diff(q) * rate for q, rate in rates.items()))))


def _sum_of_pieces(pieces: dict[sp.Symbol, sp.Matrix], regressor: Regressor) -> sp.Expr:
    """Combination of φ̈2, φ̇1 and φ0 that gives φ (paper eq. 25)."""
    moving = tuple(sp.Symbol(f"{d}{c.name}", real=True) for c in GENERALISED_COORDINATES for d in ("", "d", "dd"))
    marks = sp.symbols(f"entry_0:{len(regressor.phi)}")
    flattened = {name: sp.Add(*(mark * e for mark, e in zip(marks, piece, strict=True)))
                 for name, piece in pieces.items()}  # fmt: skip
    target = sp.Add(*(mark * e for mark, e in zip(marks, regressor.phi, strict=True)))
    return combination(flattened, target, (*marks, *moving))


def as_measured(plant: Plant, matrix: sp.Matrix) -> sp.Matrix:
    """Write a matrix with the sensors' readings in place of the angles (paper eq. 26)."""
    readings = {c.name: c.reading for c in plant.channels}
    shifts = {q: q - readings[q.name] for q in GENERALISED_COORDINATES}
    moved = {q: q + shift for q, shift in shifts.items()}
    moved |= {RATE_OF[q]: RATE_OF[q] + shift.subs(RATE_OF) for q, shift in shifts.items()}
    return matrix.subs(moved, simultaneous=True)


LEAST_SQUARES_EXAMPLE = {
    PHI: sp.ImmutableMatrix([[1, 2], [3, 5], [7, 11]]),
    Y: sp.ImmutableMatrix([2, 3, 8]),
}


def least_squares() -> sp.Matrix:
    """The X at which the gradient of ‖Y − ΦX‖² vanishes, on an example (paper eq. 17)."""
    unknown = sp.Matrix(X[:2])
    residual = LEAST_SQUARES_EXAMPLE[Y] - LEAST_SQUARES_EXAMPLE[PHI] * unknown
    gradient = sp.Matrix([residual.dot(residual)]).jacobian(unknown)
    return sp.Matrix([sp.solve(list(gradient), list(unknown))[x] for x in unknown])
