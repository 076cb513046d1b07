"""The cut-off frequency up to which differentiated motion tells more than it adds in noise, chosen for the log.

Differentiating twice makes noise grow with the square of the frequency. In the regressor it shrinks inertias, so the
motion is low-pass filtered first, at the cut-off with which the equations leave the least of the whole, unfiltered
input: a lower one takes motion away that the input has moved, a higher one adds what no input has moved, of whatever
colour and origin. At that cut-off signal and noise of the motion are equally strong.

The parameters that judge are those of a lower cut-off, at which the noise is small: fitted anew at each, they would
also explain what a controller makes of the noise.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import NamedTuple

import numpy as np

from wheelpend.estimation.linear_fit import LinearFit

CUTOFFS_PER_OCTAVE = 2  # cut-offs that are tried, downwards from the highest
LOWEST_CUTOFF_RATIO = 1e-3  # of the highest cut-off
MAX_REMOVED_MOTION = 0.003  # of a position's standard deviation: more than that is motion, not noise
MAX_INERTIA_BIAS = 0.01  # relative, by noise in the accelerations, up to which a higher cut-off is as good


class Sides(NamedTuple):
    """Both sides of the equations at some samples, for the motion behind one filter."""

    left: np.ndarray  # (N, rows)
    regressor: np.ndarray  # (N, rows, n)
    accelerated: np.ndarray  # (n,) True of the columns with accelerations in them


def cutoffs_below(highest: float, removed: Callable[[float], float]) -> list[float]:
    """Cut-offs [Hz] to choose from, falling; ``removed`` is the share of the motion that one takes away."""
    found = [highest]
    while (lower := found[-1] * 2.0 ** (-1.0 / CUTOFFS_PER_OCTAVE)) > LOWEST_CUTOFF_RATIO * highest:
        if removed(lower) > MAX_REMOVED_MOTION:
            break
        found.append(lower)
    return found


def chosen_cutoff(sides: Mapping[float, Sides], fit: Callable[[float], LinearFit | None]) -> float:
    """The highest cut-off [Hz] whose noise biases no inertia by more than a hundredth.

    ``sides`` stand by cut-offs, ``fit`` gives least squares on the motion behind one, None where nothing is left.
    """
    fits = {f: found.estimate for f in sides if (found := fit(f)) is not None}
    if not fits:  # too short for any filter to settle
        return max(sides)
    best = min(fits, key=lambda f: min(squares_left(sides, fits[f]).values()))
    return cutoff_for(sides, fits[best])


def cutoff_for(sides: Mapping[float, Sides], estimate: np.ndarray) -> float:
    """The same for given parameters (n,)."""
    squares = squares_left(sides, estimate)
    best = min(squares, key=lambda f: squares[f])
    allowed = squares[best] + MAX_INERTIA_BIAS * inertia_squares(sides[best], estimate)
    return max(f for f, value in squares.items() if value <= allowed)


def squares_left(sides: Mapping[float, Sides], estimate: np.ndarray) -> dict[float, float]:
    """Sum of squares that parameters (n,) leave of the left side, by cut-off [Hz]; where the model is defined."""
    left = sides[max(sides)].left  # the same for all, also where it is the pull of gravity
    rests = {f: left - modelled(s.regressor, estimate) for f, s in sides.items()}
    defined = np.all([np.isfinite(rest) for rest in rests.values()], axis=0)
    return {f: float(np.sum(rest[defined] ** 2)) for f, rest in rests.items()}


def modelled(regressor: np.ndarray, estimate: np.ndarray) -> np.ndarray:
    """What parameters (n,) make of a regressor (..., n); a column whose parameter is zero need not be finite."""
    used = estimate != 0.0
    return regressor[..., used] @ estimate[used]


def inertia_squares(sides: Sides, estimate: np.ndarray) -> float:
    """Sum of squares of the left side that only the weakest inertia explains; 0 where one explains nothing by itself.

    Noise in an acceleration adds its own squares to what is left, and shrinks the inertia by their ratio to these.
    """
    used = estimate != 0.0
    matrix = sides.regressor[..., used].reshape(-1, int(used.sum()))
    matrix = matrix[np.isfinite(matrix).all(axis=1)]
    scale = np.linalg.norm(matrix, axis=0)
    inertias = sides.accelerated[used] & (scale > 0.0)
    if not inertias.any():
        return 0.0
    scaled = matrix / np.where(scale > 0.0, scale, 1.0)
    inverse = np.diag(np.linalg.pinv(scaled.T @ scaled, hermitian=True))
    alone = (estimate[used] * scale)[inertias] ** 2 / inverse[inertias]
    return float(alone.min())
