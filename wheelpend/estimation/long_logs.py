"""Filtered least squares on a log too long to hold its regressor in memory: in chunks of samples.

While the filters still decay from their start the rows are formed, and their free decay is projected out. After that
only the normal equations are; where these lose too many digits, a QR decomposition takes their place.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from wheelpend.estimation.linear_fit import (
    LinearFit,
    condition_of,
    gram_square_root,
    project_out,
    solve_least_squares,
    triangular_factor,
)
from wheelpend.estimation.regressor import acting_input, free_decay
from wheelpend.estimation.restrictions import Restrictions
from wheelpend.estimation.state_reconstruction import measured_states
from wheelpend.kernels.kernel_module import KernelModule
from wheelpend.logs.log import Log

CHUNK_SAMPLES = 200_000  # samples of a long log that are processed at once
CHUNK_MARGIN_SAMPLES = 50  # samples around a chunk, from which missing readings are filled and slopes taken
FILTER_DECAY_TIME_CONSTANTS = 40.0  # time constants after which nothing is left of the filters' start
MAX_NORMAL_EQUATIONS_CONDITION = 1e10  # condition of the scaled normal equations up to which they keep six digits


@dataclass(frozen=True)
class _ChunkedEquations:
    """The filtered equations of a long log, formed chunk by chunk; a memory (of the filters) links the chunks."""

    module: KernelModule
    log: Log
    parameters: np.ndarray  # (NP,)
    tau: tuple[float, float]  # s
    first_order_hold: bool
    voltage: np.ndarray  # (N,) acting input

    @property
    def settings(self) -> tuple[np.ndarray, float, float, bool]:
        """Arguments that all filter kernels take after the signals."""
        return (self.parameters, *self.tau, self.first_order_hold)

    def first_rows(self, states: np.ndarray, begin: np.ndarray) -> np.ndarray:
        """Rows [regressor, side] (NQ k, n + 1) of the first k samples, the filters started from a state."""
        head = len(states)
        t, voltage = self.log.t[:head], self.voltage[:head]
        sides, regressors = self.module.filter_regressor(t, states, voltage, *self.settings, begin)
        return _stacked_rows(sides, regressors)

    def memory_at_start(self, begin: np.ndarray) -> np.ndarray:
        """Memory of the filters started from a state."""
        module, log = self.module, self.log
        weights, memory = module.filter_weights(log.dt, *self.tau), module.filter_memory()
        module.filter_start(log.t[0], begin, self.voltage[0], self.parameters, weights, memory)
        return memory

    def add_gram(self, samples: slice, states: np.ndarray, memory: np.ndarray, gram: np.ndarray) -> None:
        """Add the Gram matrix of a chunk's rows to gram (n + 1, n + 1), and advance the memory."""
        t, voltage = self.log.t[samples], self.voltage[samples]
        self.module.filtered_gram(t, states, voltage, *self.settings, memory, gram)

    def rows(self, samples: slice, states: np.ndarray, memory: np.ndarray) -> np.ndarray:
        """Rows of a chunk; advances the memory."""
        t, voltage = self.log.t[samples], self.voltage[samples]
        return _stacked_rows(*self.module.filter_onward(t, states, voltage, *self.settings, memory))


def _stacked_rows(sides: np.ndarray, regressors: np.ndarray) -> np.ndarray:
    return np.concatenate([regressors, sides[:, :, None]], axis=2).reshape(-1, regressors.shape[2] + 1)


