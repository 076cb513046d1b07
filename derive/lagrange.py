"""From geometry to the equations of motion: Lagrangian, Lagrange's equations, virtual work."""

from __future__ import annotations

import sympy as sp
from sympy.simplify.fu import TR8

from derive.records import Body, Coordinate, Equations, Plant


def derive_equations(plant: Plant) -> Equations:
    """Derive the equations of motion of a plant (paper eqs. 1-4, 11, 13)."""
    lagrangian = kinetic_energy(plant) - potential_energy(plant)
    return Equations(
        lagrangian,
        inertia=tuple(lagrange_row(lagrangian, c, plant.moving) for c in plant.moving),
        force=tuple(generalised_force(plant, c) for c in plant.moving),
    )


def kinetic_energy(plant: Plant) -> sp.Expr:
    """Kinetic energy of all bodies, translation and rotation [J] (paper eq. 1)."""
    return sp.Add(*(kinetic_energy_of(body, plant.moving) for body in plant.bodies))


def kinetic_energy_of(body: Body, coordinates: tuple[Coordinate, ...]) -> sp.Expr:
    """Kinetic energy of one body [J]."""
    velocity = sum((body.position.diff(c.q) * c.dq for c in coordinates), sp.zeros(*body.position.shape))
    return sp.expand(body.mass * sum_angles(velocity.dot(velocity)) / 2 + body.inertia * body.rate**2 / 2)


def potential_energy(plant: Plant) -> sp.Expr:
    """Potential energy of all bodies in the plant's gravity [J]."""
    energies = (-body.mass * sum_angles(plant.gravity.dot(body.position)) for body in plant.bodies)
    return sp.expand(sp.Add(*energies))


def sum_angles(expression: sp.Expr) -> sp.Expr:
    """Products of sines and cosines as functions of sums of angles: what trigsimp would find, 30 times faster."""
    return sp.expand(TR8(sp.expand(expression)))


def lagrange_row(lagrangian: sp.Expr, row: Coordinate, coordinates: tuple[Coordinate, ...]) -> sp.Expr:
    """d/dt ∂L/∂q̇ − ∂L/∂q by the chain rule (paper eq. 2)."""
    momentum = sp.diff(lagrangian, row.dq)
    rate_of_momentum = sp.Add(*(momentum.diff(c.dq) * c.ddq + momentum.diff(c.q) * c.dq for c in coordinates))
    return sp.expand(rate_of_momentum - sp.diff(lagrangian, row.q))


def generalised_force(plant: Plant, row: Coordinate) -> sp.Expr:
    """Generalised force on one coordinate, by the virtual work of every load on its port."""
    return sp.expand(sp.Add(*(load.force * plant.port(load.port).coordinate.diff(row.q) for load in plant.loads)))
