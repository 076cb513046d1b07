"""First guess of the initial states of segments, from the measured channels alone."""

from __future__ import annotations

import numpy as np

from wheelpend.estimation.segments import Segments
from wheelpend.estimation.state_reconstruction import states_from
from wheelpend.kernels.kernel_module import KernelModule

PARABOLA_DURATION_S, MIN_PARABOLA_SAMPLES = 0.03, 6  # s and samples, through which the first guess is drawn


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
