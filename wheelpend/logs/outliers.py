"""Readings that no motion explains: single spikes, and an angle or position that jumps and stays (a slipped count).

Both are found in the log alone, before any model sees it. A spike is a Hampel test against the readings on both sides:
the reading is far from all of them, though they agree. A machine with inertia does not get there and back between two
samples, however sudden its friction or a push. A spike becomes a missing value. A jump splits the log.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from wheelpend.logs.columns import ColumnTable
from wheelpend.logs.log import GAP_INTERVAL_RATIO, Log
from wheelpend.logs.noise import find_quantum
from wheelpend.logs.unwrap import TURN_RAD

SIDE_SAMPLES = 3  # readings on each side with which one is compared
MAX_SPIKE_SAMPLES = 2  # samples that a spike of a position lasts at most; a rate's, which a blow can make, one
MIN_SPIKE_SIGMAS = 6.0  # standard deviations from the nearest of its neighbours: 1e-9 of Gaussian readings
MIN_SPIKE_RANGE_RATIO = 2.0  # times the range of its neighbours; a sine gives 0.3 at six samples in a period
MIN_OUTLIER_STEPS = 2.5  # steps of a quantised channel: one that flickers by a count or two is none
MIN_JUMP_RATIO = 6.0  # times the fastest speed among the intervals on both sides
MAD_PER_SIGMA = 0.6745  # median of the size of a Gaussian value
ROBUST_ORDERS = range(1, 5)  # orders of the differences whose median size gives a scatter that outliers do not move
SMALLEST_SHARE = 1e-6  # of a channel's range: smaller deviations are its digits
MAX_SPIKE_SHARE = 0.02  # share of readings above which they are no spikes but how the channel is
MAX_JUMPS = 20  # jumps above which they are how the channel moves

TURN_MARGIN = 0.05 * TURN_RAD  # rad by which a jump may differ from a turn: such an angle was wrapped


class Outlier(NamedTuple):
    """A reading, or the reading after a jump, that no motion explains."""

    channel: str
    sample: int
    time: float  # s
    size: float  # by which it is off, or by which the channel jumps [unit of the channel]


class Outliers(NamedTuple):
    """Outliers of a log."""

    spikes: tuple[Outlier, ...]
    jumps: tuple[Outlier, ...]


def outliers_of(log: Log, table: ColumnTable) -> Outliers:
    """Outliers of a log of a plant with these columns."""
    positions = [c for c in log.channels if table.units.get(c) in ("rad", "m")]
    found = find_outliers(log, [find_quantum(c) for c in log.measured.T], positions)
    wrapped = [j for j in found.jumps if table.units[j.channel] == "rad" and abs(abs(j.size) - TURN_RAD) < TURN_MARGIN]
    return found._replace(jumps=tuple(j for j in found.jumps if j not in wrapped))


def find_outliers(log: Log, quanta: Sequence[float], positions: Sequence[str]) -> Outliers:
    """Spikes of every channel, and jumps of those that are positions; ``quanta`` are the channels' steps or 0."""
    spikes: list[Outlier] = []
    jumps: list[Outlier] = []
    for column, (channel, step) in enumerate(zip(log.channels, quanta, strict=True)):
        signal = log.measured[:, column]
        limit = _smallest_outlier(signal, step)
        found = spike_sizes(signal, limit, MAX_SPIKE_SAMPLES if channel in positions else 1)
        cleaned = signal.copy()
        cleaned[list(found)] = np.nan
        spikes += [Outlier(channel, k, float(log.t[k]), size) for k, size in found.items()]
        if channel in positions:
            steps = jump_sizes(cleaned, log.t, limit)
            jumps += [Outlier(channel, k, float(log.t[k]), size) for k, size in steps.items()]
    return Outliers(tuple(spikes), tuple(jumps))


def without_outliers(log: Log, found: Outliers) -> Log:
    """The log with its spikes missing and split at its jumps, and a warning on each channel's."""
    if not (found.spikes or found.jumps):
        return log
    measured = log.measured.copy()
    for spike in found.spikes:
        measured[spike.sample, log.channels.index(spike.channel)] = np.nan
    breaks = tuple(sorted({*log.breaks, *(j.sample for j in found.jumps)}))
    return replace(log, measured=measured, breaks=breaks, warnings=(*log.warnings, *outlier_sentences(found)))


