"""Multiple shooting: the maximum-likelihood fit of a model to measured logs.

A log is cut into segments; each is simulated from its own initial state with the measured voltage. Gauss-Newton with
Levenberg-Marquardt damping moves parameters and initial states together; the states are eliminated segment by segment
(Schur complement), so that only the parameters' equations remain.

"""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import cache
from types import ModuleType

import numpy as np

import derive
from derive.effects import PathForce
from wheelpend.estimation.segments import Segments
from wheelpend.parallel import thread_budget, threads

NO_WINDOW_END = np.iinfo(np.int64).max


@dataclass(frozen=True)
class ShootingLinearisation:
    """A least-squares problem, linearised at a point."""

    gram: np.ndarray  # (segments, n + 1, n + 1), [J r]ᵀ[J r], states first, residual last
    residual: np.ndarray  # (N, channels) in units of σ, NaN outside the segments; (0, channels) where it is not kept

    @property
    def cost(self) -> float:
        """Sum of squared residuals; infinite where the simulation left the finite numbers."""
        total = float(self.gram[:, -1, -1].sum())
        return total if np.isfinite(total) else np.inf


def shoot(
    module: ModuleType,
    part: Segments,
    states: np.ndarray,
    parameters: np.ndarray,
    columns: Sequence[int] = (),
    window: np.ndarray | None = None,
    max_step: float = 0.002,
    keep_residual: bool = True,
) -> ShootingLinearisation:
    """Simulate a part's segments and linearise the residual in the states and the parameters of columns.

    Without ``keep`` the residual is not stored, only its squares: a long log needs no memory beyond its own.
    """
    chosen = np.array(columns, dtype=np.int64)
    if window is None:
        window = np.tile(np.array([0, NO_WINDOW_END], dtype=np.int64), (chosen.size, 1))
    size = module.NX + chosen.size + 1
    gram = np.zeros((len(part.bounds), size, size))
    residual = np.full(part.log.measured.shape if keep_residual else (0, module.NY), np.nan)
    log, weight = part.log, 1.0 / part.sigma

    def some(a: int, b: int) -> None:
        """Segments a to b; those of another thread are others, and so are their samples."""
        module.shoot(
            log.t, log.voltage, log.measured, weight, part.bounds[a:b], states[a:b], parameters,
            chosen, window, max_step, gram[a:b], residual,
        )  # fmt: skip

    count, workers = len(part.bounds), _worker_count(module, part, parameters)
    edges = [count * k // workers for k in range(workers + 1)]
    try:
        if workers == 1:
            some(0, count)
        else:
            list(_pool().map(some, edges[:-1], edges[1:]))
    except ZeroDivisionError:  # a machine without inertia, at the bounds of its parameters, cannot be simulated
        gram[:] = np.nan
    if part.weights is not None:
        gram *= part.weights[:, None, None]
    return ShootingLinearisation(gram, residual)


def _worker_count(module: ModuleType, part: Segments, parameters: np.ndarray) -> int:
    """Threads among which segments are shared: one where they hang together, or are few."""
    return 1 if len(part.bounds) < 8 or has_coupled_segments(module, parameters) else thread_budget.share()


@cache
def _pool() -> ThreadPoolExecutor:
    return ThreadPoolExecutor(max_workers=threads())


def has_coupled_segments(module: ModuleType, parameters: np.ndarray) -> bool:
    """Whether a segment depends on the one before: something moves inside the machine, or has a memory."""
    remembering = [e.full_names[0] for e in derive.effects.LIBRARY.values() if isinstance(e.enters, PathForce)]
    there = [module.PARAMETERS.index(n) for n in remembering if n in module.PARAMETERS]
    return module.NA > module.NQ or bool(np.any(parameters[there] != 0.0))
