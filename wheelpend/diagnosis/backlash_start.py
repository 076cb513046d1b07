"""A start for an effect whose contacts make and break, from where no parameter is known well.

Where the moving part is at a moment depends on every contact before. Short segments know little of that, their
sensitivities leave out what one segment hands on to the next, and one contact too few spoils whole segments. So
segments that fit badly count less, and derivatives are differences of whole logs whose states follow in turn.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from wheelpend.estimation.continuation import fit_segments
from wheelpend.estimation.data import shortened_segments
from wheelpend.estimation.fit import Fit
from wheelpend.estimation.free_parameters import effect_parameter, limits_of, per_log_names
from wheelpend.estimation.parameters import kernel_parameters
from wheelpend.estimation.problem import EstimationProblem
from wheelpend.estimation.segments import Segments
from wheelpend.estimation.shooting import shoot
from wheelpend.estimation.states import fit_states, initial_states
from wheelpend.estimation.step_size import stable_step

RELATIVE_DIFFERENCE_STEP = (
    0.01  # of a parameter: so wide a difference that the roughness of single contacts averages out
)
MAX_RELATIVE_PARAMETER_STEP = 0.3  # of a parameter, that one step may move it
MAX_ERROR_RATIO_WITH_BACKLASH = (
    0.95  # of the error without play, that the error with it has to be below for the search to go on
)
COARSE_GAP_GRID_RAD = tuple(float(v) for v in np.geomspace(0.0015, 0.2, 9))  # first widths tried [rad]
FINE_GAP_FACTORS = (0.5, 0.63, 0.8, 0.9, 1.0, 1.1, 1.25, 1.6, 2.0)  # times the size found


class SequentialResiduals(NamedTuple):
    """What parameters leave over on consecutive segments whose states follow in turn."""

    residuals: list[np.ndarray]  # of each segment
    mean_squares: np.ndarray  # (segments,) mean square of each, in noise variances
    states: list[np.ndarray]  # of each part

    @property
    def robust_cost(self) -> float:
        """Mean logarithm of the squares: a segment that fits badly counts little more than one that fits worse."""
        return (
            float(np.mean(np.log(np.maximum(self.mean_squares, 1.0))))
            if np.isfinite(self.mean_squares).all()
            else np.inf
        )


def find_backlash_start(
    problem: EstimationProblem, origin: Mapping[str, float], per_log, free: Sequence[str], size: str
) -> dict | None:
    """Parameters near the best ones, from a rough start and an unknown size of a play; None where a play does not pay.

    ``size`` is the name of the play's width, ``own`` each log's own parameters.
    """
    module, log = problem.module, problem.training[0].log
    problem = replace(
        problem, max_step=min(problem.max_step, 2.0 * stable_step(module, origin, log))
    )  # as logs are played
    parts = shortened_segments(problem, 0.1 * problem.horizon, max_segments=10_000)
    row = effect_parameter(size, problem.plant)
    assert row is not None, f"{size} is a parameter of the library"
    values = robust_fit(problem, parts, {**origin, size: 0.5 * row.typical}, per_log, free)
    costs = {
        gap: cost_at(problem, parts, values, per_log, free, {size: gap}) for gap in (row.absent, *COARSE_GAP_GRID_RAD)
    }
    best = min(costs, key=costs.__getitem__)
    if not costs[best] < MAX_ERROR_RATIO_WITH_BACKLASH**2 * costs[row.absent]:
        return None
    values = {**values, size: best}
    for share, rounds in ((0.2, 5), (0.2, 4), (1.0, 5)):
        parts = shortened_segments(problem, share * problem.horizon, max_segments=10_000)
        gaps = [values[size] * factor for factor in FINE_GAP_FACTORS]
        values[size] = min(gaps, key=lambda gap: cost_at(problem, parts, values, per_log, free, {size: gap}))
        values = sequential_fit(problem, parts, values, per_log, free, rounds)
    return values


def cost_at(
    problem: EstimationProblem, parts: Sequence[Segments], values: Mapping[str, float], per_log, free, changed
) -> float:
    """Sum of squares of a model as it is, with some parameters changed."""
    return fit_segments(problem, parts, {**values, **changed}, free, start_per_log=per_log, rounds=0).cost


def robust_fit(
    problem: EstimationProblem, parts: Sequence[Segments], values: Mapping[str, float], per_log, free: Sequence[str]
) -> dict:
    """A few fits, in each of which a segment counts the less the worse it fitted before."""
    found = fit_segments(problem, parts, values, free, start_per_log=per_log, rounds=0)
    for _ in range(3):
        squares = [segment_mean_squares(problem, p, found, k) for k, p in enumerate(parts)]
        if not all(np.isfinite(s).all() for s in squares):
            break
        lighter = [replace(p, weights=1.0 / np.maximum(s, 1.0)) for p, s in zip(parts, squares, strict=True)]
        found = fit_segments(problem, lighter, found.values, free, start_per_log=found.per_log, rounds=4)
    return dict(found.values)


def segment_mean_squares(problem: EstimationProblem, part: Segments, found: Fit, number: int) -> np.ndarray:
    """Mean square of every segment's residual, in noise variances."""
    parameters = kernel_parameters(problem.module, found.of_log(number), part.log)
    shot = shoot(problem.module, part, found.states[number], parameters, max_step=problem.max_step)
    return shot.gram[:, -1, -1] / degrees_of_freedom(part, problem.module.NX)


