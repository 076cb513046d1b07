"""The shooting problem, linearised in a piecewise constant force that the model lacks.

On short segments the problem is almost linear. Each is cut into pieces over which a force on each row is constant; a
law is a set of columns, forces that follow the motion. Initial states are eliminated, and the model's own parameters
move along, so that a law is credited only with what they cannot explain. Least squares is solved on folds of the
segments: a law is judged on segments that did not make it.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from wheelpend.diagnosis.criteria import SHORT_HORIZON_SHARE
from wheelpend.estimation.continuation import fit_model, fit_segments
from wheelpend.estimation.data import shortened_segments
from wheelpend.estimation.fit import Fit
from wheelpend.estimation.free_parameters import free_parameters
from wheelpend.estimation.normal_equations import NormalEquations, bounded_step, symmetric, without_states
from wheelpend.estimation.parameters import FreeParameter, ParameterLayout, kernel_parameters
from wheelpend.estimation.problem import EstimationProblem
from wheelpend.estimation.segments import Segments
from wheelpend.estimation.state_reconstruction import input_table, port_motion

PIECES_PER_SEGMENT = 5
FOLD_COUNT = 5
EXTRA_STATE_DAMPING = 9e-10  # of the unit diagonal: forces in pieces say little about a short segment's state
FOLD_RUN_COUNT = 10  # consecutive stretches of a log, dealt to the folds in turn


class PiecewiseForce(NamedTuple):
    """Normal equations of a log's segments in parameters and in a force on each row in each piece."""

    equations: NormalEquations  # (S, n): parameters first, then the forces, piece by piece and in it row by row
    own: int  # number of parameters
    sample_ranges: np.ndarray  # (S, pieces, 2) half-open sample ranges
    motion: dict[str, np.ndarray]  # states, angle and speed of the drive, input and time (N,)


class LinearisedLogs(NamedTuple):
    """The training logs, linearised at a point on short segments."""

    fit: Fit
    parameters: tuple[FreeParameter, ...]  # the model's own
    pieces: tuple[PiecewiseForce, ...]  # of each log
    noise: int  # expected sum of squares of the true model
    cost: float  # sum of squares at the point

    @property
    def own(self) -> tuple[str, ...]:
        """Names of the model's own parameters."""
        return tuple(p.name for p in self.parameters)


def linearise_logs(problem: EstimationProblem, base: Fit) -> list[LinearisedLogs]:
    """The training logs linearised at a fit on short segments, and at the starts from before any fit.

    A fit bends every parameter to what is missing; far from it, and without it, the law may show more clearly.
    """
    free = base.names
    short = fit_model(problem, base.values, free, horizons=(SHORT_HORIZON_SHARE,), start_per_log=base.per_log)
    log_segments = shortened_segments(problem, SHORT_HORIZON_SHARE * problem.horizon)
    fits = [short]
    for origin in problem.fallback_starts:
        there = fit_segments(
            problem, log_segments, {**short.values, **origin}, free, start_per_log=short.per_log, rounds=0
        )
        fits += [there] if np.isfinite(there.cost) else []
    return [linearise_at(problem, fitted, log_segments) for fitted in fits]


def linearise_at(problem: EstimationProblem, fitted: Fit, log_segments: Sequence[Segments]) -> LinearisedLogs:
    """Linearise the segments of all logs at a fit to them."""
    own = tuple(fitted.names)
    pieces = tuple(
        piecewise_force(problem, fitted, segments, number, own) for number, segments in enumerate(log_segments)
    )
    noise = fitted.count - sum(s.size for s in fitted.states)
    return LinearisedLogs(fitted, free_parameters(problem, own), pieces, noise, fitted.cost)


