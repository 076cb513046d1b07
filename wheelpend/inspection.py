"""Looks a log over before any physics is blamed: clock, gaps, ranges, noise, standstill, and faults of its wiring."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from wheelpend import sensors
from wheelpend.faults import find_faults
from wheelpend.findings import Cures, Finding
from wheelpend.logs import CHANNELS, GAP, ColumnMap, Log

LONGEST = 40_000  # samples in which a step of the input is looked for
QUIET = 0.5  # s that a signal must stay the same to be called still


@dataclass(frozen=True)
class Inspection:
    """What a log is like, and what is wrong with it."""

    samples: int
    duration_s: float
    rate_hz: float  # 1 / median interval
    jitter: float  # standard deviation of the intervals over their median, gaps left out
    gaps: dict[str, float]  # count, longest [s]
    channels: dict[str, dict[str, float]]  # minimum, maximum, noise, quantum [unit of the channel], missing [share]
    findings: tuple[Finding, ...]
    proposal: str  # lines for model.toml that would cure the findings; empty when there is nothing to propose

    def to_json(self) -> dict:
        """Plain values under stable names; a number that is unknown is None."""
        return {
            "schema": 1,
            "samples": self.samples,
            "duration_s": self.duration_s,
            "rate_hz": self.rate_hz,
            "jitter": self.jitter,
            "gaps": dict(self.gaps),
            "channels": {c: {k: _finite(v) for k, v in row.items()} for c, row in self.channels.items()},
            "findings": [{**f._asdict(), "size": _finite(f.size)} for f in self.findings],
            "proposal": self.proposal,
        }


def inspect_log(
    log: Log,
    *,
    relative: bool = False,
    noise: sensors.Noise | None = None,
    columns: Mapping[str, ColumnMap] | None = None,
) -> Inspection:
    """Look a log over before a model is fitted to it.

    ``relative`` says that theta_w is measured against the body; ``columns`` are those with which the log was read, for
    the proposal. Nothing is concluded on signs, units and clocks from a log that moves too little.
    """
    noise = noise or sensors.sensor_noise(log, {}, {})
    interval = np.diff(log.t)
    gaps = interval[interval > GAP * log.dt]
    cures = Cures(columns or {})
    findings = [*find_gaps(log), *find_still(log, noise)]
    if set(CHANNELS) <= set(log.channels):
        findings += find_faults(log, relative, cures)
    return Inspection(
        samples=len(log),
        duration_s=log.duration,
        rate_hz=1.0 / log.dt,
        jitter=float(np.std(interval[interval <= GAP * log.dt]) / log.dt),
        gaps={"count": len(gaps), "longest": float(gaps.max(initial=0.0))},
        channels=describe(log, noise),
        findings=tuple(findings),
        proposal=cures.text(),
    )


def describe(log: Log, noise: sensors.Noise) -> dict[str, dict[str, float]]:
    """Range, noise, step and share of missing samples of the input and of every channel."""
    rows = [("v_in", log.voltage, 0.0, sensors.find_quantum(log.voltage[:LONGEST]))]
    rows += [(c, log.measured[:, k], noise.sigma[k], noise.quantum[k]) for k, c in enumerate(log.channels)]
    return {
        name: {
            "minimum": float(np.nanmin(values)),
            "maximum": float(np.nanmax(values)),
            "noise": float(sigma),
            "quantum": float(step),
            "missing": float(np.isnan(values).mean()),
        }
        for name, values, sigma, step in rows
    }


# ---- time axis and still signals


def find_gaps(log: Log) -> list[Finding]:
    """Intervals several times the usual one."""
    interval = np.diff(log.t)
    gaps = np.flatnonzero(interval > GAP * log.dt)
    if not len(gaps):
        return []
    k = int(gaps[np.argmax(interval[gaps])])
    count = "1 gap" if len(gaps) == 1 else f"{len(gaps)} gaps"
    sentence = f"{count} in the sampling, the longest {interval[k]:.3g} s after t = {log.t[k]:.6g} s."
    return [Finding("gap", "t", sentence, "Nothing to do: no segment spans a gap.", float(interval[k]))]


def find_still(log: Log, noise: sensors.Noise) -> list[Finding]:
    """Channels that repeat one value, the wheel also within one step of its encoder."""
    found = []
    for index, name in enumerate(log.channels):
        slack = 1.01 * noise.quantum[index] if name == "theta_w" else 0.0
        runs = [r for r in still_runs(log.measured[:, index], slack, log.dt) if log.t[r[1]] - log.t[r[0]] > QUIET]
        if not runs:
            continue
        total = sum(log.t[b] - log.t[a] for a, b in runs)
        a, b = max(runs, key=lambda r: log.t[r[1]] - log.t[r[0]])
        what = "The wheel stands still" if name == "theta_w" else f"{name} repeats one value"
        sentence = (
            f"{what} for {total:.3g} s in all, the longest time {log.t[b] - log.t[a]:.3g} s from t = {log.t[a]:.6g} s."
        )
        cure = "Little can be learnt from such stretches; if the machine did move, check this sensor."
        found.append(Finding("stand_still", name, sentence, cure, float(total)))
    return found


def still_runs(signal: np.ndarray, slack: float, dt: float) -> list[tuple[int, int]]:
    """First and last samples of stretches of at least half of QUIET within which a signal stays within slack."""
    width = max(int(0.5 * QUIET / dt), 2)
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


def _finite(value: float | None) -> float | None:
    """The number, or None where there is none."""
    return float(value) if value is not None and math.isfinite(value) else None
