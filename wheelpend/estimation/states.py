"""Initial states of segments: a first guess from the measured channels, and their fit at given parameters."""

from __future__ import annotations

from functools import partial

import numpy as np

from wheelpend.estimation.scaled_inverse import solve_damped
from wheelpend.estimation.segments import Segments
from wheelpend.estimation.shooting import ShootingLinearisation, Simulator, has_coupled_segments
from wheelpend.estimation.state_reconstruction import states_from
from wheelpend.kernels.kernel_module import KernelModule

MAX_STATE_UPDATE_ROUNDS = 3  # rounds up to which initial states are only brought up to date, from one start
PARABOLA_DURATION_S, MIN_PARABOLA_SAMPLES = 0.03, 6  # s and samples, through which the first guess is drawn
START_STATE_DAMPING = 1e-4  # of the unit diagonal


def initial_states(module: KernelModule, segments: Segments) -> np.ndarray:
    """First guess of the segments' initial states (segments, NX), from the measured channels alone.

    Positions and rates come from short parabolas through the first samples, or what these allow.
    """
    log, first = segments.log, segments.bounds[:, :1]
    places = first + np.arange(max(MIN_PARABOLA_SAMPLES, round(PARABOLA_DURATION_S / log.dt)))
    beyond = places >= segments.bounds[:, 1:]
    places = np.minimum(places, len(log) - 1)
    t, measured = log.t[places] - log.t[first], np.where(beyond[:, :, None], np.nan, log.measured[places])
    curves = np.stack([parabola_values_and_slopes(t, measured[:, :, c]) for c in range(module.NY)], axis=2)
    return states_from(module, curves[:, 0], curves[:, 1])


def parabola_values_and_slopes(t: np.ndarray, signals: np.ndarray) -> np.ndarray:
    """Value and slope at time 0 (segments, 2) of least-squares parabolas through signals (segments, samples) at t.

    Through two samples goes a line, through one a constant; NaN where there is none.
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
    log, found = segments.log, states.copy()
    weight, two_starts = 1.0 / segments.sigma, rounds > MAX_STATE_UPDATE_ROUNDS
    try:
        simulator.module.fit_initial_states(
            log.t, log.known_voltage, log.measured, weight, segments.bounds, found, parameters,
            simulator.max_step, rounds, two_starts,
        )  # fmt: skip
    except ZeroDivisionError:  # as in shoot
        return states
    return found


def _merge_improved(
    old: ShootingLinearisation, new: ShootingLinearisation, segments: Segments, better: np.ndarray
) -> ShootingLinearisation:
    """The new linearisation for the segments that are better, the old one for the others."""
    gram, residual = old.gram.copy(), old.residual.copy()
    gram[better] = new.gram[better]
    for a, b in segments.bounds[better] if len(residual) else ():
        residual[a:b] = new.residual[a:b]
    return ShootingLinearisation(gram, residual)
