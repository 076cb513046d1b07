"""A log's closed loop replayed with the model, from the log's reference and the known controller."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from wheelpend.diagnosis.horizons import MAX_PREDICTED_ANGLE_RAD
from wheelpend.estimation.parameters import kernel_parameters
from wheelpend.estimation.problem import EstimationProblem
from wheelpend.estimation.segments import Segments
from wheelpend.estimation.shooting import Simulator
from wheelpend.estimation.states import fit_states, initial_states


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
    log, controller, module = segments.log, problem.model.controller, problem.module
    if controller is None or log.reference is None or not np.isfinite(log.reference).all():
        return None
    parameters = kernel_parameters(module, values, log)
    first = replace(segments, bounds=segments.bounds[:1])
    state, _ = fit_states(Simulator(module), first, initial_states(module, first)[0][None], parameters)
    zeros = np.zeros((len(log), module.NY))
    _, outputs, voltage = module.closed_loop(
        log.t, log.reference, np.gradient(log.reference, log.t), np.array(controller.gains, dtype=float), state[0],
        parameters, zeros, np.zeros(module.NY), problem.max_step,
    )  # fmt: skip
    diverged = not np.isfinite(outputs).all()
    channel = module.RANGE_OUTPUT
    diverged |= channel >= 0 and bool(np.max(np.abs(outputs[:, channel])) > MAX_PREDICTED_ANGLE_RAD)
    difference = np.sqrt(np.nanmean((outputs - log.measured) ** 2, axis=0))
    return ClosedLoopReplay(
        {} if diverged else dict(zip(log.channels, map(float, difference), strict=True)),
        float("nan") if diverged else float(np.sqrt(np.nanmean((voltage - log.voltage) ** 2))),
        diverged,
    )
