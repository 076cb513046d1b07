"""On which states, input or time a missing force depends, and how much of it is repeatable.

A smooth function of some variables, as a force on a row, is made from some stretches of the logs together with a refit
of the model's own parameters, and predicts the other stretches. What repeats is the share that it takes away there of
what the model leaves over above the sensors' noise. A force that comes and goes as it likes is predicted by nothing.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from wheelpend.diagnosis.missing_force.law_terms import HARMONICS_PER_TURN, MIN_WAVE_PHASE_RAD
from wheelpend.diagnosis.missing_force.piecewise_force import (
    FoldedLeastSquares,
    LinearisedLogs,
    build_least_squares,
    force_columns,
    linearise_logs,
    piece_means,
    values_in_segments,
)
from wheelpend.estimation.fit import Fit
from wheelpend.estimation.problem import EstimationProblem

DRIVE_ROW = "drive"  # the name of a force between wheel and body
MAX_VARIABLES = 3  # variables of a function
MIN_ADDED_SHARE = 0.05  # share that a further variable must predict
MIN_REPORTED_SHARE = 0.1  # share below which nothing is said to repeat
KNOT_QUANTILES = (0.1, 0.35, 0.65, 0.9)  # quantiles at which a function may bend
CLIP_QUANTILES = (0.005, 0.995)  # quantiles beyond which it is constant
COEFFICIENT_PRIOR_PER_V2 = (
    1.0  # 1/V², prior information of a coefficient: what the parameters can do as well is left to them
)
WITHIN_TURN_SUFFIX = " within a turn"
CURVE_POINT_COUNT = 121  # of a curve


class Curve(NamedTuple):
    """A missing force over one variable, the others at their medians, less its mean."""

    variable: str
    x: np.ndarray  # (CURVE_POINT_COUNT,)
    force: np.ndarray  # (CURVE_POINT_COUNT,) V
    sigma: np.ndarray  # (CURVE_POINT_COUNT,) V, one standard deviation


@dataclass(frozen=True)
class ExplainedForce:
    """How much of what a model leaves over repeats as a force at one place, and with what."""

    row: str  # of the model, or "drive" for a force between wheel and body
    depends_on: tuple[str, ...]  # variables, the one that predicts most first
    alone: float  # share that the first predicts
    repeatable: float  # share that all of them predict, on data that did not make the function
    curves: tuple[Curve, ...] = field(repr=False, default=())  # over each variable


def explained_forces(problem: EstimationProblem, base: Fit) -> tuple[ExplainedForce, ...]:
    """How much of what a fitted model leaves over repeats: on each row, and between wheel and body; most first.

    None where the model leaves over hardly more than noise.
    """
    views, rows = linearise_logs(problem, base), problem.module.ROWS
    ways = {name: np.eye(len(rows))[k] for k, name in enumerate(rows)}
    if len(rows) == 2:
        ways[DRIVE_ROW] = np.array([-1.0, 1.0])
    prepared = [EvaluatedBasis.of(view) for view in views]
    found = [explained_force_along(prepared, name, way) for name, way in ways.items()]
    return tuple(sorted((r for r in found if r is not None), key=lambda r: -r.repeatable))


def explained_force_along(views: Sequence[EvaluatedBasis], name: str, direction: np.ndarray) -> ExplainedForce | None:
    """How much repeats as a force that acts on the rows as ``way``; None where there is hardly more than noise."""
    grown = [SelectedVariables.by_forward_selection(view, direction) for view in views]
    start = min(g.cross_validated_costs[0] for g in grown)
    best = min(grown, key=lambda g: g.cross_validated_costs[-1])
    structure = start - best.view.noise
    if structure < 0.1 * best.view.noise:
        return None
    shares = [float(np.clip((start - left) / structure, 0.0, 1.0)) for left in best.cross_validated_costs]
    if shares[-1] < MIN_REPORTED_SHARE:
        return ExplainedForce(name, (), 0.0, shares[-1])
    return ExplainedForce(name, tuple(best.chosen), shares[1], shares[-1], tuple(curve(best, v) for v in best.chosen))


class EvaluatedBasis(NamedTuple):
    """A view with the shapes (S, pieces, m) of all functions in each of its logs."""

    view: LinearisedLogs
    smooth: SmoothFunctions
    names: list[str]
    shapes: list[np.ndarray]

    @staticmethod
    def of(view: LinearisedLogs) -> EvaluatedBasis:
        """Evaluate all functions along the motion."""
        smooth = SmoothFunctions.of(view)
        names = [n for group in smooth.groups.values() for n in group]
        return EvaluatedBasis(
            view, smooth, names, [piece_means(p, smooth.matrix(p.motion, names)) for p in view.pieces]
        )


class SelectedVariables(NamedTuple):
    """Variables chosen one after the other in one view."""

    view: LinearisedLogs
    smooth: SmoothFunctions
    least_squares: FoldedLeastSquares
    chosen: list[str]
    cross_validated_costs: list[
        float
    ]  # sum of squares on folds that did not make the function: without it, with one variable, ...

    @staticmethod
    def by_forward_selection(prepared: EvaluatedBasis, direction: np.ndarray) -> SelectedVariables:
        """Choose the variables that predict most, while each pays."""
        view, smooth, names = prepared.view, prepared.smooth, prepared.names
        columns = [force_columns(shapes, np.tile(direction, (len(names), 1))) for shapes in prepared.shapes]
        given = build_least_squares(view, names, columns, ridge=COEFFICIENT_PRIOR_PER_V2)
        chosen: list[str] = []
        lefts = [given.left(view.own)]
        worth = MIN_ADDED_SHARE * max(lefts[0] - view.noise, 0.0)
        while len(chosen) < MAX_VARIABLES:
            free = [v for v in smooth.variables if v not in chosen]
            trials = {v: given.left([*view.own, *smooth.names([*chosen, v])]) for v in free}
            first = min(trials, key=lambda v: trials[v])
            if lefts[-1] - trials[first] < worth:
                break
            chosen.append(first)
            lefts.append(trials[first])
        return SelectedVariables(view, smooth, given, chosen, lefts)


def curve(best: SelectedVariables, variable: str) -> Curve:
    """The function that all folds give, over one of its variables, with its standard deviation.

    The model's own parameters are as refitted with it; what they can do as well is theirs.
    """
    view, given = best.view, best.least_squares
    names = [*view.own, *best.smooth.names(best.chosen)]
    places, change = given.places(names), given.solve(names)
    law = [k for k in places if given.labels[k] not in view.own and given.labels[k].split("@")[0] not in view.own]
    normal = given.normal.sum(axis=0)[np.ix_(law, law)] + np.diag(given.prior_information[law])
    seen = {v: values_in_segments(view, v.removesuffix(WITHIN_TURN_SUFFIX)) for v in best.smooth.splines}
    base = variable.removesuffix(WITHIN_TURN_SUFFIX)
    ends = (
        np.array([0.0, 2 * np.pi]) if variable.endswith(WITHIN_TURN_SUFFIX) else np.quantile(seen[base], CLIP_QUANTILES)
    )
    grid = np.linspace(float(ends[0]), float(ends[1]), CURVE_POINT_COUNT)
    motion = {v: np.full(CURVE_POINT_COUNT, np.median(x)) for v, x in seen.items()} | {base: grid}
    matrix = best.smooth.matrix(motion, best.smooth.names(best.chosen))
    matrix = matrix - matrix.mean(axis=0)
    excess = max(best.cross_validated_costs[-1] / max(view.noise, 1), 1.0)
    variance = np.einsum("ik,kl,il->i", matrix, np.linalg.pinv(normal, rcond=1e-12, hermitian=True), matrix) * excess
    return Curve(variable, grid, matrix @ change[-len(law) :], np.sqrt(np.maximum(variance, 0.0)))


# ---- smooth functions


class SplineBasis(NamedTuple):
    """How a function of one variable is made: straight, bent at knots, with a jump at zero where it has a direction."""

    centre: float
    spread: float
    clip_range: tuple[float, float]
    knots: tuple[float, ...]
    has_jump: bool

    @staticmethod
    def of(name: str, seen: np.ndarray) -> SplineBasis:
        """From the values that the logs cover."""
        jumps = name.startswith(("d", "v_")) and seen.min() < 0.0 < seen.max()
        knots = tuple(map(float, np.unique(np.quantile(seen, KNOT_QUANTILES))))
        ends = np.quantile(seen, CLIP_QUANTILES)
        return SplineBasis(float(seen.mean()), float(seen.std()), (float(ends[0]), float(ends[1])), knots, bool(jumps))

    def columns(self, values: np.ndarray) -> list[np.ndarray]:
        """What the function is a sum of (N,)."""
        x = np.clip(values, *self.clip_range)
        found = [(x - self.centre) / self.spread, *(np.maximum(x - k, 0.0) / self.spread for k in self.knots)]
        return [*found, np.sign(values)] if self.has_jump else found


class SmoothFunctions(NamedTuple):
    """Functions of every variable, and of every two of them together."""

    splines: dict[str, SplineBasis]
    turns: tuple[tuple[str, tuple[int, ...]], ...]  # angles, and how often a function may repeat within their turn
    groups: dict[tuple[str, ...], list[str]]  # names of the columns of each variable, or pair

    @staticmethod
    def of(view: LinearisedLogs) -> SmoothFunctions:
        """Functions of what changes in a view."""
        seen = {n: values_in_segments(view, n) for n in view.pieces[0].motion}
        bends = {n: SplineBasis.of(n, v) for n, v in seen.items() if v.std() > 0.0}
        angles = {n: np.ptp(seen[n]) for n in bends if n.startswith("theta")}
        turns = tuple(
            (n, tuple(k for k in HARMONICS_PER_TURN if k * reach > MIN_WAVE_PHASE_RAD))
            for n, reach in angles.items()
            if reach > MIN_WAVE_PHASE_RAD
        )
        groups: dict[tuple[str, ...], list[str]] = {(): ["constant"]}
        groups |= {(n,): [f"{n} {k}" for k in range(1 + len(b.knots) + b.has_jump)] for n, b in bends.items()}
        groups |= {(n + WITHIN_TURN_SUFFIX,): [f"{f} {k} {n}" for k in ks for f in ("sin", "cos")] for n, ks in turns}
        for k, one in enumerate(bends):
            groups |= {(a, one): [f"{a} {one} {i}{j}" for i in "01" for j in "01"] for a in list(bends)[:k]}
        return SmoothFunctions(bends, turns, groups)

    @property
    def variables(self) -> list[str]:
        """What a function may depend on."""
        return [group[0] for group in self.groups if len(group) == 1]

    def names(self, variables: Sequence[str]) -> list[str]:
        """Columns of a function of these variables."""
        return [n for group, names in self.groups.items() if set(group) <= set(variables) for n in names]

    def matrix(self, motion: Mapping[str, np.ndarray], names: Sequence[str]) -> np.ndarray:
        """The named columns (N, m) along a motion."""
        table = self.columns(motion)
        return np.column_stack([table[n] for n in names])

    def columns(self, motion: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
        """Every column (N,) along a motion."""
        parts = {n: b.columns(motion[n]) for n, b in self.splines.items()}
        table = {"constant": np.ones_like(next(iter(parts.values()))[0])}
        table |= {name: c for n, columns in parts.items() for name, c in zip(self.groups[n,], columns, strict=True)}
        for n, ks in self.turns:
            waves = [f(k * motion[n]) for k in ks for f in (np.sin, np.cos)]
            table |= dict(zip(self.groups[n + WITHIN_TURN_SUFFIX,], waves, strict=True))
        for group, names in self.groups.items():
            if len(group) == 2:
                a, b = ((parts[n][0], parts[n][-1]) for n in group)
                table |= dict(zip(names, [x * y for x in a for y in b], strict=True))
        return table
