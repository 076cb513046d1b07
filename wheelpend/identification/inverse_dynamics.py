"""Inverse dynamics: the input that a model needs for the measured motion, against the one that was measured.

The robotics way of identification (Gautier 1997; Janot, Vandanjon, Gautier 2014): positions are filtered without phase
and differentiated, put into the regressor, and both sides are filtered alike and thinned before least squares. The
input is taken as it stands at the sample, as there. The relative force error is what the equations leave of the input.
It needs a log with little noise.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from types import ModuleType
from typing import NamedTuple

import numpy as np
from scipy.signal import butter, decimate, sosfiltfilt

from wheelpend.errors import Failure
from wheelpend.estimation.least_squares import LinearFit, acting_input, equations_at, solve
from wheelpend.estimation.parameters import vector
from wheelpend.estimation.state_reconstruction import fill_gaps, states_from
from wheelpend.logs.log import Log, stretches

ORDER = 4  # of the Butterworth filter for positions and their derivatives
BANDWIDTH = 100.0  # Hz, of that filter; less where the log is slow
PARALLEL = 50.0  # Hz, up to which both sides are compared
SLOWEST = 5.0  # samples in a period of the fastest motion that is looked at
FEWEST = 40  # samples in a stretch
STANDS_OUT = 6.0  # standard deviations, robustly estimated, from which a missing force stands out
UNTRUSTED = 50.0  # % of the input that the equations leave, from which their moments say nothing
BESIDE = 0.02  # s, within which a reversal is at a burst
NEARLY = 0.3  # of an interval, by which a sample may come late and still count as on time
ENDS = 0.05  # s at either end of a stretch, where filters have not enough on one side


class Sides(NamedTuple):
    """Left side and regressor of the model's equations on the measured motion."""

    left: np.ndarray  # (N, rows)
    regressor: np.ndarray  # (N, rows, n)


def inverse_dynamics(module: ModuleType, log: Log, parameters: np.ndarray) -> LinearFit:
    """Least squares on the measured motion; raises Failure where no stretch of the log is long enough."""
    sides = sides_of(module, log, parameters)
    return solve(module, sides.left, sides.regressor)


def force_error(module: ModuleType, log: Log, values: Mapping[str, float]) -> float | None:
    """What a model's equations leave of the left side, relative to it [%]; None where there is nothing to compare.

    The left side is the measured input, or for a machine that swings freely the pull of gravity.
    """
    return _error(raws_of(module, log, vector(module, values, log)), estimate_of(module, values))


def _error(raws: Sequence[Raw], estimate: np.ndarray) -> float | None:
    """The force error over some stretches."""
    sides = together(raws)
    if sides is None:
        return None
    rest = sides.left - sides.regressor @ estimate
    size = float(np.sum(sides.left**2))
    return float(100.0 * np.sqrt(np.sum(rest**2) / size)) if size > 0.0 else None


def estimate_of(module: ModuleType, values: Mapping[str, float]) -> np.ndarray:
    """Values of the regressor's parameters (n,); 0 of what a model has not."""
    return np.array([values.get(n, 0.0) for n in module.LINEAR])


class Burst(NamedTuple):
    """A short stretch in which the equations miss far more force than usual."""

    low: float  # s, from
    high: float  # s, to
    row: str
    peak: float  # largest missing force [unit of the input]
    at_reversal: bool  # whether something reverses there, where friction is hardest to know


def forces(module: ModuleType, log: Log, values: Mapping[str, float]) -> tuple[float | None, list[Burst]]:
    """The force error of a model, and where in time its equations miss far more force than usual, in order.

    Bursts are found at the full bandwidth of the differentiated motion: a push, or something that winds up and rings,
    is short. There are none where noise or a wrong model leave most of the input unexplained.
    """
    raws, estimate = raws_of(module, log, vector(module, values, log)), estimate_of(module, values)
    left = _error(raws, estimate)
    if left is None or left > UNTRUSTED:
        return left, []
    return left, sorted(b for raw in raws for b in _standing_out(module, raw, raw.left - raw.regressor @ estimate))


def _standing_out(module: ModuleType, raw: Raw, rest: np.ndarray) -> list[Burst]:
    """Stretches of one run of samples in which the rest (N, rows) stands out."""
    found, smooth = [], butter(ORDER, raw.band, fs=1.0 / raw.dt, output="sos")
    edge, apart = int(np.ceil(ENDS / raw.dt)), max(1, round(ENDS / raw.dt))
    slips = raw.states[:, module.NQ :] @ np.array([*module.PORTS.values()]).T
    turns = np.flatnonzero((np.diff(np.sign(slips), axis=0) != 0).any(axis=1))
    for row, name in enumerate(module.ROWS):
        force = sosfiltfilt(smooth, rest[:, row])  # the measured side has more bandwidth than the motion
        usual = 1.48 * float(np.median(np.abs(force)))
        out = np.flatnonzero(np.abs(force) > STANDS_OUT * usual)
        out = out[(out >= edge) & (out < len(force) - edge)]
        for group in np.split(out, np.flatnonzero(np.diff(out) > apart) + 1) if len(out) else []:
            first, last = raw.t[group[0]], raw.t[group[-1]]
            beside = (raw.t[turns] > first - BESIDE) & (raw.t[turns] < last + BESIDE)
            peak = float(np.abs(force[group]).max())
            found.append(Burst(float(first), float(last), name, peak, bool(beside.any())))
    return found


