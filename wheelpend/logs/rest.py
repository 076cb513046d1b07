"""Rest: how long a machine stands still when its log begins or ends, and a log that begins with a step from rest."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from wheelpend.logs.checks import is_step_from_rest
from wheelpend.logs.columns import ColumnTable
from wheelpend.logs.log import EXCERPT_SAMPLES, REST_SHARE, Log
from wheelpend.logs.noise import find_quantum, rounding_sigma
from wheelpend.logs.white_noise import difference_noise
from wheelpend.numerics import last_true

LEAD_S = 0.2  # of rest before a step with which a log begins: longer than a command is remembered
GATHERED_SHARE, MIN_FIRST_STEPS = 0.6, 3  # of the largest step: until then, and so many at least, a parabola fits
MIN_ROWS_BEFORE, MIN_SPEED_SIGMAS = 0.6, 2.0  # of such a gain, and of that speed's error, from which on it had set out
REST_BAND_SIGMAS = 12.0  # of a channel's noise, that its readings spread at rest: a hundred million reach 11.5
MAX_REST_SIGMAS = 2.0  # of it, that they scatter about their mean: a swing within that band scatters more
STANDSTILL_BAND_SIGMAS = 6.0  # standard deviations within which a position stays that stands still
STANDSTILL_BAND_STEPS = 2.01  # steps of a quantised one: the reading next to an edge flickers, the gears give a little
MIN_STANDSTILL_S = 0.1  # s
MIN_STANDSTILL_SAMPLES = 6  # that a swing does not spend where it turns


def standstill_band(sigma: np.ndarray, quantum: np.ndarray) -> np.ndarray:
    """The band (channels,) within which positions of this noise and step (channels,) stay that stand still."""
    return np.maximum(STANDSTILL_BAND_SIGMAS * sigma, STANDSTILL_BAND_STEPS * quantum)


def standstill_times(t: np.ndarray, signal: np.ndarray, band: float) -> list[tuple[float, float]]:
    """Times from and to [s], some time and a few samples apart, between which a signal (N,) stays within a band."""
    known = np.flatnonzero(np.isfinite(signal))
    t, values, found, first = t[known], signal[known].tolist(), [], 0
    low = high = values[0] if values else 0.0
    for k in range(1, len(values) + 1):
        if k < len(values) and max(high, values[k]) - min(low, values[k]) <= band:
            low, high = min(low, values[k]), max(high, values[k])
            continue
        if t[k - 1] - t[first] >= MIN_STANDSTILL_S and k - first >= MIN_STANDSTILL_SAMPLES:
            found.append((float(t[first]), float(t[k - 1])))
        first = min(k, len(values) - 1)
        low = high = values[first]
    return found


def rest_begin(log: Log, sigma: Sequence[float] | np.ndarray, share: float = REST_SHARE) -> int:
    """The first sample after which no channel of noise sigma (channels,) moves until the log ends.

    A channel stands still within a ``share`` of its range, or its noise. The number of samples where it moves to the
    end. Of a long log some 400 000 samples are looked at.
    """
    every = max(1, len(log) // EXCERPT_SAMPLES)
    seen = log.measured[::every]
    still = min(_still_values(values[::-1], own, share) for values, own in zip(seen.T, sigma, strict=True))
    return min(every * (len(seen) - still), len(log)) if still > 1 else len(log)


def rest_end(log: Log, sigma: Sequence[float] | np.ndarray) -> int:
    """The first sample, up to which no channel of noise sigma (channels,) has moved since the log began."""
    every = max(1, len(log) // EXCERPT_SAMPLES)
    seen = log.measured[::every]
    still = min(_still_values(values, own, REST_SHARE) for values, own in zip(seen.T, sigma, strict=True))
    return min(every * still, len(log))


def _still_values(channel: np.ndarray, sigma: float, share: float) -> int:
    """How many of a channel's values (n,), from the first on, stay in its band."""
    spread = np.fmax.accumulate(channel) - np.fmin.accumulate(channel)
    part = share * float(np.nanmax(channel) - np.nanmin(channel))
    still = int(np.count_nonzero(~(spread > max(part, REST_BAND_SIGMAS * sigma))))  # nothing read: nothing moved
    scatter = _growing_deviation(channel[:still])
    return int(last_true(scatter <= max(MAX_REST_SIGMAS * sigma, part))[-1]) + 1 if still else 0


