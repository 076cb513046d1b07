"""Inverse dynamics: the input that a model needs for the measured motion, against the one that was measured.

Identification as in robotics (Gautier 1997; Janot, Vandanjon, Gautier 2014): positions are filtered with zero phase and
differentiated, put into the regressor, and both sides are filtered in parallel and decimated before least squares. The
input is taken as it stands at the sample, as there. The cut-off of the filter is chosen for the log (``bandwidth``),
and the decimation follows from it. The force error is the residual relative to the input.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from scipy.signal import decimate

from wheelpend.errors import Failure
from wheelpend.estimation.linear_fit import LinearFit, solve_least_squares
from wheelpend.estimation.parameters import kernel_parameters
from wheelpend.estimation.regressor import acting_input, equations_at
from wheelpend.estimation.restrictions import NO_RESTRICTIONS, Restrictions
from wheelpend.identification.bandwidth import Sides, chosen_cutoff, cutoff_for, modelled
from wheelpend.identification.measured_motion import (
    MIN_STRETCH_S,
    MIN_STRETCH_SAMPLES,
    low_passed,
    measured_stretches,
    possible_cutoffs,
    smooth_motion,
    uniform_times,
)
from wheelpend.kernels.kernel_module import KernelModule
from wheelpend.logs.log import Log

COMPARED_BAND_SHARE = 0.5  # of the cut-off, up to which both sides are compared: there the filter does next to nothing
BURST_THRESHOLD_SIGMAS = 6.0  # robust standard deviations above which a missing force is a burst
SIGMA_PER_MEDIAN_DEVIATION = 1.48  # standard deviation of Gaussian noise over its median absolute value
MAX_FORCE_ERROR_PERCENT = 50.0  # residual in % of the input above which bursts are not sought
REVERSAL_MARGIN_S = 0.02  # s, within which a reversal is at a burst
SAMPLE_DELAY_TOLERANCE = 0.3  # of an interval: by so much a sample may be late and still count as on time
MIN_FILTER_EDGE_S = 0.05  # s at either end of a stretch, where the filters are not settled
FILTER_EDGE_PERIODS = (
    0.3  # the same in periods of the cut-off, the longer of both: by then a step at the end has decayed
)
MAX_JUDGED_SAMPLES = 20_000  # samples of a log at which cut-offs are compared


class RegressionEquations(NamedTuple):
    """Left side and regressor of the model's equations on the measured motion."""

    left: np.ndarray  # (N, rows)
    regressor: np.ndarray  # (N, rows, n)


class InverseDynamics(NamedTuple):
    """Least squares on the measured motion, and the cut-off of its filter."""

    fit: LinearFit
    cutoff: float  # Hz


def inverse_dynamics(
    module: KernelModule, log: Log, parameters: np.ndarray, restrictions: Restrictions = NO_RESTRICTIONS
) -> InverseDynamics:
    """Least squares on the measured motion; raises Failure where no stretch of the log is long enough."""

    def fit_at(cutoff: float) -> LinearFit | None:
        sides = stacked_equations(equations_by_stretch(module, log, parameters, cutoff))
        return None if sides is None else solve_least_squares(module, *sides, restrictions=restrictions)

    sides = judged_sides(module, log, parameters)
    cutoff = chosen_cutoff(sides, fit_at) if sides else None
    fitted = fit_at(cutoff) if cutoff else None
    if cutoff is None or fitted is None:
        least = max(MIN_STRETCH_S, MIN_STRETCH_SAMPLES * log.dt)
        raise Failure(
            f"{log.name} must hold an uninterrupted stretch of at least {least:.3g} s for its motion to be "
            "differentiated. Use `--method shooting`."
        )
    return InverseDynamics(fitted, cutoff)


def force_error(module: KernelModule, log: Log, values: Mapping[str, float]) -> float | None:
    """Residual of a model's equations relative to their left side [%]; None where there is nothing to compare.

    The left side is the measured input, or for a machine that swings freely the pull of gravity.
    """
    return _force_error_percent(equations_with_values(module, log, values), linear_parameter_values(module, values))


