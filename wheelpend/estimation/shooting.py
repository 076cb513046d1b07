"""Multiple shooting: a log's segments simulated from their own initial states, and their residual linearised.

The kernels integrate the state and its sensitivities to initial state and parameters with the measured input.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import cache
from typing import NamedTuple

import numpy as np

from wheelpend.estimation.first_guess import initial_states
from wheelpend.estimation.segments import Segments
from wheelpend.kernels.kernel_module import KernelModule
from wheelpend.parallel import thread_budget, threads

NO_WINDOW_END = np.iinfo(np.int64).max
DEFAULT_MAX_STEP_S = 0.002  # s
WARM_UP_STATE_ROUNDS = 3  # rounds in which the initial states of the segments of a warm-up are fitted
MIN_PARALLEL_SEGMENTS = 8  # segments below which one thread simulates all


@dataclass(frozen=True)
class ShootingLinearisation:
    """The least-squares problem of one log, linearised in initial states and parameters."""

    gram: np.ndarray  # (segments, n + 1, n + 1), [J r]ᵀ[J r], states first, residual last
    residual: np.ndarray  # (N, channels) in units of σ, NaN outside the segments; (0, channels) where it is not kept

    @property
    def cost(self) -> float:
        """Sum of squared residuals; infinite where the simulation left the finite numbers."""
        total = float(self.gram[:, -1, -1].sum())
        return total if np.isfinite(total) else np.inf

    @property
    def costs(self) -> np.ndarray:
        """Sum of squared residuals [σ²] of every segment (segments,)."""
        return self.gram[:, -1, -1]

    def with_segments(
        self, other: ShootingLinearisation, places: np.ndarray, chosen: np.ndarray, segments: Segments | None = None
    ) -> ShootingLinearisation:
        """The linearisation with another one's ``chosen`` segments in these places.

        Their residuals come along where ``segments`` says where they lie, and residuals are kept.
        """
        gram, residual = self.gram.copy(), self.residual.copy()
        gram[places] = other.gram[chosen]
        for a, b in segments.bounds[places] if segments is not None and len(residual) else ():
            residual[a:b] = other.residual[a:b]
        return ShootingLinearisation(gram, residual)


class Simulator(NamedTuple):
    """Kernels that simulate segments, and the longest step of their integrator."""

    module: KernelModule
    max_step: float = DEFAULT_MAX_STEP_S  # s

    def shoot(
        self,
        segments: Segments,
        states: np.ndarray,
        parameters: np.ndarray,
        columns: Sequence[int] = (),
        window: np.ndarray | None = None,
        keep_residual: bool = True,
    ) -> ShootingLinearisation:
        """Simulate segments from their initial states (segments, NX); linearise the residual in these and parameters.

        columns are the places of these parameters in the vector (NP,), each effective in a window (columns, 2) of
        samples. Without keep_residual only its squares are stored: a long log needs no memory beyond its own.
        """
        chosen = np.array(columns, dtype=np.int64)
        if window is None:
            window = np.tile(np.array([0, NO_WINDOW_END], dtype=np.int64), (chosen.size, 1))
        longer, states, judged = self.with_warm_up(segments, states, parameters)
        log, size = segments.log, self.module.NX + chosen.size + 1
        gram = np.zeros((len(longer.bounds), size, size))
        residual = np.full(log.measured.shape if keep_residual else (0, self.module.NY), np.nan)
        weight = 1.0 / segments.sigma

        def shoot_range(a: int, b: int) -> None:
            """Simulate segments a to b; no two threads write to the same segment or sample."""
            self.module.shoot(
                log.t, log.known_voltage, log.measured, weight, longer.bounds[a:b], states[a:b], parameters,
                chosen, window, self.max_step, gram[a:b], residual,
            )  # fmt: skip

        try:
            _run_in_threads(shoot_range, len(longer.bounds), _worker_count(self.module, longer, parameters, chosen))
        except ZeroDivisionError:  # a machine without inertia, at the bounds of its parameters, cannot be simulated
            gram[:] = np.nan
        for first, last in longer.bounds[~judged] if keep_residual else ():
            residual[first:last] = np.nan
        gram = gram[judged]
        if segments.weights is not None:
            gram *= segments.weights[:, None, None]
        return ShootingLinearisation(gram, residual)

    def with_warm_up(
        self, segments: Segments, states: np.ndarray, parameters: np.ndarray
    ) -> tuple[Segments, np.ndarray, np.ndarray]:
        """Segments and states with those of the warm-ups, and a mask of the segments that are judged.

        Only a coupled model goes through a warm-up: there it finds the states that it carries into the first segment.
        """
        warm_up = segments.warm_up if has_coupled_segments(self.module, parameters) else segments.bounds[:0]
        if not len(warm_up):
            return segments, states, np.ones(len(segments.bounds), dtype=bool)
        lead = replace(segments, bounds=warm_up, weights=None)
        guess = initial_states(self.module, lead)
        found = self.follow(lead, guess, parameters, WARM_UP_STATE_ROUNDS, two_starts=False)
        bounds = np.concatenate([warm_up, segments.bounds])
        order = np.argsort(bounds[:, 0], kind="stable")
        longer = replace(segments, bounds=np.ascontiguousarray(bounds[order]), weights=None)
        both = np.ascontiguousarray(np.concatenate([found, states])[order])
        return longer, both, order >= len(warm_up)

    def follow(
        self, segments: Segments, states: np.ndarray, parameters: np.ndarray, rounds: int, two_starts: bool
    ) -> np.ndarray:
        """Initial states (segments, NX) fitted one after the other, with what each segment hands on to the next."""
        log, found = segments.log, states.copy()
        try:
            self.module.fit_initial_states(
                log.t, log.known_voltage, log.measured, 1.0 / segments.sigma, segments.bounds, found, parameters,
                self.max_step, rounds, two_starts,
            )  # fmt: skip
        except ZeroDivisionError:  # as in shoot
            return states
        return found


def _run_in_threads(job: Callable[[int, int], None], count: int, workers: int) -> None:
    """Run a job on ranges that divide so many items among so many threads."""
    if workers == 1:
        job(0, count)
    else:
        edges = [count * k // workers for k in range(workers + 1)]
        list(_pool().map(job, edges[:-1], edges[1:]))


def _worker_count(module: KernelModule, segments: Segments, parameters: np.ndarray, columns: np.ndarray) -> int:
    """Number of threads for some segments: one where these are coupled, or few.

    Also where a force with a memory is absent and one of the columns: its slope carries over from segment to segment.
    """
    coupled = has_coupled_segments(module, parameters) or not {*module.HYSTERESIS_SIZES}.isdisjoint(columns.tolist())
    alone = len(segments.bounds) < MIN_PARALLEL_SEGMENTS or coupled
    return 1 if alone else thread_budget.share()


@cache
def _pool() -> ThreadPoolExecutor:
    return ThreadPoolExecutor(max_workers=threads())


def has_coupled_segments(module: KernelModule, parameters: np.ndarray) -> bool:
    """True where a segment depends on the one before: with internal coordinates, or friction that has a memory."""
    return module.NA > module.NQ or bool(np.any(parameters[list(module.HYSTERESIS_SIZES)] != 0.0))
