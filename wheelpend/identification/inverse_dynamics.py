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
from wheelpend.estimation.least_squares import LinearFit, acting_input, equations_at, solve_least_squares
from wheelpend.estimation.parameters import kernel_parameters
from wheelpend.estimation.state_reconstruction import fill_gaps, states_from
from wheelpend.logs.log import Log, gapless_ranges

BUTTERWORTH_ORDER = 4  # of the Butterworth filter for positions and their derivatives
MOTION_CUTOFF_HZ = 100.0  # Hz, of that filter; less where the log is slow
PARALLEL_FILTER_CUTOFF_HZ = 50.0  # Hz, up to which both sides are compared
MIN_SAMPLES_PER_PERIOD = 5.0  # samples in a period of the fastest motion that is looked at
MIN_STRETCH_SAMPLES = 40  # samples in a stretch
BURST_THRESHOLD_SIGMAS = 6.0  # standard deviations, robustly estimated, from which a missing force stands out
MAX_FORCE_ERROR_PERCENT = 50.0  # % of the input that the equations leave, from which their moments say nothing
REVERSAL_MARGIN_S = 0.02  # s, within which a reversal is at a burst
SAMPLE_DELAY_TOLERANCE = 0.3  # of an interval, by which a sample may come late and still count as on time
FILTER_EDGE_S = 0.05  # s at either end of a stretch, where filters have not enough on one side


class RegressionEquations(NamedTuple):
    """Left side and regressor of the model's equations on the measured motion."""

    left: np.ndarray  # (N, rows)
    regressor: np.ndarray  # (N, rows, n)


def inverse_dynamics(module: ModuleType, log: Log, parameters: np.ndarray) -> LinearFit:
    """Least squares on the measured motion; raises Failure where no stretch of the log is long enough."""
    sides = regression_equations(module, log, parameters)
    return solve_least_squares(module, sides.left, sides.regressor)


def force_error(module: ModuleType, log: Log, values: Mapping[str, float]) -> float | None:
    """What a model's equations leave of the left side, relative to it [%]; None where there is nothing to compare.

    The left side is the measured input, or for a machine that swings freely the pull of gravity.
    """
    return _force_error_percent(
        equations_by_stretch(module, log, kernel_parameters(module, values, log)),
        linear_parameter_values(module, values),
    )


def _force_error_percent(raws: Sequence[StretchEquations], estimate: np.ndarray) -> float | None:
    """The force error over some stretches."""
    sides = stacked_equations(raws)
    if sides is None:
        return None
    rest = sides.left - sides.regressor @ estimate
    size = float(np.sum(sides.left**2))
    return float(100.0 * np.sqrt(np.sum(rest**2) / size)) if size > 0.0 else None


def linear_parameter_values(module: ModuleType, values: Mapping[str, float]) -> np.ndarray:
    """Values of the regressor's parameters (n,); 0 of what a model has not."""
    return np.array([values.get(n, 0.0) for n in module.LINEAR])


class Burst(NamedTuple):
    """A short stretch in which the equations miss far more force than usual."""

    low: float  # s, from
    high: float  # s, to
    row: str
    peak: float  # largest missing force [unit of the input]
    at_reversal: bool  # whether something reverses there, where friction is hardest to know


def force_error_and_bursts(
    module: ModuleType, log: Log, values: Mapping[str, float]
) -> tuple[float | None, list[Burst]]:
    """The force error of a model, and where in time its equations miss far more force than usual, in order.

    Bursts are found at the full bandwidth of the differentiated motion: a push, or something that winds up and rings,
    is short. There are none where noise or a wrong model leave most of the input unexplained.
    """
    raws, estimate = (
        equations_by_stretch(module, log, kernel_parameters(module, values, log)),
        linear_parameter_values(module, values),
    )
    left = _force_error_percent(raws, estimate)
    if left is None or left > MAX_FORCE_ERROR_PERCENT:
        return left, []
    return left, sorted(b for raw in raws for b in _bursts_of_stretch(module, raw, raw.left - raw.regressor @ estimate))


def _bursts_of_stretch(module: ModuleType, raw: StretchEquations, rest: np.ndarray) -> list[Burst]:
    """Stretches of one run of samples in which the rest (N, rows) stands out."""
    found, smooth = [], butter(BUTTERWORTH_ORDER, raw.band, fs=1.0 / raw.dt, output="sos")
    edge, apart = int(np.ceil(FILTER_EDGE_S / raw.dt)), max(1, round(FILTER_EDGE_S / raw.dt))
    slips = raw.states[:, module.NQ :] @ np.array([*module.PORTS.values()]).T
    turns = np.flatnonzero((np.diff(np.sign(slips), axis=0) != 0).any(axis=1))
    for row, name in enumerate(module.ROWS):
        force = sosfiltfilt(smooth, rest[:, row])  # the measured side has more bandwidth than the motion
        usual = 1.48 * float(np.median(np.abs(force)))
        out = np.flatnonzero(np.abs(force) > BURST_THRESHOLD_SIGMAS * usual)
        out = out[(out >= edge) & (out < len(force) - edge)]
        for group in np.split(out, np.flatnonzero(np.diff(out) > apart) + 1) if len(out) else []:
            first, last = raw.t[group[0]], raw.t[group[-1]]
            beside = (raw.t[turns] > first - REVERSAL_MARGIN_S) & (raw.t[turns] < last + REVERSAL_MARGIN_S)
            peak = float(np.abs(force[group]).max())
            found.append(Burst(float(first), float(last), name, peak, bool(beside.any())))
    return found


