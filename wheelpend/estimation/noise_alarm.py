"""The alarm of an error well below the noise floor: σ is then overstated, and everything that rests on it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

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
    if not is_overstated(problem, error, segments):
        return ()
    states, values = _states_and_values(problem, segments)
    count = max(values - states, 1)
    quiet = _quiet_channels(segments, residuals, values / count)
    where = f" ({', '.join(f'{name} {size:.2g} σ' for name, (size, _) in quiet.items())})" if quiet else ""
    return (
        f"The error {error:.2g} is well below the noise floor {problem.floor:.2g}{where}: σ is overstated, so that "
        "standard errors are too large and small effects are overlooked. Numbers in [sensors] that are too large do "
        "that, and channels that were filtered or fused before they were logged. Compare [sensors] with what "
        f"`wheelpend inspect` finds, and state the noise of such channels{_stated_text(quiet)}.",
    )


def is_overstated(problem: EstimationProblem, error: float, segments: Sequence[Segments]) -> bool:
    """True of an error [σ] on some segments that is well below the noise floor, and not by chance."""
    ratio, (states, values) = error / problem.floor, _states_and_values(problem, segments)
    chance = MIN_CHANCE_SIGMAS * np.sqrt(2.0 / max(values - states, 1))
    return ratio < MAX_ERROR_FLOOR_RATIO and bool(1.0 - ratio**2 >= chance)


def _states_and_values(problem: EstimationProblem, segments: Sequence[Segments]) -> tuple[int, int]:
    """How many start states some segments have, and readings."""
    return 2 * problem.module.NQ * sum(len(s.bounds) for s in segments), sum(s.values for s in segments)


def _stated_text(quiet: Mapping[str, tuple[float, float]]) -> str:
    """The σ of channels as model.toml states it; where none is known, which command prints it."""
    if not quiet:
        return ": `wheelpend residuals LOG` prints the lines for model.toml"
    stated = ", ".join(f"{name} = {found:.2g}" for name, (_, found) in quiet.items())
    return f" under [sensors] in model.toml: noise = {{ {stated} }}"


def _quiet_channels(
    segments: Sequence[Segments], residuals: Sequence[np.ndarray], inflation: float
) -> dict[str, tuple[float, float]]:
    """Channels whose residuals are well below σ, with their root mean squares in σ and in the channel's unit.

    ``inflation`` is of their squares, for the states that every segment's fit has taken from them.
    """
    if not residuals:
        return {}
    squares = [c[np.isfinite(c)] ** 2 for c in np.concatenate(list(residuals)).T]
    sizes = [float(np.sqrt(inflation * s.mean())) if s.size else np.inf for s in squares]
    rows = zip(segments[0].log.channels, sizes, segments[0].sigma, strict=True)
    return {name: (size, size * float(sigma)) for name, size, sigma in rows if size < MAX_ERROR_FLOOR_RATIO}
