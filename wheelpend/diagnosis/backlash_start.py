"""A start for backlash, whose contacts make and break, from where no parameter is known well.

The position of the moving part at a moment depends on every contact before. Short segments know little of that, their
sensitivities leave out what one segment hands on to the next, and one contact too few spoils whole segments. So
segments that fit badly count less, and derivatives are differences of whole logs simulated segment after segment.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from wheelpend.estimation.continuation import fit_segments
from wheelpend.estimation.data import shortened_segments
from wheelpend.estimation.fit import Fit
from wheelpend.estimation.free_parameters import effect_parameter, limits_of, per_log_names
from wheelpend.estimation.parameters import kernel_parameters
from wheelpend.estimation.problem import EstimationProblem
from wheelpend.estimation.scaled_inverse import solve_damped
from wheelpend.estimation.segments import Segments
from wheelpend.estimation.states import fit_states, initial_states
from wheelpend.estimation.step_size import stable_step

RELATIVE_DIFFERENCE_STEP = 0.01  # of a parameter: so wide that the roughness of single contacts averages out
MAX_RELATIVE_PARAMETER_STEP = 0.3  # of a parameter, in one Gauss-Newton step
MAX_ERROR_RATIO_WITH_BACKLASH = 0.95  # of the error without backlash, below which the search goes on
COARSE_GAP_GRID_RAD = tuple(float(v) for v in np.geomspace(0.0015, 0.2, 9))  # first widths tried [rad]
FINE_GAP_FACTORS = (0.5, 0.63, 0.8, 0.9, 1.0, 1.1, 1.25, 1.6, 2.0)  # times the size found
FIRST_HORIZON_SHARE = 0.1  # of the horizon: segments on which the width is searched first
FINE_SEARCHES = ((0.2, 5), (0.2, 4), (1.0, 5))  # horizon shares, and Gauss-Newton iterations of each
MAX_SEGMENTS = 10_000  # of each log: all of them, unless it is very long
MIN_DAMPING, MAX_DAMPING = 1e-3, 10.0  # on a unit diagonal: at first, and up to which a step is tried


class SequentialResiduals(NamedTuple):
    """Residuals on consecutive segments, each simulated from the end of the one before."""

    residuals: list[np.ndarray]  # of each segment (values,) [σ]
    mean_squares: np.ndarray  # (segments,) mean square of each, in noise variances
    states: list[np.ndarray]  # (segments, NX) of each log

    @property
    def robust_cost(self) -> float:
        """Mean logarithm of the squares: a segment that fits badly counts little more than one that fits worse."""
        if not np.isfinite(self.mean_squares).all():
            return np.inf
        return float(np.mean(np.log(np.maximum(self.mean_squares, 1.0))))


@dataclass(frozen=True)
class BacklashProblem:
    """An estimation problem on consecutive segments, and the parameters in which a start is searched."""

    problem: EstimationProblem
    log_segments: Sequence[Segments]
    per_log: Sequence[Mapping[str, float]]  # values of the parameters that each log has for itself
    free: Sequence[str]

    def with_segments(self, horizon_share: float) -> BacklashProblem:
        """The same on segments of another length, as a share of the horizon."""
        length = horizon_share * self.problem.horizon
        return replace(self, log_segments=shortened_segments(self.problem, length, max_segments=MAX_SEGMENTS))

    def cost_at(self, values: Mapping[str, float]) -> float:
        """Sum of squares at some values, only the initial states fitted."""
        return self.fit_at(values).cost

    def fit_at(self, values: Mapping[str, float]) -> Fit:
        """A fit of the initial states at some values."""
        return fit_segments(self.problem, self.log_segments, values, self.free, start_per_log=self.per_log, rounds=0)

    @property
    def shared(self) -> list[str]:
        """Names of the free parameters that the logs share."""
        return [n for n in self.free if n not in per_log_names(self.free)]


def find_backlash_start(
    problem: EstimationProblem,
    origin: Mapping[str, float],
    per_log: Sequence[Mapping[str, float]],
    free: Sequence[str],
    size: str,
) -> dict[str, float] | None:
    """Parameters near the best ones, from a rough start and an unknown gap; None where backlash does not pay.

    ``size`` is the name of the gap's width, ``per_log`` has each log's own parameters.
    """
    step = 2.0 * stable_step(problem.module, origin, problem.logs[0])  # as logs are simulated
    problem = replace(problem, max_step=min(problem.max_step, step))
    row = effect_parameter(size, problem.plant)
    assert row is not None, f"{size} is a parameter of the library"
    search = BacklashProblem(problem, (), per_log, free).with_segments(FIRST_HORIZON_SHARE)
    values = robust_fit(search, {**origin, size: 0.5 * row.typical})
    costs = {gap: search.cost_at({**values, size: gap}) for gap in (row.absent, *COARSE_GAP_GRID_RAD)}
    best = min(costs, key=costs.__getitem__)
    if not costs[best] < MAX_ERROR_RATIO_WITH_BACKLASH**2 * costs[row.absent]:
        return None
    values = {**values, size: best}
    for share, iterations in FINE_SEARCHES:
        search = search.with_segments(share)
        gaps = [values[size] * factor for factor in FINE_GAP_FACTORS]
        values[size] = min(gaps, key=lambda gap: search.cost_at({**values, size: gap}))
        values = sequential_fit(search, values, iterations)
    return values


def robust_fit(search: BacklashProblem, values: Mapping[str, float]) -> dict[str, float]:
    """A few fits, in each of which a segment counts the less the worse it fitted before."""
    found = search.fit_at(values)
    for _ in range(3):
        squares = [segment_mean_squares(search.problem, s, found, k) for k, s in enumerate(search.log_segments)]
        if not all(np.isfinite(s).all() for s in squares):
            break
        pairs = zip(search.log_segments, squares, strict=True)
        weighted = [replace(segments, weights=1.0 / np.maximum(s, 1.0)) for segments, s in pairs]
        found = fit_segments(search.problem, weighted, found.values, search.free, start_per_log=found.per_log, rounds=4)
    return dict(found.values)


def segment_mean_squares(problem: EstimationProblem, segments: Segments, found: Fit, number: int) -> np.ndarray:
    """Mean square (segments,) of every segment's residual, in noise variances, at a fit to it as log ``number``."""
    parameters = kernel_parameters(problem.module, found.of_log(number), segments.log)
    linearisation = problem.simulator.shoot(segments, found.states[number], parameters)
    return linearisation.gram[:, -1, -1] / degrees_of_freedom(segments, problem.module.NX)