def regression_equations(module: ModuleType, log: Log, parameters: np.ndarray) -> RegressionEquations:
    """Both sides of the equations, filtered alike and thinned, over all stretches of a log that are long enough."""
    sides = stacked_equations(equations_by_stretch(module, log, parameters))
    if sides is None:
        raise Failure(
            f"{log.name} must hold an uninterrupted stretch of at least {4 * FILTER_EDGE_S:g} s for its motion to be "
            "differentiated. Use `--method shooting`."
        )
    return sides


def equations_by_stretch(module: ModuleType, log: Log, parameters: np.ndarray) -> list[StretchEquations]:
    """The sides over every stretch of a log that is long enough."""
    found = (stretch_equations(module, log.part(a, b), parameters) for a, b in measured_stretches(log))
    return [raw for raw in found if raw is not None]


def stacked_equations(raws: Sequence[StretchEquations]) -> RegressionEquations | None:
    """Sides of several stretches, thinned; None where nothing is left."""
    kept = [s for s in map(_decimated_equations, raws) if s is not None]
    if not kept:
        return None
    return RegressionEquations(np.concatenate([s.left for s in kept]), np.concatenate([s.regressor for s in kept]))


def measured_stretches(log: Log) -> list[tuple[int, int]]:
    """Ranges of samples without a gap in which no channel is missing for longer than its motion may be unknown."""
    most, found = max(2, round(1.0 / (2.0 * MOTION_CUTOFF_HZ * log.dt))), []
    for a, b in gapless_ranges(log, 0, len(log)):
        lost = np.zeros(b - a, dtype=bool)
        for signal in log.measured[a:b].T:
            edges = np.flatnonzero(np.diff(np.concatenate(([0], np.isnan(signal).astype(int), [0]))))
            for first, last in edges.reshape(-1, 2):
                lost[first:last] |= last - first > most
        edges = np.flatnonzero(np.diff(np.concatenate(([0], (~lost).astype(int), [0]))))
        found += [(a + int(first), a + int(last)) for first, last in edges.reshape(-1, 2)]
    return found


class StretchEquations(NamedTuple):
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


def stretch_equations(module: ModuleType, log: Log, parameters: np.ndarray) -> StretchEquations | None:
    """The sides over one stretch; None where it is too short."""
    if len(log) < MIN_STRETCH_SAMPLES or log.duration < 4 * FILTER_EDGE_S:
        return None
    t = uniform_times(log.t)
    dt = float(t[1] - t[0])
    band = min(MOTION_CUTOFF_HZ, 1.0 / (MIN_SAMPLES_PER_PERIOD * dt))
    states, rates = smooth_motion(module, log, t, band)
    held = log.t.searchsorted(t + SAMPLE_DELAY_TOLERANCE * dt, side="right") - 1
    voltage = acting_input(module, log, parameters)[np.maximum(held, 0)]
    return StretchEquations(t, states, *equations_at(module, t, states, rates, voltage, parameters), band)


def _decimated_equations(raw: StretchEquations) -> RegressionEquations | None:
    """Sides filtered alike and thinned to what that lets through, clear of the ends; None where nothing is left."""
    left, regressor = raw.left, raw.regressor
    thin = max(1, round(1.0 / (2.0 * min(PARALLEL_FILTER_CUTOFF_HZ, 0.5 * raw.band) * raw.dt)))
    if thin > 1:
        left, regressor = (decimate(side, thin, axis=0) for side in (left, regressor))
    edge = int(np.ceil(FILTER_EDGE_S / (thin * raw.dt)))
    return RegressionEquations(left[edge:-edge], regressor[edge:-edge]) if len(left) > 4 * edge else None


def uniform_times(t: np.ndarray) -> np.ndarray:
    """As many times at equal distances, from the first sample to the last or nearly so."""
    return np.linspace(t[0], t[-1], len(t))


def smooth_motion(module: ModuleType, log: Log, t: np.ndarray, band: float) -> tuple[np.ndarray, np.ndarray]:
    """States (N, NX) and accelerations (N, NQ) at uniform times, from signals filtered forth and back."""
    dt = float(t[1] - t[0])
    sos = butter(BUTTERWORTH_ORDER, band, fs=1.0 / dt, output="sos")
    filled = [np.interp(t, log.t, fill_gaps(log.t, signal)) for signal in log.measured.T]
    values = np.column_stack([sosfiltfilt(sos, signal) for signal in filled])
    states = states_from(module, values, np.gradient(values, dt, axis=0))
    return states, np.gradient(states[:, module.NQ :], dt, axis=0)
