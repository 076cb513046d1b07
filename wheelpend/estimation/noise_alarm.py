"""The alarm of an error well below the noise floor: σ is then overstated, and everything that rests on it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from wheelpend.estimation.problem import EstimationProblem
from wheelpend.estimation.segments import Segments

MAX_ERROR_FLOOR_RATIO = 0.9  # error over floor below which σ is overstated by a tenth, and the alarm is given
MIN_CHANCE_SIGMAS = 4.0  # standard deviations by which the squared error must be too small to be no chance


def overstated_noise(
    problem: EstimationProblem,
    error: float,
    segments: Sequence[Segments],
    residuals: Sequence[np.ndarray] = (),
) -> tuple[str, ...]:
    """A sentence where an error [σ] on some segments is well below the noise floor, and not by chance; else none.

    ``residuals`` (N, channels) [σ] of the segments, where they are at hand, tell in which channels.
    """
    ratio = error / problem.floor
    states = 2 * problem.module.NQ * sum(len(s.bounds) for s in segments)
    count = max(sum(s.values for s in segments) - states, 1)
    chance = MIN_CHANCE_SIGMAS * np.sqrt(2.0 / count)
    if not ratio < MAX_ERROR_FLOOR_RATIO or 1.0 - ratio**2 < chance:
        return ()
    where = _quiet_channels(segments, residuals)
    return (
        f"The error {error:.2g} is well below the noise floor {problem.floor:.2g}{where}: σ is overstated, so that "
        "standard errors are too large and small effects are overlooked. Numbers in [sensors] that are too large do "
        "that, and channels that were filtered or fused before they were logged. Compare [sensors] with what "
        "`wheelpend inspect` finds, and state the noise of such channels in [sensors.noise].",
    )


def _quiet_channels(segments: Sequence[Segments], residuals: Sequence[np.ndarray]) -> str:
    """Channels whose residuals are well below σ, with their root mean squares, in brackets; empty where none is."""
    if not residuals:
        return ""
    together = np.concatenate(list(residuals))
    squares = [c[np.isfinite(c)] ** 2 for c in together.T]
    sizes = [float(np.sqrt(s.mean())) if s.size else np.inf for s in squares]
    quiet = [
        f"{c} {r:.2g} σ" for c, r in zip(segments[0].log.channels, sizes, strict=True) if r < MAX_ERROR_FLOOR_RATIO
    ]
    return f" ({', '.join(quiet)})" if quiet else ""
