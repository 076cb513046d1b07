"""The trajectory that tells most within limits: known ones first, then multisines by differential evolution."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from scipy.optimize import differential_evolution

from wheelpend.experiments.closed_loop import ClosedLoop, Limits, SimulatedExperiment
from wheelpend.experiments.excitation import (
    MAX_FREQUENCY_HZ,
    MIN_FREQUENCY_HZ,
    MULTISINE_COMPONENTS,
    Excitation,
    excitation_family,
    multisine,
)

POPULATION_SIZE = 24  # multisines of a generation
MAX_GENERATIONS = 12
MIN_AMPLITUDE_SHARE = 0.01  # amplitude of a sine as a share of the limit of pitch, at least

Criterion = Callable[[SimulatedExperiment], float]  # how much a rehearsed log would tell; the larger the better


class RatedTrajectory(NamedTuple):
    """A trajectory within the limits, and how much it tells."""

    worth: float
    excitation: Excitation
    played: SimulatedExperiment


def best_trajectory(
    excitations: Sequence[Excitation], loop: ClosedLoop, limits: Limits, criterion: Criterion
) -> RatedTrajectory | None:
    """The best of some trajectories, each made smaller until it keeps the limits; None where none can be."""
    best: RatedTrajectory | None = None
    for excitation in excitations:
        played = loop.play_within(excitation, limits)
        value = -np.inf if played is None else criterion(played)
        if played is not None and (best is None or value > best.worth):
            best = RatedTrajectory(value, excitation, played)
    return best


def search_trajectory(
    loop: ClosedLoop,
    limits: Limits,
    criterion: Criterion,
    *,
    generations: int = MAX_GENERATIONS,
    progress: Callable[[str], None] = lambda text: None,
) -> RatedTrajectory | None:
    """The best trajectory that was found within the limits; the same every time.

    Sines of free frequency, amplitude and phase are evolved from a spread of random ones; what breaks a limit is made
    smaller. The best of the known family wins where it is better than all of them.
    """  # fmt: skip
    best = best_trajectory(excitation_family(), loop, limits, criterion)
    longest = max(MIN_FREQUENCY_HZ, 1.0 / float(loop.t[-1]))  # a slower sine would not come round within the record
    low, high = np.log(longest), np.log(max(MAX_FREQUENCY_HZ, 2.0 * longest))
    bounds = (
        [(low, high)] * MULTISINE_COMPONENTS
        + [(np.log(MIN_AMPLITUDE_SHARE), 0.0)] * MULTISINE_COMPONENTS
        + [(-np.pi, np.pi)] * MULTISINE_COMPONENTS
    )
    generation = 0

    def cost(x: np.ndarray) -> float:
        nonlocal best
        found = _with_played_amplitudes(best_trajectory([_multisine_of(x, limits)], loop, limits, criterion), x, limits)
        if found is None or not np.isfinite(found.worth):
            return 1e6  # nothing is worse
        best = found if best is None or found.worth > best.worth else best
        return -found.worth

    def after(_x: np.ndarray, convergence: float = 0.0) -> None:
        nonlocal generation
        generation += 1
        progress(f"trying trajectories: generation {generation} of {generations}")

    differential_evolution(
        cost,
        bounds,
        maxiter=generations,
        popsize=1,
        init=_initial_population(bounds),
        tol=0.0,
        polish=False,
        seed=0,
        callback=after,
    )
    return best


def _initial_population(bounds: Sequence[tuple[float, float]]) -> np.ndarray:
    """The first generation (POPULATION, variables), evenly spread over each variable."""
    random = np.random.default_rng(1)
    ranks = np.array([random.permutation(POPULATION_SIZE) for _ in bounds]).T
    low, high = np.array(bounds).T
    return low + (high - low) * (ranks + random.uniform(size=ranks.shape)) / POPULATION_SIZE


def _multisine_of(x: np.ndarray, limits: Limits, factor: float = 1.0) -> Excitation:
    frequency, amplitude, phase = x.reshape(3, MULTISINE_COMPONENTS)
    return multisine(np.exp(frequency), factor * limits.pitch * np.exp(amplitude), phase)


def _with_played_amplitudes(found: RatedTrajectory | None, x: np.ndarray, limits: Limits) -> RatedTrajectory | None:
    """A multisine with the amplitudes that the limits left it."""
    if found is None:
        return None
    return found._replace(
        excitation=_multisine_of(x, limits, found.played.factor), played=found.played._replace(factor=1.0)
    )
