"""Initial states of segments: a first guess from the measured channels, and their fit at given parameters."""

from __future__ import annotations

from types import ModuleType

import numpy as np

from wheelpend.estimation.normal_equations import solve_damped
from wheelpend.estimation.segments import Segments
from wheelpend.estimation.shooting import ShootingLinearisation, has_coupled_segments, shoot
from wheelpend.estimation.state_reconstruction import states_from

MAX_STATE_UPDATE_ROUNDS = 3  # rounds up to which initial states are only brought up to date, from one start


def initial_states(module: ModuleType, part: Segments) -> np.ndarray:
    """First guess of the segments' initial states (segments, NX), from the measured channels alone.

    Angles and rates come from short parabolas through what follows, or what the points allow.
    """
    log, first = part.log, part.bounds[:, :1]
    places = first + np.arange(max(6, round(0.03 / log.dt)))
    beyond = places >= part.bounds[:, 1:]
    places = np.minimum(places, len(log) - 1)
    t, measured = log.t[places] - log.t[first], np.where(beyond[:, :, None], np.nan, log.measured[places])
    curves = np.stack([parabola_values_and_slopes(t, measured[:, :, c]) for c in range(module.NY)], axis=2)
    return states_from(module, curves[:, 0], curves[:, 1])


def parabola_values_and_slopes(t: np.ndarray, signals: np.ndarray) -> np.ndarray:
    """Value and slope at time 0 (segments, 2) of least-squares parabolas through signals (segments, samples) at t.

    Through two points goes a line, through one a constant; NaN where there is none.
    """
    good = np.isfinite(signals)
    scale = np.maximum(np.max(np.where(good, t, 0.0), axis=1), 1e-9)
    count = good.sum(axis=1)
    powers = (t / scale[:, None])[:, :, None] ** np.arange(3) * (
        good[:, :, None] & (np.arange(3) < count[:, None, None])
    )
    normal = np.einsum("sij,sik->sjk", powers, powers)
    right = np.einsum("sij,si->sj", powers, np.where(good, signals, 0.0))
    fitted = np.einsum("sjk,sk->sj", np.linalg.pinv(normal, hermitian=True), right)[:, :2]
    return np.where(count[:, None] > 0, fitted / np.column_stack([np.ones_like(scale), scale]), np.nan)


@np.errstate(over="ignore", invalid="ignore")  # a segment that runs away gives infinities, and is not kept
def fit_states(
    module: ModuleType,
    part: Segments,
    states: np.ndarray,
    parameters: np.ndarray,
    max_step: float = 0.002,
    rounds: int = 8,
    keep_residual: bool = True,
) -> tuple[np.ndarray, ShootingLinearisation]:
    """Fit only the initial states; every segment has its own damping and keeps its best."""
    if has_coupled_segments(module, parameters):
        states = sequential_states(module, part, states, parameters, max_step, rounds)
        return states, shoot(module, part, states, parameters, max_step=max_step, keep_residual=keep_residual)
    states = states.copy()
    shot = shoot(module, part, states, parameters, max_step=max_step, keep_residual=keep_residual)
    damping = np.full(len(states), 1e-4)
    for _ in range(rounds):
        step = solve_damped(shot.gram[:, :-1, :-1], shot.gram[:, :-1, -1:], damping)[:, :, 0]
        trial = shoot(module, part, states + step, parameters, max_step=max_step, keep_residual=keep_residual)
        old, new = (np.nan_to_num(x.gram[:, -1, -1], nan=np.inf) for x in (shot, trial))
        better = new < old
        gain = np.where(better & np.isfinite(old), old - new, 0.0)
        states[better] += step[better]
        damping = np.where(better, damping * 0.1, damping * 10.0)
        shot = _merge_improved(shot, trial, part, better)
        if np.all(gain <= 1e-4 * (1.0 + np.where(np.isfinite(old), old, 0.0)) / 10.0):
            break
    return states, shot


def sequential_states(
    module: ModuleType, part: Segments, states: np.ndarray, parameters: np.ndarray, max_step: float, rounds: int
) -> np.ndarray:
    """Initial states of segments each of which begins with what the one before hands on, fitted one after the other."""
    log, found = part.log, states.copy()
    try:
        module.settle(
            log.t,
            log.voltage,
            log.measured,
            1.0 / part.sigma,
            part.bounds,
            found,
            parameters,
            max_step,
            rounds,
            # then also from where the one before ended, which no missed contact has led astray
            rounds > MAX_STATE_UPDATE_ROUNDS,
        )
    except ZeroDivisionError:  # as in shoot
        return states
    return found


def _merge_improved(
    old: ShootingLinearisation, new: ShootingLinearisation, part: Segments, better: np.ndarray
) -> ShootingLinearisation:
    gram, residual = old.gram.copy(), old.residual.copy()
    gram[better] = new.gram[better]
    for a, b in part.bounds[better] if len(residual) else ():
        residual[a:b] = new.residual[a:b]
    return ShootingLinearisation(gram, residual)
