"""Sensor noise: standard deviation and quantisation of every channel, from the log alone.

No model enters the estimate, so that residuals are weighted alike before and after an effect is added.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from wheelpend.logs.coloured_noise import coloured_noise, filter_remark
from wheelpend.logs.log import Log
from wheelpend.logs.runs import runs_of
from wheelpend.logs.white_noise import difference_noise, predicted_noise, white_sigma

UNPREDICTED = (np.inf, 0.0)  # σ by prediction, and its relative error, where nothing was predicted
# Scatter of a quantised channel over that of rounding, from which noise is added to it. Motion between two samples
# passes for scatter where a channel moves many steps, so that a stated step is believed for longer.
MIN_SCATTER_RATIO, MIN_SCATTER_RATIO_STATED = 1.5, 3.0

MIN_HELD_READINGS, MIN_MOVING_READINGS = 4, 50  # alike, of a speed at a standstill; and others that tell its noise
WALK_S = 0.5  # s, as long as a segment, over which the sum of a speed's noise wanders
MIN_REPEATED_SHARE = 0.5  # share of repeated readings from which their rounding errors are not independent
MAX_COUNTS = 1e7  # steps that a quantised channel covers at most
FIRST_COUNTS = 16.0  # steps by which a grid with rounded digits is fitted at first
DIGITS = 2.4e-7  # of a value: twice the last digit of single precision, in which logs are often kept


class Noise(NamedTuple):
    """Sensor noise of a log, channel by channel."""

    sigma: np.ndarray  # (channels,) standard deviation [unit of the channel]
    quantum: np.ndarray  # (channels,) step of a quantised channel, 0 where none is seen
    floor: float  # expected error of the true model, 1.0 unless a quantised channel stands still
    remarks: tuple[str, ...] = ()  # sentences on channels whose σ rests on an assumption
    repeats: bool = False  # True where a quantised channel without other noise repeats most of its readings

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
    unknown = any(np.ptp(u[np.isfinite(u)]) > 0.0 for u in log.inputs if np.isfinite(u).any())
    unknown &= not all(given.get(c) for c in log.channels)
    predicted = predicted_noise(log) if unknown else [UNPREDICTED] * len(log.channels)
    rows = [
        channel_noise(log, channel, given.get(channel), quanta.get(channel), limit)
        for channel, limit in zip(log.channels, predicted, strict=True)
    ]
    sigma, quantum, error_ratios = zip(*rows, strict=True)
    estimated = [(c, s) for c, s, q in zip(log.channels, sigma, quantum, strict=True) if not (given.get(c) or q)]
    remarks = tuple(remark for c, s in estimated if (remark := filter_remark(log, c, s)))
    held = [
        q > 0.0 and s < 1.01 * rounding_sigma(q) and repeated_share(values) > MIN_REPEATED_SHARE
        for s, q, values in zip(sigma, quantum, log.measured.T, strict=True)
    ]
    return Noise(np.array(sigma), np.array(quantum), float(np.sqrt(np.mean(error_ratios))), remarks, any(held))


def noise_of_values(values: np.ndarray) -> float:
    """Standard deviation of the noise of readings (N,), from their differences, at least that of rounding."""
    return max(difference_noise(values), rounding_sigma(find_quantum(values)))


def noise_of_moving(values: np.ndarray) -> float:
    """The same of a speed (N,) while it changes: at a standstill it repeats itself, and scatters by nothing."""
    held = [run for run in runs_of(np.diff(values) == 0.0) if run[1] - run[0] >= MIN_HELD_READINGS]
    moving = np.array(values, dtype=float)
    for begin, end in held:
        moving[begin : end + 1] = np.nan
    enough = np.isfinite(moving).sum() >= MIN_MOVING_READINGS
    return max(noise_of_values(values), difference_noise(moving) if enough else 0.0)


def channel_noise(
    log: Log,
    channel: str,
    stated_sigma: float | None,
    stated_step: float | None,
    predicted: tuple[float, float] = UNPREDICTED,
) -> tuple[float, float, float]:
    """σ and step of a channel [its unit], and the expected squared error over σ², 1 unless σ is that of rounding.

    ``predicted`` is σ by prediction from the past and its relative standard error. The sum of a speed wanders.
    """
    signal = log.measured[:, log.channels.index(channel)]
    step = quantum_of(_richest_stretch(signal, log.breaks), stated_step)
    if stated_sigma:
        return stated_sigma, step, 1.0
    if channel in log.speed_noise:
        return max(wander(log.speed_noise[channel], log), _smallest_sigma(signal)), 0.0, 1.0
    rounding, scatter = rounding_sigma(step), white_sigma(signal, predicted, log.t)
    if not step:
        scatter = max(scatter, coloured_noise(log, channel))
    limit = MIN_SCATTER_RATIO_STATED if step == stated_step else MIN_SCATTER_RATIO
    sigma = rounding if step and scatter < limit * rounding else max(scatter, rounding)
    is_rounding = bool(step) and sigma == rounding
    error_ratio = rounding_error(signal, step) ** 2 / rounding**2 if is_rounding else 1.0
    return max(sigma, _smallest_sigma(signal)), step, error_ratio


def wander(speed_noise: float, log: Log) -> float:
    """σ of the sum of a speed of such noise: that of a random walk about its best line, for as long as a segment lasts.

    Its variance is a fifteenth of that at the walk's end.
    """
    interval = np.diff(log.t)
    interval = interval[interval <= log.longest_interval]
    step = float(np.sum(interval**2) / max(np.sum(interval), 1e-300))  # where some are longer these weigh more
    return speed_noise * float(np.sqrt(step * WALK_S / 15.0))


def quantum_of(signal: np.ndarray, stated: float | None) -> float:
    """Step of a signal [its unit]: the stated one unless the signal moves in other steps."""
    if not (stated and is_quantised(signal, stated)):
        return find_quantum(signal)
    found = find_quantum(signal)
    return found if found > 1.5 * stated else stated


def _richest_stretch(signal: np.ndarray, breaks: Sequence[int]) -> np.ndarray:
    """The part of a signal (N,) with most values without a break: behind one, the grid of its steps may be another."""
    return max(np.split(signal, list(breaks)), key=lambda part: np.unique(part[np.isfinite(part)]).size)


def find_quantum(signal: np.ndarray) -> float:
    """Step of the grid on which all values of a signal lie [its unit]; 0 of a signal that is not quantised."""
    values = np.unique(signal[np.isfinite(signal)])
    if values.size < 3:
        return 0.0
    span = float(values[-1] - values[0])
    digits = max(DIGITS * float(np.abs(values).max()), 1e-9 * span)
    steps = np.diff(values)
    for gaps in (steps, np.diff(np.unique(steps))):  # what goes on and on never moves by a single step, but by others
        found = gaps[gaps > digits]
        if not found.size or span >= MAX_COUNTS * found.min() or found.min() > np.median(steps[steps > digits]):
            return 0.0
        step = float(np.median(found[found < 1.5 * found.min()]))
        for able in (step, _counted_step(values, step)):
            if is_quantised(values, able):
                return able
    return 0.0


def _counted_step(values: np.ndarray, step: float) -> float:
    """The step of a grid on which sorted values (N,) lie but for their last digits, from a first one.

    The digits of one step tell it too badly to count hundreds of them, so it is fitted to ever more.
    """
    way, reach = values - values[0], FIRST_COUNTS * step
    while reach < 2.0 * way[-1]:
        near = way[way <= reach]
        counts = np.round(near / step)
        step = float(near @ counts / (counts @ counts)) if counts.any() else step
        reach *= 2.0
    return step


def is_quantised(signal: np.ndarray, step: float) -> bool:
    """True of a signal that moves in whole steps, as a quantised one does unless noise was added afterwards."""
    counts = (signal[np.isfinite(signal)] - signal[np.isfinite(signal)][0]) / step
    return bool(np.mean(np.abs(counts - np.round(counts)) < 0.1) > 0.95)


def repeated_share(signal: np.ndarray) -> float:
    """Share of readings of a signal (N,) that repeat the one before: within this step still, and nothing new."""
    known = signal[np.isfinite(signal)]
    return float(np.mean(np.diff(known) == 0.0)) if known.size > 1 else 0.0


def rounding_sigma(step: float) -> float:
    """Standard deviation of the error of rounding to a step."""
    return step / np.sqrt(12.0)


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
