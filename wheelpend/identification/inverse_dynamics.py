"""Inverse dynamics: the input that a model needs for the measured motion, against the one that was measured.

Identification as in robotics (Gautier 1997; Janot, Vandanjon, Gautier 2014): positions are filtered with zero phase and
differentiated, put into the regressor, and both sides are filtered in parallel and decimated before least squares. The
input is taken as it stands at the sample, as there. The force error is the residual relative to the input. The method
needs a log with little noise.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from scipy.signal import butter, decimate, sosfiltfilt

from wheelpend.errors import Failure
from wheelpend.estimation.linear_fit import LinearFit, solve_least_squares
from wheelpend.estimation.parameters import kernel_parameters
from wheelpend.estimation.regressor import acting_input, equations_at
from wheelpend.estimation.state_reconstruction import fill_gaps, states_from
from wheelpend.kernels.kernel_module import KernelModule
from wheelpend.logs.log import Log, gapless_ranges

BUTTERWORTH_ORDER = 4  # of the Butterworth filter for positions and their derivatives
MOTION_CUTOFF_HZ = 100.0  # Hz, of that filter; less where the log is slow
PARALLEL_FILTER_CUTOFF_HZ = 50.0  # Hz, up to which both sides are compared
MIN_SAMPLES_PER_PERIOD = 5.0  # samples in a period of the fastest motion that is passed
MIN_STRETCH_SAMPLES = 40  # samples in a stretch
BURST_THRESHOLD_SIGMAS = 6.0  # robust standard deviations above which a missing force is a burst
SIGMA_PER_MEDIAN_DEVIATION = 1.48  # standard deviation of Gaussian noise over its median absolute value
MAX_FORCE_ERROR_PERCENT = 50.0  # residual in % of the input above which bursts are not sought
REVERSAL_MARGIN_S = 0.02  # s, within which a reversal is at a burst
SAMPLE_DELAY_TOLERANCE = 0.3  # of an interval: by so much a sample may be late and still count as on time
FILTER_EDGE_S = 0.05  # s at either end of a stretch, where the filters are not settled


class RegressionEquations(NamedTuple):
    """Left side and regressor of the model's equations on the measured motion."""

    left: np.ndarray  # (N, rows)
    regressor: np.ndarray  # (N, rows, n)


def inverse_dynamics(module: KernelModule, log: Log, parameters: np.ndarray) -> LinearFit:
    """Least squares on the measured motion; raises Failure where no stretch of the log is long enough."""
    sides = regression_equations(module, log, parameters)
    return solve_least_squares(module, sides.left, sides.regressor)


def force_error(module: KernelModule, log: Log, values: Mapping[str, float]) -> float | None:
    """Residual of a model's equations relative to their left side [%]; None where there is nothing to compare.

    The left side is the measured input, or for a machine that swings freely the pull of gravity.
    """
    return _force_error_percent(
        equations_by_stretch(module, log, kernel_parameters(module, values, log)),
        linear_parameter_values(module, values),
    )


def _force_error_percent(stretches: Sequence[StretchEquations], estimate: np.ndarray) -> float | None:
    """Force error of an estimate (n,) over some stretches."""
    sides = stacked_equations(stretches)
    if sides is None:
        return None
    residual = sides.left - sides.regressor @ estimate
    size = float(np.sum(sides.left**2))
    return float(100.0 * np.sqrt(np.sum(residual**2) / size)) if size > 0.0 else None


def linear_parameter_values(module: KernelModule, values: Mapping[str, float]) -> np.ndarray:
    """Values of the regressor's parameters (n,), 0 where missing."""
    return np.array([values.get(n, 0.0) for n in module.LINEAR])


class Burst(NamedTuple):
    """A short time in which the residual of the equations is far larger than usual."""

    low: float  # s, from
    high: float  # s, to
    row: str  # name of the equation
    peak: float  # largest missing force [unit of the input]
    at_reversal: bool  # True where a port's speed changes its sign, where friction is least certain


