"""Sensor noise: standard deviation and quantisation of every channel, from the log alone.

No model enters the estimate, so that residuals are weighted alike before and after an effect is added.
"""

from __future__ import annotations

from math import comb
from typing import NamedTuple

import numpy as np

from wheelpend.logs.log import Log

DIFFERENCE_ORDERS = range(2, 7)  # differences of these orders: the higher, the less of a smooth signal remains
COLOUR_LAG_SAMPLES = 4  # samples; noise has colour where the scatter at this lag exceeds that from sample to sample
MAX_SCATTER_GROWTH = 1.9  # over that lag; at √COLOUR_LAG_SAMPLES the noise would be a random walk, without a variance
# Time [s] over which the motion counts as smooth, and growth of the scatter above which the noise has colour, by
# whether the channel is a rate, in which the controller shows.
COLOUR_LIMITS = {False: (0.021, 1.25), True: (0.0085, 1.6)}
SPIKE_SIGMAS = 5.0  # standard deviations from its neighbours beyond which a reading is a spike
MAX_SPIKE_SHARE = 0.02  # share of readings above which they are no spikes but motion
VARIANCE_WINDOW_SAMPLES = 50  # samples over which a variance is taken


class Noise(NamedTuple):
    """Sensor noise of a log, channel by channel."""

    sigma: np.ndarray  # (channels,) standard deviation [unit of the channel]
    quantum: np.ndarray  # (channels,) step of a quantised channel, 0 where none is seen
    floor: float  # expected error of the true model, 1.0 unless a quantised channel stands still

    @property
    def sigma_before_rounding(self) -> np.ndarray:
        """Standard deviation (channels,) of what rounding to the quantum does not account for."""
        rounding = np.array([rounding_sigma(q) for q in self.quantum])
        return np.sqrt(np.maximum(self.sigma**2 - rounding**2, 0.0))


def sensor_noise(log: Log, given: dict[str, float | None], quanta: dict[str, float | None]) -> Noise:
    """Noise of every channel: the stated σ and steps where there are some, the rest estimated from the log.

    A quantised channel has σ = step/√12 unless noise is added to it. The floor accounts for a quantised channel that
    stands still: its rounding error is then constant and smaller than σ says. A channel that was low-pass filtered
    before it was logged hardly scatters from sample to sample though its error may be large; for an angle and its rate
    the error is then taken from the inconsistency of the two.
    """
    rows = [channel_noise(log, channel, given.get(channel), quanta.get(channel)) for channel in log.channels]
    sigma, quantum, error_ratios = zip(*rows, strict=True)
    return Noise(np.array(sigma), np.array(quantum), float(np.sqrt(np.mean(error_ratios))))


def channel_noise(
    log: Log, channel: str, stated_sigma: float | None, stated_step: float | None
) -> tuple[float, float, float]:
    """σ and step of a channel [its unit], and the expected squared error over σ², 1 unless σ is that of rounding."""
    signal = log.measured[:, log.channels.index(channel)]
    step = quantum_of(signal, stated_step)
    if stated_sigma:
        return stated_sigma, step, 1.0
    rounding = rounding_sigma(step)
    scatter = rounding if step and step == stated_step else difference_noise(signal)
    if not step:
        scatter = float(np.hypot(max(scatter, coloured_noise(log, channel)), spike_sigma(signal, scatter)))
    sigma = rounding if step and scatter < 1.5 * rounding else max(scatter, rounding)
    is_rounding = bool(step) and sigma == rounding
    error_ratio = rounding_error(signal, step) ** 2 / rounding**2 if is_rounding else 1.0
    return max(sigma, _smallest_sigma(signal)), step, error_ratio


def quantum_of(signal: np.ndarray, stated: float | None) -> float:
    """Step of a signal [its unit]: the stated one unless the signal moves in other steps."""
    if not (stated and is_quantised(signal, stated)):
        return find_quantum(signal)
    found = find_quantum(signal)
    return found if found > 1.5 * stated else stated


