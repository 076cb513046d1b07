"""Noise with colour, such as a filter or a fusion of sensors gives it: it hardly scatters from sample to sample."""

from __future__ import annotations

from itertools import pairwise
from math import comb

import numpy as np

from wheelpend.logs.log import GAP_INTERVAL_RATIO, Log
from wheelpend.logs.white_noise import DIFFERENCE_ORDERS, difference_noise

COLOUR_LAG_SAMPLES = 4  # samples; noise has colour where the scatter at this lag exceeds that from sample to sample
MAX_SCATTER_GROWTH = 1.9  # over that lag; at √COLOUR_LAG_SAMPLES the noise would be a random walk, without a variance
# Time [s] over which the motion counts as smooth, and growth of the scatter above which the noise has colour, by
# whether the channel is a rate, in which the controller shows.
COLOUR_LIMITS = {False: (0.021, 1.25), True: (0.0085, 1.6)}

MIN_FILTERED_RATIO = 1.5  # σ over the scatter from sample to sample, from which a channel is called filtered
MIN_RESOLUTION = 1e-6  # scatter over the standard deviation of the channel: 20 bits, finer than sensors resolve


def filter_remark(log: Log, channel: str, sigma: float) -> str:
    """A sentence on a channel whose σ cannot be had from its scatter, with what was assumed; empty where it can."""
    signal = log.measured[:, log.channels.index(channel)]
    scatter = difference_noise(signal)
    cure = f"If you know its error, state it in model.toml: [sensors.noise] {channel} = ..."
    partner = rate_partner(log, channel)
    if partner and sigma > MIN_FILTERED_RATIO * scatter and coloured_noise(log, channel):
        return (
            f"{channel} was filtered or fused before it was logged: from sample to sample it scatters by {scatter:.2g} "
            f"only. σ = {sigma:.2g} is assumed, from how far it contradicts {partner} within half a second. {cure}"
        )
    bounded = channel == log.range_channel or channel in log.rates  # a wheel may turn as far as it likes
    if bounded and 0.0 < scatter < MIN_RESOLUTION * float(np.nanstd(signal)):
        return (
            f"{channel} scatters by {scatter:.2g} only, less than a millionth of its motion: it was filtered, computed "
            f"from other sensors, or has no noise. σ = {sigma:.2g} is taken, and may be far too small. {cure}"
        )
    return ""


def rate_partner(log: Log, channel: str) -> str:
    """The angle of a rate or the rate of an angle, where the log has both; else empty."""
    pairs = [(a, r) for r, a in log.rates.items() if {a, r} <= set(log.channels)]
    return next((r if channel == a else a for a, r in pairs if channel in (a, r)), "")


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
    for window in _whole_windows(log, good, length):
        x = t[window] - t[window.start]
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


def _whole_windows(log: Log, good: np.ndarray, length: int) -> list[slice]:
    """Windows of so many good samples (mask (N,)) without a gap or a break: over those a rate cannot be integrated."""
    step = np.diff(log.t[good])
    longest = GAP_INTERVAL_RATIO * max(log.dt, float(np.median(step)) if step.size else 0.0)
    jumps = np.cumsum(good)[np.array(log.breaks, dtype=int) - 1] if log.breaks else np.zeros(0, dtype=int)
    edges = np.unique(np.concatenate([[0], np.flatnonzero(step > longest) + 1, jumps, [int(good.sum())]])).tolist()
    return [slice(k, k + length) for a, b in pairwise(edges) for k in range(a, b - length + 1, length)]
