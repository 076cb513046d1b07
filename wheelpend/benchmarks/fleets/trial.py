"""One unit: its log simulated, and its parameters identified."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from wheelpend.benchmarks.fleets.cases import FRICTION_NAME, Unit, fleet_model
from wheelpend.errors import Failure
from wheelpend.identification.identify import identify
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
    failure: str | None = None

    def to_json(self) -> dict[str, Any]:
        """The answer under the keys of its journal."""
        return {
            "key": self.key,
            "names": self.names,
            "values": self.values,
            "covariance": self.covariance,
            "failure": self.failure,
        }


def try_unit(unit: Unit) -> Answer:
    """Simulate a unit's log and identify its parameters from it, as a campaign does."""
    model, truth = fleet_model(), dict(unit.truth)
    friction = truth.pop(FRICTION_NAME)
    machine = replace(model, simulation={**(model.simulation or {}), **truth})
    try:
        seed = 1000 * unit.fleet + unit.number
        log = simulate(machine, command=LOG_COMMAND, duration=LOG_DURATION_S, hide={FRICTION_NAME: friction}, seed=seed)
        found = identify(model, [log], test_bias=False)
    except Failure as failure:
        return Answer(unit.key, failure=str(failure))
    if found.covariance is None:
        return Answer(unit.key, failure="there is no covariance")
    names = tuple(found.covariance.names)
    values = tuple(float(found.parameters[n].value) for n in names)
    return Answer(unit.key, names, values, tuple(map(tuple, np.asarray(found.covariance.matrix).tolist())))
