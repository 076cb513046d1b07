"""The signals of a log on a uniform grid, and the scan of a misfit over time shifts."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from wheelpend.logs.log import Log, gapless_ranges
from wheelpend.numerics import gaussian_smoothed

MAX_ANALYSED_SAMPLES = 40_000  # samples analysed for signs and clocks; of a longer log, those in its middle
MIN_ANALYSED_SAMPLES = 250  # samples, below which nothing is concluded on clocks, nor on signs of several places
MIN_SIGN_SAMPLES = 100  # samples, below which nothing is concluded on the sign of one place, nor on the scale of a rate
END_SAMPLES = 4  # of a stretch, that its uniform grid is shorter by at most
MIN_STRETCH_SAMPLES = 100  # samples of a stretch that is looked at beside others
MAX_SHIFT_SAMPLES = 30  # samples, the largest time shift looked for
MAX_SHORT_SHIFT_SAMPLES = 10  # the same in a log that is too short for clocks: more of it is left
MIN_SHIFT_SAMPLES = 2.5  # samples, the smallest time shift reported
JACKKNIFE_BLOCKS = 8  # blocks of a log, of which the jackknife makes a standard error
MIN_SMOOTHING_SIGMA_S = 0.03  # s, standard deviation of the finest Gaussian; at least 3 samples
MIN_ANALYSED_S = MIN_SMOOTHING_SIGMA_S * (2 * 4 + 0.5 * 4 * JACKKNIFE_BLOCKS)  # s of a stretch: its ends, and its rows
SMOOTHING_FACTORS = (1.0, 2.0, 4.0, 8.0)  # widths against the finest, increased until noise no longer matters
MIN_WHOLE_VALUES = 5  # different whole numbers from which on a column counts something
MAX_SWAPPED_MISFIT_SHARE = 0.05  # share of its power that an angle's derivative leaves of a signal that is its rate
DEGREES_PER_RADIAN = 180 / math.pi


class Signals(NamedTuple):
    """A stretch of a log on a uniform grid, without missing samples."""

    dt: float  # s
    voltage: np.ndarray  # (N,) mean of the input that acted within dt around each sample; 0 without just one input
    channels: dict[str, np.ndarray]  # (N,) each
    input: str  # its column
    smoothing_factor: float = 1.0  # of the smoothing, against the finest

    @property
    def is_long(self) -> bool:
        """True where there are enough samples to conclude anything on clocks."""
        return len(self.voltage) >= MIN_ANALYSED_SAMPLES - END_SAMPLES

    @property
    def max_shift(self) -> int:
        """The largest time shift that is looked for [samples]."""
        return MAX_SHIFT_SAMPLES if self.is_long else MAX_SHORT_SHIFT_SAMPLES

    @property
    def width(self) -> float:
        """Standard deviation of the smoothing Gaussian [s]."""
        return self.smoothing_factor * max(MIN_SMOOTHING_SIGMA_S, 3 * self.dt)

    @property
    def rows(self) -> np.ndarray:
        """Indices of the samples that are used, clear of the ends, as dense as smoothing leaves information."""
        margin = int(4 * self.width / self.dt) + self.max_shift + 1
        return np.arange(margin, len(self.voltage) - margin, max(int(0.5 * self.width / self.dt), 1))

    def since(self, first: int) -> Signals:
        """The signals from a sample on."""
        later = {name: values[first:] for name, values in self.channels.items()}
        return self._replace(voltage=self.voltage[first:], channels=later)

    def smooth(self, name: str, order: int = 0) -> np.ndarray:
        """A derivative of a channel, or of the input, behind the Gaussian (N,)."""
        signal = self.voltage if name == self.input else self.channels[name]
        result = gaussian_smoothed(signal, self.width / self.dt)
        for _ in range(order):  # differences keep a constant exactly at zero, truncated Gaussians do not
            result = np.gradient(result, self.dt)
        return result


class TimeShift(NamedTuple):
    """The optimum of a scan over time shifts."""

    samples: float  # by which the shifted signal is late
    sigma: float  # standard error [samples]
    gain: float  # unexplained power at no shift over that at the optimum
    share: float  # unexplained share of the power at the optimum
    blocks: np.ndarray  # (JACKKNIFE_BLOCKS,) that share, block by block

    def is_significant(self, gain: float) -> bool:
        """True of a shift that is large, five standard errors from 0, inside the range scanned, and of enough gain."""
        inside = MIN_SHIFT_SAMPLES <= abs(self.samples) < MAX_SHIFT_SAMPLES - 0.5
        return inside and abs(self.samples) > 5 * self.sigma and self.gain > gain


def uniform_signals(
    log: Log, input: str, *, in_range: bool, all_needed: bool = True, least: int = MIN_ANALYSED_SAMPLES
) -> Signals | None:
    """The log's longest gapless stretch on a uniform grid, at most MAX_ANALYSED_SAMPLES; None of less than ``least``.

    ``in_range`` leaves out samples beyond the plant's range; ``input`` is the column of its only input, if any.
    A channel that is read too seldom is left out, or leaves nothing to analyse where ``all_needed``.
    """
    runs = gapless_ranges(log if in_range else replace(log, range_channel=""), 0, len(log))
    first, last = max(runs, key=lambda r: r[1] - r[0], default=(0, 0))
    spare = max(last - first - MAX_ANALYSED_SAMPLES, 0) // 2
    first, last = first + spare, last - spare
    if last - first < least:
        return None
    found = _signals_of(log, first, last, input)
    if found is None or (all_needed and len(found.channels) < len(log.channels)):
        return None
    return found if len(found.rows) >= 4 * JACKKNIFE_BLOCKS else None


def all_signals(log: Log) -> tuple[Signals, ...]:
    """Every gapless stretch of a log that leaves a few samples clear of its ends, with the channels that it has."""
    runs = gapless_ranges(replace(log, range_channel=""), 0, min(len(log), MAX_ANALYSED_SAMPLES))
    found = (_signals_of(log, first, last, "") for first, last in runs if last - first >= MIN_STRETCH_SAMPLES)
    return tuple(s for s in found if s is not None and len(s.rows) >= JACKKNIFE_BLOCKS)


def _signals_of(log: Log, first: int, last: int, input: str) -> Signals | None:
    """A stretch of a log on a uniform grid, with the channels that are read often enough; None without any."""
    t, dt = log.t[first:last], log.dt
    grid = np.arange(t[0] + dt, t[-1] - dt, dt)
    held = log.voltage[first : last - 1] if log.voltage.ndim == 1 else np.zeros(last - first - 1)
    charge = np.concatenate(([0.0], np.cumsum(held * np.diff(t))))  # V s; V is held
    edges = np.append(grid, grid[-1] + dt) - 0.5 * dt
    channels = {}
    for name, values in zip(log.channels, log.measured[first:last].T, strict=True):
        known = np.isfinite(values)
        if known.sum() >= MIN_STRETCH_SAMPLES:
            channels[name] = np.interp(grid, t[known], values[known])
    return Signals(dt, np.diff(np.interp(edges, t, charge)) / dt, channels, input) if channels else None


def with_channel(log: Log, name: str, values: np.ndarray) -> Log:
    """The log with other values (N,) of one channel."""
    measured = log.measured.copy()
    measured[:, log.channels.index(name)] = values
    return replace(log, measured=measured)


def channel_values(log: Log, name: str) -> np.ndarray:
    """Measured values (N,) of a channel."""
    return log.measured[:, log.channels.index(name)]


def is_whole(values: np.ndarray) -> bool:
    """True of readings that are all whole numbers, more than a few of them: counts."""
    known = values[np.isfinite(values)]
    return bool(known.size and (known == np.round(known)).all() and len(np.unique(known)) > MIN_WHOLE_VALUES)


def share_in_common(one: np.ndarray, other: np.ndarray) -> float:
    """Share of a signal's power (N,) about its mean that another one explains."""
    if not (np.ptp(one) and np.ptp(other)):
        return 0.0
    return float(np.corrcoef(one, other)[0, 1] ** 2)


