"""The linear-in-parameters regressor and its exact split into pieces without accelerations."""

from __future__ import annotations

from collections.abc import Sequence
from math import prod

import sympy as sp

from derive.algebra import derivative, expand, jacobian, substitute, symbols_in
from derive.functions import TIME_SYMBOL, symbol
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
    slipping = [row + force for row, force in zip(residual, dry_forces(surfaces, len(residual)), strict=True)]
    rows = [expand(s * r) for s, r in zip(row_signs(plant, grouping), slipping, strict=True)]
    parameters = linear_parameters(rows, grouping.names, fitted)
    phi = jacobian(rows, parameters).applyfunc(expand)
    known = [expand(row - sp.Add(*map(prod, zip(phi[n, :], parameters, strict=True)))) for n, row in enumerate(rows)]
    tau = -sp.Matrix(known)
    pieces = [split_accelerations(plant, entry) for entry in phi]
    phi2, phi1, phi0 = (sp.Matrix(*phi.shape, [p[k] for p in pieces]) for k in range(3))
    balance = energy_balance(plant, slipping, parameters)
    return Regressor(parameters, tau, phi, phi2, phi1, phi0, balance)


def energy_balance(plant: Plant, slipping: list[sp.Expr], parameters: tuple[sp.Symbol, ...]) -> EnergyBalance:
    """Multiply each row by its rate and add: what multiplies a parameter is a stored energy's rate plus a power.

    This is the energy regressor of the paper's references [22, 23]. Raises ValueError if an acceleration is left.
    """
    power = expand(sp.Add(*(c.dq * row for c, row in zip(plant.coordinates, slipping, strict=True))))
    per_parameter = [expand(derivative(power, x)) for x in parameters]
    stored = [stored_energy(plant, p) for p in per_parameter]
    taken = [expand(p - time_derivative(plant, e)) for p, e in zip(per_parameter, stored, strict=True)]
    if any(p.has(*(c.ddq for c in plant.coordinates)) for p in taken):
        raise ValueError(f"{plant.name}: the energy balance must be free of accelerations, but {taken} is not")
    known = sp.Add(*(x * p for x, p in zip(parameters, per_parameter, strict=True)))
    return EnergyBalance(sp.Matrix([stored]), sp.Matrix([taken]), expand(known - power))


def stored_energy(plant: Plant, power: sp.Expr) -> sp.Expr:
    """Kinetic and potential energy whose rate a power contains."""
    still = {c.ddq: sp.Integer(0) for c in plant.coordinates}
    kinetic = sp.Add(*(substitute(derivative(power, c.ddq), still) * c.dq for c in plant.coordinates)) / 2
    left = expand(power - time_derivative(plant, kinetic))
    potential = sp.Integer(0)
    for c in plant.coordinates:
        pull = left.coeff(c.dq, 1)
        moving = (*(s for k in plant.coordinates for s in (k.dq, k.ddq)), *plant.inputs, TIME_SYMBOL)
        if pull != 0 and not pull.has(*moving) and has_potential(pull, c.q):
            potential += sp.Add(*(potential_of(term, c.q) for term in sp.Add.make_args(pull)))
            left = expand(left - pull * c.dq)
    return expand(kinetic) + potential


def has_potential(pull: sp.Expr, angle: sp.Symbol) -> bool:
    """True where a force's potential is one that kernels can evaluate: of sines and powers of its angle.

    The work of any other force is counted as power taken, which is as true.
    """
    waves = pull.atoms(sp.Function)
    plain = pull.subs({w: sp.Dummy() for w in waves})
    known = all(isinstance(w, sp.sin | sp.cos) for w in waves)
    return known and bool(plain.is_polynomial(angle))


