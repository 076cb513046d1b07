"""Units of fleets, drawn by a fixed seed: each parameter scatters; some aged in one, or have an effect beside it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from wheelpend.model.record import Model

ALL_FLEETS, FLEET_UNITS, AGED_UNITS = 20, 100, 5
SCATTER_SHARE = 0.01  # of each parameter, its standard deviation from unit to unit
AGED_SHARE = 0.08  # of the parameter that aged, by which it did
DRY_FRICTION, FRICTION_NAME, FRICTION_V = "coulomb_drive", "coulomb_drive.torque", 0.3
AGEING_SIDES = {FRICTION_NAME: 1.0, "X6": -1.0, "X5": 1.0}  # parameters that age, and to which side
LACKING_FLEETS, LACKING_FLEET_UNITS = 3, 40
LACKED_EFFECTS = {"voltage_dead_zone": 0.1, "quadratic_drive": 0.0005, "actuator_delay": 0.004}  # of one unit by turns
LACKED_PARAMETERS = {"voltage_dead_zone": "threshold", "quadratic_drive": "coefficient", "actuator_delay": "delay"}
FLEET_SEED = 24


class Unit(NamedTuple):
    """A unit of a fleet: its true parameters, and which of them aged."""

    fleet: int
    number: int
    truth: tuple[tuple[str, float], ...]  # by name
    aged: str = ""  # the parameter; empty where none did
    lacked: str = ""  # an effect of this unit that the model does not have

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
    found = _alike_units(fleet, FLEET_UNITS)
    for number in range(AGED_UNITS):
        aged = list(AGEING_SIDES)[(number + fleet) % len(AGEING_SIDES)]
        off = AGEING_SIDES[aged] * AGED_SHARE * usual_values()[aged]
        truth = tuple((n, v + off if n == aged else v) for n, v in found[number].truth)
        found[number] = found[number]._replace(truth=truth, aged=aged)
    return found


def units_of_lacking_fleet(number: int) -> list[Unit]:
    """The units of a smaller fleet, of which one for each effect has that, and the model does not."""
    found = _alike_units(ALL_FLEETS + number, LACKING_FLEET_UNITS)
    for place, effect in enumerate(LACKED_EFFECTS):
        found[place] = found[place]._replace(lacked=effect)
    return found


def _alike_units(fleet: int, count: int) -> list[Unit]:
    """Units that only scatter."""
    rng = np.random.default_rng((FLEET_SEED, fleet))
    usual = usual_values()
    factors = 1.0 + SCATTER_SHARE * rng.normal(size=(count, len(usual)))
    values = (factors * np.array(list(usual.values()))).tolist()
    return [Unit(fleet, k, tuple(zip(usual, row, strict=True))) for k, row in enumerate(values)]


def plan(fleets: int = ALL_FLEETS) -> list[Unit]:
    """All units of so many fleets, and those of the fleets of which some have an effect beside the model."""
    lacking = [unit for number in range(LACKING_FLEETS) for unit in units_of_lacking_fleet(number)]
    return [unit for fleet in range(fleets) for unit in units_of_fleet(fleet)] + lacking
