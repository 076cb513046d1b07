"""A log's closed loop replayed with the model, from the log's reference and the known controller."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from wheelpend.estimation.parameters import kernel_parameters
from wheelpend.estimation.problem import EstimationProblem
from wheelpend.estimation.segments import Segments
from wheelpend.estimation.shooting import Simulator
from wheelpend.estimation.states import fit_states, initial_states
from wheelpend.simulation.closed_loop import ClosedLoop


@dataclass(frozen=True)
class ClosedLoopReplay:
    """The closed loop replayed with the model: root mean square difference from the log."""

    rmse: dict[str, float]  # per channel [its unit]
    rmse_input: float  # V
    diverged: bool

    def to_json(self) -> dict[str, Any]:
        """The replay under the keys of JSON."""
        return {"rmse": self.rmse, "rmse_input": self.rmse_input, "diverged": self.diverged}


def replay_closed_loop(
    problem: EstimationProblem, segments: Segments, values: dict[str, float]
) -> ClosedLoopReplay | None:
    """Simulate the model in closed loop with the log's reference; None where controller or reference is unknown."""
    log, module = segments.log, problem.module
    if problem.model.controller is None or log.reference is None or not np.isfinite(log.reference).all():
        return None
    parameters = kernel_parameters(module, values, log)
    first = replace(segments, bounds=segments.bounds[:1])
    state, _ = fit_states(Simulator(module), first, initial_states(module, first)[0][None], parameters)
    run = ClosedLoop.of(problem.model, module, problem.max_step).replay(log, state[0], parameters)
    if not run.stays_in_range:
        return ClosedLoopReplay({}, float("nan"), diverged=True)
    difference = np.sqrt(np.nanmean((run.measured - log.measured) ** 2, axis=0))
    return ClosedLoopReplay(
        dict(zip(log.channels, map(float, difference), strict=True)),
        float(np.sqrt(np.nanmean((run.input - log.voltage) ** 2))),
        diverged=False,
    )
