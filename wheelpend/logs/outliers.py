"""Readings that no motion explains: single spikes, and an angle or position that jumps and stays (a slipped count).

Both are found in the log alone, before any model sees it. A spike is a Hampel test against the readings on both sides:
the reading is far from all of them, though they agree. A machine with inertia does not get there and back between two
samples, however sudden its friction or a push. A spike becomes a missing value. A jump splits the log.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from wheelpend.logs.columns import ColumnTable
from wheelpend.logs.log import EXCERPT_SAMPLES, GAP_INTERVAL_RATIO, Log
from wheelpend.logs.noise import find_quantum
from wheelpend.logs.unwrap import TURN_RAD

SIDE_SAMPLES = 3  # readings on each side with which one is compared
MAX_SPIKE_SAMPLES = 2  # samples that a spike of a position lasts at most; a rate's, which a blow can make, one
MAX_BURST_SAMPLES = 7  # readings within which several spikes may stand with sound ones between them
OVERLAP_SAMPLES = 100  # by which parts of a long log overlap, so that every spike is seen with its neighbours
MIN_SPIKE_SIGMAS = 6.0  # standard deviations from the nearest of its neighbours: 1e-9 of Gaussian readings
MIN_SPIKE_RANGE_RATIO = 2.0  # times the range of its neighbours; a sine gives 0.3 at six samples in a period
MIN_OUTLIER_STEPS = 2.5  # steps of a quantised channel, or usual ones: one that flickers by a count or two is none
MIN_JUMP_RATIO = 6.0  # times the fastest speed among the intervals on both sides
MAD_PER_SIGMA = 0.6745  # median of the size of a Gaussian value
ROBUST_ORDERS = range(1, 5)  # orders of the differences whose median size gives a scatter that outliers do not move
SMALLEST_SHARE = 1e-6  # of a channel's range: smaller deviations are its digits
MAX_SPIKE_SHARE = 0.02  # share of readings above which they are no spikes but how the channel is
MAX_JUMPS, MAX_JUMP_SHARE = 20, 1e-3  # jumps, and share of the readings, above both of which the channel moves so

AROUND = np.array([k for k in range(2 * SIDE_SAMPLES + 1) if k != SIDE_SAMPLES])  # intervals around the middle one
MAX_USUAL_STEPS = 20_000  # steps, spread over the log, that say what is usual
USUAL_SHARE = 0.99  # of the steps, that count as usual: jumps are a tenth of the rest at most
DIGITS_SHARE = 1e-9  # of a channel's range: smaller changes are those of its arithmetic

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
    """Outliers of a log of a plant with these columns; jumps at which it is split already are none."""
    positions = [c for c in log.channels if table.units.get(c) in ("rad", "m")]
    found = find_outliers(log, [find_quantum(c) for c in log.excerpt().measured.T], positions)
    known = {j for j in found.jumps if j.sample in log.breaks or _is_turn(j, table)}
    return found._replace(jumps=tuple(j for j in found.jumps if j not in known))


def _is_turn(jump: Outlier, table: ColumnTable) -> bool:
    return table.units[jump.channel] == "rad" and abs(abs(jump.size) - TURN_RAD) < TURN_MARGIN


def find_outliers(log: Log, quanta: Sequence[float], positions: Sequence[str]) -> Outliers:
    """Spikes of every channel, and jumps of those that are positions; ``quanta`` are the channels' steps or 0."""
    spikes: list[Outlier] = []
    jumps: list[Outlier] = []
    excerpt = log.excerpt()
    for column, (channel, step) in enumerate(zip(log.channels, quanta, strict=True)):
        signal = log.measured[:, column]
        limit = _smallest_outlier(excerpt.measured[:, column], step)
        found = spike_sizes(signal, limit, MAX_SPIKE_SAMPLES if channel in positions else 1)
        spikes += [Outlier(channel, k, float(log.t[k]), size) for k, size in found.items()]
        if channel in positions:
            steps = jump_sizes(_without(signal, found), log.t, limit)
            jumps += [Outlier(channel, k, float(log.t[k]), size) for k, size in steps.items()]
    return Outliers(tuple(spikes), tuple(jumps))


def _without(signal: np.ndarray, samples: Iterable[int]) -> np.ndarray:
    """A signal (N,) with some samples missing."""
    left = np.array(signal, dtype=float)
    left[list(samples)] = np.nan
    return left


