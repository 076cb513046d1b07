"""Initial states of segments, fitted at given parameters."""

from __future__ import annotations

from functools import partial

import numpy as np

from wheelpend.estimation.first_guess import initial_states, parabola_values_and_slopes
from wheelpend.estimation.scaled_inverse import solve_damped
from wheelpend.estimation.segments import Segments
from wheelpend.estimation.shooting import ShootingLinearisation, Simulator, has_coupled_segments

MAX_STATE_UPDATE_ROUNDS = 3  # rounds up to which initial states are only brought up to date, from one start
START_STATE_DAMPING = 1e-4  # of the unit diagonal


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
    for _ in range(rounds):
        step = solve_damped(best.gram[:, :-1, :-1], best.gram[:, :-1, -1:], damping)[:, :, 0]
        trial = linearise(states + step)
        old, new = (np.nan_to_num(x.gram[:, -1, -1], nan=np.inf) for x in (best, trial))
        better = new < old
        gain = np.where(better & np.isfinite(old), old - new, 0.0)
        states[better] += step[better]
        damping = np.where(better, damping * 0.1, damping * 10.0)
        best = _merge_improved(best, trial, segments, better)
        if np.all(gain <= 1e-4 * (1.0 + np.where(np.isfinite(old), old, 0.0)) / 10.0):
            break
    return states, best


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


def _merge_improved(
    old: ShootingLinearisation, new: ShootingLinearisation, segments: Segments, better: np.ndarray
) -> ShootingLinearisation:
    """The new linearisation for the segments that are better, the old one for the others."""
    gram, residual = old.gram.copy(), old.residual.copy()
    gram[better] = new.gram[better]
    for a, b in segments.bounds[better] if len(residual) else ():
        residual[a:b] = new.residual[a:b]
    return ShootingLinearisation(gram, residual)


__all__ = ["fit_states", "initial_states", "parabola_values_and_slopes", "sequential_states"]