def outlier_sentences(found: Outliers) -> list[str]:
    """What was found and what is done about it, a sentence for each channel and kind."""
    sentences = []
    for channel in dict.fromkeys(o.channel for o in found.spikes):
        own = [o for o in found.spikes if o.channel == channel]
        sentences.append(
            f"{channel} has {_counted(own, 'reading')} far off both neighbours, {_when_and_size(own)}: spikes, which "
            "count as missing."
        )
    for channel in dict.fromkeys(o.channel for o in found.jumps):
        own = [o for o in found.jumps if o.channel == channel]
        sentences.append(
            f"{channel} jumps {_counted(own, 'time')} and stays there, {_when_and_size(own)}: no motion does that, "
            "lost counts do. The log is split there."
        )
    return sentences


def _counted(own: Sequence[Outlier], noun: str) -> str:
    return f"{len(own)} {noun}{'s' * (len(own) > 1)}"


def _when_and_size(own: Sequence[Outlier]) -> str:
    largest = max(own, key=lambda o: abs(o.size))
    if len(own) == 1:
        return f"at t = {largest.time:.6g} s by {largest.size:.3g}"
    return f"first at t = {own[0].time:.6g} s, the largest at t = {largest.time:.6g} s by {largest.size:.3g}"


def spike_sizes(signal: np.ndarray, limit: float, longest: int = MAX_SPIKE_SAMPLES) -> dict[int, float]:
    """Sample and size of the spikes of a signal (N,) that are off by more than a limit [its unit].

    They last ``longest`` samples at most.
    """
    found: dict[int, float] = {}
    for width in range(1, longest + 1):
        known = np.flatnonzero(np.isfinite(signal))
        if known.size < 2 * SIDE_SAMPLES + width:
            break
        values = signal[known]
        windows = np.lib.stride_tricks.sliding_window_view(values, 2 * SIDE_SAMPLES + width)
        inside = windows[:, SIDE_SAMPLES : SIDE_SAMPLES + width]
        around = np.concatenate([windows[:, :SIDE_SAMPLES], windows[:, SIDE_SAMPLES + width :]], axis=1)
        low, high = around.min(axis=1), around.max(axis=1)
        threshold = np.maximum(limit, MIN_SPIKE_RANGE_RATIO * (high - low))
        far = (inside.min(axis=1) > high + threshold) | (inside.max(axis=1) < low - threshold)
        for k in np.flatnonzero(far):
            centre = float(np.median(around[k]))
            found |= {int(known[k + SIDE_SAMPLES + j]): float(inside[k, j]) - centre for j in range(width)}
        signal = signal.copy()
        signal[list(found)] = np.nan
    return dict(sorted(found.items())) if len(found) <= MAX_SPIKE_SHARE * len(signal) else {}


def jump_sizes(signal: np.ndarray, t: np.ndarray, limit: float) -> dict[int, float]:
    """Sample after each jump of a position (N,) at times (N,) [s], with the jump's size beyond the motion.

    The speed over that interval exceeds all others around it many times over, which no force on an inertia does.
    """
    known = np.flatnonzero(np.isfinite(signal))
    if known.size < 4 * SIDE_SAMPLES:
        return {}
    steps, interval = np.diff(signal[known]), np.diff(t[known])
    windows = np.lib.stride_tricks.sliding_window_view(steps / interval, 2 * SIDE_SAMPLES + 1)
    around = np.delete(windows, SIDE_SAMPLES, axis=1)
    middle, fastest = slice(SIDE_SAMPLES, -SIDE_SAMPLES), np.abs(around).max(axis=1)
    beyond = steps[middle] - np.median(around, axis=1) * interval[middle]
    least = np.maximum(limit, MIN_JUMP_RATIO * fastest * interval[middle])
    near = interval[middle] <= GAP_INTERVAL_RATIO * float(np.median(interval))
    places = np.flatnonzero((np.abs(beyond) > least) & near)
    if places.size > MAX_JUMPS:
        return {}
    return {int(known[k + SIDE_SAMPLES + 1]): float(beyond[k]) for k in places}


def _smallest_outlier(signal: np.ndarray, step: float) -> float:
    """Deviation of an outlier at least [unit of the signal], from a scatter that outliers themselves do not move."""
    known = signal[np.isfinite(signal)]
    if known.size < 2 * SIDE_SAMPLES:
        return np.inf
    scatters = [robust_scatter(known, order) for order in ROBUST_ORDERS]
    return max(
        MIN_SPIKE_SIGMAS * min(scatters),
        MIN_OUTLIER_STEPS * step,
        SMALLEST_SHARE * float(np.ptp(known)),
    )


def robust_scatter(signal: np.ndarray, order: int) -> float:
    """Standard deviation of a signal's (N,) white part from the median size of its differences of an order."""
    gain = float(np.sqrt(np.sum(np.poly(np.ones(order)) ** 2)))  # of white noise, through the difference's weights
    return float(np.median(np.abs(np.diff(signal, order)))) / (MAD_PER_SIGMA * gain)
