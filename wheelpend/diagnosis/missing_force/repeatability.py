"""The states, input or time on which a missing force depends, and its repeatable share.

A smooth function of some variables, as a force on a row, is made from some stretches of the logs together with a refit
of the model's own parameters, and predicts the other stretches. The repeatable share is that which it takes away there
of the sum of squares above the sensors' noise. A force at random is predicted by nothing.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

import numpy as np

from derive.plant_signature import PlantSignature
from wheelpend.diagnosis.missing_force.piecewise_force import (
    FoldedLeastSquares,
    LinearisedLogs,
    build_least_squares,
    force_columns,
    linearise_logs,
    piece_means,
    values_in_segments,
)
from wheelpend.diagnosis.missing_force.smooth_basis import CLIP_QUANTILES, WITHIN_TURN_SUFFIX, SmoothBasis
from wheelpend.estimation.fit import Fit
from wheelpend.estimation.problem import EstimationProblem

MAX_VARIABLES = 3  # variables of a function
MIN_ADDED_SHARE = 0.05  # share that a further variable must predict
MIN_REPORTED_SHARE = 0.1  # share below which nothing is said to repeat
MIN_EXCESS_SHARE = 0.1  # of the noise's sum of squares, below which there is hardly more than noise
COEFFICIENT_PRIOR_PER_V2 = 1.0  # 1/V², prior information of a coefficient: parameters are preferred to functions
CURVE_POINT_COUNT = 121


class Curve(NamedTuple):
    """A missing force over one variable, the others at their medians, less its mean."""

    variable: str
    x: np.ndarray  # (CURVE_POINT_COUNT,)
    force: np.ndarray  # (CURVE_POINT_COUNT,) V
    sigma: np.ndarray  # (CURVE_POINT_COUNT,) V, one standard deviation


@dataclass(frozen=True)
class ExplainedForce:
    """The share of the unexplained sum of squares that repeats as a force on one row, and its variables."""

    row: str  # of the model, or the port of a force between two parts
    depends_on: tuple[str, ...]  # variables, the one that predicts most first
    alone: float  # share that the first predicts
    repeatable: float  # share that all of them predict, on data that did not make the function
    curves: tuple[Curve, ...] = field(repr=False, default=())  # over each variable
    between: str = field(repr=False, default="")  # where it acts, of a force between two parts: between wheel and body

    def to_json(self) -> dict[str, Any]:
        """The shares under the keys of JSON, without the curves."""
        return {"row": self.row, "depends_on": self.depends_on, "alone": self.alone, "repeatable": self.repeatable}


def explained_forces(problem: EstimationProblem, base: Fit) -> tuple[ExplainedForce, ...]:
    """The repeatable share of what a fitted model leaves over: on each row, and between two parts; most first.

    Empty where the model leaves over hardly more than noise.
    """
    rows, couplings = problem.module.ROWS, problem.plant.couplings
    directions = {name: np.eye(len(rows))[k] for k, name in enumerate(rows)}
    directions |= {name: -np.array(port.weights) for name, port in couplings.items()}  # a resistance there
    bases = [EvaluatedBasis.of(linearised, problem.plant) for linearised in linearise_logs(problem, base)]
    found = [explained_force_along(bases, name, direction) for name, direction in directions.items()]
    named = [replace(r, between=couplings[r.row].place) if r.row in couplings else r for r in found if r is not None]
    return tuple(sorted(named, key=lambda r: -r.repeatable))


def explained_force_along(bases: Sequence[EvaluatedBasis], name: str, direction: np.ndarray) -> ExplainedForce | None:
    """The repeatable share of a force along a direction (rows,); None where there is hardly more than noise."""
    selections = [SelectedVariables.by_forward_selection(basis, direction) for basis in bases]
    start = min(s.cross_validated_costs[0] for s in selections)
    best = min(selections, key=lambda s: s.cross_validated_costs[-1])
    noise = best.linearised.noise
    excess = start - noise
    if excess < MIN_EXCESS_SHARE * noise:
        return None
    shares = [float(np.clip((start - cost) / excess, 0.0, 1.0)) for cost in best.cross_validated_costs]
    if shares[-1] < MIN_REPORTED_SHARE:
        return ExplainedForce(name, (), 0.0, shares[-1])
    return ExplainedForce(name, tuple(best.chosen), shares[1], shares[-1], tuple(curve(best, v) for v in best.chosen))


class EvaluatedBasis(NamedTuple):
    """The basis functions of a linearisation, evaluated along the motion of each of its logs."""

    linearised: LinearisedLogs
    basis: SmoothBasis
    names: list[str]
    shapes: list[np.ndarray]  # of each log (S, pieces, names)

    @staticmethod
    def of(linearised: LinearisedLogs, plant: PlantSignature) -> EvaluatedBasis:
        """Evaluate all functions along the motion."""
        basis = SmoothBasis.of(linearised, plant)
        names = [n for group in basis.groups.values() for n in group]
        shapes = [piece_means(p, basis.matrix(p.motion, names)) for p in linearised.pieces]
        return EvaluatedBasis(linearised, basis, names, shapes)


class SelectedVariables(NamedTuple):
    """Variables chosen one after the other at one point of linearisation."""

    linearised: LinearisedLogs
    basis: SmoothBasis
    least_squares: FoldedLeastSquares
    chosen: list[str]
    cross_validated_costs: list[float]  # sum of squares on folds that were not fitted: without, with one variable, ...

    @staticmethod
    def by_forward_selection(evaluated: EvaluatedBasis, direction: np.ndarray) -> SelectedVariables:
        """Choose the variables that predict most, while each predicts enough."""
        linearised, basis, names = evaluated.linearised, evaluated.basis, evaluated.names
        columns = [force_columns(shapes, np.tile(direction, (len(names), 1))) for shapes in evaluated.shapes]
        least_squares = build_least_squares(linearised, names, columns, ridge=COEFFICIENT_PRIOR_PER_V2)
        chosen: list[str] = []
        costs = [least_squares.cross_validated_cost(linearised.own)]
        least_gain = MIN_ADDED_SHARE * max(costs[0] - linearised.noise, 0.0)
        while len(chosen) < MAX_VARIABLES:
            free = [v for v in basis.variables if v not in chosen]
            candidates = {v: [*linearised.own, *basis.names([*chosen, v])] for v in free}
            trials = {v: least_squares.cross_validated_cost(names) for v, names in candidates.items()}
            first = min(trials, key=lambda v: trials[v])
            if costs[-1] - trials[first] < least_gain:
                break
            chosen.append(first)
            costs.append(trials[first])
        return SelectedVariables(linearised, basis, least_squares, chosen, costs)


def curve(best: SelectedVariables, variable: str) -> Curve:
    """The function that all folds give, over one of its variables, with its standard deviation.

    The model's own parameters are as refitted with it; what they explain as well is left to them.
    """
    linearised, least_squares = best.linearised, best.least_squares
    names = [*linearised.own, *best.basis.names(best.chosen)]
    indices, change = least_squares.indices(names), least_squares.solve(names)
    law = [k for k in indices if least_squares.folds.layout.elements[k].role == "column"]
    normal = least_squares.folds.information.sum(axis=0)[np.ix_(law, law)] + np.diag(
        least_squares.prior_information[law]
    )
    grid, motion = _curve_motion(best, variable)
    matrix = best.basis.matrix(motion, best.basis.names(best.chosen))
    matrix = matrix - matrix.mean(axis=0)
    excess = max(best.cross_validated_costs[-1] / max(linearised.noise, 1), 1.0)
    variance = np.einsum("ik,kl,il->i", matrix, np.linalg.pinv(normal, rcond=1e-12, hermitian=True), matrix) * excess
    return Curve(variable, grid, matrix @ change[-len(law) :], np.sqrt(np.maximum(variance, 0.0)))


def _curve_motion(best: SelectedVariables, variable: str) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """A grid of one variable, within what the logs cover, and all variables along it, the others at their medians."""
    values = {v: values_in_segments(best.linearised, v.removesuffix(WITHIN_TURN_SUFFIX)) for v in best.basis.splines}
    name = variable.removesuffix(WITHIN_TURN_SUFFIX)
    within_turn = variable.endswith(WITHIN_TURN_SUFFIX)
    ends = np.array([0.0, 2 * np.pi]) if within_turn else np.quantile(values[name], CLIP_QUANTILES)
    grid = np.linspace(float(ends[0]), float(ends[1]), CURVE_POINT_COUNT)
    return grid, {v: np.full(CURVE_POINT_COUNT, np.median(x)) for v, x in values.items()} | {name: grid}
