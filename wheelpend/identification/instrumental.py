"""Instrumental variables: regression that noise in a closed loop does not bias.

The instruments are what the filtered regressor would be without noise: the robot's closed loop, simulated with the same
controller and reference. They go with the motion and not with the noise.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from types import ModuleType
from typing import NamedTuple

import numpy as np

from wheelpend.errors import Failure
from wheelpend.estimation import least_squares
from wheelpend.estimation.data import noise_of
from wheelpend.estimation.free_parameters import known_values
from wheelpend.estimation.least_squares import LinearFit
from wheelpend.estimation.segments import Segments
from wheelpend.estimation.starts import START_TIME_CONSTANTS_S
from wheelpend.estimation.states import initial_states
from wheelpend.estimation.step_size import stable_step
from wheelpend.logs.log import Log
from wheelpend.model.record import Model
from wheelpend.simulation.simulate import first_sample_out_of_range

IV_TIME_CONSTANTS_S = (
    0.5,
    1.0,
)  # s, where the error is least on the paper's log; anything from 0.4 to 2.5 is within a tenth of it
MAX_IV_ITERATIONS = 30
RELATIVE_CONVERGENCE_TOLERANCE = 1e-4  # relative change of the estimate at which it has converged
MAX_STEP_HALVINGS = 6
NOISE_DRAW_COUNT = 40  # of the sensor noise, for standard errors right within a tenth


class ClosedLoopRun(NamedTuple):
    """A simulated closed loop."""

    states: np.ndarray  # (N, NX)
    measured: np.ndarray  # (N, NY)
    voltage: np.ndarray  # (N,)


@dataclass(frozen=True)
class ClosedLoop:
    """The robot under its controller, along a log's reference, from the log's own first state."""

    module: ModuleType
    log: Log
    gains: np.ndarray  # (3,)
    start: np.ndarray  # (NX,)

    @classmethod
    def of(cls, model: Model, module: ModuleType, log: Log) -> ClosedLoop:
        """Raise Failure where the controller or the reference is not known."""
        if model.controller is None:
            raise Failure(f"{log.name}: the controller must be known to simulate the loop, but the model has no "
                          "[controller]. Give its kind and gains, or use `--method shooting`.")  # fmt: skip
        if len(module.INPUTS) != 1:
            raise Failure(f"{log.name}: the loop can be simulated for a plant with one input, but this one has "
                          f"{', '.join(module.INPUTS) or 'none'}. Use `--method shooting`.")  # fmt: skip
        if log.reference is None or not np.isfinite(log.reference).all():
            raise Failure(f"{log.name} must have {model.table.reference} at every sample to simulate the loop, but it "
                          f"{'has none' if log.reference is None else 'misses some'}. Map it in [columns], "
                          "or use `--method shooting`.")  # fmt: skip
        whole = Segments(log, np.ones(len(log.channels)), np.array([[0, len(log)]]))
        start = initial_states(module, whole)[0]
        return cls(module, log, np.array(model.controller.gains, dtype=float), start)

    def run(
        self, parameters: np.ndarray, noise: np.ndarray | None = None, quantum: np.ndarray | None = None
    ) -> ClosedLoopRun | None:
        """Play the loop, without noise unless some is given; None where the robot falls."""
        module, log, reference = self.module, self.log, self.log.reference
        assert reference is not None
        noise = np.zeros((len(log), module.NY)) if noise is None else noise
        quantum = np.zeros(module.NY) if quantum is None else quantum
        step = min(stable_step(module, dict(zip(module.PARAMETERS, parameters, strict=True)), log), 0.002)
        rate = np.gradient(reference, log.t)
        run = ClosedLoopRun(*module.closed_loop(
            log.t, reference, rate, self.gains, self.start, parameters, noise, quantum, step
        ))  # fmt: skip
        return run if first_sample_out_of_range(module, run.states) is None else None


class FilteredEquations(NamedTuple):
    """Filtered equations right = matrix · X of a log, the filters' free decay taken out."""

    right: np.ndarray  # (rows,)
    matrix: np.ndarray  # (rows, n)