def without_spikes(values: np.ndarray) -> np.ndarray:
    """A signal (N,) with single readings missing that are far from those beside them."""
    return _without(values, spike_sizes(values, _smallest_outlier(values[:EXCERPT_SAMPLES], find_quantum(values)), 1))


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

    They last ``longest`` samples at most; several may stand within MAX_BURST_SAMPLES, sound readings between them.
    """
    found: dict[int, float] = {}
    for first in range(0, len(signal), EXCERPT_SAMPLES):  # saves memory
        last = first + EXCERPT_SAMPLES
        begin = max(first - OVERLAP_SAMPLES, 0)
        part = _spikes_of_part(signal[begin : last + OVERLAP_SAMPLES], limit, longest)
        found |= {begin + k: size for k, size in part.items() if first <= begin + k < last}
    return found if len(found) <= MAX_SPIKE_SHARE * len(signal) else {}


def _spikes_of_part(signal: np.ndarray, limit: float, longest: int) -> dict[int, float]:
    """The spikes of a part of a signal (N,), in the order of their samples."""
    found: dict[int, float] = {}
    for width in range(1, MAX_BURST_SAMPLES + 1):
        known = np.flatnonzero(np.isfinite(signal))
        if known.size < 2 * SIDE_SAMPLES + width:
            break
        own = _bursts(signal[known], limit, width, longest)
        found |= {int(known[k]): size for k, size in own.items()}
        signal = _without(signal, found)
    return dict(sorted(found.items()))


def _bursts(values: np.ndarray, limit: float, width: int, longest: int) -> dict[int, float]:
    """Spikes among so many readings of a signal (N,), the first and last of which are spikes, between sound ones."""
    count = values.size - 2 * SIDE_SAMPLES - width + 1
    starts = [*range(SIDE_SAMPLES), *range(SIDE_SAMPLES + width, 2 * SIDE_SAMPLES + width)]
    low, high = values[:count].copy(), values[:count].copy()  # of the neighbours on both sides
    for k in starts[1:]:
        np.minimum(low, values[k : k + count], out=low)
        np.maximum(high, values[k : k + count], out=high)
    threshold = np.maximum(limit, MIN_SPIKE_RANGE_RATIO * (high - low))
    low, high = low - threshold, high + threshold
    ends = [values[k : k + count] for k in (SIDE_SAMPLES, SIDE_SAMPLES + width - 1)]
    found: dict[int, float] = {}
    for k in np.flatnonzero(np.logical_and.reduce([(e < low) | (e > high) for e in ends])):
        inside = values[k + SIDE_SAMPLES : k + SIDE_SAMPLES + width]
        far = (inside < low[k]) | (inside > high[k])
        half = 0.5 * threshold[k]  # sound readings between spikes lie with their neighbours, not half way to the spikes
        sound = (inside >= low[k] + half) & (inside <= high[k] - half)
        if (far | sound).all() and _longest_run(far) <= longest:
            centre = float(np.median(values[k + np.array(starts)]))
            found |= {int(k + SIDE_SAMPLES + j): float(inside[j]) - centre for j in np.flatnonzero(far)}
    return found


def _longest_run(mask: np.ndarray) -> int:
    """The most true values in a row of a mask (n,)."""
    return max(len(run) for run in "".join("x" if m else " " for m in mask).split(" "))


def jump_sizes(signal: np.ndarray, t: np.ndarray, limit: float) -> dict[int, float]:
    """Sample after each jump of a position (N,) at times (N,) [s], with the jump's size beyond the motion.

    The speed over that interval exceeds all others around it many times over, which no force on an inertia does.
    """
    known = np.flatnonzero(np.isfinite(signal))
    if known.size < 4 * SIDE_SAMPLES:
        return {}
    steps, interval = np.diff(signal[known]), np.diff(t[known])
    speed = steps / interval
    count = speed.size - 2 * SIDE_SAMPLES
    fastest = np.zeros(count)
    for k in AROUND:
        np.maximum(fastest, np.abs(speed[k : k + count]), out=fastest)
    middle = slice(SIDE_SAMPLES, -SIDE_SAMPLES)
    steps, interval = steps[middle], interval[middle]
    least = np.maximum(max(limit, _usual_step(speed, steps, interval)), MIN_JUMP_RATIO * fastest * interval)
    near = interval <= GAP_INTERVAL_RATIO * float(np.median(interval))
    places = np.flatnonzero((np.abs(steps) + fastest * interval > least) & near)
    beyond = _beyond_motion(speed, steps, interval, places)
    found = np.abs(beyond) > least[places]
    if found.sum() > max(MAX_JUMPS, MAX_JUMP_SHARE * known.size):
        return {}
    return {int(known[k + SIDE_SAMPLES + 1]): float(b) for k, b in zip(places[found], beyond[found], strict=True)}


def _beyond_motion(speed: np.ndarray, steps: np.ndarray, interval: np.ndarray, places: np.ndarray) -> np.ndarray:
    """Steps (N,) at some places less the motion over their interval (N,) [s], at the usual speed around them."""
    return np.asarray(steps[places] - np.median(speed[places[:, None] + AROUND], axis=1) * interval[places])


def _usual_step(speed: np.ndarray, steps: np.ndarray, interval: np.ndarray) -> float:
    """Least step that is large against all usual ones between different readings, each less the motion around it."""
    places = np.flatnonzero(steps)
    if not places.size:
        return np.inf
    beyond = np.abs(_beyond_motion(speed, steps, interval, places[:: -(-places.size // MAX_USUAL_STEPS)]))
    return MIN_OUTLIER_STEPS * float(np.quantile(beyond, USUAL_SHARE, method="lower"))


def _smallest_outlier(signal: np.ndarray, step: float) -> float:
    """Deviation of an outlier at least [unit of the signal], from a scatter that outliers themselves do not move.

    It is large against the usual change of the step between readings too: a count of an encoder, also where its counts
    were converted and rounded.
    """
    known = signal[np.isfinite(signal)]
    changes = np.abs(np.diff(known, 2))  # of the step from one reading to the next
    changes = changes[changes > DIGITS_SHARE * np.ptp(known)] if known.size else known
    if known.size < 2 * SIDE_SAMPLES or not changes.size:
        return np.inf
    scatters = [robust_scatter(known, order) for order in ROBUST_ORDERS]
    return max(
        MIN_SPIKE_SIGMAS * min(scatters),
        MIN_OUTLIER_STEPS * max(step, float(np.median(changes))),
        SMALLEST_SHARE * float(np.ptp(known)),
    )


def robust_scatter(signal: np.ndarray, order: int) -> float:
    """Standard deviation of a signal's (N,) white part from the median size of its differences of an order."""
    gain = float(np.sqrt(np.sum(np.poly(np.ones(order)) ** 2)))  # of white noise, through the difference's weights
    return float(np.median(np.abs(np.diff(signal, order)))) / (MAD_PER_SIGMA * gain)
