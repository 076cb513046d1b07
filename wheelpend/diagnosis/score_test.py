"""The score test: the expected gain of every effect, from one linearisation of the shooting problem.

At the fitted model all candidates' coefficients are zero, and the sensitivities say how the residual would change with
each. States and base parameters are eliminated first, so that a candidate is credited only with what they cannot
explain. An effect with a parameter that cannot be scored at its absence is linearised at each of its settings instead.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

import derive
from derive.effects import Effect
from wheelpend.diagnosis.criteria import MIN_REMAINING_INFORMATION_SHARE
from wheelpend.estimation.fit import Fit
from wheelpend.estimation.free_parameters import free_parameters
from wheelpend.estimation.normal_equations import NormalEquations, reduced_equations
from wheelpend.estimation.parameters import ParameterLayout, kernel_parameters
from wheelpend.estimation.problem import EstimationProblem, with_stable_step
from wheelpend.estimation.profiled_starts import ProfileGrid
from wheelpend.estimation.segments import Segments
from wheelpend.estimation.shooting import ShootingLinearisation

MIN_TWIN_CORRELATION = 0.99999  # correlation of two projected sensitivities above which no size tells effects apart
MIN_TWIN_INFORMATION_SHARE = 1e-7  # of an effect's information, beside base parameters, below which it has no twin


class EffectSize(NamedTuple):
    """Values of an effect's parameters, in one log or in several."""

    values: dict[str, float]  # by name; of a per-log parameter the first log's
    further: dict[int, dict[str, float]]  # by log: the values of per-log parameters in logs after the first

    def value(self, name: str, log: int) -> float:
        """Value of a parameter in a log."""
        return self.further.get(log, {}).get(name, self.values[name])

    def in_log(self, log: int) -> EffectSize:
        """The size in one log alone."""
        return EffectSize({n: self.value(n, log) for n in self.values}, {})

    def with_values(self, values: Mapping[str, float]) -> EffectSize:
        """The size with some values set otherwise."""
        return self._replace(values={**self.values, **values})


class Candidate(NamedTuple):
    """An effect with the size that the linearisation gives it."""

    effect: Effect
    starts: tuple[EffectSize, ...]  # one, or one per setting of a profiled parameter, best first
    gain: float  # expected fall of the sum of squares with the first
    sigma: dict[str, float]  # of each coefficient, if nothing else were missing; empty where it is not believed
    trials: int  # number of independent settings that were compared for it


class ScoreTest(NamedTuple):
    """Result of the score test."""

    candidates: tuple[Candidate, ...]  # best first
    twins: dict[str, tuple[str, ...]]  # effects that these data cannot tell from another, at any size


class FittedSegments(NamedTuple):
    """A fit and the very segments of each log that it was made on: the point of a linearisation."""

    problem: EstimationProblem
    fit: Fit
    log_segments: Sequence[Segments]

    @property
    def values(self) -> int:
        """Number of measured values in the segments."""
        return sum(s.values for s in self.log_segments)


class ProjectedEquations(NamedTuple):
    """Normal equations at a fit, without what initial states and base parameters explain."""

    rest: NormalEquations  # base parameters first; its cost is expected once states and base parameters are refitted
    unprojected_information: np.ndarray  # (free,) diagonal of the information with the base parameters held fixed
    cost: float  # sum of squares

    def indices(self, names: Sequence[str]) -> list[int]:
        """Places of the named parameters, in all logs."""
        return self.rest.layout.indices(names)


def score_test(
    problem: EstimationProblem, fitted: Fit, log_segments: Sequence[Segments], grids: Mapping[str, ProfileGrid]
) -> ScoreTest:
    """Score every effect that the model may be missing, at a fit to these very segments.

    grids holds the settings of the effects with a parameter that has to be profiled.
    """
    point = FittedSegments(problem, fitted, log_segments)
    effects = [e for e in problem.candidates() if not e.event]
    linear = [e for e in effects if e.profiled is None]
    equations = linearise(point, [n for e in linear for n in linear_names(e)], {})
    found = [_score_linear(e, equations, point.values) for e in linear]
    found += [_score_profiled(point, e, grids[e.name], equations) for e in effects if e.name in grids]
    indices = {e.name: equations.indices(linear_names(e)) for e in linear}
    twins = find_twins(indices, equations.rest.information, equations.unprojected_information)
    return ScoreTest(tuple(sorted(found, key=lambda c: -c.gain)), twins)


@np.errstate(over="ignore", invalid="ignore")  # a setting that cannot be simulated gives infinities, and is left out
def linearise(point: FittedSegments, names: Sequence[str], setting: Mapping[str, float]) -> ProjectedEquations:
    """Linearise the residual of a fit, some values set otherwise, in its free parameters and the named ones."""
    layout, linearisations = shoot_with_candidates(point, names, setting)
    reduced = reduced_equations(linearisations, point.problem.module.NX, layout)
    cost = sum(s.cost for s in linearisations)
    if not (np.isfinite(cost) and np.isfinite(reduced.total.information).all()):
        size = len(layout.elements)
        nothing = NormalEquations(layout, np.zeros((size, size)), np.zeros(size), np.array(np.inf))
        return ProjectedEquations(nothing, np.zeros(size), np.inf)
    rest = reduced.total.project(layout.indices(point.fit.names))
    return ProjectedEquations(rest, np.diag(reduced.total.information), cost)


