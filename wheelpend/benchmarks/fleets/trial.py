"""One unit: its log simulated, its parameters identified, and where it stands out a diagnosis."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from derive.parameter_name import full_name
from wheelpend.api import diagnose
from wheelpend.benchmarks.fleets.cases import FRICTION_NAME, LACKED_EFFECTS, LACKED_PARAMETERS, Unit, fleet_model
from wheelpend.errors import Failure
from wheelpend.identification.identify import identify
from wheelpend.logs.log import Log
from wheelpend.simulation.simulate import simulate

LOG_DURATION_S = 4.0  # s
LOG_COMMAND = "aggressive"


@dataclass(frozen=True)
class Answer:
    """A unit's estimate, or why there is none."""

    key: str
    names: tuple[str, ...] = ()
    values: tuple[float, ...] = ()
    covariance: tuple[tuple[float, ...], ...] = ()
    error: float = 1.0  # that the model leaves, over the noise floor
    failure: str | None = None

    def to_json(self) -> dict[str, Any]:
        """The answer under the keys of its journal."""
        return {
            "key": self.key,
            "names": self.names,
            "values": self.values,
            "covariance": self.covariance,
            "error": self.error,
            "failure": self.failure,
        }


@dataclass(frozen=True)
class Lack:
    """What the diagnosis of a unit that stands out says."""

    key: str
    verdict: str = ""
    named: tuple[str, ...] = ()  # the first effect, and those that it is declared equivalent to
    failure: str | None = None

    def to_json(self) -> dict[str, Any]:
        """The answer under the keys of its journal."""
        return {"key": self.key, "verdict": self.verdict, "named": self.named, "failure": self.failure}


def try_unit(unit: Unit) -> Answer:
    """Simulate a unit's log and identify its parameters from it, as a campaign does."""
    try:
        found = identify(fleet_model(), [log_of(unit)], test_bias=False)
    except Failure as failure:
        return Answer(unit.key, failure=str(failure))
    if found.covariance is None:
        return Answer(unit.key, failure="there is no covariance")
    names = tuple(found.covariance.names)
    values = tuple(float(found.parameters[n].value) for n in names)
    matrix = tuple(map(tuple, np.asarray(found.covariance.matrix).tolist()))
    return Answer(unit.key, names, values, matrix, (found.error or 1.0) / (found.noise_floor or 1.0))


def diagnose_unit(unit: Unit) -> Lack:
    """What a unit's log says that the fleet's model lacks, as a campaign asks those that stand out."""
    try:
        found = diagnose(fleet_model(), [log_of(unit)])
    except Failure as failure:
        return Lack(unit.key, failure=str(failure))
    named = tuple(name for first in found.named[:1] for name in (first.effect, *first.equivalent_to))
    return Lack(unit.key, found.verdict, named)


def log_of(unit: Unit) -> Log:
    """The log of a simulated unit."""
    model, truth = fleet_model(), dict(unit.truth)
    hide = {FRICTION_NAME: truth.pop(FRICTION_NAME)}
    if unit.lacked:
        hide[full_name(unit.lacked, LACKED_PARAMETERS[unit.lacked])] = LACKED_EFFECTS[unit.lacked]
    machine = replace(model, simulation={**(model.simulation or {}), **truth})
    seed = 1000 * unit.fleet + unit.number
    return simulate(machine, command=LOG_COMMAND, duration=LOG_DURATION_S, hide=hide, seed=seed)
