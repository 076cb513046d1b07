"""Stretches of a log in which something repeats, rests or is missing."""

from __future__ import annotations

import math

import numpy as np

from wheelpend.inspection.findings import Finding
from wheelpend.logs import noise as sensors
from wheelpend.logs.columns import ColumnTable
from wheelpend.logs.log import GAP_INTERVAL_RATIO, Log

STANDSTILL_BAND_SIGMAS, MIN_STANDSTILL_S = (
    6.0,
    0.1,
)  # standard deviations within which a place stays, and seconds for which, to stand still
MIN_CONSTANT_SIGNAL_S = 0.5  # s that a signal must stay the same to be called still


def find_gaps(log: Log) -> list[Finding]:
    """Intervals several times the usual one."""
    interval = np.diff(log.t)
    gaps = np.flatnonzero(interval > GAP_INTERVAL_RATIO * log.dt)
    if not len(gaps):
        return []
    k = int(gaps[np.argmax(interval[gaps])])
    count = "1 gap" if len(gaps) == 1 else f"{len(gaps)} gaps"
    sentence = f"{count} in the sampling, the longest {interval[k]:.3g} s after t = {log.t[k]:.6g} s."
    return [Finding("gap", "t", sentence, "Nothing to do: no segment spans a gap.", float(interval[k]))]


def constant_signal_times(log: Log, noise: sensors.Noise, table: ColumnTable) -> dict[str, list[tuple[float, float]]]:
    """Times from and to [s] between which a channel stays the same, a place that is quantised within a step of it."""
    found: dict[str, list[tuple[float, float]]] = {}
    for index, name in enumerate(log.channels):
        slack = 1.01 * noise.quantum[index] if name in position_channels(log, table) else 0.0
        runs = constant_runs(log.measured[:, index], slack, log.dt)
        times = [(float(log.t[a]), float(log.t[b])) for a, b in runs if log.t[b] - log.t[a] > MIN_CONSTANT_SIGNAL_S]
        found |= {name: times} if times else {}
    return found


def position_channels(log: Log, table: ColumnTable) -> list[str]:
    """Channels that say where something is, such as an encoder; not the one by which the machine falls."""
    return [c for c in log.channels if table.units.get(c) in ("rad", "m") and c != table.range_channel]


def standstills(log: Log, sigma: np.ndarray, table: ColumnTable) -> dict[str, list[tuple[float, float]]]:
    """Times from and to [s] between which a place stays the same within its noise, for each channel where it does."""
    known = [(k, c) for k, c in enumerate(log.channels) if c in position_channels(log, table)]
    found = {c: standstill_times(log.t, log.measured[:, k], STANDSTILL_BAND_SIGMAS * float(sigma[k])) for k, c in known}
    return {c: times for c, times in found.items() if times}


def standstill_times(t: np.ndarray, signal: np.ndarray, slack: float) -> list[tuple[float, float]]:
    """Times from and to [s] between which a signal (N,) stays within a slack, not for less than REST."""
    known = np.flatnonzero(np.isfinite(signal))
    t, values, found, first = t[known], signal[known].tolist(), [], 0
    low = high = values[0] if values else 0.0
    for k in range(1, len(values) + 1):
        if k < len(values) and max(high, values[k]) - min(low, values[k]) <= slack:
            low, high = min(low, values[k]), max(high, values[k])
            continue
        if t[k - 1] - t[first] >= MIN_STANDSTILL_S:
            found.append((float(t[first]), float(t[k - 1])))
        first = min(k, len(values) - 1)
        low = high = values[first]
    return found


def constant_runs(signal: np.ndarray, slack: float, dt: float) -> list[tuple[int, int]]:
    """First and last samples of stretches of at least half of QUIET within which a signal stays within slack."""
    width = max(int(0.5 * MIN_CONSTANT_SIGNAL_S / dt), 2)
    blocks = len(signal) // width
    if not blocks:
        return []
    cut = signal[: blocks * width].reshape(blocks, width)
    still = np.ptp(cut, axis=1) <= slack
    level = cut[:, 0]
    edges = np.flatnonzero(np.diff(np.concatenate(([0], still.astype(int), [0]))))
    runs = []
    for first, last in edges.reshape(-1, 2):
        begin = first
        for k in range(first + 1, last + 1):  # a run ends where its level changes
            if k == last or abs(level[k] - level[begin]) > slack:
                runs.append((int(begin) * width, int(k) * width - 1))
                begin = k
    return runs


def _finite_or_none(value: float | None) -> float | None:
    """The number, or None where there is none."""
    return float(value) if value is not None and math.isfinite(value) else None
