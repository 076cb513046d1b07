"""Units of fleets, drawn by a fixed seed: each parameter scatters, and of some units one has aged."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from wheelpend.model.record import Model

ALL_FLEETS, FLEET_UNITS, AGED_UNITS = 20, 100, 5
SCATTER_SHARE = 0.01  # of each parameter, its standard deviation from unit to unit
AGED_SHARE = 0.08  # of the parameter that aged, by which it did
DRY_FRICTION, FRICTION_NAME, FRICTION_V = "coulomb_drive", "coulomb_drive.torque", 0.3
AGEING_SIDES = {FRICTION_NAME: 1.0, "X6": -1.0, "X5": 1.0}  # parameters that age, and to which side
FLEET_SEED = 24


class Unit(NamedTuple):
    """A unit of a fleet: its true parameters, and which of them aged."""

    fleet: int
    number: int
    truth: tuple[tuple[str, float], ...]  # by name
    aged: str = ""  # the parameter; empty where none did

    @property
    def key(self) -> str:
        """What names it."""
        return f"fleet {self.fleet} unit {self.number}"


def fleet_model() -> Model:
    """The paper's robot with dry friction in its model."""
    return Model.default().with_effects([DRY_FRICTION])


def usual_values() -> dict[str, float]:
    """The parameters of the fleet's mean."""
    known = fleet_model().simulation or {}
    return {**{n: float(v) for n, v in known.items() if n.startswith("X")}, FRICTION_NAME: FRICTION_V}


def units_of_fleet(fleet: int) -> list[Unit]:
    """The units of a fleet; its first ones aged, each in another parameter by turns."""
    rng = np.random.default_rng((FLEET_SEED, fleet))
    usual, found = usual_values(), []
    for number in range(FLEET_UNITS):
        factors = 1.0 + SCATTER_SHARE * rng.normal(size=len(usual))
        truth = dict(zip(usual, factors * np.array(list(usual.values())), strict=True))
        aged = list(AGEING_SIDES)[(number + fleet) % len(AGEING_SIDES)] if number < AGED_UNITS else ""
        if aged:
            truth[aged] += AGEING_SIDES[aged] * AGED_SHARE * usual[aged]
        found.append(Unit(fleet, number, tuple((n, float(v)) for n, v in truth.items()), aged))
    return found


def plan(fleets: int = ALL_FLEETS) -> list[Unit]:
    """All units of so many fleets."""
    return [unit for fleet in range(fleets) for unit in units_of_fleet(fleet)]
