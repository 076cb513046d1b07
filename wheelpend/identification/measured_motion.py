"""Motion from measured positions: stretches without a gap, filtered with zero phase and differentiated."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

import numpy as np
from scipy.signal import butter, sosfiltfilt

from wheelpend.estimation.state_reconstruction import fill_gaps, states_from
from wheelpend.identification.bandwidth import cutoffs_below
from wheelpend.kernels.kernel_module import KernelModule
from wheelpend.logs.log import Log, gapless_ranges
from wheelpend.logs.noise import sensor_noise
from wheelpend.logs.runs import runs_of

BUTTERWORTH_ORDER = 4  # of the Butterworth filter for positions and their derivatives
MAX_MOTION_CUTOFF_HZ = 100.0  # Hz, of that filter, as published; less where the log is slow or noisy
MIN_SAMPLES_PER_PERIOD = 5.0  # samples in a period of the fastest motion that is passed
MIN_STRETCH_SAMPLES, MIN_STRETCH_S = 40, 0.2  # samples and s in a stretch
NOISE_MARGIN = 1.1  # a channel's σ is known to a tenth at worst


def measured_stretches(log: Log) -> list[Log]:
    """Parts long enough to differentiate, without a gap or a channel missing for half a period at the cut-off."""
    longest, found = max(2, round(1.0 / (2.0 * MAX_MOTION_CUTOFF_HZ * log.dt))), []
    for a, b in gapless_ranges(log, 0, len(log)):
        lost = np.zeros(b - a, dtype=bool)
        for signal in log.measured[a:b].T:
            for first, last in runs_of(np.isnan(signal)):
                lost[first:last] |= last - first > longest
        found += [log.part(a + int(first), a + int(last)) for first, last in runs_of(~lost)]
    return [part for part in found if len(part) >= MIN_STRETCH_SAMPLES and part.duration >= MIN_STRETCH_S]


def uniform_times(t: np.ndarray) -> np.ndarray:
    """As many times at equal distances, from the first sample to the last or nearly so."""
    return np.linspace(t[0], t[-1], len(t))


def uniform_channels(log: Log, t: np.ndarray) -> np.ndarray:
    """Channels (N, channels) at uniform times, missing values interpolated."""
    return np.column_stack([np.interp(t, log.t, fill_gaps(log.t, signal)) for signal in log.measured.T])


def low_passed(values: np.ndarray, dt: float, cutoff: float) -> np.ndarray:
    """Signals (N, ...) at an interval [s], filtered forward and backward up to a cut-off [Hz]."""
    return sosfiltfilt(butter(BUTTERWORTH_ORDER, cutoff, fs=1.0 / dt, output="sos"), values, axis=0)


def smooth_motion(module: KernelModule, log: Log, t: np.ndarray, cutoff: float) -> tuple[np.ndarray, np.ndarray]:
    """States (N, NX) and accelerations (N, NQ) at uniform times, from channels filtered up to a cut-off [Hz]."""
    dt = float(t[1] - t[0])
    values = low_passed(uniform_channels(log, t), dt, cutoff)
    states = states_from(module, values, np.gradient(values, dt, axis=0))
    return states, np.gradient(states[:, module.NQ :], dt, axis=0)


def possible_cutoffs(module: KernelModule, log: Log, stretches: Sequence[Log]) -> list[float]:
    """Cut-offs [Hz] that leave the motion of a log's stretches as it is, falling.

    The filter works at a stretch's mean interval, which is longer than the usual one where samples are missing.
    """
    longest = max(part.duration / (len(part) - 1) for part in stretches)
    highest = min(MAX_MOTION_CUTOFF_HZ, 1.0 / (MIN_SAMPLES_PER_PERIOD * longest))
    sigma = sensor_noise(log.excerpt(), {}, {}).sigma
    return cutoffs_below(highest, partial(_removed_motion, module, stretches, sigma))


def _removed_motion(module: KernelModule, stretches: Sequence[Log], sigma: np.ndarray, cutoff: float) -> float:
    """Largest share of a position's standard deviation that a cut-off [Hz] takes away beside noise (channels,)."""
    positions = np.asarray(module.OUTPUT_MATRIX)[:, : module.NQ].any(axis=1)
    removed, size = np.zeros(len(sigma)), np.zeros(len(sigma))
    for part in stretches:
        t = uniform_times(part.t)
        values = uniform_channels(part, t)
        squares = ((values - low_passed(values, float(t[1] - t[0]), cutoff)) ** 2).sum(axis=0)
        removed += np.maximum(squares - len(t) * (NOISE_MARGIN * sigma) ** 2, 0.0)
        size += len(t) * values.var(axis=0)
    return float(np.sqrt(removed / np.where(size > 0.0, size, np.inf))[positions].max(initial=0.0))
