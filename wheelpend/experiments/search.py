"""The trajectory that tells most within limits: known ones first, then multisines by differential evolution."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from scipy.optimize import differential_evolution

from wheelpend.experiments.closed_loop import Limits, Loop, Played
from wheelpend.experiments.excitation import COMPONENTS, HIGHEST, LOWEST, Excitation, family, multisine

POPULATION = 24  # multisines of a generation
GENERATIONS = 12
FAINTEST = 0.01  # amplitude of a sine as a share of the limit of pitch, at least

Worth = Callable[[Played], float]  # how much a rehearsed log would tell; the larger the better


class Found(NamedTuple):
    """A trajectory within the limits, and how much it tells."""

    worth: float
    excitation: Excitation
    played: Played


def best_of(excitations: Sequence[Excitation], loop: Loop, limits: Limits, worth: Worth) -> Found | None:
    """The best of some trajectories, each made smaller until it keeps the limits; None where none can be."""
    best: Found | None = None
    for excitation in excitations:
        played = loop.play_within(excitation, limits)
        value = -np.inf if played is None else worth(played)
        if played is not None and (best is None or value > best.worth):
            best = Found(value, excitation, played)
    return best


def search(
    loop: Loop,
    limits: Limits,
    worth: Worth,
    *,
    generations: int = GENERATIONS,
    progress: Callable[[str], None] = lambda text: None,
) -> Found | None:
    """The best trajectory that was found within the limits; the same every time.

    Sines of free frequency, amplitude and phase are evolved from a spread of random ones; what breaks a limit is made
    smaller. The best of the known family wins where it is better than all of them.
    """  # fmt: skip
    best = best_of(family(), loop, limits, worth)
    longest = max(LOWEST, 1.0 / float(loop.t[-1]))  # a slower sine would not come round within the record
    low, high = np.log(longest), np.log(max(HIGHEST, 2.0 * longest))
    bounds = [(low, high)] * COMPONENTS + [(np.log(FAINTEST), 0.0)] * COMPONENTS + [(-np.pi, np.pi)] * COMPONENTS
    generation = 0

    def cost(x: np.ndarray) -> float:
        nonlocal best
        found = _as_played(best_of([_multisine(x, limits)], loop, limits, worth), x, limits)
        if found is None or not np.isfinite(found.worth):
            return 1e6  # nothing is worse
        best = found if best is None or found.worth > best.worth else best
        return -found.worth

    def after(_x: np.ndarray, convergence: float = 0.0) -> None:
        nonlocal generation
        generation += 1
        progress(f"trying trajectories: generation {generation} of {generations}")

    differential_evolution(cost, bounds, maxiter=generations, popsize=1, init=_first(bounds), tol=0.0, polish=False,
                           seed=0, callback=after)  # fmt: skip
    return best


def _first(bounds: Sequence[tuple[float, float]]) -> np.ndarray:
    """The first generation (POPULATION, variables), evenly spread over each variable."""
    random = np.random.default_rng(1)
    ranks = np.array([random.permutation(POPULATION) for _ in bounds]).T
    low, high = np.array(bounds).T
    return low + (high - low) * (ranks + random.uniform(size=ranks.shape)) / POPULATION


def _multisine(x: np.ndarray, limits: Limits, factor: float = 1.0) -> Excitation:
    frequency, amplitude, phase = x.reshape(3, COMPONENTS)
    return multisine(np.exp(frequency), factor * limits.pitch * np.exp(amplitude), phase)


def _as_played(found: Found | None, x: np.ndarray, limits: Limits) -> Found | None:
    """A multisine with the amplitudes that the limits left it."""
    if found is None:
        return None
    return found._replace(
        excitation=_multisine(x, limits, found.played.factor), played=found.played._replace(factor=1.0)
    )