def chunked_least_squares(
    module: KernelModule,
    log: Log,
    parameters: np.ndarray,
    tau: tuple[float, float],
    first_order_hold: bool,
    start: np.ndarray | None,
    restrictions: Restrictions,
) -> LinearFit:
    """Filtered least squares (paper eqs. 39-43) in memory for one chunk; ``start`` as in filtered_least_squares."""
    equations = _ChunkedEquations(
        module, log, parameters, tau, first_order_hold, acting_input(module, log, parameters)
    )  # fmt: skip
    head, count = _decay_samples(log, tau), len(module.LINEAR)
    states = states_of_range(module, log, 0, head)
    begin = states[0] if start is None else start
    rows = equations.first_rows(states, begin)
    if start is None:
        rows = project_out(free_decay(log.t[:head], tau, module.NQ).reshape(len(rows), -1), rows)[0]
    memory = equations.memory_at_start(begin)
    equations.add_gram(slice(0, head), states, memory, np.zeros((count + 1, count + 1)))  # only for the memory
    memory_after_head, gram = memory.copy(), rows.T @ rows
    for samples, states in chunks_from(module, log, head):
        equations.add_gram(samples, states, memory, gram)
    if condition_of(gram[:-1, :-1]) < MAX_NORMAL_EQUATIONS_CONDITION:
        root = gram_square_root(gram)
    else:
        root = _triangular_factor_of_chunks(equations, rows, memory_after_head, head)
    found = solve_least_squares(module, root[:, None, -1], root[:, None, :-1], restrictions=restrictions)
    free = int(restrictions.is_free(module.LINEAR).sum())
    share = max((len(root) - free) / (module.NQ * len(log) - free), 0.0)
    sigma, covariance = found.sigma * np.sqrt(share), found.covariance * share
    return replace(found, sigma=sigma, covariance=covariance, rows=module.NQ * len(log))


def filtered_residual(
    module: KernelModule,
    t: np.ndarray,
    states: np.ndarray,
    voltage: np.ndarray,
    parameters: np.ndarray,
    tau: tuple[float, float],
    coefficients: np.ndarray,
) -> np.ndarray:
    """Left sides of the filtered equations less their regressors times coefficients (n,): (N, NQ).

    In memory for the regressors of one chunk.
    """
    settings = (parameters, *tau, True)
    sides, regressors = module.filter_regressor(t[:1], states[:1], voltage[:1], *settings, states[0])
    found = [sides - regressors @ coefficients]
    weights, memory = module.filter_weights(t[1] - t[0], *tau), module.filter_memory()
    module.filter_start(t[0], states[0], voltage[0], parameters, weights, memory)
    for a in range(1, len(t), CHUNK_SAMPLES):
        chunk = slice(a - 1, min(a + CHUNK_SAMPLES, len(t)))
        sides, regressors = module.filter_onward(t[chunk], states[chunk], voltage[chunk], *settings, memory)
        found.append(sides - regressors @ coefficients)
    return np.concatenate(found)


def _decay_samples(log: Log, tau: tuple[float, float]) -> int:
    """Samples until nothing is left of the filters' start."""
    end = int(np.searchsorted(log.t, log.t[0] + FILTER_DECAY_TIME_CONSTANTS * max(tau)))
    return min(max(end, CHUNK_SAMPLES // 8), len(log))


def _triangular_factor_of_chunks(
    equations: _ChunkedEquations, rows: np.ndarray, memory: np.ndarray, head: int
) -> np.ndarray:
    """R factor (n + 1, n + 1) of the head's rows and those of all chunks after it."""
    root = triangular_factor(rows)
    for samples, states in chunks_from(equations.module, equations.log, head):
        root = triangular_factor(equations.rows(samples, states, memory), root)
    return root


def chunks_from(module: KernelModule, log: Log, first: int) -> Iterator[tuple[slice, np.ndarray]]:
    """Ranges of samples from one on, each with the sample before it, and their states."""
    for a in range(first, len(log), CHUNK_SAMPLES):
        b = min(a + CHUNK_SAMPLES, len(log))
        yield slice(a - 1, b), states_of_range(module, log, a - 1, b)


def states_of_range(module: KernelModule, log: Log, first: int, last: int) -> np.ndarray:
    """Measured states (last - first, NX) of a range of samples; those around it determine the slopes at its ends."""
    a, b = max(first - CHUNK_MARGIN_SAMPLES, 0), min(last + CHUNK_MARGIN_SAMPLES, len(log))
    return measured_states(module, log.part(a, b))[first - a : last - a]