def degrees_of_freedom(part: Segments, states: int) -> np.ndarray:
    """Measured values of every segment, less its fitted states."""
    values = [np.isfinite(part.log.measured[a:b]).sum() - states for a, b in part.bounds]
    return np.maximum(np.array(values, dtype=float), 1.0)


def sequential_residuals(
    problem: EstimationProblem, parts: Sequence[Segments], values, per_log, states=None, rounds: int = 3
) -> SequentialResiduals:
    """What parameters leave over once the states have followed them."""
    residuals, squares, found = [], [], []
    for k, part in enumerate(parts):
        parameters = kernel_parameters(problem.module, {**values, **(per_log[k] if k < len(per_log) else {})}, part.log)
        begun = states[k] if states else initial_states(problem.module, part)
        begun, shot = fit_states(problem.module, part, begun, parameters, problem.max_step, rounds)
        residuals += [np.nan_to_num(shot.residual[a:b].ravel()) for a, b in part.bounds]
        squares.append(shot.gram[:, -1, -1] / degrees_of_freedom(part, problem.module.NX))
        found.append(begun)
    return SequentialResiduals(residuals, np.concatenate(squares), found)


def sequential_fit(
    problem: EstimationProblem, parts: Sequence[Segments], values, per_log, free: Sequence[str], rounds: int
) -> dict:
    """Gauss-Newton by differences on the logarithm of the segments' squares, for the parameters that logs share."""
    names = [n for n in free if n not in per_log_names(free)]
    limits = limits_of(names, problem.plant, problem.module.SIGNED)
    values, damping = dict(values), 1e-3
    here = sequential_residuals(problem, parts, values, per_log)
    for _ in range(rounds):
        scale = np.array([abs(values[n]) or RELATIVE_DIFFERENCE_STEP for n in names])
        normal, right = difference_normal_equations(problem, parts, values, per_log, names, scale, here)
        diagonal = np.sqrt(np.diag(normal)) + 1e-300
        while damping < 10.0:
            damped = normal / np.outer(diagonal, diagonal) + damping * np.eye(len(names))
            step = (
                np.clip(
                    np.linalg.solve(damped, right / diagonal) / diagonal,
                    -MAX_RELATIVE_PARAMETER_STEP,
                    MAX_RELATIVE_PARAMETER_STEP,
                )
                * scale
            )
            moved = {n: float(np.clip(values[n] + s, *limits.get(n, (-np.inf, np.inf))))
                     for n, s in zip(names, step, strict=True)}  # fmt: skip
            there = sequential_residuals(problem, parts, {**values, **moved}, per_log)
            if there.robust_cost < here.robust_cost:
                break
            damping *= 10.0
        else:
            break
        values, here, damping = {**values, **moved}, there, damping * 0.1
    return values


def difference_normal_equations(
    problem: EstimationProblem,
    parts,
    values,
    per_log,
    names: Sequence[str],
    scale: np.ndarray,
    here: SequentialResiduals,
) -> tuple[np.ndarray, np.ndarray]:
    """Normal equations in units of scale, every segment weighted by its squares."""
    weights = 1.0 / np.sqrt(np.maximum(here.mean_squares, 1.0))

    def weighted(whole: SequentialResiduals) -> np.ndarray:
        return np.concatenate([w * r for w, r in zip(weights, whole.residuals, strict=True)])

    base, columns = weighted(here), []
    for name, size in zip(names, scale, strict=True):
        aside = sequential_residuals(
            problem,
            parts,
            {**values, name: values[name] + RELATIVE_DIFFERENCE_STEP * size},
            per_log,
            here.states,
            rounds=1,
        )
        columns.append(
            (weighted(aside) - base) / RELATIVE_DIFFERENCE_STEP
            if np.isfinite(aside.mean_squares).all()
            else np.zeros_like(base)
        )
    jacobian = np.array(columns).T
    return jacobian.T @ jacobian, -jacobian.T @ base