def force_error_and_bursts(
    module: KernelModule, log: Log, values: Mapping[str, float]
) -> tuple[float | None, list[Burst]]:
    """Force error of a model [%], and the bursts of its residual, in the order of time.

    Bursts are sought at the full bandwidth of the differentiated motion: a push, or a stiff part that rings, is short.
    There are none where noise or a wrong model leave most of the input unexplained.
    """
    stretches = equations_by_stretch(module, log, kernel_parameters(module, values, log))
    estimate = linear_parameter_values(module, values)
    error = _force_error_percent(stretches, estimate)
    if error is None or error > MAX_FORCE_ERROR_PERCENT:
        return error, []
    residuals = [s.left - s.regressor @ estimate for s in stretches]
    pairs = zip(stretches, residuals, strict=True)
    return error, sorted(b for s, residual in pairs for b in _bursts_of_stretch(module, s, residual))


def _bursts_of_stretch(module: KernelModule, stretch: StretchEquations, residual: np.ndarray) -> list[Burst]:
    """Bursts in the residual (N, rows) of one stretch."""
    found, smooth = [], butter(BUTTERWORTH_ORDER, stretch.band, fs=1.0 / stretch.dt, output="sos")
    port_speeds = stretch.states[:, module.NQ :] @ np.array([*module.PORTS.values()]).T
    reversals = stretch.t[np.flatnonzero((np.diff(np.sign(port_speeds), axis=0) != 0).any(axis=1))]
    for row, name in enumerate(module.ROWS):
        force = sosfiltfilt(smooth, residual[:, row])  # the measured side has more bandwidth than the motion
        for group in _outlier_groups(force, stretch.dt):
            first, last = stretch.t[group[0]], stretch.t[group[-1]]
            beside = (reversals > first - REVERSAL_MARGIN_S) & (reversals < last + REVERSAL_MARGIN_S)
            peak = float(np.abs(force[group]).max())
            found.append(Burst(float(first), float(last), name, peak, bool(beside.any())))
    return found


def _outlier_groups(force: np.ndarray, dt: float) -> list[np.ndarray]:
    """Samples, clear of the ends, at which a missing force (N,) stands out, grouped where they are close together."""
    edge, gap = int(np.ceil(FILTER_EDGE_S / dt)), max(1, round(FILTER_EDGE_S / dt))
    sigma = SIGMA_PER_MEDIAN_DEVIATION * float(np.median(np.abs(force)))
    outliers = np.flatnonzero(np.abs(force) > BURST_THRESHOLD_SIGMAS * sigma)
    outliers = outliers[(outliers >= edge) & (outliers < len(force) - edge)]
    return np.split(outliers, np.flatnonzero(np.diff(outliers) > gap) + 1) if len(outliers) else []


def regression_equations(module: KernelModule, log: Log, parameters: np.ndarray) -> RegressionEquations:
    """Both sides, filtered in parallel and decimated, over all stretches of a log; raises Failure without any."""
    sides = stacked_equations(equations_by_stretch(module, log, parameters))
    if sides is None:
        raise Failure(
            f"{log.name} must hold an uninterrupted stretch of at least {4 * FILTER_EDGE_S:g} s for its motion to be "
            "differentiated. Use `--method shooting`."
        )
    return sides


def equations_by_stretch(module: KernelModule, log: Log, parameters: np.ndarray) -> list[StretchEquations]:
    """Both sides of the equations over every stretch of a log that is long enough."""
    found = (stretch_equations(module, log.part(a, b), parameters) for a, b in measured_stretches(log))
    return [stretch for stretch in found if stretch is not None]


def stacked_equations(stretches: Sequence[StretchEquations]) -> RegressionEquations | None:
    """Sides of several stretches, decimated; None where nothing is left."""
    kept = [s for s in map(_decimated_equations, stretches) if s is not None]
    if not kept:
        return None
    return RegressionEquations(np.concatenate([s.left for s in kept]), np.concatenate([s.regressor for s in kept]))


