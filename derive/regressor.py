"""The linear-in-parameters regressor and its exact split into pieces without accelerations."""

from __future__ import annotations

import sympy as sp

from derive.functions import TIME, symbol
from derive.records import DrySurface, EnergyBalance, Grouping, Parameter, Plant, Regressor


def derive_regressor(
    plant: Plant,
    residual: tuple[sp.Expr, ...],
    surfaces: tuple[DrySurface, ...],
    grouping: Grouping,
    fitted: tuple[Parameter, ...],
) -> Regressor:
    """Write the residual as tau − phi · X, with the commanded input on the left (paper eqs. 21-23, 25, 26).

    Dry friction enters with its direction. Effect parameters in which the residual is not linear (a slope's angle) stay
    inside tau and phi as known numbers. Raises ValueError, naming the culprits, if a base parameter is not linear.
    """
    slipping = sp.Matrix(residual) + dry_forces(plant, surfaces)
    rows = sp.Matrix([sp.expand(s * r) for s, r in zip(orientation(plant, grouping), slipping, strict=True)])
    parameters = linear_parameters(rows, grouping.names, fitted)
    phi = rows.jacobian(parameters)
    tau = -(rows - phi * sp.Matrix(parameters)).applyfunc(sp.expand)
    pieces = [split(plant, sp.expand(entry)) for entry in phi]
    phi2, phi1, phi0 = (sp.Matrix(*phi.shape, [p[k] for p in pieces]) for k in range(3))
    balance = energy_balance(plant, slipping, parameters)
    return Regressor(parameters, tau, phi.applyfunc(sp.expand), phi2, phi1, phi0, balance)


def energy_balance(plant: Plant, slipping: sp.Matrix, parameters: tuple[sp.Symbol, ...]) -> EnergyBalance:
    """Multiply each row by its rate and add: what multiplies a parameter is a stored energy's rate plus a power.

    This is the energy regressor of the paper's references [22, 23]. Raises ValueError if an acceleration is left.
    """
    power = sp.expand(sp.Add(*(c.dq * row for c, row in zip(plant.coordinates, slipping, strict=True))))
    per_parameter = [sp.expand(power.diff(x)) for x in parameters]
    stored = [stored_energy(plant, p) for p in per_parameter]
    taken = [sp.expand(p - total_rate(plant, e)) for p, e in zip(per_parameter, stored, strict=True)]
    if any(p.has(*(c.ddq for c in plant.coordinates)) for p in taken):
        raise ValueError(f"{plant.name}: the energy balance must be free of accelerations, but {taken} is not")
    known = sp.Add(*(x * p for x, p in zip(parameters, per_parameter, strict=True)))
    return EnergyBalance(sp.Matrix([stored]), sp.Matrix([taken]), sp.expand(known - power))


def stored_energy(plant: Plant, power: sp.Expr) -> sp.Expr:
    """Kinetic and potential energy whose rate a power contains."""
    kinetic = sp.Add(*(power.diff(c.ddq).subs({k.ddq: 0 for k in plant.coordinates}) * c.dq
                       for c in plant.coordinates)) / 2  # fmt: skip
    left = sp.expand(power - total_rate(plant, kinetic))
    potential = sp.Integer(0)
    for c in plant.coordinates:
        pull = left.coeff(c.dq, 1)
        moving = (*(s for k in plant.coordinates for s in (k.dq, k.ddq)), *plant.inputs, TIME)
        if not pull.has(*moving) and has_potential(pull, c.q):
            potential += sp.integrate(pull, c.q)
            left = sp.expand(left - pull * c.dq)
    return sp.expand(kinetic) + potential


def has_potential(pull: sp.Expr, angle: sp.Symbol) -> bool:
    """Whether a force's potential is one that kernels can evaluate: of sines and powers of its angle.

    The work of any other force is counted as power taken, which is as true.
    """
    waves = pull.atoms(sp.Function)
    plain = pull.subs({w: sp.Dummy() for w in waves})
    known = all(isinstance(w, sp.sin | sp.cos) for w in waves)
    return known and bool(plain.is_polynomial(angle))


def total_rate(plant: Plant, expression: sp.Expr) -> sp.Expr:
    """Time derivative of a function of the coordinates and their rates."""
    return sp.Add(*(expression.diff(c.q) * c.dq + expression.diff(c.dq) * c.ddq for c in plant.coordinates))


def dry_forces(plant: Plant, surfaces: tuple[DrySurface, ...]) -> sp.Matrix:
    """Dry friction on each row while slipping."""
    total = sp.zeros(len(plant.coordinates), 1)
    for surface in surfaces:
        total += sp.Matrix(surface.slip).applyfunc(sp.nsimplify) * surface.law
    return total


def orientation(plant: Plant, grouping: Grouping) -> tuple[sp.Expr, ...]:
    """Factor per row that puts the input on the left with a plus sign, as in the paper's (19) and (20)."""
    gains = (own_gain(plant, sp.expand(row)) for row in grouping.rows)
    return tuple(-1 / gain if gain else sp.Integer(1) for gain in gains)


def own_gain(plant: Plant, row: sp.Expr) -> sp.Expr:
    """What all inputs together do to a row; where they cancel, what the last one does."""
    gains = [row.coeff(u) for u in plant.inputs]
    return sp.simplify(sp.Add(*gains)) or gains[-1]


def linear_parameters(rows: sp.Matrix, base: tuple[str, ...], fitted: tuple[Parameter, ...]) -> tuple:
    """Base parameters, then those effect parameters in which the rows are jointly linear."""
    parameters = [symbol(name) for name in base]
    culprits = [x for x in parameters if rows.jacobian(parameters).diff(x) != rows.jacobian(parameters) * 0]
    if culprits:
        raise ValueError(f"The model is not linear in {', '.join(map(str, culprits))}")
    for candidate in (symbol(p.name) for p in fitted[len(base) :]):
        column = rows.diff(candidate)
        if not any(column.has(x) for x in (*parameters, candidate)) and any(column):
            parameters.append(candidate)
    return tuple(parameters)


def split(plant: Plant, entry: sp.Expr) -> tuple[sp.Expr, sp.Expr, sp.Expr]:
    """Split one entry into (a, b, c) with entry = d²a/dt² + db/dt + c and no acceleration in any of them.

    A constant times an acceleration is the second derivative of an angle. A function of the configuration times an
    acceleration is the derivative of function · rate, less the function's own derivative · rate. What remains and is
    the time derivative of a function of the configuration goes into b as well.
    """
    twice, once, rest = sp.Integer(0), sp.Integer(0), entry
    for c in plant.coordinates:
        factor = sp.expand(rest).coeff(c.ddq)
        if factor == 0:
            continue
        if not factor.free_symbols & set(_states(plant)):
            twice += factor * c.q
        else:
            once += factor * c.dq
            factor_rate = sp.Add(*(factor.diff(k.q) * k.dq for k in plant.coordinates))
            rest -= factor_rate * c.dq
        rest = sp.expand(rest - _acceleration_terms(rest, c))
    for c in plant.coordinates:
        factor = rest.coeff(c.dq)
        if factor != 0 and not factor.has(*_states(plant)) and not factor.has(*plant.inputs):
            once += factor * c.q
            rest = sp.expand(rest - factor * c.dq)
    return twice, once, rest


def _acceleration_terms(expression: sp.Expr, c) -> sp.Expr:
    return sp.expand(expression).coeff(c.ddq) * c.ddq


def _states(plant: Plant) -> tuple[sp.Symbol, ...]:
    return tuple(s for c in plant.coordinates for s in (c.q, c.dq))
