"""Stretches of a log in which samples are missing, a signal is constant or the machine stands still."""

from __future__ import annotations

import numpy as np

from wheelpend.estimation.criteria import DEFAULT_HORIZON_S
from wheelpend.inspection.findings import Finding
from wheelpend.logs.checks import INTERVAL_CURE, MOVE_CURE, silent_channels, stillness
from wheelpend.logs.columns import ColumnTable
from wheelpend.logs.log import Log, shortest_segment
from wheelpend.logs.noise import Noise
from wheelpend.logs.rest import standstill_band, standstill_times
from wheelpend.logs.runs import runs_of

MIN_CONSTANT_SIGNAL_S = 0.5  # s for which a signal must stay the same to count as constant


def find_gaps(log: Log) -> list[Finding]:
    """The finding on intervals longer than a log's own."""
    interval = np.diff(log.t)
    gaps = np.flatnonzero(interval > log.longest_interval)
    if not len(gaps):
        return []
    k = int(gaps[np.argmax(interval[gaps])])
    count = "1 gap" if len(gaps) == 1 else f"{len(gaps)} gaps"
    sentence = f"{count} in the sampling, the longest {interval[k]:.3g} s after t = {log.t[k]:.6g} s."
    longest = int(np.diff(np.r_[0, gaps + 1, len(log.t)]).max())
    needed = shortest_segment(log, DEFAULT_HORIZON_S)
    cure = (
        "Nothing to do: no segment spans a gap."
        if longest >= needed
        else f"No stretch without a gap has the {needed} samples that a fit needs: log every row. If rows were sampled "
        f"evenly, and only arrived together, {INTERVAL_CURE}."
    )
    return [Finding("gap", "t", sentence, cure, float(interval[k]))]


def find_no_excitation(log: Log, table: ColumnTable) -> list[Finding]:
    """The finding that nothing moves, and so that nothing can be identified."""
    sentence = stillness(log, table)
    cure = MOVE_CURE.format(words=table.words)
    return [Finding("no_excitation", " and ".join(log.channels), sentence, cure, None)] if sentence else []


def find_silent_channels(log: Log, table: ColumnTable) -> list[Finding]:
    """The findings on sensors that are not there: rates that never change, channels that are hardly read."""
    found = silent_channels(log, table).items()
    return [Finding("silent_sensor", name, sentence, cure, None) for name, (sentence, cure) in found]


def constant_signal_times(log: Log, noise: Noise, table: ColumnTable) -> dict[str, list[tuple[float, float]]]:
    """Times from and to [s] between which each channel stays the same, a quantised position within a step."""
    found: dict[str, list[tuple[float, float]]] = {}
    for index, name in enumerate(log.channels):
        band = 1.01 * noise.quantum[index] if name in position_channels(log, table) else 0.0
        runs = constant_runs(log.measured[:, index], band, log.dt)
        times = [(float(log.t[a]), float(log.t[b])) for a, b in runs if log.t[b] - log.t[a] > MIN_CONSTANT_SIGNAL_S]
        found |= {name: times} if times else {}
    return found


def position_channels(log: Log, table: ColumnTable) -> list[str]:
    """Channels of angle or position, such as an encoder's, without the one whose range is limited."""
    return [c for c in log.channels if table.units.get(c) in ("rad", "m") and c != table.range_channel]


def standstills(log: Log, noise: Noise, table: ColumnTable) -> dict[str, list[tuple[float, float]]]:
    """Times from and to [s] between which positions stay the same within noise and a step each way, by channel."""
    bands = standstill_band(noise.sigma, noise.quantum)
    known = [(k, c) for k, c in enumerate(log.channels) if c in position_channels(log, table)]
    found = {c: standstill_times(log.t, log.measured[:, k], float(bands[k])) for k, c in known}
    return {c: times for c, times in found.items() if times}


def constant_runs(signal: np.ndarray, band: float, dt: float) -> list[tuple[int, int]]:
    """First and last samples of stretches in which a signal (N,) stays within a band.

    Blocks of half of MIN_CONSTANT_SIGNAL_S are compared, so that a stretch is at least as long as one.
    """
    width = max(int(0.5 * MIN_CONSTANT_SIGNAL_S / dt), 2)
    blocks = len(signal) // width
    if not blocks:
        return []
    cut = signal[: blocks * width].reshape(blocks, width)
    still = np.ptp(cut, axis=1) <= band
    level = cut[:, 0]
    runs = []
    for first, last in runs_of(still):
        begin = first
        for k in range(first + 1, last + 1):  # a run ends where its level changes
            if k == last or abs(level[k] - level[begin]) > band:
                runs.append((int(begin) * width, int(k) * width - 1))
                begin = k
    return runs
