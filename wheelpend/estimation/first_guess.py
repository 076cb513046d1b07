"""First guess of the initial states of segments, from the measured channels alone."""

from __future__ import annotations

import numpy as np

from wheelpend.estimation.segments import Segments
from wheelpend.estimation.state_reconstruction import states_from
from wheelpend.kernels.kernel_module import KernelModule

SCATTER_ERRORS = 3.0  # standard errors of a mean square by which what readings leave may exceed that of their noise
PARABOLA_DURATION_S, MIN_PARABOLA_SAMPLES = 0.03, 6  # s and samples, through which the first guess is drawn at least
PARABOLA_PARAMETERS = 3
LONGEST_PARABOLA = 16  # times as many samples, where a parabola still is all that they say


def initial_states(module: KernelModule, segments: Segments) -> np.ndarray:
    """First guess of the segments' initial states (segments, NX), from the measured channels alone.

    Positions and rates come from parabolas through the first samples, or what these allow: through a few, and twice as
    many as long as what that leaves is noise. Slow motion in the steps of an encoder has no direction over a few
    samples, and dry friction takes the wrong one for certain. A segment in which nothing leaves its noise begins at
    rest at its mean: dry friction would make a standstill of no slope but that.
    """
    count = max(MIN_PARABOLA_SAMPLES, round(PARABOLA_DURATION_S / segments.log.dt))
    curves, _ = _curves(module, segments, count)
    all_noise = np.ones((len(segments.bounds), module.NY), dtype=bool)
    longest = np.diff(segments.bounds).max(initial=0)
    for factor in (2**k for k in range(1, LONGEST_PARABOLA.bit_length()) if 2**k * count <= longest):
        longer, in_noise = _curves(module, segments, factor * count)
        all_noise = np.logical_and(all_noise, in_noise)
        curves = np.where(all_noise[:, None], longer, curves)
    for k, (a, b) in enumerate(segments.bounds):
        if (means := means_at_rest(segments.log.measured[a:b], segments.sigma)) is not None:
            curves[k] = means, np.zeros_like(means)
    return states_from(module, curves[:, 0], curves[:, 1])


def _curves(module: KernelModule, segments: Segments, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Values and slopes (segments, 2, channels) of parabolas through so many first samples of the segments.

    And a mask (segments, channels) of those that reach over all these samples and leave no more than noise.
    """
    log, first = segments.log, segments.bounds[:, :1]
    places = first + np.arange(count)
    beyond = places >= segments.bounds[:, 1:]
    places = np.minimum(places, len(log) - 1)
    t, measured = log.t[places] - log.t[first], np.where(beyond[:, :, None], np.nan, log.measured[places])
    fitted = [parabolas(t, measured[:, :, c]) for c in range(module.NY)]
    curves, left = (np.stack(part, axis=-1) for part in zip(*fitted, strict=True))
    known = np.isfinite(measured).sum(axis=1)
    in_noise = is_noise(left, np.maximum(known - PARABOLA_PARAMETERS, 1), segments.sigma)
    return curves, in_noise & (known > PARABOLA_PARAMETERS) & ~beyond.any(axis=1, keepdims=True)


def is_noise(squares: np.ndarray, freedom: np.ndarray, sigma: np.ndarray) -> np.ndarray:
    """Mask of sums of squares that so many degrees of freedom leave of noise of this standard deviation."""
    return squares <= (1.0 + SCATTER_ERRORS * np.sqrt(2.0 / freedom)) * freedom * sigma**2


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
        if not is_noise(deviation @ deviation, known.size, sigma[c]):
            return None
    return means


def parabolas(t: np.ndarray, signals: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Value and slope at time 0 (segments, 2) of least-squares parabolas through signals (segments, samples) at t.

    And the sums of squares (segments,) that they leave. Through two samples goes a line, through one a constant; NaN
    where there is none.
    """
    good = np.isfinite(signals)
    scale = np.maximum(np.max(np.where(good, t, 0.0), axis=1), 1e-9)
    count, known = good.sum(axis=1), np.where(good, signals, 0.0)
    powers = (t / scale[:, None])[:, :, None] ** np.arange(3) * (
        good[:, :, None] & (np.arange(3) < count[:, None, None])
    )
    normal = np.einsum("sij,sik->sjk", powers, powers)
    fitted = np.einsum("sjk,sk->sj", np.linalg.pinv(normal, hermitian=True), np.einsum("sij,si->sj", powers, known))
    left = ((known - np.einsum("sij,sj->si", powers, fitted)) ** 2).sum(axis=1)
    slopes = fitted[:, :2] / np.column_stack([np.ones_like(scale), scale])
    return np.where(count[:, None] > 0, slopes, np.nan), left