def find_quantum(signal: np.ndarray) -> float:
    """Step of the grid on which all values of a signal lie [its unit]; 0 of a signal that is not quantised."""
    values = np.unique(signal[np.isfinite(signal)])
    if values.size < 3:
        return 0.0
    steps = np.diff(values)
    span = float(values[-1] - values[0])
    steps = steps[steps > 1e-9 * span]
    step = float(np.median(steps[steps < 1.5 * steps.min()]))
    return step if is_quantised(values, step) and span < 1e6 * step else 0.0


def is_quantised(signal: np.ndarray, step: float) -> bool:
    """True of a signal that moves in whole steps, as a quantised one does unless noise was added afterwards."""
    counts = (signal[np.isfinite(signal)] - signal[np.isfinite(signal)][0]) / step
    return bool(np.mean(np.abs(counts - np.round(counts)) < 0.1) > 0.95)


def rounding_sigma(step: float) -> float:
    """Standard deviation of the error of rounding to a step."""
    return step / np.sqrt(12.0)


def coloured_noise(log: Log, channel: str) -> float:
    """Standard deviation of noise with colour, such as a low-pass filter gives it [unit of the channel]; 0 where white.

    The scatter of such noise grows with the lag of the samples. Tested only on logs so fast that the motion is smooth
    over that lag. The inconsistency of an angle with its rate gives the angle's noise whatever its colour; for a rate
    it is an upper limit only, and a first-order filter is assumed.
    """
    signal, is_rate = log.measured[:, log.channels.index(channel)], log.rates.get(channel) in log.channels
    longest, growth = COLOUR_LIMITS[is_rate]
    if COLOUR_LAG_SAMPLES * log.dt > longest or len(signal) < 1000:
        return 0.0
    near = difference_noise(signal)
    far = float(np.median([difference_noise(signal[k::COLOUR_LAG_SAMPLES]) for k in range(COLOUR_LAG_SAMPLES)]))
    if not far > growth * near:
        return 0.0
    limit = angle_rate_inconsistency(log, channel)
    filtered = near * filtered_noise_ratio(min(far / near, MAX_SCATTER_GROWTH))
    if far > MAX_SCATTER_GROWTH * near:  # smoother than a first-order filter makes it: only the inconsistency counts
        return limit or filtered
    return min(limit or np.inf, filtered) if is_rate else (limit or filtered)


def filtered_noise_ratio(growth: float) -> float:
    """Standard deviation of noise behind a first-order filter over its scatter from sample to sample.

    ``growth`` is the scatter at a lag of COLOUR_LAG_SAMPLES over that at a lag of one sample; the filter's pole that
    causes it is found by bisection.
    """
    rows = np.array([comb(DIFFERENCE_ORDERS[-1], k) * (-1) ** k for k in range(DIFFERENCE_ORDERS[-1] + 1)], dtype=float)
    lags = np.abs(np.subtract.outer(np.arange(rows.size), np.arange(rows.size)))

    def scatter(pole: float) -> float:
        return float(np.sqrt(rows @ pole**lags @ rows / (rows @ rows)))

    low, high = 0.0, 1.0 - 1e-6
    for _ in range(50):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if scatter(middle**COLOUR_LAG_SAMPLES) < growth * scatter(middle) else (low, middle)
    return 1.0 / scatter(low)


