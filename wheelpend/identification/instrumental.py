"""Instrumental variables: regression that noise in a closed loop does not bias.

The instruments are what the filtered regressor would be without noise: the machine's closed loop, simulated with
the same controller and reference. They are correlated with the motion and not with the noise.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from wheelpend.errors import Failure
from wheelpend.estimation.data import noise_of
from wheelpend.estimation.free_parameters import known_values
from wheelpend.estimation.linear_fit import (
    MIN_SINGULAR_VALUE_RATIO,
    LinearFit,
    project_out,
    unidentifiable_names,
    with_fixed,
)
from wheelpend.estimation.nonnegative import nonnegative_least_squares
from wheelpend.estimation.regressor import acting_input, free_decay
from wheelpend.estimation.restrictions import NO_RESTRICTIONS, Restrictions
from wheelpend.estimation.segments import Segments
from wheelpend.estimation.starts import start_time_constants
from wheelpend.estimation.state_reconstruction import measured_states
from wheelpend.estimation.states import initial_states
from wheelpend.estimation.step_size import stable_step
from wheelpend.kernels.kernel_module import KernelModule
from wheelpend.logs.log import Log
from wheelpend.model.record import Model
from wheelpend.simulation.closed_loop import ClosedLoop, ClosedLoopRun

IV_TIME_CONSTANTS_S = (0.5, 1.0)  # s, of least error on the paper's log; from 0.4 to 2.5 it is within a tenth of it
MAX_IV_ITERATIONS = 30
RELATIVE_CONVERGENCE_TOLERANCE = 1e-4  # relative change of the estimate at which it has converged
MAX_STEP_HALVINGS = 6
NOISE_DRAW_COUNT = 40  # draws of the sensor noise, for standard errors to within a tenth


@dataclass(frozen=True)
class LoggedLoop:
    """The machine under its controller, along a log's reference, from the log's own first state."""

    closed_loop: ClosedLoop
    log: Log
    start: np.ndarray  # (NX,)

    @classmethod
    def of(cls, model: Model, module: KernelModule, log: Log) -> LoggedLoop:
        """The loop of a log; raises Failure where the controller or the reference is not known."""
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
        return cls(ClosedLoop.of(model, module), log, start)

    @property
    def module(self) -> KernelModule:
        """The robot's kernels."""
        return self.closed_loop.module

    def run(
        self, parameters: np.ndarray, noise: np.ndarray | None = None, quantum: np.ndarray | None = None
    ) -> ClosedLoopRun | None:
        """Simulate the loop with noise (N, NY) and quanta (NY,), none unless given; None out of range."""
        values = dict(zip(self.module.PARAMETERS, parameters, strict=True))
        step = min(stable_step(self.module, values, self.log), self.closed_loop.max_step)
        run = replace(self.closed_loop, max_step=step).replay(self.log, self.start, parameters, noise, quantum)
        return run if run.stays_in_range else None


class FilteredEquations(NamedTuple):
    """Filtered equations right = matrix · X of a log, the filters' free decay projected out."""

    right: np.ndarray  # (rows,)
    matrix: np.ndarray  # (rows, n)


class InstrumentalEstimate(NamedTuple):
    """A converged estimate with its instruments."""

    fit: LinearFit
    columns: np.ndarray  # (rows, n) the instruments
    covariance: np.ndarray  # (n, n)