def degrees_of_freedom(segments: Segments, states: int) -> np.ndarray:
    """Measured values of every segment, less its fitted states, at least 1 (segments,)."""
    values = [np.isfinite(segments.log.measured[a:b]).sum() - states for a, b in segments.bounds]
    return np.maximum(np.array(values, dtype=float), 1.0)


def sequential_residuals(
    search: BacklashProblem,
    values: Mapping[str, float],
    states: Sequence[np.ndarray] | None = None,
    iterations: int = 3,
) -> SequentialResiduals:
    """Residuals at some values once the initial states have followed them."""
    problem, per_log, residuals, squares, found = search.problem, search.per_log, [], [], []
    for k, segments in enumerate(search.log_segments):
        own = per_log[k] if k < len(per_log) else {}
        parameters = kernel_parameters(problem.module, {**values, **own}, segments.log)
        first = states[k] if states else initial_states(problem.module, segments)
        fitted, linearisation = fit_states(problem.simulator, segments, first, parameters, iterations)
        residuals += [np.nan_to_num(linearisation.residual[a:b].ravel()) for a, b in segments.bounds]
        squares.append(linearisation.gram[:, -1, -1] / degrees_of_freedom(segments, problem.module.NX))
        found.append(fitted)
    return SequentialResiduals(residuals, np.concatenate(squares), found)


def sequential_fit(search: BacklashProblem, values: Mapping[str, float], iterations: int) -> dict[str, float]:
    """Gauss-Newton by differences on the logarithm of the segments' squares, for the parameters that logs share."""
    names, values, damping = search.shared, dict(values), MIN_DAMPING
    limits = limits_of(names, search.problem.plant, search.problem.module.SIGNED)
    here = sequential_residuals(search, values)
    for _ in range(iterations):
        scale = np.array([abs(values[n]) or RELATIVE_DIFFERENCE_STEP for n in names])
        normal, right = difference_normal_equations(search, values, names, scale, here)
        while damping < MAX_DAMPING:
            step = _damped_step(normal, right, damping) * scale
            moved = {n: float(np.clip(values[n] + s, *limits[n]))
                     for n, s in zip(names, step, strict=True)}  # fmt: skip
            there = sequential_residuals(search, {**values, **moved})
            if there.robust_cost < here.robust_cost:
                break
            damping *= 10.0
        else:
            break
        values, here, damping = {**values, **moved}, there, damping * 0.1
    return values


def _damped_step(normal: np.ndarray, right: np.ndarray, damping: float) -> np.ndarray:
    """Levenberg-Marquardt step of normal equations (n, n) and (n,), each component within its bound."""
    step = solve_damped(normal, right[:, None], damping)[:, 0]
    return np.clip(step, -MAX_RELATIVE_PARAMETER_STEP, MAX_RELATIVE_PARAMETER_STEP)


def difference_normal_equations(
    search: BacklashProblem,
    values: Mapping[str, float],
    names: Sequence[str],
    scale: np.ndarray,
    here: SequentialResiduals,
) -> tuple[np.ndarray, np.ndarray]:
    """Normal equations of the named parameters in units of scale (names,), every segment weighted by its squares."""
    weights = 1.0 / np.sqrt(np.maximum(here.mean_squares, 1.0))

    def weighted(sequence: SequentialResiduals) -> np.ndarray:
        return np.concatenate([w * r for w, r in zip(weights, sequence.residuals, strict=True)])

    base, columns = weighted(here), []
    for name, size in zip(names, scale, strict=True):
        moved = {**values, name: values[name] + RELATIVE_DIFFERENCE_STEP * size}
        there = sequential_residuals(search, moved, here.states, iterations=1)
        finite = np.isfinite(there.mean_squares).all()
        columns.append((weighted(there) - base) / RELATIVE_DIFFERENCE_STEP if finite else np.zeros_like(base))
    jacobian = np.array(columns).T
    return jacobian.T @ jacobian, -jacobian.T @ base