def _growing_deviation(values: np.ndarray) -> np.ndarray:
    """Standard deviation of the first one, two, ... of values (n,), of those that are known."""
    known = np.isfinite(values)
    centred = np.where(known, values - (np.nanmean(values) if known.any() else 0.0), 0.0)
    count = np.maximum(np.cumsum(known), 1)
    mean = np.cumsum(centred) / count
    return np.sqrt(np.maximum(np.cumsum(centred**2) / count - mean**2, 0.0))


def led_by_rest(log: Log, table: ColumnTable) -> Log:
    """A log that begins with a step from rest, led by a time of rest without a command; any other as it is.

    What was commanded before a log begins is unknown, and its first moments are left out where an actuator may
    remember it. But a machine that rests at first, and that the first command sets in motion while it is held, was not
    driven before, and stood where it is first seen. Of a fast motor these moments are all that shows how it gathers
    speed.
    """
    places = [log.channels.index(c) for c in table.places]
    known = np.isfinite(log.voltage[:1]).all() and log.voltage[:1].any() and np.isfinite(log.measured[0, places]).all()
    held = log.measured[: _held_until(log)]
    by_name = dict(zip(log.channels, held.T, strict=True))
    rests = is_step_from_rest(by_name, table) and not any(_had_set_out(held[:, k]) for k in places)
    if log.lead or not known or not rests or not _moves_in(log, held):
        return log
    lead = math.ceil(LEAD_S / log.dt)
    seen = np.full((lead, len(log.channels)), np.nan)
    seen[0, places] = log.measured[0, places]
    return replace(
        log,
        t=np.concatenate([log.t[0] + log.dt * np.arange(-lead, 0), log.t]),
        voltage=np.concatenate([np.zeros((lead, *log.voltage.shape[1:])), log.voltage]),
        measured=np.concatenate([seen, log.measured]),
        reference=None
        if log.reference is None
        else np.concatenate([np.repeat(log.reference[:1], lead), log.reference]),
        breaks=tuple(k + lead for k in log.breaks),
        lead=lead,
    )


def _had_set_out(place: np.ndarray) -> bool:
    """True of a place (N,) that moves in its first sample: as fast as it is after most of a row of acceleration.

    By a parabola of its speed through the steps until it has gained most of its speed.
    """
    sizes = np.abs(np.diff(place))
    count = int(np.argmax(sizes > GATHERED_SHARE * np.nanmax(sizes, initial=0.0))) + 1
    steps = np.diff(place[: max(count, MIN_FIRST_STEPS) + 1])
    if len(steps) < MIN_FIRST_STEPS or not np.isfinite(steps).all():
        return False
    at_once = np.linalg.pinv(np.vander(np.arange(len(steps)) + 0.5, 3, increasing=True))  # speed, and what it gains
    speed, gain = float(at_once[0] @ steps), float(at_once[1] @ steps)
    error = rounding_sigma(find_quantum(place)) or difference_noise(place)
    error *= float(np.linalg.norm(np.diff(at_once[0], prepend=0.0, append=0.0)))  # each reading is in two steps
    return speed * gain > 0.0 and bool(abs(speed) > max(MIN_ROWS_BEFORE * abs(gain), MIN_SPEED_SIGMAS * error))


def _held_until(log: Log) -> int:
    """The first sample at which a command changes, or which follows a gap or a jump of a sensor; else the log's end."""
    ends = (log.inputs[:, 1:] != log.inputs[:, :1]).any(axis=0) | (np.diff(log.t) > log.longest_interval)
    return min([*(np.flatnonzero(ends)[:1] + 1).tolist(), *log.breaks[:1], len(log)])


def _moves_in(log: Log, part: np.ndarray) -> bool:
    """True where in a part (n, channels) of a log one leaves its first value by more than a share of its range."""
    left, most = (np.nanmax(np.abs(values - log.measured[0]), axis=0) for values in (part, log.measured))
    return bool(np.any(left > REST_SHARE * most))  # where the first is unknown, nothing is known
