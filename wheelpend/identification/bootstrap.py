"""Rehearsal of a log: the model at a consistent estimate plays it again, with fresh sensor noise of the log's own size.

What a method makes of such replicas shows its bias and its spread on this very log (parametric bootstrap).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from types import ModuleType

import numpy as np

from wheelpend.errors import Failure
from wheelpend.estimation.continuation import fit_model
from wheelpend.estimation.data import noise_of, prepare
from wheelpend.estimation.fit import Fit
from wheelpend.estimation.free_parameters import free_names
from wheelpend.estimation.parameters import vector
from wheelpend.estimation.problem import Study
from wheelpend.estimation.segments import Part
from wheelpend.estimation.shooting import shoot
from wheelpend.estimation.starts import best_start
from wheelpend.estimation.states import fit_states
from wheelpend.identification import instrumental
from wheelpend.identification.instrumental import Loop
from wheelpend.logs.log import Log
from wheelpend.logs.noise import Noise, rounding_only
from wheelpend.model.record import Model

HEAD = 0.5  # s of the log to which the rehearsal's first state is fitted
Played = tuple[np.ndarray, np.ndarray]  # voltage (N,), measured (N, channels)


@dataclass(frozen=True)
class Rehearsal:
    """A log that can be played again at an estimate that noise does not bias."""

    log: Log
    against: str  # the method that gave the estimate: iv or shooting
    parameters: np.ndarray  # (NP,) of the lean module, the estimate among them
    estimate: np.ndarray  # (n,) of the linear parameters
    covariance: np.ndarray  # (n, n)
    noise: Noise
    play: Callable[[np.ndarray, np.ndarray], Played | None]  # from noise (N, channels) and quanta; None: it falls
    again: Callable[[Log], np.ndarray] | None  # the same estimate from a replica, where that is cheap

    def replica(self, number: int) -> Log | None:
        """The log as it might have been; None where the robot falls."""
        white = np.sqrt(
            np.maximum(self.noise.sigma**2 - np.array([rounding_only(q) for q in self.noise.quantum]) ** 2, 0.0)
        )
        draw = np.random.default_rng([number, len(self.log)]).normal(size=self.log.measured.shape)
        played = self.play(draw * white, self.noise.quantum)
        if played is None:
            return None
        measured = np.where(np.isfinite(self.log.measured), played[1], np.nan)
        return replace(self.log, voltage=played[0], measured=measured)

    def replicas(self, count: int) -> Iterator[Log]:
        """So many replicas; raises Failure when more than half of them fall."""
        found = 0
        for number in range(2 * count):
            log = self.replica(number)
            if log is not None:
                found += 1
                yield log
            if found == count:
                return
        raise Failure(f"{self.log.name}: a simulated robot must stay up to rehearse the log, but with the parameters "
                      f"found by {self.against} it falls. Check the log with `wheelpend inspect`.")  # fmt: skip


def rehearse(
    model: Model,
    module: ModuleType,
    log: Log,
    parameters: np.ndarray,
    progress: Callable[[str], None] = lambda text: None,
) -> Rehearsal:
    """Make a log ready to be played again: in its closed loop where controller and reference are known.

    Else its own voltage is kept, and only the readings are drawn anew around the smoothed motion.
    """
    progress("a consistent estimate")
    try:
        return _in_closed_loop(model, module, log, parameters)
    except Failure:
        return _with_its_voltage(model, module, log, progress)


def _in_closed_loop(model: Model, module: ModuleType, log: Log, parameters: np.ndarray) -> Rehearsal:
    noise = noise_of(log, model)
    found = instrumental.instrumental(model, module, log, parameters, instrumental.TAU)
    centre = instrumental.with_linear(module, parameters, found.fit.estimate)
    loop = Loop.of(model, module, log)
    head = Part(log, noise.sigma, np.array([[0, min(len(log), max(6, round(HEAD / log.dt)))]]))
    loop = replace(loop, start=fit_states(module, head, loop.start[None], centre)[0][0])

    def play(noise: np.ndarray, quantum: np.ndarray) -> Played | None:
        run = loop.run(centre, noise, quantum)
        return None if run is None else (run.voltage, run.measured)

    def again(replica: Log) -> np.ndarray:
        equations = instrumental.equations(module, replica, centre, instrumental.TAU)
        return instrumental.solve(module, equations, found.columns).estimate

    return Rehearsal(log, "iv", centre, found.fit.estimate, found.covariance, noise, play, again)


def _with_its_voltage(model: Model, module: ModuleType, log: Log, progress: Callable[[str], None]) -> Rehearsal:
    study, fitted = shooting_fit(model, [log], progress)
    values, part = fitted.of_log(0), study.training[0]
    shot = shoot(study.module, part, fitted.states[0], vector(study.module, values, log), max_step=study.max_step)
    smooth = log.measured - np.nan_to_num(shot.residual) * part.sigma
    keys = [fitted.free.index(n if n in fitted.free else f"{n}@0") for n in module.LINEAR]
    centre = vector(module, values, log)

    def play(noise: np.ndarray, quantum: np.ndarray) -> Played:
        readings, step = smooth + noise, np.where(quantum > 0.0, quantum, 1.0)
        return log.voltage, np.where(quantum > 0.0, np.round(readings / step) * step, readings)

    estimate = np.array([values[n] for n in module.LINEAR])
    covariance = fitted.covariance[np.ix_(keys, keys)]
    return Rehearsal(log, "shooting", centre, estimate, covariance, study.noise[0], play, None)


def shooting_fit(model: Model, logs: Sequence[str | Path | Log], progress: Callable[[str], None]) -> tuple[Study, Fit]:
    """Multiple shooting on all samples of the logs."""
    study = prepare(model, logs, use_all=True, lean=True)
    progress("finding a start")
    study, start = best_start(study)
    progress("fitting")
    return study, fit_model(study, start, free_names(study, model.effects))