def instrumental_estimate(
    model: Model,
    module: KernelModule,
    log: Log,
    parameters: np.ndarray,
    tau: tuple[float, float],
    *,
    errors: bool = True,
    restrictions: Restrictions = NO_RESTRICTIONS,
) -> InstrumentalEstimate:
    """Estimate from the first start whose simulated loop stays up and converges; standard errors only with ``errors``.

    Raises Failure where the loop cannot be simulated and where no start converges.
    """
    loop = LoggedLoop.of(model, module, log)
    rows = filtered_equations(module, log, parameters, tau)
    for start in start_candidates(model, module, log, parameters):
        start = np.where(restrictions.is_free(module.LINEAR), start, restrictions.fixed_values(module.LINEAR))
        found = _iterate(loop, rows, with_linear_values(module, parameters, start), tau, restrictions)
        if found is not None:
            return with_standard_errors(model, loop, rows, found, parameters, tau, restrictions) if errors else found
    words = model.plant_signature.words
    raise Failure(f"{log.name}: the simulated loop must {words.stay} to give instruments, but from every start the "
                  f"{words.machine} {words.failed} or the estimate did not settle. Check the gains in [controller], "
                  "or use `--method shooting`."
                  )  # fmt: skip


def start_candidates(model: Model, module: KernelModule, log: Log, parameters: np.ndarray) -> Iterator[np.ndarray]:
    """Possible values of the linear parameters: the model's, then filtered regressions, slow filters first."""
    known = known_values(model)
    if all(n in known for n in module.LINEAR):
        yield np.array([known[n] for n in module.LINEAR])
    for tau in reversed(start_time_constants(log)):
        yield np.array(list(nonnegative_least_squares(module, log, parameters, tau).values()))


def with_linear_values(module: KernelModule, parameters: np.ndarray, values: np.ndarray) -> np.ndarray:
    """The parameter vector with other values of the linear parameters."""
    changed = parameters.copy()
    changed[[module.PARAMETERS.index(n) for n in module.LINEAR]] = values
    return changed


def linear_values(module: KernelModule, parameters: np.ndarray) -> np.ndarray:
    """Values of the linear parameters in a parameter vector."""
    return parameters[[module.PARAMETERS.index(n) for n in module.LINEAR]]


def filtered_equations(
    module: KernelModule, log: Log, parameters: np.ndarray, tau: tuple[float, float]
) -> FilteredEquations:
    """The filtered equations of a measured log (paper eqs. 39-43)."""
    states, voltage = measured_states(module, log), acting_input(module, log, parameters)
    sides, regressors = module.filter_regressor(log.t, states, voltage, parameters, *tau, True, states[0])
    decay = free_decay(log.t, tau, module.NQ).reshape(sides.size, -1)
    return FilteredEquations(*project_out(decay, sides.ravel(), regressors.reshape(sides.size, -1)))


def simulated_instruments(
    module: KernelModule, log: Log, run: ClosedLoopRun, parameters: np.ndarray, tau: tuple[float, float]
) -> np.ndarray:
    """Instruments (rows, n): the filtered regressor of the simulated loop."""
    voltage = acting_input(module, replace(log, voltage=run.input, earlier=None), parameters)
    regressors = module.filter_regressor(log.t, run.states, voltage, parameters, *tau, True, run.states[0])[1]
    return regressors.reshape(-1, regressors.shape[2])


def _iterate(
    loop: LoggedLoop,
    rows: FilteredEquations,
    parameters: np.ndarray,
    tau: tuple[float, float],
    restrictions: Restrictions,
) -> InstrumentalEstimate | None:
    """Renew the instruments with each estimate until it converges; None where it does not, or leaves its range."""
    module, run = loop.module, loop.run(parameters)
    for _ in range(MAX_IV_ITERATIONS):
        if run is None:
            return None
        instruments = simulated_instruments(module, loop.log, run, parameters, tau)
        fit = solve_instrumental(module, rows, instruments, restrictions)
        change = fit.estimate - linear_values(module, parameters)
        if np.all(np.abs(change) <= RELATIVE_CONVERGENCE_TOLERANCE * np.abs(fit.estimate)):
            return InstrumentalEstimate(fit, instruments, fit.covariance)
        parameters, run = _halved_step(loop, parameters, change)
    return None


