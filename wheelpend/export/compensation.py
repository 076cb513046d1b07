"""Which effects a command can take away, and by how much less than identified, so that none is compensated too much."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

import derive
from derive.effects import Deformation, DryForce, Effect, Force, HysteresisForce, InputMap
from derive.parameter_name import full_name
from wheelpend.export.exported_model import ExportedModel
from wheelpend.kernels.kernel_module import KernelModule

INTERVAL_SIGMAS = 2.0  # standard errors by which a coefficient counts less than identified: one in fifty is less still
UNKNOWN_ERROR_SHARE = 0.1  # of a coefficient without a standard error, by which it counts less
LEAST_SLIP = {"rad": 0.05, "m": 0.005}  # rad/s and m/s below which the wanted input says where friction acts
LEAST_INPUT_SHARE = 0.1  # of dry friction and dead zone, below which their compensation fades
FEEDFORWARD_FAMILIES = ("drive", "ground")  # of forces that a command can act against


@dataclass(frozen=True)
class Compensation:
    """Parameter vectors of the compensator, and what it does."""

    effects: tuple[str, ...]  # that it compensates
    forces: np.ndarray  # (NP,) with these forces alone
    absent: np.ndarray  # (NP,) with no effects
    maps: np.ndarray  # (NP,) with what the actuator makes of a command alone
    shares: np.ndarray  # (HYSTERESES,) of each force with a memory
    least_slip: float
    least_input: float


def compensation_of(exported: ExportedModel) -> Compensation | None:
    """The compensation of a model's effects; None where none of them can be compensated, or several inputs drive it."""
    module, model = exported.module, exported.model
    rows = [derive.effects.in_plant_units(derive.effects.find(e), model.plant_signature) for e in model.effects]
    chosen = [row for row in rows if _is_compensable(row, module)]
    if exported.inputs != 1 or not chosen:
        return None
    own = list(range(module.OWN_PARAMETERS)) + list(range(module.FITTED, module.NP))
    absent = np.array(module.ABSENT, dtype=float)
    absent[own] = exported.parameters[own]
    forces, maps = absent.copy(), absent.copy()
    for row in chosen:
        target = maps if isinstance(row.enters, InputMap) else forces
        for parameter in row.parameters:
            place = module.PARAMETERS.index(full_name(row.name, parameter.name))
            lowers = parameter.absent == 0.0
            target[place] = lowered(exported, place) if lowers else exported.parameters[place]
    shares = [
        lowered(exported, i) / exported.parameters[i] if exported.parameters[i] else 0.0
        for i in module.HYSTERESIS_SIZES
    ]
    thresholds = [abs(exported.parameters[module.PARAMETERS.index(n)]) for n in _thresholds(chosen)]
    unit = model.plant_signature.coordinates[0].unit
    return Compensation(
        tuple(row.name for row in chosen),
        forces,
        absent,
        maps,
        np.array(shares),
        LEAST_SLIP.get(unit, LEAST_SLIP["rad"]),
        max(LEAST_INPUT_SHARE * max(thresholds, default=0.0), 1e-6),
    )


def lowered(exported: ExportedModel, place: int) -> float:
    """A coefficient nearer to zero by its interval, and not past it."""
    value, name = float(exported.parameters[place]), exported.module.PARAMETERS[place]
    error = exported.sigma.get(name, UNKNOWN_ERROR_SHARE / INTERVAL_SIGMAS * abs(value))
    return math.copysign(max(abs(value) - INTERVAL_SIGMAS * error, 0.0), value)


def _is_compensable(row: Effect, module: KernelModule) -> bool:
    """True of an effect that takes something from the input, or changes it, and lasts."""
    if row.event or row.full_names[0] in module.ABSORBED:
        return False
    if isinstance(row.enters, InputMap):
        return row.name != "voltage_saturation"  # what is cut off no command brings back
    if isinstance(row.enters, Force | DryForce | HysteresisForce):
        return row.family in FEEDFORWARD_FAMILIES
    return isinstance(row.enters, Deformation) and row.name == "slope"


def _thresholds(rows: list[Effect]) -> list[str]:
    """Names of the parameters at which a machine begins to move."""
    return [
        full_name(row.name, row.parameters[0].name)
        for row in rows
        if isinstance(row.enters, DryForce | HysteresisForce) or row.name == "voltage_dead_zone"
    ]