def measured_stretches(log: Log) -> list[tuple[int, int]]:
    """Ranges of samples without a gap, in which no channel is missing for longer than half a period at the cutoff."""
    longest, found = max(2, round(1.0 / (2.0 * MOTION_CUTOFF_HZ * log.dt))), []
    for a, b in gapless_ranges(log, 0, len(log)):
        lost = np.zeros(b - a, dtype=bool)
        for signal in log.measured[a:b].T:
            edges = np.flatnonzero(np.diff(np.concatenate(([0], np.isnan(signal).astype(int), [0]))))
            for first, last in edges.reshape(-1, 2):
                lost[first:last] |= last - first > longest
        edges = np.flatnonzero(np.diff(np.concatenate(([0], (~lost).astype(int), [0]))))
        found += [(a + int(first), a + int(last)) for first, last in edges.reshape(-1, 2)]
    return found


class StretchEquations(NamedTuple):
    """Both sides of the equations over one stretch, at evenly spaced times, and the motion that they are taken at."""

    t: np.ndarray  # (N,) s
    states: np.ndarray  # (N, NX)
    left: np.ndarray  # (N, rows)
    regressor: np.ndarray  # (N, rows, n)
    band: float  # Hz, of the motion

    @property
    def dt(self) -> float:
        """Interval of the times [s]."""
        return float(self.t[1] - self.t[0])


def stretch_equations(module: KernelModule, log: Log, parameters: np.ndarray) -> StretchEquations | None:
    """Both sides of the equations over one stretch; None where it is too short."""
    if len(log) < MIN_STRETCH_SAMPLES or log.duration < 4 * FILTER_EDGE_S:
        return None
    t = uniform_times(log.t)
    dt = float(t[1] - t[0])
    band = min(MOTION_CUTOFF_HZ, 1.0 / (MIN_SAMPLES_PER_PERIOD * dt))
    states, rates = smooth_motion(module, log, t, band)
    latest = log.t.searchsorted(t + SAMPLE_DELAY_TOLERANCE * dt, side="right") - 1
    voltage = acting_input(module, log, parameters)[np.maximum(latest, 0)]
    return StretchEquations(t, states, *equations_at(module, t, states, rates, voltage, parameters), band)


def _decimated_equations(stretch: StretchEquations) -> RegressionEquations | None:
    """Sides filtered in parallel and decimated to their bandwidth, clear of the ends; None where nothing is left."""
    left, regressor = stretch.left, stretch.regressor
    thin = max(1, round(1.0 / (2.0 * min(PARALLEL_FILTER_CUTOFF_HZ, 0.5 * stretch.band) * stretch.dt)))
    if thin > 1:
        left, regressor = (decimate(side, thin, axis=0) for side in (left, regressor))
    edge = int(np.ceil(FILTER_EDGE_S / (thin * stretch.dt)))
    return RegressionEquations(left[edge:-edge], regressor[edge:-edge]) if len(left) > 4 * edge else None


def uniform_times(t: np.ndarray) -> np.ndarray:
    """As many times at equal distances, from the first sample to the last or nearly so."""
    return np.linspace(t[0], t[-1], len(t))


def smooth_motion(module: KernelModule, log: Log, t: np.ndarray, band: float) -> tuple[np.ndarray, np.ndarray]:
    """States (N, NX) and accelerations (N, NQ) at uniform times, from channels filtered forward and backward."""
    dt = float(t[1] - t[0])
    sos = butter(BUTTERWORTH_ORDER, band, fs=1.0 / dt, output="sos")
    filled = [np.interp(t, log.t, fill_gaps(log.t, signal)) for signal in log.measured.T]
    values = np.column_stack([sosfiltfilt(sos, signal) for signal in filled])
    states = states_from(module, values, np.gradient(values, dt, axis=0))
    return states, np.gradient(states[:, module.NQ :], dt, axis=0)