def equations_with_values(module: KernelModule, log: Log, values: Mapping[str, float]) -> list[StretchEquations]:
    """Both sides over every stretch of a log, at the cut-off that suits it and these values."""
    parameters = kernel_parameters(module, values, log)
    sides = judged_sides(module, log, parameters)
    if not sides:
        return []
    cutoff = cutoff_for(sides, linear_parameter_values(module, values))
    return equations_by_stretch(module, log, parameters, cutoff)


def _force_error_percent(stretches: Sequence[StretchEquations], estimate: np.ndarray) -> float | None:
    """Force error of an estimate (n,) over some stretches."""
    sides = stacked_equations(stretches)
    if sides is None:
        return None
    residual = sides.left - modelled(sides.regressor, estimate)
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

    Bursts are sought up to the cut-off of the motion: a push, or a stiff part that rings, is short.
    There are none where noise or a wrong model leave most of the input unexplained.
    """
    stretches = equations_with_values(module, log, values)
    estimate = linear_parameter_values(module, values)
    error = _force_error_percent(stretches, estimate)
    if error is None or error > MAX_FORCE_ERROR_PERCENT:
        return error, []
    residuals = [s.left - modelled(s.regressor, estimate) for s in stretches]
    pairs = zip(stretches, residuals, strict=True)
    return error, sorted(b for s, residual in pairs for b in _bursts_of_stretch(module, s, residual))


def _bursts_of_stretch(module: KernelModule, stretch: StretchEquations, residual: np.ndarray) -> list[Burst]:
    """Bursts in the residual (N, rows) of one stretch."""
    found = []
    port_speeds = stretch.states[:, module.NQ :] @ np.array([*module.PORTS.values()]).T
    reversals = stretch.t[np.flatnonzero((np.diff(np.sign(port_speeds), axis=0) != 0).any(axis=1))]
    for row, name in enumerate(module.ROWS):
        force = low_passed(
            residual[:, row], stretch.dt, stretch.cutoff
        )  # the measured side has more bandwidth than the motion
        for group in _outlier_groups(force, stretch):
            first, last = stretch.t[group[0]], stretch.t[group[-1]]
            beside = (reversals > first - REVERSAL_MARGIN_S) & (reversals < last + REVERSAL_MARGIN_S)
            peak = float(np.abs(force[group]).max())
            found.append(Burst(float(first), float(last), name, peak, bool(beside.any())))
    return found


def _outlier_groups(force: np.ndarray, stretch: StretchEquations) -> list[np.ndarray]:
    """Samples, clear of the ends, at which a missing force (N,) stands out, grouped where they are close together."""
    edge, gap = stretch.edge, max(1, round(MIN_FILTER_EDGE_S / stretch.dt))
    sigma = SIGMA_PER_MEDIAN_DEVIATION * float(np.median(np.abs(force)))
    outliers = np.flatnonzero(np.abs(force) > BURST_THRESHOLD_SIGMAS * sigma)
    outliers = outliers[(outliers >= edge) & (outliers < len(force) - edge)]
    return np.split(outliers, np.flatnonzero(np.diff(outliers) > gap) + 1) if len(outliers) else []


def judged_sides(module: KernelModule, log: Log, parameters: np.ndarray) -> dict[float, Sides]:
    """The equations' sides, not filtered themselves, at the same samples for every cut-off [Hz]; empty without any."""
    stretches = measured_stretches(log)
    if not stretches:
        return {}
    cutoffs, thin = possible_cutoffs(module, log, stretches), -(-len(log) // MAX_JUDGED_SAMPLES)
    thins = [min(thin, len(part) // MIN_STRETCH_SAMPLES) for part in stretches]  # none gets shorter than the shortest
    found = {}
    for cutoff in cutoffs:
        rows = [stretch_equations(module, p, parameters, cutoff, n) for p, n in zip(stretches, thins, strict=True)]
        kept = [slice(e, -e) for e in (filter_edge(min(cutoffs), row.dt) for row in rows)]
        left = np.concatenate([row.left[k] for row, k in zip(rows, kept, strict=True)])
        regressor = np.concatenate([row.regressor[k] for row, k in zip(rows, kept, strict=True)])
        found[cutoff] = Sides(left, regressor, accelerated_columns(module, parameters))
    return found if len(found[cutoffs[0]].left) else {}


def accelerated_columns(module: KernelModule, parameters: np.ndarray) -> np.ndarray:
    """True (n,) of the regressor's columns that have accelerations in them."""
    states, rates = np.linspace(0.3, 0.7, module.NX), np.linspace(1.0, 2.0, module.NQ)  # nowhere special
    voltage = np.zeros(max(len(module.INPUTS), 1))
    still, moving = (
        equations_at(
            module, np.zeros(1), states[None], r[None], voltage[None, :] if len(voltage) > 1 else voltage, parameters
        )[1]
        for r in (0.0 * rates, rates)
    )
    return (still != moving).any(axis=(0, 1))


def equations_by_stretch(
    module: KernelModule, log: Log, parameters: np.ndarray, cutoff: float
) -> list[StretchEquations]:
    """Both sides of the equations over every stretch of a log that is long enough, at a cut-off [Hz]."""
    return [stretch_equations(module, part, parameters, cutoff) for part in measured_stretches(log)]


def stacked_equations(stretches: Sequence[StretchEquations]) -> RegressionEquations | None:
    """Sides of several stretches, decimated; None where nothing is left."""
    kept = [s for s in map(_decimated_equations, stretches) if s is not None]
    if not kept:
        return None
    return RegressionEquations(np.concatenate([s.left for s in kept]), np.concatenate([s.regressor for s in kept]))


class StretchEquations(NamedTuple):
    """Both sides of the equations over one stretch, at evenly spaced times, and the motion that they are taken at."""

    t: np.ndarray  # (N,) s
    states: np.ndarray  # (N, NX)
    left: np.ndarray  # (N, rows)
    regressor: np.ndarray  # (N, rows, n)
    cutoff: float  # Hz, of the motion

    @property
    def dt(self) -> float:
        """Interval of the times [s]."""
        return float(self.t[1] - self.t[0])

    @property
    def edge(self) -> int:
        """Samples at either end at which the filter is not settled."""
        return filter_edge(self.cutoff, self.dt)


def filter_edge(cutoff: float, dt: float) -> int:
    """Samples at an interval [s] within which a filter up to a cut-off [Hz] settles."""
    return int(np.ceil(max(MIN_FILTER_EDGE_S, FILTER_EDGE_PERIODS / cutoff) / dt))


def stretch_equations(
    module: KernelModule, log: Log, parameters: np.ndarray, cutoff: float, thin: int = 1
) -> StretchEquations:
    """Both sides of the equations over one stretch at a cut-off [Hz], at every ``thin``-th of its samples."""
    t = uniform_times(log.t)
    dt = float(t[1] - t[0])
    states, rates = (part[::thin] for part in smooth_motion(module, log, t, cutoff))
    latest = log.t.searchsorted(t[::thin] + SAMPLE_DELAY_TOLERANCE * dt, side="right") - 1
    voltage = acting_input(module, log, parameters)[np.maximum(latest, 0)]
    sides = equations_at(module, t[::thin], states, rates, voltage, parameters)
    return StretchEquations(t[::thin], states, *sides, cutoff)


def _decimated_equations(stretch: StretchEquations) -> RegressionEquations | None:
    """Sides filtered in parallel and decimated to their bandwidth, clear of the ends; None where nothing is left."""
    left, regressor = stretch.left, stretch.regressor
    thin = max(1, round(1.0 / (2.0 * COMPARED_BAND_SHARE * stretch.cutoff * stretch.dt)))
    if thin > 1:
        left, regressor = (decimate(side, thin, axis=0) for side in (left, regressor))
    edge = -(-stretch.edge // thin)
    return RegressionEquations(left[edge:-edge], regressor[edge:-edge]) if len(left) > 4 * edge else None
