"""The score test: every effect's gain at once, from one linearisation of the shooting problem.

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
from wheelpend.estimation.fit import Fit
from wheelpend.estimation.free_parameters import per_log_names
from wheelpend.estimation.normal_equations import eliminate_initial_states
from wheelpend.estimation.parameters import ParameterLayout, kernel_parameters, parameter_layout
from wheelpend.estimation.problem import EstimationProblem, with_stable_step
from wheelpend.estimation.profiled_starts import ProfileGrid
from wheelpend.estimation.segments import Segments
from wheelpend.estimation.shooting import ShootingLinearisation, shoot

MIN_TWIN_CORRELATION = (
    0.99999  # correlation of two effects' projected sensitivities above which no size tells them apart
)
MIN_REMAINING_INFORMATION_SHARE = (
    1e-3  # share of an effect's information left by base parameters, below which no size is claimed
)


class Candidate(NamedTuple):
    """An effect with the size that the linearisation gives it."""

    effect: Effect
    starts: tuple[dict[str, float], ...]  # one, or one per setting of a profiled parameter, best first; by name@log
    gain: float  # expected fall of the sum of squares with the first
    sigma: dict[str, float]  # of each coefficient, if nothing else were missing; empty where it is not believed
    trials: int  # how many independent shapes were tried for it


class ScoreTest(NamedTuple):
    """Result of the score test."""

    candidates: tuple[Candidate, ...]  # best first
    twins: dict[str, tuple[str, ...]]  # effects that these data cannot tell from another, at any size


class ProjectedNormalEquations(NamedTuple):
    """A shooting problem in some parameters, without what states and base parameters explain."""

    labels: tuple[str, ...]  # base parameters first
    information: np.ndarray  # (labels, labels)
    score: np.ndarray  # (labels,)
    unprojected_information: (
        np.ndarray
    )  # (labels,) diagonal of the information before the base parameters were taken out
    cost: float  # sum of squares
    left: float  # what states and base parameters are expected to leave of it


def score_test(
    problem: EstimationProblem, fitted: Fit, parts: Sequence[Segments], shapes: Mapping[str, ProfileGrid]
) -> ScoreTest:
    """Score every effect that the model may be missing, at a fit to these very parts.

    shapes holds the settings of the effects with a parameter that has to be profiled.
    """
    effects = [e for e in problem.candidates() if not e.event]
    plain = [e for e in effects if e.profiled is None]
    there = linearise(problem, fitted, parts, [n for e in plain for n in linear_names(e)], {})
    values = sum(p.values for p in parts)
    found = [_score_linear(e, there, values) for e in plain]
    found += [
        _score_profiled(problem, fitted, parts, e, shapes[e.name], there, values) for e in effects if e.name in shapes
    ]
    own = {e.name: _label_indices(there.labels, linear_names(e)) for e in plain}
    return ScoreTest(
        tuple(sorted(found, key=lambda c: -c.gain)), find_twins(own, there.information, there.unprojected_information)
    )


@np.errstate(over="ignore", invalid="ignore")  # a setting that cannot be simulated gives infinities, and is left out
def linearise(
    problem: EstimationProblem,
    fitted: Fit,
    parts: Sequence[Segments],
    names: Sequence[str],
    setting: Mapping[str, float],
) -> ProjectedNormalEquations:
    """Linearise the residual of a fit, some values set otherwise, in its free parameters and the named ones."""
    base = fitted.names
    plan, shots = shoot_with_candidates(problem, fitted, parts, names, setting)
    reduced, nx = eliminate_initial_states(shots, problem.module.NX, plan), problem.module.NX
    cost = sum(s.cost for s in shots)
    if not (np.isfinite(cost) and np.isfinite(reduced.information).all()):
        size = len(plan.labels)
        return ProjectedNormalEquations(
            plan.labels, np.zeros((size, size)), np.zeros(size), np.zeros(size), np.inf, np.inf
        )
    own = _label_indices(plan.labels, base)
    step = solve(reduced.information[np.ix_(own, own)], reduced.score[own])[0]
    by_states = sum(float((s.gram[:, :nx, -1] * x).sum()) for s, (x, _) in zip(shots, reduced.steps, strict=True))
    information, score = project(reduced.information, reduced.score, own)
    left = cost - by_states - float(reduced.score[own] @ step)
    return ProjectedNormalEquations(plan.labels, information, score, np.diag(reduced.information), cost, left)


def shoot_with_candidates(
    problem: EstimationProblem,
    fitted: Fit,
    parts: Sequence[Segments],
    names: Sequence[str],
    setting: Mapping[str, float],
) -> tuple[ParameterLayout, list[ShootingLinearisation]]:
    """One pass over the data at a fit: its free parameters and the named ones, some values set otherwise."""
    free = [*fitted.names, *names]
    plan, columns = (
        parameter_layout(free, per_log_names(free), len(parts)),
        [problem.module.PARAMETERS.index(n) for n in free],
    )
    values = [kernel_parameters(problem.module, {**fitted.of_log(k), **setting}, p.log) for k, p in enumerate(parts)]
    shots = [
        shoot(problem.module, part, states, parameters, columns, max_step=problem.max_step, keep_residual=False)
        for part, states, parameters in zip(parts, fitted.states, values, strict=True)
    ]
    return plan, shots


def project(information: np.ndarray, score: np.ndarray, base: list[int]) -> tuple[np.ndarray, np.ndarray]:
    """Take out of every column what the base columns explain."""
    scale = np.sqrt(np.maximum(np.diag(information), 0.0))
    scale = np.where(scale > 0.0, scale, np.inf)  # a column without any influence stays without
    scaled, right = information / np.outer(scale, scale), score / scale
    solved = np.linalg.lstsq(scaled[np.ix_(base, base)], np.column_stack([scaled[base], right[base]]), rcond=1e-11)[0]
    rest = scaled - scaled[:, base] @ solved[:, :-1]
    back = np.where(np.isfinite(scale), scale, 0.0)
    return rest * np.outer(back, back), (right - scaled[:, base] @ solved[:, -1]) * back


def _label_indices(labels: Sequence[str], names: Sequence[str]) -> list[int]:
    return [k for k, label in enumerate(labels) if label.split("@")[0] in names]


def _score_linear(effect: Effect, there: ProjectedNormalEquations, values: int) -> Candidate:
    start, sigma, gain = _estimate_effect(effect, linear_names(effect), there)
    places = _label_indices(there.labels, linear_names(effect))
    taken_up = (
        np.diag(there.information)[places] < MIN_REMAINING_INFORMATION_SHARE * there.unprojected_information[places]
    ).any()
    trials = 1 + sum(len(p.grid) for p in effect.parameters)  # every start that is tried counts
    return Candidate(effect, (start,), gain / residual_variance_ratio(there, values), {} if taken_up else sigma, trials)


def _score_profiled(
    problem, fitted, parts, effect: Effect, shape: ProfileGrid, there: ProjectedNormalEquations, values: int
) -> Candidate:
    """Score an effect at every setting; where it has no other size the setting itself is what is scored."""
    names, found, problem = (
        linear_names(effect),
        [],
        with_stable_step(problem.with_candidates(effect.name), fitted.values),
    )
    for setting in shape.settings:
        here = linearise(problem, fitted, parts, names or list(setting), setting)
        start, sigma, gain = _estimate_effect(effect, names or list(setting), here)
        gain += there.left - here.left
        found.append((gain if np.isfinite(gain) else -np.inf, {**start, **setting}, sigma))
    found.sort(key=lambda f: -f[0])
    gain, _, sigma = found[0] if found else (-np.inf, {}, {})
    starts = tuple(start for _, start, _ in found)
    return Candidate(
        effect, starts, gain / residual_variance_ratio(there, values), sigma if names else {}, max(shape.trials, 1)
    )


def residual_variance_ratio(there: ProjectedNormalEquations, values: int) -> float:
    """Mean square of the residual in noise variances, at least 1."""
    return max(there.cost / max(values, 1), 1.0)


def _estimate_effect(
    effect: Effect, names: Sequence[str], there: ProjectedNormalEquations
) -> tuple[dict[str, float], dict[str, float], float]:
    """Size and standard error of an effect's parameters and the expected gain.

    Sizes of further logs, where they have their own, come as name@log; a standard error is that of the first.
    """
    places = _label_indices(there.labels, names)
    step, inverse = solve(there.information[np.ix_(places, places)], there.score[places])
    start: dict[str, float] = {}
    sigma: dict[str, float] = {}
    for k, place in enumerate(places):
        name, _, log = there.labels[place].partition("@")
        start[f"{name}@{log}" if int(log or 0) else name] = float(step[k])
        sigma.setdefault(name, float(np.sqrt(max(inverse[k, k], 0.0))))
    return start, sigma, float(there.score[places] @ step)


@np.errstate(over="ignore", invalid="ignore")  # a column without any influence
def solve(block: np.ndarray, right: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Solution of normal equations scaled to a unit diagonal, and their inverse; flat directions do not move."""
    scale = np.sqrt(np.maximum(np.diag(block), 1e-300))
    inverse = np.linalg.pinv(block / np.outer(scale, scale), rcond=1e-9, hermitian=True) / np.outer(scale, scale)
    return inverse @ right, inverse


def _is_locally_nonlinear(name: str) -> bool:
    """Whether an effect is not locally linear: what it resembles at zero it need not resemble at its size."""
    return any(p.grid for p in derive.effects.find(name).parameters)


def find_twins(own: Mapping[str, list[int]], information: np.ndarray, raw: np.ndarray) -> dict[str, tuple[str, ...]]:
    """Pairs of effects with one coefficient whose projected sensitivities are parallel."""
    single = {
        n: p[0]
        for n, p in own.items()
        if len(p) == 1 and information[p[0], p[0]] > 1e-7 * raw[p[0]] and not _is_locally_nonlinear(n)
    }
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
    return [f"{effect.name}.{p.name}" for p in effect.linear]


def size_names(effect: Effect) -> list[str]:
    """Full names of the parameters that say how large an effect is."""
    return [f"{effect.name}.{p.name}" for p in effect.sizes]
