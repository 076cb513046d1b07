"""Initial states of segments, fitted at given parameters."""

from __future__ import annotations

from functools import partial

import numpy as np

from wheelpend.estimation.first_guess import initial_states
from wheelpend.estimation.scaled_inverse import solve_damped
from wheelpend.estimation.segments import Segments
from wheelpend.estimation.shooting import ShootingLinearisation, Simulator, has_coupled_segments

MAX_STATE_UPDATE_ROUNDS = 3  # rounds up to which initial states are only brought up to date, from one start
START_STATE_DAMPING, MAX_STATE_DAMPING = 1e-4, 1e3  # of the unit diagonal
SUFFICIENT_DECREASE, ROUNDING_DECREASE = 1e-5, 1e-9  # of a sum of squares


@np.errstate(over="ignore", invalid="ignore")  # a segment that diverges gives infinities, and is rejected
def fit_states(
    simulator: Simulator,
    segments: Segments,
    states: np.ndarray,
    parameters: np.ndarray,
    rounds: int = 8,
    keep_residual: bool = True,
) -> tuple[np.ndarray, ShootingLinearisation]:
    """Fit only the initial states (segments, NX); every segment has its own damping and keeps its best."""
    linearise = partial(simulator.shoot, segments, parameters=parameters, keep_residual=keep_residual)
    if has_coupled_segments(simulator.module, parameters):
        states = sequential_states(simulator, segments, states, parameters, rounds)
        return states, linearise(states)
    states = states.copy()
    best, damping = linearise(states), np.full(len(states), START_STATE_DAMPING)
    moving = np.arange(len(states))
    for _ in range(rounds):
        if not len(moving):
            break
        part, gram = segments.chosen(moving), best.gram[moving]
        trial_states = states[moving] + solve_damped(gram[:, :-1, :-1], gram[:, :-1, -1:], damping[moving])[:, :, 0]
        trial = simulator.shoot(part, trial_states, parameters, keep_residual=keep_residual)
        old, new = (np.nan_to_num(x[:, -1, -1], nan=np.inf) for x in (gram, trial.gram))
        better = new < old
        states[moving[better]] = trial_states[better]
        damping[moving] *= np.where(better, 0.1, 10.0)
        best = best.with_segments(trial, moving[better], better, segments)
        moving = moving[_still_moves(old, new, damping[moving])]
    return states, best


def _still_moves(old: np.ndarray, new: np.ndarray, damping: np.ndarray) -> np.ndarray:
    """Mask (segments,) of those whose sum of squares a further step may lower, after one that took it from old to new.

    A step that raised it was too long: where dry friction holds or lets go, the way down may begin with a short one.
    """
    lowered = new < old
    falls = lowered & (old - new > SUFFICIENT_DECREASE * (1.0 + new))
    too_long = np.isfinite(old) & (new - old > ROUNDING_DECREASE * old) & (damping <= MAX_STATE_DAMPING)
    return falls | (~lowered & too_long)


def sequential_states(
    simulator: Simulator, segments: Segments, states: np.ndarray, parameters: np.ndarray, rounds: int
) -> np.ndarray:
    """Initial states (segments, NX) of coupled segments, fitted one after the other.

    Each begins with the internal coordinates and the memory with which the one before ends. In more than a few rounds
    it is also fitted from where the one before ended, which no missed contact has led astray.
    """
    longer, states_with_lead, judged = simulator.with_warm_up(segments, states, parameters)
    two_starts = rounds > MAX_STATE_UPDATE_ROUNDS
    return simulator.follow(longer, states_with_lead, parameters, rounds, two_starts)[judged]


__all__ = ["fit_states", "initial_states", "sequential_states"]