def sides_of(module: ModuleType, log: Log, parameters: np.ndarray) -> Sides:
    """Both sides of the equations, filtered alike and thinned, over all stretches of a log that are long enough."""
    sides = together(raws_of(module, log, parameters))
    if sides is None:
        raise Failure(f"{log.name} must hold an uninterrupted stretch of at least {4 * ENDS:g} s for its motion to be "
                      "differentiated. Use `--method shooting`.")  # fmt: skip
    return sides


def raws_of(module: ModuleType, log: Log, parameters: np.ndarray) -> list[Raw]:
    """The sides over every stretch of a log that is long enough."""
    found = (raw_sides(module, log.part(a, b), parameters) for a, b in measured_stretches(log))
    return [raw for raw in found if raw is not None]


def together(raws: Sequence[Raw]) -> Sides | None:
    """Sides of several stretches, thinned; None where nothing is left."""
    kept = [s for s in map(_thinned, raws) if s is not None]
    if not kept:
        return None
    return Sides(np.concatenate([s.left for s in kept]), np.concatenate([s.regressor for s in kept]))


def measured_stretches(log: Log) -> list[tuple[int, int]]:
    """Ranges of samples without a gap in which no channel is missing for longer than its motion may be unknown."""
    most, found = max(2, round(1.0 / (2.0 * BANDWIDTH * log.dt))), []
    for a, b in stretches(log, 0, len(log)):
        lost = np.zeros(b - a, dtype=bool)
        for signal in log.measured[a:b].T:
            edges = np.flatnonzero(np.diff(np.concatenate(([0], np.isnan(signal).astype(int), [0]))))
            for first, last in edges.reshape(-1, 2):
                lost[first:last] |= last - first > most
        edges = np.flatnonzero(np.diff(np.concatenate(([0], (~lost).astype(int), [0]))))
        found += [(a + int(first), a + int(last)) for first, last in edges.reshape(-1, 2)]
    return found


class Raw(NamedTuple):
    """The sides over one stretch at evenly spaced times, and the motion that they were made of."""

    t: np.ndarray  # (N,) s
    states: np.ndarray  # (N, NX)
    left: np.ndarray  # (N, rows)
    regressor: np.ndarray  # (N, rows, n)
    band: float  # Hz, of the motion

    @property
    def dt(self) -> float:
        """Distance of the times [s]."""
        return float(self.t[1] - self.t[0])


def raw_sides(module: ModuleType, log: Log, parameters: np.ndarray) -> Raw | None:
    """The sides over one stretch; None where it is too short."""
    if len(log) < FEWEST or log.duration < 4 * ENDS:
        return None
    t = evenly(log.t)
    dt = float(t[1] - t[0])
    band = min(BANDWIDTH, 1.0 / (SLOWEST * dt))
    states, rates = smooth_motion(module, log, t, band)
    held = log.t.searchsorted(t + NEARLY * dt, side="right") - 1
    voltage = acting_input(module, log, parameters)[np.maximum(held, 0)]
    return Raw(t, states, *equations_at(module, t, states, rates, voltage, parameters), band)


def _thinned(raw: Raw) -> Sides | None:
    """Sides filtered alike and thinned to what that lets through, clear of the ends; None where nothing is left."""
    left, regressor = raw.left, raw.regressor
    thin = max(1, round(1.0 / (2.0 * min(PARALLEL, 0.5 * raw.band) * raw.dt)))
    if thin > 1:
        left, regressor = (decimate(side, thin, axis=0) for side in (left, regressor))
    edge = int(np.ceil(ENDS / (thin * raw.dt)))
    return Sides(left[edge:-edge], regressor[edge:-edge]) if len(left) > 4 * edge else None


def evenly(t: np.ndarray) -> np.ndarray:
    """As many times at equal distances, from the first sample to the last or nearly so."""
    return np.linspace(t[0], t[-1], len(t))


def smooth_motion(module: ModuleType, log: Log, t: np.ndarray, band: float) -> tuple[np.ndarray, np.ndarray]:
    """States (N, NX) and accelerations (N, NQ) at uniform times, from signals filtered forth and back."""
    dt = float(t[1] - t[0])
    sos = butter(ORDER, band, fs=1.0 / dt, output="sos")
    filled = [np.interp(t, log.t, fill_gaps(log.t, signal)) for signal in log.measured.T]
    values = np.column_stack([sosfiltfilt(sos, signal) for signal in filled])
    states = states_from(module, values, np.gradient(values, dt, axis=0))
    return states, np.gradient(states[:, module.NQ :], dt, axis=0)