def piecewise_force(
    problem: EstimationProblem, fitted: Fit, segments: Segments, number: int, own: Sequence[str]
) -> PiecewiseForce:
    """Linearise a log's shooting problem, at a fit to it as log ``number``, in parameters and constant forces."""
    module = problem.module
    forces = list(module.MISSING_FORCES)
    length = int(np.max(segments.bounds[:, 1] - segments.bounds[:, 0]))
    edges = np.linspace(0, length, min(PIECES_PER_SEGMENT, length) + 1).astype(np.int64)
    pairs = list(itertools.pairwise(edges))
    window = np.array([[0, length]] * len(own) + [p for p in pairs for _ in forces], dtype=np.int64)
    columns = [module.PARAMETERS.index(n) for n in (*own, *(forces * len(pairs)))]
    parameters = kernel_parameters(module, fitted.of_log(number), segments.log)
    linearisation = problem.simulator.shoot(
        segments, fitted.states[number], parameters, columns, window, keep_residual=False
    )
    layout = ParameterLayout.of(free_parameters(problem, (*own, *(forces * len(pairs)))), 1)
    equations = force_equations(linearisation.gram, module.NX, layout)
    spans = np.minimum(segments.bounds[:, :1, None] + np.array(pairs), segments.bounds[:, 1:, None])
    return PiecewiseForce(equations, len(own), spans, fitted_motion(problem, fitted, segments, number))


def force_equations(gram: np.ndarray, nx: int, layout: ParameterLayout) -> NormalEquations:
    """Normal equations of segments in force pieces, and parameters, their initial states eliminated."""
    equations, _ = without_states(gram, nx, layout, EXTRA_STATE_DAMPING)
    return replace(equations, information=symmetric(equations.information))


def fitted_motion(problem: EstimationProblem, fitted: Fit, segments: Segments, number: int) -> dict[str, np.ndarray]:
    """States, the drive's angle and speed, input and time (N,) as a fit has them; 0 outside the segments.

    On short segments its trajectories are the measured motion without the sensors' noise, and they are those along
    which the parameters' own influence is known, so that what a parameter contains is no law.
    """
    module, log, names = problem.module, segments.log, problem.module.STATES
    parameters = kernel_parameters(module, fitted.of_log(number), log)
    states = np.zeros((len(log.t), len(names)))
    for (a, b), start in zip(segments.bounds, fitted.states[number], strict=True):
        states[a:b] = module.simulate(log.t[a:b], log.voltage[a:b], start, parameters, problem.max_step)[
            :, : len(names)
        ]
    table = {name: states[:, k] for k, name in enumerate(names)}
    for name, weights in port_motion(module).items():
        table[name] = states @ weights
    table |= input_table(module, np.nan_to_num(log.voltage))
    table["t"] = log.t - log.t[0]
    return table


def values_in_segments(linearised: LinearisedLogs, name: str) -> np.ndarray:
    """Values of a variable within the segments of all logs."""
    found = []
    for p in linearised.pieces:
        used = np.zeros(len(p.motion["t"]), dtype=bool)
        for a, b in zip(p.sample_ranges[:, 0, 0], p.sample_ranges[:, -1, 1], strict=True):
            used[a:b] = True
        found.append(p.motion[name][used])
    return np.concatenate(found)


def piece_means(pieces: PiecewiseForce, values: np.ndarray) -> np.ndarray:
    """Means (S, pieces, m) over the pieces of values at every sample (N, m); 0 for a piece without samples."""
    total = np.concatenate([np.zeros((1, values.shape[1])), np.cumsum(values, axis=0)])
    samples = np.maximum(pieces.sample_ranges[..., 1] - pieces.sample_ranges[..., 0], 1)[..., None]
    return (total[pieces.sample_ranges[..., 1]] - total[pieces.sample_ranges[..., 0]]) / samples


def force_columns(shapes: np.ndarray, directions: np.ndarray) -> np.ndarray:
    """Columns (S, pieces · rows, m) of forces with shapes (S, pieces, m) along directions (m, rows)."""
    segments, count, number = shapes.shape
    return (shapes[:, :, None, :] * directions.T).reshape(segments, count * directions.shape[1], number)


# ---- least squares


