"""Refits of a model with one effect more: the best of every screening, or one that the user names."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np

import derive
from derive.effects import Effect, InnerPlay
from wheelpend.diagnosis.backlash_start import find_backlash_start
from wheelpend.diagnosis.events import find_events, fit_event
from wheelpend.diagnosis.score_test import Candidate, ScoreTest, linear_names, score_test
from wheelpend.estimation.continuation import fit_model, fit_segments
from wheelpend.estimation.criteria import MAX_EXPLAINED_ERROR_RATIO
from wheelpend.estimation.data import shortened_segments
from wheelpend.estimation.fit import Fit
from wheelpend.estimation.free_parameters import free_names, per_log_names
from wheelpend.estimation.problem import EstimationProblem, extended_effects, with_stable_step
from wheelpend.estimation.profiled_starts import ProfileGrid, profile_grids

MAX_PROFILED_STARTS = 2  # best settings of a profiled parameter from which a refit starts
PROBE_ITERATIONS, SHORT_FIT_ITERATIONS = (
    4,
    8,
)  # rounds of a refit that every start is given, and those that lead after them
MAX_CONTINUED_FITS = 3  # so many of them
MAX_REFIT_SEGMENTS, MAX_START_SEGMENTS = (
    80,
    40,
)  # segments of a refit that only prepares, and of what only tells where to start
SHORT_HORIZON_SHARE = 0.1  # of the horizon: segments so short that the problem is almost linear
MIN_SEGMENTS_BEYOND_PARAMETERS = 15  # segments over parameters below which significance is taken from shorter segments

Progress = Callable[[str], None]


def short_score_tests(
    problem: EstimationProblem, short: Fit, start: dict[str, float], shapes: Mapping[str, ProfileGrid], corrupted: bool
) -> list[tuple[dict[str, float], ScoreTest]]:
    """Score every effect on short segments: at the fit, and where a missing effect corrupts that, at its starts too.

    A base fit that bends every parameter to a missing effect can hide that very effect from its own linearisation.
    """
    found = [
        (
            short.values,
            score_test(problem, short, shortened_segments(problem, SHORT_HORIZON_SHARE * problem.horizon), shapes),
        )
    ]
    free, parts = (
        free_names(problem, problem.model.effects),
        shortened_segments(problem, SHORT_HORIZON_SHARE * problem.horizon, max_segments=MAX_START_SEGMENTS),
    )
    for origin in (start, *problem.fallback_starts) if corrupted else ():
        values = {**short.values, **origin}
        there = fit_segments(problem, parts, values, free, start_per_log=short.per_log, rounds=0)
        if np.isfinite(there.cost):
            found.append((values, score_test(problem, there, parts, shapes)))
    return found


def significance_fit(problem: EstimationProblem, fitted: Fit, begun: Fit) -> Fit:
    """The fit whose segments are counted for significance: the full one, or on a short log one with more segments."""
    segments = sum(len(p.bounds) for p in problem.training)
    if segments - len(fitted.free) >= MIN_SEGMENTS_BEYOND_PARAMETERS:
        return fitted
    share = max(SHORT_HORIZON_SHARE, segments / (len(fitted.free) + 2.0 * MIN_SEGMENTS_BEYOND_PARAMETERS))
    free = fitted.names
    parts = shortened_segments(problem, share * problem.horizon, max_segments=1000)
    return fit_segments(problem, parts, begun.values, free, start_per_log=begun.per_log)


def free_names_with(problem: EstimationProblem, base: Fit, effect: str) -> list[str]:
    """Names of what a fit has, with an effect more in place of those that it contains."""
    own = base.names
    gone = problem.replaced(effect)
    return [*(n for n in own if n.partition(".")[0] not in gone), *derive.effects.find(effect).full_names]


def replace_contained(
    problem: EstimationProblem, effect: Effect, values: Mapping[str, float], size: Mapping[str, float]
) -> tuple[dict, dict]:
    """A start, and the size of an effect there, once it has taken the place of the present effects that it contains."""
    left, grown = dict(values), dict(size)
    for smaller in problem.replaced(effect.name):
        names, weights = linear_names(derive.effects.find(smaller)), problem.module.CONTAINS[effect.name][smaller]
        for name, row in zip(linear_names(effect), weights, strict=True):
            grown[name] = grown.get(name, 0.0) + float(np.dot(row, [values[n] for n in names]))
        left |= dict.fromkeys(names, 0.0)
    return left, grown


def starts_for(
    score_tests: list[tuple[dict[str, float], ScoreTest]], name: str
) -> list[tuple[dict[str, float], Candidate]]:
    """Where an effect's refits may start: each screening's point with the size it suggests there."""
    return [(values, c) for values, found in score_tests for c in found.candidates if c.effect.name == name]


def refit(problem: EstimationProblem, short: Fit, beginnings: Sequence[tuple[dict[str, float], Candidate]]) -> Fit:
    """Refit the model with one more effect on short segments, from several points and sizes, with fresh states."""
    effect = beginnings[0][1].effect
    found = continue_fit(problem, multistart_fit(problem, short, beginnings), effect.name)
    if not isinstance(effect.enters, InnerPlay) or found.error < MAX_EXPLAINED_ERROR_RATIO * problem.floor:
        return found
    return min((f for f in (found, refit_backlash(problem, short, effect)) if f is not None), key=lambda f: f.cost)


def refit_backlash(problem: EstimationProblem, short: Fit, effect: Effect) -> Fit | None:
    """Refit with a play from a start before any fit that follows its contacts; None where that does not pay."""
    origin = {**short.values, **(problem.fallback_starts[0] if problem.fallback_starts else {})}
    problem, free = (
        with_stable_step(problem.with_candidates(effect.name), origin),
        free_names_with(problem, short, effect.name),
    )
    begun = find_backlash_start(problem, origin, short.per_log, free, effect.full_names[0])
    if begun is None:
        return None
    parts = shortened_segments(problem, 0.3 * problem.horizon, max_segments=MAX_REFIT_SEGMENTS)
    return fit_segments(problem, parts, begun, free, start_per_log=short.per_log)


def multistart_fit(
    problem: EstimationProblem, short: Fit, beginnings: Sequence[tuple[dict[str, float], Candidate]]
) -> Fit:
    """The best of a few rounds from each of several points and sizes, on segments so short that it is almost linear.

    Effects that are not locally linear (a delay, a threshold) start from a grid of sizes as well.
    """
    effect = beginnings[0][1].effect
    problem = with_stable_step(problem.with_candidates(effect.name), short.values)
    free = free_names_with(problem, short, effect.name)
    placed = [replace_contained(problem, effect, values, s) for n, (values, c) in enumerate(beginnings)
              for s in c.starts[:MAX_PROFILED_STARTS]]  # fmt: skip
    trials = [(values, clip_to_bounds(effect, size)) for values, size in placed]
    for parameter in effect.parameters:
        name = f"{effect.name}.{parameter.name}"
        trials += [(trials[0][0], {**trials[0][1], name: size}) for size in parameter.grid]
    parts, fits = (
        shortened_segments(
            problem,
            SHORT_HORIZON_SHARE * problem.horizon,
            max_segments=MAX_START_SEGMENTS if effect.frees else MAX_REFIT_SEGMENTS,
        ),
        [],
    )

    def reaches(start: Mapping[str, float], own: Sequence[Mapping[str, float]], rounds: int) -> bool:
        fits.append(fit_segments(problem, parts, start, free, start_per_log=own, rounds=rounds))
        return fits[-1].error < MAX_EXPLAINED_ERROR_RATIO * problem.floor  # it cannot get better than the noise

    glance = SHORT_FIT_ITERATIONS if effect.frees else PROBE_ITERATIONS  # what frees something goes astray at first
    places = (_start_with_sizes(values, short.per_log, size) for values, size in trials)
    if not any(reaches(start, own, glance) for start, own in places):
        for f in sorted(fits, key=lambda f: f.cost)[:MAX_CONTINUED_FITS]:
            if not f.converged and reaches(f.values, f.per_log, SHORT_FIT_ITERATIONS):
                break
    return min(fits, key=lambda f: f.cost)


def continue_fit(problem: EstimationProblem, begun: Fit, effect: str, rounds: int = 15) -> Fit:
    """A fit with an effect taken to its end, or for a few rounds, and to longer segments."""
    problem = with_stable_step(problem.with_candidates(effect), begun.values)
    free = begun.names
    for share in (0.3,) if begun.converged else (SHORT_HORIZON_SHARE, 0.3):
        parts = shortened_segments(problem, share * problem.horizon, max_segments=MAX_REFIT_SEGMENTS)
        begun = fit_segments(problem, parts, begun.values, free, start_per_log=begun.per_log, rounds=rounds)
    return begun


def fit_from_full_score_test(problem: EstimationProblem, base: Fit, candidate: Candidate) -> Fit:
    """A fit of middling segments that starts from the full ones' fit and the size that they suggest."""
    effect = candidate.effect
    problem = with_stable_step(problem.with_candidates(effect.name), base.values)
    values, size = replace_contained(problem, effect, base.values, candidate.starts[0])
    start, own = _start_with_sizes(values, base.per_log, clip_to_bounds(effect, size))
    parts = shortened_segments(problem, 0.3 * problem.horizon, max_segments=MAX_REFIT_SEGMENTS)
    return fit_segments(problem, parts, start, free_names_with(problem, base, effect.name), start_per_log=own)