def angle_rate_inconsistency(log: Log, channel: str) -> float:
    """Standard deviation of an angle less its integrated rate, within half a second [unit of the channel].

    The difference should be constant; offset and drift are removed from every window. For a rate it is the standard
    deviation of the difference's slope, less that of the slope of the angle's own white noise. 0 where the log lacks
    the other of angle and rate, and where the angle's noise is most of it.
    """
    pairs = [(a, r) for r, a in log.rates.items() if channel in (a, r) and {a, r} <= set(log.channels)]
    if not pairs:
        return 0.0
    angle, rate = pairs[0]
    angles, rates = (log.measured[:, log.channels.index(c)] for c in (angle, rate))
    good = np.isfinite(angles) & np.isfinite(rates)
    t, angles, rates = log.t[good], angles[good], rates[good]
    step = np.diff(t)
    difference = angles - np.concatenate([[0.0], np.cumsum(0.5 * (rates[1:] + rates[:-1]) * step)])
    length = max(8, round(0.5 / log.dt))
    width = 2 * max(1, round(0.01 / log.dt)) + 1
    squares = []
    for first in range(0, len(t) - length + 1, length):
        window = slice(first, first + length)
        x = t[window] - t[first]
        rest = difference[window] - np.polyval(np.polyfit(x, difference[window], 1), x)
        if channel == rate:
            rest = np.gradient(np.convolve(rest, np.ones(width) / width, mode="valid"), log.dt)
        squares.append(np.mean(rest**2))
    if not squares:
        return 0.0
    variance, angle_variance = float(np.mean(squares)), 0.0
    if channel == rate:
        angle_variance = (difference_noise(angles) / (width * log.dt)) ** 2
    return float(np.sqrt(variance - angle_variance)) if angle_variance < 0.5 * variance else 0.0


def difference_noise(signal: np.ndarray) -> float:
    """Standard deviation of the white part of a signal (N,), from its differences of high order.

    The variance is averaged over short windows, those with bursts left out, so that the noise need not be Gaussian.
    """
    estimates = []
    for order in DIFFERENCE_ORDERS:
        squares = np.diff(signal, order) ** 2 / comb(2 * order, order)
        squares = squares[np.isfinite(squares)]  # a missing value leaves no difference
        if squares.size <= 10:
            break
        width = VARIANCE_WINDOW_SAMPLES if squares.size > VARIANCE_WINDOW_SAMPLES else squares.size
        means = squares[: squares.size // width * width].reshape(-1, width).mean(axis=1)
        estimates.append(float(np.sqrt(means[means <= 2.0 * np.median(means)].mean())))
    return min(estimates) if estimates else float(np.nanstd(signal))


def spike_sigma(signal: np.ndarray, scatter: float) -> float:
    """Contribution of single readings far off to the standard deviation of a signal with that scatter [its unit].

    A reading is compared with the median of its four neighbours: motion, however sudden, moves some of those along.
    """
    known = signal[np.isfinite(signal)]
    if known.size < 5:
        return 0.0
    around = np.stack([known[:-4], known[1:-3], known[3:-1], known[4:]])
    off = known[2:-2] - np.median(around, axis=0)
    far = np.abs(off) > SPIKE_SIGMAS * scatter
    return float(np.sqrt(np.mean(np.where(far, off**2, 0.0)))) if np.mean(far) < MAX_SPIKE_SHARE else 0.0


def rounding_error(signal: np.ndarray, step: float) -> float:
    """Root mean square of the error that rounding to a step makes on the smoothed signal."""
    good = np.isfinite(signal)
    finite = np.interp(np.arange(signal.size), np.flatnonzero(good), signal[good])
    kernel = np.hanning(min(41, finite.size // 2 * 2 - 1) + 2)[1:-1]
    smooth = np.convolve(finite, kernel / kernel.sum(), mode="valid")
    start = finite[0]
    error = np.round((smooth - start) / step) * step + start - smooth
    return float(np.sqrt(np.mean(error**2)))


def _smallest_sigma(signal: np.ndarray) -> float:
    """Lower limit of σ: a ten-thousandth of the change between samples, or a billionth of a still signal's size.

    A log from ideal sensors would otherwise be trusted beyond the accuracy of any integration.
    """
    known = signal[np.isfinite(signal)]
    if known.size < 2:
        return 1e-12
    return max(1e-4 * float(np.sqrt(np.mean(np.diff(known) ** 2))), 1e-9 * float(np.abs(known).max()), 1e-12)