@dataclass(frozen=True)
class FoldedLeastSquares:
    """Least squares in parameters and columns of laws, summed over folds of the segments."""

    folds: NormalEquations  # (FOLD_COUNT, n), of parameters of the model, and of columns
    lowest: np.ndarray  # (n,) bounds on the change
    highest: np.ndarray  # (n,)
    prior_information: np.ndarray  # (n,) diagonal of the information that is there before any data
    cost: float  # sum of squares without any change

    def indices(self, names: Sequence[str]) -> list[int]:
        """Sorted positions of parameters and columns."""
        return sorted(k for n in dict.fromkeys(names) for k in self.index.get(n, ()))

    @cached_property
    def index(self) -> dict[str, list[int]]:
        """Positions of each parameter or column, one or one for every log."""
        found: dict[str, list[int]] = {}
        for k, parameter in enumerate(self.folds.layout.elements):
            found.setdefault(parameter.name, []).append(k)
        return found

    def solve(self, names: Sequence[str], left_out: int | None = None) -> np.ndarray:
        """Change of the named parameters and columns, within bounds, from all folds but one."""
        chosen, kept = self.indices(names), [k for k in range(FOLD_COUNT) if k != left_out]
        normal = self.folds.information[np.ix_(kept, chosen, chosen)].sum(axis=0)
        right = self.folds.score[np.ix_(kept, chosen)].sum(axis=0)
        prior = np.diag(self.prior_information[chosen])
        return bounded_step(normal + prior, right, 0.0, self.lowest[chosen], self.highest[chosen])

    def gain(self, names: Sequence[str], change: np.ndarray, fold: int) -> float:
        """Fall of the sum of squares of a fold with a change."""
        return self.folds.part(fold).gain(self.indices(names), change)

    def cross_validated_cost(self, names: Sequence[str]) -> float:
        """Sum of squares that is left when every fold is predicted with the coefficients of the others."""
        return self.cost - sum(self.gain(names, self.solve(names, k), k) for k in range(FOLD_COUNT))


def build_least_squares(
    linearised: LinearisedLogs,
    names: Sequence[str],
    columns: Sequence[np.ndarray],
    *,
    per_log: Sequence[str] = (),
    ridge: float = 0.0,
) -> FoldedLeastSquares:
    """Least squares in the model's parameters and in named columns, (S, pieces · rows, m) for each log.

    ``ridge`` is the prior information of every column; those in ``per_log`` have a coefficient for each log.
    """
    scopes = dict.fromkeys(per_log, "per log")
    coefficients = [FreeParameter(n, scope=scopes.get(n, "shared"), role="column") for n in names]
    layout = ParameterLayout.of((*linearised.parameters, *coefficients), len(linearised.pieces))
    folds = NormalEquations.zeros(layout, FOLD_COUNT)
    for pieces, column, places in zip(linearised.pieces, columns, layout.places, strict=True):
        for k, (block, score) in enumerate(normal_equations_by_fold(pieces, column)):
            folds.information[k][np.ix_(places, places)] += block
            folds.score[k][places] += score
    lowest, highest = change_bounds(linearised, layout.elements)
    prior = np.array([ridge if p.role == "column" else 0.0 for p in layout.elements])
    return FoldedLeastSquares(folds, lowest, highest, prior, linearised.cost)


def normal_equations_by_fold(pieces: PiecewiseForce, columns: np.ndarray) -> list[tuple[np.ndarray, np.ndarray]]:
    """For each fold information (n, n) and score (n,) in a log's parameters and in columns (S, pieces · rows, m)."""
    own, folds, found = pieces.own, fold_numbers(len(columns)), []
    information, scores = pieces.equations.information, pieces.equations.score
    pulled = information[:, :, own:] @ columns  # (S, n, m) information between everything and the columns
    for k in range(FOLD_COUNT):
        inside = folds == k
        flat = columns[inside].reshape(-1, columns.shape[2])
        mixed, inner = pulled[inside, :own].sum(axis=0), flat.T @ pulled[inside, own:].reshape(flat.shape)
        block = np.block([[information[inside, :own, :own].sum(axis=0), mixed], [mixed.T, inner]])
        score = scores[inside]
        found.append((block, np.concatenate([score[:, :own].sum(axis=0), flat.T @ score[:, own:].ravel()])))
    return found


def change_bounds(linearised: LinearisedLogs, elements: Sequence[FreeParameter]) -> tuple[np.ndarray, np.ndarray]:
    """How far each parameter may change: the model's own are never negative; columns are free."""
    lowest, highest = [], []
    for parameter in elements:
        value = linearised.fit.of_log(parameter.log or 0).get(parameter.name, 0.0)
        lowest.append(parameter.bounds[0] - value)
        highest.append(parameter.bounds[1] - value)
    return np.minimum(np.array(lowest), 0.0), np.maximum(np.array(highest), 0.0)


def fold_numbers(segments: int) -> np.ndarray:
    """Fold of each segment: consecutive runs, dealt in turn."""
    return np.arange(segments) * min(FOLD_RUN_COUNT, segments) // max(segments, 1) % FOLD_COUNT