def block_sums(squares: np.ndarray) -> np.ndarray:
    """Sums (JACKKNIFE_BLOCKS,) over consecutive blocks."""
    return np.array([block.sum() for block in np.array_split(squares, JACKKNIFE_BLOCKS)])


def scan_time_shifts(residual: Callable[[int], tuple[np.ndarray, float]], most: int = MAX_SHIFT_SAMPLES) -> TimeShift:
    """Time shift of least squares; ``residual`` gives residuals and total power of a fit at a shift [samples].

    Shifts of up to so many samples, ``most``, are looked at, of both signs.

    The standard error is that of the jackknife over JACKKNIFE_BLOCKS.
    """
    shares = []
    for k in range(-most, most + 1):
        rest, power = residual(k)
        shares.append(block_sums(rest**2) / power)
    table = np.array(shares)  # (shifts, blocks)
    total = table.sum(axis=1)
    replicates = [parabolic_minimum(total - table[:, b]) for b in range(JACKKNIFE_BLOCKS)]
    sigma = math.sqrt((JACKKNIFE_BLOCKS - 1) * float(np.var(replicates)))
    best = int(np.argmin(total))
    gain = float(total[most] / total[best])
    return TimeShift(parabolic_minimum(total), sigma, gain, float(total[best]), table[best])


def parabolic_minimum(costs: np.ndarray) -> float:
    """Shift [samples] of least cost, by a parabola through the three lowest neighbours."""
    k, middle = int(np.argmin(costs)), len(costs) // 2
    if k in (0, len(costs) - 1):
        return float(k - middle)
    curvature = costs[k - 1] - 2 * costs[k] + costs[k + 1]
    return k - middle + (float(0.5 * (costs[k - 1] - costs[k + 1]) / curvature) if curvature > 0 else 0.0)
