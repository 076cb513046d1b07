"""The most informative trajectory within limits: known ones first, then multisines by differential evolution."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from scipy.optimize import differential_evolution

from wheelpend.durations import StepTimer
from wheelpend.experiments.excitation import (
    MAX_FREQUENCY_HZ,
    MIN_FREQUENCY_HZ,
    MULTISINE_COMPONENTS,
    Excitation,
    excitation_family,
    multisine,
)
from wheelpend.experiments.simulated_experiment import ExperimentLoop, Limits, SimulatedExperiment

POPULATION_SIZE = 24  # multisines of a generation
MAX_GENERATIONS = 12
MIN_AMPLITUDE_SHARE = 0.01  # amplitude of a sine as a share of the limit of pitch, at least
FAILED_COST = 1e6  # of a trajectory that cannot keep the limits: nothing is worse

Criterion = Callable[[SimulatedExperiment], float]  # of a simulated log; the larger, the more informative


class RatedTrajectory(NamedTuple):
    """A trajectory within the limits, and its criterion."""

    criterion: float
    excitation: Excitation
    played: SimulatedExperiment


def best_trajectory(
    excitations: Sequence[Excitation], loop: ExperimentLoop, limits: Limits, criterion: Criterion
) -> RatedTrajectory | None:
    """The best of some trajectories, each made smaller until it keeps the limits; None where none can be."""
    best: RatedTrajectory | None = None
    for excitation in excitations:
        played = loop.play_within(excitation, limits)
        value = -np.inf if played is None else criterion(played)
        if played is not None and (best is None or value > best.criterion):
            best = RatedTrajectory(value, excitation, played)
    return best


def search_trajectory(
    loop: ExperimentLoop,
    limits: Limits,
    criterion: Criterion,
    *,
    generations: int = MAX_GENERATIONS,
    progress: Callable[[str], None] = lambda text: None,
) -> RatedTrajectory | None:
    """The best trajectory that was found within the limits; the same every time.

    Sines of free frequency, amplitude and phase are evolved from a spread of random ones; what breaks a limit is made
    smaller. The best of the known family wins where it is better than all of them.
    """
    search = MultisineSearch(loop, limits, criterion)
    bounds = search.bounds()
    count, timer = itertools.count(1), StepTimer(generations)

    def after_generation(_x: np.ndarray, convergence: float = 0.0) -> None:
        done = next(count)
        progress(f"trying trajectories: generation {done} of {generations}{timer.left_text(done)}")

    differential_evolution(
        search.cost,
        bounds,
        maxiter=generations,
        popsize=1,
        init=_initial_population(bounds),
        tol=0.0,
        polish=False,
        seed=0,
        callback=after_generation,
    )
    return search.best


class MultisineSearch:
    """Multisines by logarithms of frequency [Hz] and of amplitude [of the pitch limit], and phase; and the best one."""

    def __init__(self, loop: ExperimentLoop, limits: Limits, criterion: Criterion) -> None:
        self.loop, self.limits, self.criterion = loop, limits, criterion
        self.best = best_trajectory(excitation_family(), loop, limits, criterion)

    def bounds(self) -> list[tuple[float, float]]:
        """Bounds of the variables: of all frequencies, all amplitudes and all phases."""
        slowest = max(MIN_FREQUENCY_HZ, 1.0 / float(self.loop.t[-1]))  # one period within the log
        frequency = (np.log(slowest), np.log(max(MAX_FREQUENCY_HZ, 2.0 * slowest)))
        amplitude = (np.log(MIN_AMPLITUDE_SHARE), 0.0)
        return [b for b in (frequency, amplitude, (-np.pi, np.pi)) for _ in range(MULTISINE_COMPONENTS)]

    def cost(self, x: np.ndarray) -> float:
        """Negative criterion of a multisine, made smaller until it keeps the limits; large where none does."""
        found = best_trajectory([_multisine_of(x, self.limits)], self.loop, self.limits, self.criterion)
        if found is None or not np.isfinite(found.criterion):
            return FAILED_COST
        if self.best is None or found.criterion > self.best.criterion:
            self.best = _with_played_amplitudes(found, x, self.limits)
        return -found.criterion


def _initial_population(bounds: Sequence[tuple[float, float]]) -> np.ndarray:
    """The first generation (POPULATION_SIZE, variables), evenly spread over each variable."""
    random = np.random.default_rng(1)
    ranks = np.array([random.permutation(POPULATION_SIZE) for _ in bounds]).T
    low, high = np.array(bounds).T
    return low + (high - low) * (ranks + random.uniform(size=ranks.shape)) / POPULATION_SIZE


def _multisine_of(x: np.ndarray, limits: Limits, factor: float = 1.0) -> Excitation:
    frequency, amplitude, phase = x.reshape(3, MULTISINE_COMPONENTS)
    return multisine(np.exp(frequency), factor * limits.pitch * np.exp(amplitude), phase)


def _with_played_amplitudes(found: RatedTrajectory, x: np.ndarray, limits: Limits) -> RatedTrajectory:
    """A multisine with the amplitudes that the limits left it."""
    excitation = _multisine_of(x, limits, found.played.factor)
    return found._replace(excitation=excitation, played=found.played._replace(factor=1.0))