def potential_of(pull: sp.Expr, angle: sp.Symbol) -> sp.Expr:
    """Integral over its angle of a pull without sums: by rule for powers, sines and cosines, else by SymPy, slowly."""
    factor, function = pull.as_independent(angle, as_Add=False)
    base, exponent = function.as_base_exp()
    if function == 1 or (base == angle and exponent.is_Integer and exponent > 0):
        power = 1 if function == 1 else exponent + 1
        return factor * angle**power / power
    if isinstance(function, sp.sin | sp.cos):
        argument = function.args[0]
        turning = derivative(argument, angle)
        whole = (-sp.cos(argument) if isinstance(function, sp.sin) else sp.sin(argument)) / turning
        if turning.is_number:
            return factor * whole
        if angle not in symbols_in(turning) and (turning.is_Symbol or (-turning).is_Symbol):
            still = substitute(function, {s: sp.Integer(0) for s in symbols_in(turning)}) * angle
            return factor * sp.Piecewise((whole, sp.Ne(turning, 0)), (still, True))
    return sp.integrate(pull, angle)


def time_derivative(plant: Plant, expression: sp.Expr) -> sp.Expr:
    """Time derivative of a function of the coordinates and their rates."""
    return sp.Add(
        *(derivative(expression, c.q) * c.dq + derivative(expression, c.dq) * c.ddq for c in plant.coordinates)
    )


def dry_forces(surfaces: tuple[DrySurface, ...], rows: int) -> list[sp.Expr]:
    """Dry friction on each row while slipping."""
    return [sp.Add(*(sp.nsimplify(s.slip[n]) * s.law for s in surfaces if s.slip[n])) for n in range(rows)]


def row_signs(plant: Plant, grouping: Grouping) -> tuple[sp.Expr, ...]:
    """Factor per row that puts the input on the left with a plus sign, as in the paper's (19) and (20)."""
    gains = (input_gain(plant, expand(row)) for row in grouping.rows)
    return tuple(-1 / gain if gain else sp.Integer(1) for gain in gains)


def input_gain(plant: Plant, row: sp.Expr) -> sp.Expr:
    """Gain of all inputs together in a row; where they cancel, that of the last one."""
    gains = [row.coeff(u) for u in plant.inputs]
    return sp.simplify(sp.Add(*gains)) or gains[-1]


def linear_parameters(rows: Sequence[sp.Expr], base: tuple[str, ...], fitted: tuple[Parameter, ...]) -> tuple:
    """Base parameters, then those effect parameters in which the rows are jointly linear."""
    parameters = [symbol(name) for name in base]
    columns = jacobian(rows, parameters)
    culprits = [x for x in parameters if any(derivative(entry, x) for entry in columns)]
    if culprits:
        raise ValueError(f"The model is not linear in {', '.join(map(str, culprits))}")
    for candidate in (symbol(p.name) for p in fitted[len(base) :]):
        column = [derivative(row, candidate) for row in rows]
        if any(column) and not any(symbols_in(entry) & {*parameters, candidate} for entry in column):
            parameters.append(candidate)
    return tuple(parameters)


def split_accelerations(plant: Plant, entry: sp.Expr) -> tuple[sp.Expr, sp.Expr, sp.Expr]:
    """Split one entry into (a, b, c) with entry = d²a/dt² + db/dt + c and no acceleration in any of them.

    A constant times an acceleration is the second derivative of an angle. A function of the configuration times an
    acceleration is the derivative of function · rate, less the function's own derivative · rate. What remains and is
    the time derivative of a function of the configuration goes into b as well.
    """
    twice, once, rest = sp.Integer(0), sp.Integer(0), entry
    for c in plant.coordinates:
        factor = rest.coeff(c.ddq)
        if factor == 0:
            continue
        if not factor.free_symbols & set(_states(plant)):
            twice += factor * c.q
        else:
            once += factor * c.dq
            factor_rate = sp.Add(*(derivative(factor, k.q) * k.dq for k in plant.coordinates))
            rest -= factor_rate * c.dq
        rest = expand(rest - factor * c.ddq)
    for c in plant.coordinates:
        factor = rest.coeff(c.dq)
        if factor != 0 and not factor.has(*_states(plant)) and not factor.has(*plant.inputs):
            once += factor * c.q
            rest = expand(rest - factor * c.dq)
    return twice, once, rest


def _states(plant: Plant) -> tuple[sp.Symbol, ...]:
    return tuple(s for c in plant.coordinates for s in (c.q, c.dq))
