"""A log's closed loop replayed with the model, from the log's reference and the known controller."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from wheelpend.diagnosis.criteria import SHORT_HORIZON_SHARE
from wheelpend.estimation.parameters import kernel_parameters
from wheelpend.estimation.problem import EstimationProblem
from wheelpend.estimation.segments import Segments
from wheelpend.estimation.shooting import Simulator
from wheelpend.estimation.states import fit_states, initial_states
from wheelpend.simulation.closed_loop import ClosedLoop

MIN_START_SAMPLES = 20  # to which the state is fitted in which a replay begins


@dataclass(frozen=True)
class ClosedLoopReplay:
    """The closed loop replayed with the model: root mean square difference from the log."""

    rmse: dict[str, float]  # per channel [its unit]
    rmse_input: float  # V
    diverged: bool
    samples: int = 1  # of the stretch

    def to_json(self) -> dict[str, Any]:
        """The replay under the keys of JSON."""
        return {"rmse": self.rmse, "rmse_input": self.rmse_input, "diverged": self.diverged}


def replay_closed_loop(
    problem: EstimationProblem, segments: Segments, values: dict[str, float]
) -> ClosedLoopReplay | None:
    """Simulate the model in closed loop along the first stretch without a gap of a log that has segments.

    None where controller or reference is unknown. The stretch is played from its beginning, where the controller's
    integral begins at zero, though segments of a held-out log begin later. Where it begins is had from so short a time
    that what the model lacks does not bend it.
    """
    begin, _, end = next(s for s in segments.log.stretches if s.end > segments.bounds[0, 0])
    log, module = segments.log.part(begin, end), problem.module
    if problem.model.controller is None or log.reference is None or not np.isfinite(log.reference).all():
        return None
    parameters = kernel_parameters(module, values, segments.log)
    length = max(MIN_START_SAMPLES, round(SHORT_HORIZON_SHARE * np.diff(segments.bounds[0])[0]))
    begun = replace(segments, bounds=np.array([[begin, min(begin + length, end)]]))
    state, _ = fit_states(Simulator(module), begun, initial_states(module, begun)[0][None], parameters)
    run = ClosedLoop.of(problem.model, module, problem.max_step).replay(log, state[0], parameters)
    if not run.stays_in_range:
        return ClosedLoopReplay({}, float("nan"), diverged=True)
    difference = np.sqrt(np.nanmean((run.measured - log.measured) ** 2, axis=0))
    return ClosedLoopReplay(
        dict(zip(log.channels, map(float, difference), strict=True)),
        float(np.sqrt(np.nanmean((run.input - log.voltage) ** 2))),
        diverged=False,
        samples=len(log.t),
    )


def replayed_together(replays: Iterable[ClosedLoopReplay | None]) -> ClosedLoopReplay | None:
    """The difference over the samples of several logs together; diverged where one did, None where none was played."""
    found = [r for r in replays if r]
    if not found or any(r.diverged for r in found):
        return next((r for r in found if r.diverged), None)
    weights = np.array([r.samples for r in found], dtype=float)
    channels = {n: np.array([r.rmse[n] for r in found]) for n in found[0].rmse}
    return ClosedLoopReplay(
        {n: float(np.sqrt(np.average(v**2, weights=weights))) for n, v in channels.items()},
        float(np.sqrt(np.average([r.rmse_input**2 for r in found], weights=weights))),
        diverged=False,
        samples=int(weights.sum()),
    )