class InstrumentalEstimate(NamedTuple):
    """A converged estimate with its instruments."""

    fit: LinearFit
    columns: np.ndarray  # (rows, n) instruments
    covariance: np.ndarray  # (n, n)


def instrumental_estimate(
    model: Model,
    module: ModuleType,
    log: Log,
    parameters: np.ndarray,
    tau: tuple[float, float],
    *,
    errors: bool = True,
) -> InstrumentalEstimate:
    """Estimate from the first start whose simulated loop stays up and settles; without ``errors`` they stay NaN.

    Raises Failure where the loop cannot be simulated and where no start leads anywhere.
    """
    loop = ClosedLoop.of(model, module, log)
    rows = filtered_equations(module, log, parameters, tau)
    for start in start_candidates(model, module, log, parameters):
        found = _iterate(loop, rows, with_linear_values(module, parameters, start), tau)
        if found is not None:
            return with_standard_errors(model, loop, rows, found, parameters, tau) if errors else found
    raise Failure(f"{log.name}: the simulated loop must stay up to give instruments, but from every start the robot "
                  "fell or the estimate did not settle. Check the gains in [controller], or use `--method shooting`."
                  )  # fmt: skip


def start_candidates(model: Model, module: ModuleType, log: Log, parameters: np.ndarray) -> Iterator[np.ndarray]:
    """Possible values of the linear parameters: the model's, then filtered regressions, slow filters first."""
    known = known_values(model)
    if all(n in known for n in module.LINEAR):
        yield np.array([known[n] for n in module.LINEAR])
    for time in reversed(START_TIME_CONSTANTS_S):
        if 4 * log.dt < time < log.duration / 4:
            values = least_squares.nonnegative_least_squares(module, log, parameters, (time, 1.3 * time))
            yield np.array(list(values.values()))


def with_linear_values(module: ModuleType, parameters: np.ndarray, values: np.ndarray) -> np.ndarray:
    """The parameter vector with other values of the linear parameters."""
    changed = parameters.copy()
    changed[[module.PARAMETERS.index(n) for n in module.LINEAR]] = values
    return changed


def linear_values(module: ModuleType, parameters: np.ndarray) -> np.ndarray:
    """Values of the linear parameters in a parameter vector."""
    return parameters[[module.PARAMETERS.index(n) for n in module.LINEAR]]


def filtered_equations(
    module: ModuleType, log: Log, parameters: np.ndarray, tau: tuple[float, float]
) -> FilteredEquations:
    """The paper's filtered equations of a measured log."""
    states, voltage = least_squares.measured_states(module, log), least_squares.acting_input(module, log, parameters)
    sides, regressors = module.filter_regressor(log.t, states, voltage, parameters, *tau, True, states[0])
    decay = least_squares.free_decay(log.t, tau, module.NQ).reshape(sides.size, -1)
    return FilteredEquations(*least_squares.project_out(decay, sides.ravel(), regressors.reshape(sides.size, -1)))


def simulated_instruments(
    module: ModuleType, log: Log, run: ClosedLoopRun, parameters: np.ndarray, tau: tuple[float, float]
) -> np.ndarray:
    """Instruments (rows, n): the filtered regressor of the simulated loop."""
    voltage = least_squares.acting_input(module, replace(log, voltage=run.voltage), parameters)
    regressors = module.filter_regressor(log.t, run.states, voltage, parameters, *tau, True, run.states[0])[1]
    return regressors.reshape(-1, regressors.shape[2])


