"""Parametric bootstrap of a log: the model at a consistent estimate, simulated again with fresh sensor noise.

The estimates of a method from such replicas give its bias and its standard deviation on this very log.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from derive.plant_signature import PlantWords
from wheelpend.errors import Failure
from wheelpend.estimation.continuation import fit_model
from wheelpend.estimation.data import noise_of, prepare
from wheelpend.estimation.fit import Fit
from wheelpend.estimation.free_parameters import free_names
from wheelpend.estimation.parameters import kernel_parameters
from wheelpend.estimation.problem import EstimationProblem
from wheelpend.estimation.restrictions import NO_RESTRICTIONS, Restrictions
from wheelpend.estimation.segments import Segments
from wheelpend.estimation.shooting import Simulator
from wheelpend.estimation.starts import best_start
from wheelpend.estimation.states import fit_states, initial_states
from wheelpend.identification import instrumental
from wheelpend.identification.instrumental import LoggedLoop
from wheelpend.kernels.kernel_module import KernelModule
from wheelpend.logs.log import Log, segments_of_ranges
from wheelpend.logs.noise import Noise
from wheelpend.logs.sources import LogsLike
from wheelpend.model.record import Model

INITIAL_STATE_FIT_DURATION_S = 0.5  # s of the log to which the first state of its replicas is fitted
MIN_INITIAL_STATE_SAMPLES = 6  # and as many samples
InputAndReadings = tuple[np.ndarray, np.ndarray]  # voltage (N,), measured (N, channels)


@dataclass(frozen=True)
class ParametricBootstrap:
    """A log that can be simulated again, at an estimate that noise does not bias."""

    log: Log
    against: str  # the method that gave the estimate: iv or shooting
    parameters: np.ndarray  # (NP,) of the model's own kernels, the estimate among them
    estimate: np.ndarray  # (n,) of the linear parameters
    covariance: np.ndarray  # (n, n)
    noise: Noise
    play: Callable[[np.ndarray, np.ndarray], InputAndReadings | None]  # of noise (N, channels) and quanta (channels,);
    # None where the machine leaves its range
    reestimate: Callable[[Log], np.ndarray] | None  # the same estimate (n,) from a replica, where that is cheap
    words: PlantWords

    def replica(self, number: int) -> Log | None:
        """The log with another draw of its sensor noise; None where the machine leaves its range."""
        draw = np.random.default_rng([number, len(self.log)]).normal(size=self.log.measured.shape)
        played = self.play(draw * self.noise.sigma_before_rounding, self.noise.quantum)
        if played is None:
            return None
        measured = np.where(np.isfinite(self.log.measured), played[1], np.nan)
        return replace(self.log, voltage=played[0], measured=measured, earlier=None)

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
        words = self.words
        raise Failure(f"{self.log.name}: a simulated {words.machine} must {words.stay} to rehearse the log, but with "
                      f"the parameters found by {self.against} it {words.leaves}. Check the log with "
                      "`wheelpend inspect`.")  # fmt: skip


def parametric_bootstrap(
    model: Model,
    module: KernelModule,
    log: Log,
    parameters: np.ndarray,
    progress: Callable[[str], None] = lambda text: None,
) -> ParametricBootstrap:
    """The bootstrap of a log: in its closed loop where controller and reference are known.

    Else its own voltage is kept, and only the readings are drawn anew around the fitted motion.
    """
    progress("a consistent estimate")
    try:
        return _closed_loop_bootstrap(model, module, log, parameters)
    except Failure:
        return _open_loop_bootstrap(model, module, log, progress)


def _closed_loop_bootstrap(model: Model, module: KernelModule, log: Log, parameters: np.ndarray) -> ParametricBootstrap:
    noise = noise_of(log, model)
    found = instrumental.instrumental_estimate(model, module, log, parameters, instrumental.IV_TIME_CONSTANTS_S)
    centre = instrumental.with_linear_values(module, parameters, found.fit.estimate)
    loop = LoggedLoop.of(model, module, log)
    samples = min(len(log), max(MIN_INITIAL_STATE_SAMPLES, round(INITIAL_STATE_FIT_DURATION_S / log.dt)))
    head = Segments(log, noise.sigma, np.array([[0, samples]]))
    loop = replace(loop, start=fit_states(Simulator(module), head, loop.start[None], centre)[0][0])

    def play(noise: np.ndarray, quantum: np.ndarray) -> InputAndReadings | None:
        run = loop.run(centre, noise, quantum)
        return None if run is None else (run.input, run.measured)

    def reestimate(replica: Log) -> np.ndarray:
        equations = instrumental.filtered_equations(module, replica, centre, instrumental.IV_TIME_CONSTANTS_S)
        return instrumental.solve_instrumental(module, equations, found.columns).estimate

    words = model.plant_signature.words
    return ParametricBootstrap(log, "iv", centre, found.fit.estimate, found.covariance, noise, play, reestimate, words)


def _open_loop_bootstrap(
    model: Model, module: KernelModule, log: Log, progress: Callable[[str], None]
) -> ParametricBootstrap:
    problem, fitted = shooting_fit(model, [log], progress)
    values, segments = fitted.of_log(0), problem.data.estimation[0]
    parameters = kernel_parameters(problem.module, values, log)
    ranges = [(s.begin, s.end) for s in log.stretches]  # the warm-up too: readings there are drawn anew as well
    whole = replace(segments, bounds=segments_of_ranges(log, problem.horizon, ranges))
    _, linearisation = fit_states(problem.simulator, whole, initial_states(problem.module, whole), parameters)
    words = model.plant_signature.words
    if whole.are_lost(linearisation.residual):
        raise Failure(f"{log.name}: a simulated {words.machine} must {words.stay} within {problem.horizon:g} s, but "
                      f"with the parameters found by shooting it {words.leaves}. Check the log with "
                      "`wheelpend inspect`.")  # fmt: skip
    smooth = log.measured - np.nan_to_num(linearisation.residual) * segments.sigma
    keys = [fitted.place(n) for n in module.LINEAR]
    centre = kernel_parameters(module, values, log)

    def play(noise: np.ndarray, quantum: np.ndarray) -> InputAndReadings:
        readings, step = smooth + noise, np.where(quantum > 0.0, quantum, 1.0)
        return log.voltage, np.where(quantum > 0.0, np.round(readings / step) * step, readings)

    estimate = np.array([values[n] for n in module.LINEAR])
    covariance = fitted.covariance[np.ix_(keys, keys)]
    return ParametricBootstrap(log, "shooting", centre, estimate, covariance, problem.noise[0], play, None, words)


def shooting_fit(
    model: Model, logs: LogsLike, progress: Callable[[str], None], restrictions: Restrictions = NO_RESTRICTIONS
) -> tuple[EstimationProblem, Fit]:
    """Multiple shooting on all samples of the logs; parameters that are fixed have their values in the model."""
    problem = replace(prepare(model, logs, use_all=True, lean=True), restrictions=restrictions)
    progress("finding a start")
    problem, start = best_start(problem)
    progress("fitting")
    return problem, fit_model(problem, start, free_names(problem, model.effects))
