"""From geometry to the equations of motion: Lagrangian, Lagrange's equations, virtual work."""

from __future__ import annotations

import sympy as sp
from sympy.simplify.fu import TR8

from derive.algebra import derivative, expand, jacobian
from derive.records import Body, Coordinate, Equations, Plant


def derive_equations(plant: Plant) -> Equations:
    """Derive the equations of motion of a plant (paper eqs. 1-4, 11, 13)."""
    lagrangian = kinetic_energy(plant) - potential_energy(plant)
    sideways = lateral_momentum(plant)
    return Equations(
        lagrangian,
        inertia=tuple(
            expand(lagrange_row(lagrangian, c, plant.moving) + heading_term(plant, sideways, c)) for c in plant.moving
        ),
        force=tuple(generalised_force(plant, c) for c in plant.moving),
    )


def kinetic_energy(plant: Plant) -> sp.Expr:
    """Kinetic energy of all bodies, translation and rotation [J] (paper eq. 1)."""
    return sp.Add(*(kinetic_energy_of(body, plant) for body in plant.bodies))


def velocity_of(body: Body, plant: Plant) -> sp.Matrix:
    """Velocity of a body's centre of mass [m/s], in the frame of the positions, which may turn."""
    velocity = jacobian(body.position, [c.q for c in plant.moving]) * sp.Matrix([c.dq for c in plant.moving])
    if plant.heading is None:
        return velocity
    arm, rate = body.position - plant.heading.origin, plant.heading.coordinate.dq
    return velocity + rate * sp.Matrix([-arm[1], arm[0], 0])


def kinetic_energy_of(body: Body, plant: Plant) -> sp.Expr:
    """Kinetic energy of one body [J]."""
    velocity = velocity_of(body, plant)
    turning = sp.sympify(body.rate) ** 2
    return expand(body.mass * sum_angles(velocity.dot(velocity)) / 2 + body.inertia * sum_angles(turning) / 2)


def potential_energy(plant: Plant) -> sp.Expr:
    """Potential energy of all bodies in the plant's gravity [J]."""
    energies = (-body.mass * sum_angles(plant.gravity.dot(body.position)) for body in plant.bodies)
    return expand(sp.Add(*energies))


def sum_angles(expression: sp.Expr) -> sp.Expr:
    """Products of sines and cosines as functions of sums of angles: what trigsimp would find, 30 times faster."""
    return expand(TR8(expand(expression)))


def lagrange_row(lagrangian: sp.Expr, row: Coordinate, coordinates: tuple[Coordinate, ...]) -> sp.Expr:
    """d/dt ∂L/∂q̇ − ∂L/∂q by the chain rule (paper eq. 2)."""
    momentum = derivative(lagrangian, row.dq)
    rate_of_momentum = sp.Add(
        *(derivative(momentum, c.dq) * c.ddq + derivative(momentum, c.q) * c.dq for c in coordinates)
    )
    return expand(rate_of_momentum - derivative(lagrangian, row.q))


def lateral_momentum(plant: Plant) -> sp.Expr:
    """Momentum along the turning frame's y axis, in which no wheel rolls [kg m/s]."""
    if plant.heading is None:
        return sp.Integer(0)
    return expand(sp.Add(*(body.mass * velocity_of(body, plant)[1] for body in plant.bodies)))


def heading_term(plant: Plant, sideways: sp.Expr, row: Coordinate) -> sp.Expr:
    """Term of one row in the Boltzmann-Hamel equations of a turning frame, beside Lagrange's.

    The speeds of rolling and of turning are not rates of coordinates of the plane. With the sideways momentum p and the
    forward speed v of the origin, p ψ̇ is missing forward and p v about the vertical.
    """
    if plant.heading is None:
        return sp.Integer(0)
    forward = plant.heading.origin[0]
    speed = sp.Add(*(derivative(forward, c.q) * c.dq for c in plant.moving))
    turned = sideways * speed if row == plant.heading.coordinate else sp.Integer(0)
    return turned - plant.heading.coordinate.dq * sideways * derivative(forward, row.q)


def generalised_force(plant: Plant, row: Coordinate) -> sp.Expr:
    """Generalised force on one coordinate, by the virtual work of every load on its port."""
    return expand(sp.Add(*(load.force * derivative(plant.port(load.port).coordinate, row.q) for load in plant.loads)))