def _iterate(
    loop: ClosedLoop, rows: FilteredEquations, parameters: np.ndarray, tau: tuple[float, float]
) -> InstrumentalEstimate | None:
    """Renew the instruments with each estimate until it settles; None where the robot falls or it does not."""
    module, run = loop.module, loop.run(parameters)
    for _ in range(MAX_IV_ITERATIONS):
        if run is None:
            return None
        chosen = simulated_instruments(module, loop.log, run, parameters, tau)
        fit = solve_instrumental(module, rows, chosen)
        change = fit.estimate - linear_values(module, parameters)
        if np.all(np.abs(change) <= RELATIVE_CONVERGENCE_TOLERANCE * np.abs(fit.estimate)):
            return InstrumentalEstimate(fit, chosen, np.full((fit.estimate.size,) * 2, np.nan))
        parameters, run = _halved_step(loop, parameters, change)
    return None


def _halved_step(
    loop: ClosedLoop, parameters: np.ndarray, change: np.ndarray
) -> tuple[np.ndarray, ClosedLoopRun | None]:
    """Step to the new estimate, or so far towards it that the simulated robot stays up."""
    here = linear_values(loop.module, parameters)
    for halving in range(MAX_STEP_HALVINGS):
        moved = with_linear_values(loop.module, parameters, here + 0.5**halving * change)
        run = loop.run(moved)
        if run is not None:
            return moved, run
    return parameters, None


def solve_instrumental(module: ModuleType, rows: FilteredEquations, instrument_columns: np.ndarray) -> LinearFit:
    """X from chosenᵀ right = chosenᵀ matrix X, both scaled; flat directions stay at zero."""
    scale, weight = (np.linalg.norm(a, axis=0) for a in (rows.matrix, instrument_columns))
    silent = (scale == 0.0) | (weight == 0.0)
    scale, weight = np.where(silent, 1.0, scale), np.where(silent, 1.0, weight)
    u, s, v = np.linalg.svd((instrument_columns.T @ rows.matrix) / weight[:, None] / scale)
    kept = s > 1e-9 * s[0]
    estimate = v[kept].T @ (u[:, kept].T @ (instrument_columns.T @ rows.right / weight) / s[kept]) / scale
    lost = (v[~kept] ** 2).sum(axis=0)
    flat = tuple(n for n, q, w in zip(module.LINEAR, silent, lost, strict=True) if q or w > 1e-3)
    condition = float(s[0] / max(s[-1], 1e-300))
    unknown = np.full(len(scale), np.nan)
    return LinearFit(tuple(module.LINEAR), estimate, unknown, condition, rows.right.size, flat)


def with_standard_errors(
    model: Model,
    loop: ClosedLoop,
    rows: FilteredEquations,
    found: InstrumentalEstimate,
    parameters: np.ndarray,
    tau: tuple[float, float],
) -> InstrumentalEstimate:
    """Standard errors from fresh sensor noise on the measured log, which colours the residual as the filters do.

    Where the residual is larger than that noise makes it, so are the errors.
    """
    log, draws = (
        loop.log,
        np.random.default_rng(len(loop.log)).normal(size=(NOISE_DRAW_COUNT, *loop.log.measured.shape)),
    )
    own = noise_of(log, model).sigma
    scores, power = [], 0.0
    for draw in draws:
        other = filtered_equations(loop.module, replace(log, measured=log.measured + own * draw), parameters, tau)
        added = other.right - rows.right - (other.matrix - rows.matrix) @ found.fit.estimate
        scores.append(found.columns.T @ added)
        power += float(added @ added) / NOISE_DRAW_COUNT
    residual = rows.right - rows.matrix @ found.fit.estimate
    excess = max(1.0, float(residual @ residual) / max(power, 1e-300))
    inverse = np.linalg.pinv(found.columns.T @ rows.matrix)
    matrix = excess * inverse @ (np.array(scores).T @ np.array(scores) / NOISE_DRAW_COUNT) @ inverse.T
    return found._replace(fit=replace(found.fit, sigma=np.sqrt(np.diag(matrix))), covariance=matrix)
