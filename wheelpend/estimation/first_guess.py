"""First guess of the initial states of segments, from the measured channels alone."""

from __future__ import annotations

import numpy as np

from wheelpend.estimation.segments import Segments
from wheelpend.estimation.state_reconstruction import states_from
from wheelpend.kernels.kernel_module import KernelModule

REST_SCATTER_ERRORS = 3.0  # standard errors of a mean square by which readings at rest may exceed it
PARABOLA_DURATION_S, MIN_PARABOLA_SAMPLES = 0.03, 6  # s and samples, through which the first guess is drawn


def initial_states(module: KernelModule, segments: Segments) -> np.ndarray:
    """First guess of the segments' initial states (segments, NX), from the measured channels alone.

    Positions and rates come from short parabolas through the first samples, or what these allow. A segment in which
    nothing leaves its noise begins at rest at its mean: dry friction would make a standstill of no slope but that.
    """
    log, first = segments.log, segments.bounds[:, :1]
    places = first + np.arange(max(MIN_PARABOLA_SAMPLES, round(PARABOLA_DURATION_S / log.dt)))
    beyond = places >= segments.bounds[:, 1:]
    places = np.minimum(places, len(log) - 1)
    t, measured = log.t[places] - log.t[first], np.where(beyond[:, :, None], np.nan, log.measured[places])
    curves = np.stack([parabola_values_and_slopes(t, measured[:, :, c]) for c in range(module.NY)], axis=2)
    for k, (a, b) in enumerate(segments.bounds):
        if (means := means_at_rest(log.measured[a:b], segments.sigma)) is not None:
            curves[k] = means, np.zeros_like(means)
    return states_from(module, curves[:, 0], curves[:, 1])


def means_at_rest(measured: np.ndarray, sigma: np.ndarray) -> np.ndarray | None:
    """Means (channels,) of readings (samples, channels) that scatter by no more than their noise sigma (channels,).

    None where one scatters by more, or one was never read.
    """
    means = np.empty(len(sigma))
    for c, values in enumerate(measured.T):
        known = values[np.isfinite(values)]
        if not known.size:
            return None
        means[c] = known.mean()
        deviation = known - means[c]
        if deviation @ deviation > (1.0 + REST_SCATTER_ERRORS * np.sqrt(2.0 / known.size)) * known.size * sigma[c] ** 2:
            return None
    return means


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