def _halved_step(
    loop: LoggedLoop, parameters: np.ndarray, change: np.ndarray
) -> tuple[np.ndarray, ClosedLoopRun | None]:
    """Step to the new estimate, or so far towards it that the simulated machine stays in range."""
    here = linear_values(loop.module, parameters)
    for halving in range(MAX_STEP_HALVINGS):
        moved = with_linear_values(loop.module, parameters, here + 0.5**halving * change)
        run = loop.run(moved)
        if run is not None:
            return moved, run
    return parameters, None


def solve_instrumental(
    module: KernelModule, rows: FilteredEquations, instruments: np.ndarray, restrictions: Restrictions = NO_RESTRICTIONS
) -> LinearFit:
    """X from Zᵀ right = Zᵀ matrix X for instruments Z (rows, n), both scaled; zero along unidentifiable directions.

    What fixed parameters do is taken from the right side.
    """
    names, free = tuple(module.LINEAR), restrictions.is_free(module.LINEAR)
    if not restrictions.fixed:
        return _solve_free(names, rows.right, rows.matrix, instruments)
    right = rows.right - rows.matrix[:, ~free] @ restrictions.fixed_values(names)[~free]
    found = _solve_free(tuple(restrictions.free(names)), right, rows.matrix[:, free], instruments[:, free])
    return with_fixed(found, names, restrictions)


def _solve_free(names: tuple[str, ...], right: np.ndarray, matrix: np.ndarray, instruments: np.ndarray) -> LinearFit:
    """X of the free parameters alone; standard errors are not known yet."""
    scale, weight = (np.linalg.norm(a, axis=0) for a in (matrix, instruments))
    silent = (scale == 0.0) | (weight == 0.0)
    scale, weight = np.where(silent, 1.0, scale), np.where(silent, 1.0, weight)
    u, s, v = np.linalg.svd((instruments.T @ matrix) / weight[:, None] / scale)
    kept = s > MIN_SINGULAR_VALUE_RATIO * s[0]
    estimate = v[kept].T @ (u[:, kept].T @ (instruments.T @ right / weight) / s[kept]) / scale
    unidentifiable = unidentifiable_names(names, silent, v[~kept])
    condition = float(s[0] / max(s[-1], 1e-300))
    unknown = np.full((len(scale),) * 2, np.nan)
    return LinearFit(names, estimate, np.diag(unknown), condition, right.size, unidentifiable, unknown)


def with_standard_errors(
    model: Model,
    loop: LoggedLoop,
    rows: FilteredEquations,
    found: InstrumentalEstimate,
    parameters: np.ndarray,
    tau: tuple[float, float],
    restrictions: Restrictions,
) -> InstrumentalEstimate:
    """The estimate with standard errors from draws of the sensor noise, added to the measured log and filtered like it.

    They are scaled up where the residual is larger than such noise makes it.
    """
    log, scores, power, free = loop.log, [], 0.0, restrictions.is_free(loop.module.LINEAR)
    draws = np.random.default_rng(len(log)).normal(size=(NOISE_DRAW_COUNT, *log.measured.shape))
    sigma = noise_of(log, model).sigma
    for draw in draws:
        noisier = filtered_equations(loop.module, replace(log, measured=log.measured + sigma * draw), parameters, tau)
        added = noisier.right - rows.right - (noisier.matrix - rows.matrix) @ found.fit.estimate
        scores.append(found.columns[:, free].T @ added)
        power += float(added @ added) / NOISE_DRAW_COUNT
    residual = rows.right - rows.matrix @ found.fit.estimate
    excess = max(1.0, float(residual @ residual) / max(power, 1e-300))
    inverse = np.linalg.pinv(found.columns[:, free].T @ rows.matrix[:, free])
    matrix = np.zeros((free.size,) * 2)
    spread = np.array(scores).T @ np.array(scores) / NOISE_DRAW_COUNT
    matrix[np.ix_(free, free)] = excess * inverse @ spread @ inverse.T
    fit = replace(found.fit, sigma=np.sqrt(np.diag(matrix)), covariance=matrix)
    return found._replace(fit=fit, covariance=matrix)