def _start_with_sizes(values: Mapping[str, float], per_log: Sequence[Mapping[str, float]], size: Mapping[str, float]):
    """A start with sizes, which may be those of each log, by name@log."""
    first = {n: v for n, v in size.items() if "@" not in n}
    own = [{**o, **{n: size.get(f"{n}@{log}", first[n]) for n in per_log_names(list(first))}}
           for log, o in enumerate(per_log)]  # fmt: skip
    return {**values, **first}, own


def clip_to_bounds(effect: Effect, start: dict[str, float]) -> dict[str, float]:
    """A start moved into the physically possible range."""
    ranges = {f"{effect.name}.{p.name}": (p.minimum, p.maximum) for p in effect.parameters}
    return {n: float(np.clip(v, *ranges[n.split("@")[0]])) for n, v in start.items()}


def refit_with(
    problem: EstimationProblem, start: dict[str, float], base: Fit, effect: str
) -> tuple[EstimationProblem, Fit]:
    """Fit the study's model plus one effect from the sizes that the screening suggests, or where an event fits best.

    Returns the study that judges it, which is another one for an event, and the fit.
    """
    present = problem.model.effects
    if derive.effects.find(effect).event:
        places = [p for p in find_events(problem, base, base.error) if p.effect.name == effect]
        return fit_event(problem, base, places, free_names(problem, present))
    short = fit_model(problem, start, free_names(problem, present), horizons=(SHORT_HORIZON_SHARE,))
    larger = [n for n, within in problem.module.CONTAINS.items() if effect in within]
    shapes = profile_grids(problem, short, [problem.effect(n) for n in (effect, *larger)])
    near = short_score_tests(
        problem, short, start, shapes, corrupted=base.error > MAX_EXPLAINED_ERROR_RATIO * problem.floor
    )
    begun = refit(problem, short, starts_for(near, effect))
    free, able = (
        free_names(problem, extended_effects(problem.model, effect)),
        with_stable_step(problem.with_candidates(effect), begun.values),
    )
    found = fit_model(able, begun.values, free, horizons=(1.0,), start_per_log=begun.per_log)
    for name in (
        larger if found.error > MAX_EXPLAINED_ERROR_RATIO * problem.floor else ()
    ):  # a larger one may go where it goes astray
        around = refit(problem, short, starts_for(near, name))
        other = fit_model(
            able,
            with_nested_effect(problem, name, effect, around.values),
            free,
            horizons=(1.0,),
            start_per_log=begun.per_log,
        )
        found = other if other.cost < found.cost else found
    return problem, found


def with_nested_effect(
    problem: EstimationProblem, larger: str, smaller: str, values: Mapping[str, float]
) -> dict[str, float]:
    """Values with an effect in place of a larger one that contains or approaches it, as near to that as it can be.

    They stay as they are where the larger effect is not among them.
    """
    sizes, names = (linear_names(derive.effects.find(e)) for e in (larger, smaller))
    if smaller in problem.module.CONTAINS.get(larger, {}):
        weights = np.array(problem.module.CONTAINS[larger][smaller])
        known = all(n in values for n in sizes)
        found = np.linalg.pinv(weights) @ [values[n] for n in sizes] if known else np.zeros(0)
    else:  # what one approaches has parameters of the same names
        alike = [f"{larger}.{n.partition('.')[2]}" for n in names]
        known = all(n in values for n in alike)
        found = np.array([values[n] for n in alike]) if known else np.zeros(0)
    if not known:
        return dict(values)
    rest = {n: v for n, v in values.items() if n.partition(".")[0] != larger}
    return rest | dict(zip(names, map(float, found), strict=True))