def shoot_with_candidates(
    point: FittedSegments, names: Sequence[str], setting: Mapping[str, float]
) -> tuple[ParameterLayout, list[ShootingLinearisation]]:
    """One pass over the data at a fit: its free parameters and the named ones, some values set otherwise."""
    module, fitted = point.problem.module, point.fit
    free = [*fitted.names, *names]
    layout = ParameterLayout.of(free_parameters(point.problem, free), len(point.log_segments))
    columns = [module.PARAMETERS.index(n) for n in free]
    linearisations = []
    for k, (segments, states) in enumerate(zip(point.log_segments, fitted.states, strict=True)):
        parameters = kernel_parameters(module, {**fitted.of_log(k), **setting}, segments.log)
        linearisations.append(point.problem.simulator.shoot(segments, states, parameters, columns, keep_residual=False))
    return layout, linearisations


def _score_linear(effect: Effect, equations: ProjectedEquations, values: int) -> Candidate:
    """Score an effect by its linear parameters; values is the number of measured values."""
    start, sigma, gain = _estimate_effect(linear_names(effect), equations)
    indices = equations.indices(linear_names(effect))
    least = MIN_REMAINING_INFORMATION_SHARE * equations.unprojected_information[indices]
    absorbed = (np.diag(equations.rest.information)[indices] < least).any()
    trials = 1 + sum(len(p.grid) for p in effect.parameters)  # every start of a refit counts
    return Candidate(
        effect, (start,), gain / residual_variance_ratio(equations, values), {} if absorbed else sigma, trials
    )


def _score_profiled(
    point: FittedSegments, effect: Effect, grid: ProfileGrid, equations: ProjectedEquations
) -> Candidate:
    """Score an effect at every setting; where it has no other size the setting itself is what is scored."""
    problem = with_stable_step(point.problem.with_candidates(effect.name), point.fit.values)
    extended, names, found = point._replace(problem=problem), linear_names(effect), []
    for setting in grid.settings:
        here = linearise(extended, names or list(setting), setting)
        start, sigma, gain = _estimate_effect(names or list(setting), here)
        gain += _fall(equations, here)
        found.append((gain if np.isfinite(gain) else -np.inf, start.with_values(setting), sigma))
    found.sort(key=lambda f: -f[0])
    gain, sigma = (found[0][0], found[0][2]) if found else (-np.inf, {})
    starts = tuple(start for _, start, _ in found)
    gain /= residual_variance_ratio(equations, point.values)
    return Candidate(effect, starts, gain, sigma if names else {}, max(grid.trials, 1))


def _fall(equations: ProjectedEquations, here: ProjectedEquations) -> float:
    """Fall of the sum of squares from one linearisation to another; −∞ where either was not finite."""
    costs = float(equations.rest.cost), float(here.rest.cost)
    return costs[0] - costs[1] if np.isfinite(costs).all() else -np.inf


def residual_variance_ratio(equations: ProjectedEquations, values: int) -> float:
    """Mean square of the residual in noise variances, at least 1."""
    return max(equations.cost / max(values, 1), 1.0)


def _estimate_effect(names: Sequence[str], equations: ProjectedEquations) -> tuple[EffectSize, dict[str, float], float]:
    """Size of the named parameters, their standard errors in the first log, and the expected gain."""
    indices = equations.indices(names)
    step, inverse = equations.rest.solve(indices)
    size, sigma = EffectSize({}, {}), dict[str, float]()
    for k, index in enumerate(indices):
        name, _, log, *_ = equations.rest.layout.elements[index]
        (size.further.setdefault(log, {}) if log else size.values)[name] = float(step[k])
        sigma.setdefault(name, float(np.sqrt(max(inverse[k, k], 0.0))))
    return size, sigma, float(equations.rest.score[indices] @ step)


def _is_locally_nonlinear(name: str) -> bool:
    """An effect not locally linear: what it resembles at zero it need not resemble at its size."""
    return any(p.grid for p in derive.effects.find(name).parameters)


def find_twins(
    indices: Mapping[str, list[int]], information: np.ndarray, unprojected_information: np.ndarray
) -> dict[str, tuple[str, ...]]:
    """Pairs of effects with one coefficient whose projected sensitivities are parallel."""
    diagonal, least = np.diag(information), MIN_TWIN_INFORMATION_SHARE * unprojected_information
    alone = {n: found[0] for n, found in indices.items() if len(found) == 1}
    single = {n: k for n, k in alone.items() if diagonal[k] > least[k] and not _is_locally_nonlinear(n)}
    twins: dict[str, tuple[str, ...]] = {}
    for name, a in single.items():
        scale = np.sqrt(information[a, a])
        close = [
            other for other, b in single.items()
            if other != name and abs(information[a, b]) > MIN_TWIN_CORRELATION * scale * np.sqrt(information[b, b])
        ]  # fmt: skip
        twins[name] = tuple(sorted(close))
    return twins


def linear_names(effect: Effect) -> list[str]:
    """Full names of the parameters in which an effect can be scored at its absence."""
    return list(map(effect.name_of, effect.linear))


def size_names(effect: Effect) -> list[str]:
    """Full names of the parameters that say how large an effect is."""
    return list(map(effect.name_of, effect.sizes))
