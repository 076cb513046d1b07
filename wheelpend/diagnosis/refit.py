"""Refits of a model with one effect more: a leading one of a score test, or one that the user names."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np

import derive
from derive.effects import Effect, InternalPlay
from derive.parameter_name import effect_of, full_name, short_name
from wheelpend.diagnosis.backlash_start import find_backlash_start
from wheelpend.diagnosis.criteria import MIDDLE_HORIZON_SHARE, SHORT_HORIZON_SHARE
from wheelpend.diagnosis.equation_scores import EquationScore, equation_scores
from wheelpend.diagnosis.events import find_events, fit_event
from wheelpend.diagnosis.score_test import Candidate, EffectSize, ScoreTest, linear_names, score_test
from wheelpend.estimation.continuation import fit_model, fit_segments
from wheelpend.estimation.criteria import MAX_EXPLAINED_ERROR_RATIO
from wheelpend.estimation.data import shortened_segments
from wheelpend.estimation.fit import Fit
from wheelpend.estimation.free_parameters import free_names, per_log_names
from wheelpend.estimation.problem import EstimationProblem, extended_effects, with_stable_step
from wheelpend.estimation.profiled_starts import ProfileGrid, profile_grids
from wheelpend.estimation.segments import Segments

MAX_PROFILED_STARTS = 2  # best settings of a profiled parameter from which a refit starts
PROBE_ITERATIONS = 4  # of a refit from every start
SHORT_FIT_ITERATIONS = 8  # of the refits that lead after those
MAX_CONTINUED_FITS = 3  # number of these
MAX_REFIT_SEGMENTS = 80  # segments of a refit that only prepares
MAX_START_SEGMENTS = 40  # segments of one that only finds a start
MIN_SEGMENTS_BEYOND_PARAMETERS = 15  # segments over parameters below which significance is taken from shorter segments

Progress = Callable[[str], None]
ScoredStart = tuple[dict[str, float], ScoreTest]  # values, and the score test of short segments at them
CandidateStart = tuple[dict[str, float], Candidate]  # values, and the size that an effect's score suggests there


def short_score_tests(
    problem: EstimationProblem, short: Fit, start: dict[str, float], grids: Mapping[str, ProfileGrid], corrupted: bool
) -> list[ScoredStart]:
    """Score every effect on short segments: at the fit, and where a missing effect corrupts that, at its starts too.

    A base fit that bends every parameter to a missing effect can hide that very effect from its own linearisation.
    """
    horizon = SHORT_HORIZON_SHARE * problem.horizon
    found = [(short.values, score_test(problem, short, shortened_segments(problem, horizon), grids))]
    free = free_names(problem, problem.model.effects)
    log_segments = shortened_segments(problem, horizon, max_segments=MAX_START_SEGMENTS)
    for origin in (start, *problem.fallback_starts) if corrupted else ():
        values = {**short.values, **origin}
        fitted = fit_segments(problem, log_segments, values, free, start_per_log=short.per_log, rounds=0)
        if np.isfinite(fitted.cost):
            found.append((values, score_test(problem, fitted, log_segments, grids)))
    return found


def significance_fit(problem: EstimationProblem, fitted: Fit) -> Fit:
    """The fit whose segments are counted for significance: the full one, or on a short log one with more segments."""
    segment_count = sum(len(s.bounds) for s in problem.data.estimation)
    if segment_count - len(fitted.free) >= MIN_SEGMENTS_BEYOND_PARAMETERS:
        return fitted
    share = max(SHORT_HORIZON_SHARE, segment_count / (len(fitted.free) + 2.0 * MIN_SEGMENTS_BEYOND_PARAMETERS))
    log_segments = shortened_segments(problem, share * problem.horizon, max_segments=1000)
    return fit_segments(problem, log_segments, fitted.values, fitted.names, start_per_log=fitted.per_log)


def free_names_with(problem: EstimationProblem, base: Fit, effect: str) -> list[str]:
    """Names of a fit's parameters, with those of one more effect in place of the effects that it contains."""
    replaced = problem.replaced(effect)
    return [*(n for n in base.names if effect_of(n) not in replaced), *derive.effects.find(effect).full_names]


def replace_contained(
    problem: EstimationProblem, effect: Effect, values: Mapping[str, float], size: EffectSize
) -> tuple[dict[str, float], EffectSize]:
    """A start, and the size of an effect there, once it has taken the place of the present effects that it replaces.

    Those that it contains are added to it; of the one that it approaches it has the size.
    """
    rest, enlarged, contained = dict(values), dict(size.values), problem.module.CONTAINS.get(effect.name, {})
    for smaller in problem.replaced(effect.name):
        names = linear_names(derive.effects.find(smaller))
        if smaller in contained:
            for name, row in zip(linear_names(effect), contained[smaller], strict=True):
                enlarged[name] = enlarged.get(name, 0.0) + float(np.dot(row, [values[n] for n in names]))
        else:
            enlarged |= {full_name(effect.name, short_name(n)): values[n] for n in names}
        rest |= dict.fromkeys(names, 0.0)
    return rest, size.with_values(enlarged)


def starts_for(score_tests: list[ScoredStart], name: str) -> list[CandidateStart]:
    """Starts of an effect's refits: the values of each score test with the size that it suggests there."""
    return [(values, c) for values, found in score_tests for c in found.candidates if c.effect.name == name]


def with_equation_start(
    starts: Sequence[CandidateStart], scores: Mapping[str, EquationScore], short: Fit
) -> list[CandidateStart]:
    """Starts of an effect's refits, and that of a regression with it where there is one."""
    found = scores.get(starts[0][1].effect.name)
    if found is None:
        return list(starts)
    return [*starts, ({**short.values, **found.rest()}, starts[0][1]._replace(starts=(EffectSize(found.size(), {}),)))]


def refit(problem: EstimationProblem, short: Fit, starts: Sequence[CandidateStart]) -> Fit:
    """Refit the model with one more effect on short segments, from several points and sizes, with fresh states."""
    effect = starts[0][1].effect
    found = continue_fit(problem, multistart_fit(problem, short, starts), effect.name)
    if not isinstance(effect.enters, InternalPlay) or found.error < MAX_EXPLAINED_ERROR_RATIO * problem.floor:
        return found
    return min((f for f in (found, refit_backlash(problem, short, effect)) if f is not None), key=lambda f: f.cost)


def refit_backlash(problem: EstimationProblem, short: Fit, effect: Effect) -> Fit | None:
    """Refit with backlash from a start before any fit that follows its contacts; None where that does not pay."""
    origin = {**short.values, **problem.unfitted_start}
    problem = with_stable_step(problem.with_candidates(effect.name), origin)
    free = free_names_with(problem, short, effect.name)
    start = find_backlash_start(problem, origin, short.per_log, free, effect.full_names[0])
    if start is None:
        return None
    log_segments = _middle_segments(problem)
    return fit_segments(problem, log_segments, start, free, start_per_log=short.per_log)


def multistart_fit(problem: EstimationProblem, short: Fit, starts: Sequence[CandidateStart]) -> Fit:
    """The best of a few iterations from each of several starts, on segments so short that it is almost linear.

    A start from which the fit reaches the noise ends the search: it cannot get better.
    """
    effect = starts[0][1].effect
    problem = with_stable_step(problem.with_candidates(effect.name), short.values)
    free, fits = free_names_with(problem, short, effect.name), []
    count = MAX_START_SEGMENTS if effect.releases else MAX_REFIT_SEGMENTS
    log_segments = shortened_segments(problem, SHORT_HORIZON_SHARE * problem.horizon, max_segments=count)

    def reaches_noise(start: Mapping[str, float], per_log: Sequence[Mapping[str, float]], iterations: int) -> bool:
        fits.append(fit_segments(problem, log_segments, start, free, start_per_log=per_log, rounds=iterations))
        return fits[-1].error < MAX_EXPLAINED_ERROR_RATIO * problem.floor

    first = SHORT_FIT_ITERATIONS if effect.releases else PROBE_ITERATIONS  # an internal coordinate goes astray at first
    kept = _without_replaced(problem, effect, short.per_log)
    points = (_start_with_sizes(v, kept, size) for v, size in _start_sizes(problem, effect, starts))
    if not any(reaches_noise(start, per_log, first) for start, per_log in points):
        for f in sorted(fits, key=lambda f: f.cost)[:MAX_CONTINUED_FITS]:
            if not f.converged and reaches_noise(f.values, f.per_log, SHORT_FIT_ITERATIONS):
                break
    return min(fits, key=lambda f: f.cost)


def _start_sizes(
    problem: EstimationProblem, effect: Effect, starts: Sequence[CandidateStart]
) -> list[tuple[dict[str, float], EffectSize]]:
    """Values and sizes from which an effect's refits start.

    Effects that are not locally linear (a delay, a threshold) start from a grid of sizes as well. One of which no score
    suggests a size, as where nothing can be linearised, starts from its typical one.
    """
    suggested = [
        replace_contained(problem, effect, values, size)
        for values, candidate in starts
        for size in candidate.starts[:MAX_PROFILED_STARTS]
    ]
    found = [(values, clip_to_bounds(effect, size)) for values, size in suggested]
    found = found or [(starts[0][0], EffectSize({effect.name_of(p): p.typical for p in effect.parameters}, {}))]
    for parameter in effect.parameters:
        name = effect.name_of(parameter)
        found += [(found[0][0], found[0][1].with_values({name: size})) for size in parameter.grid]
    return found


def _middle_segments(problem: EstimationProblem) -> tuple[Segments, ...]:
    """Segments on which refits are compared."""
    return shortened_segments(problem, MIDDLE_HORIZON_SHARE * problem.horizon, max_segments=MAX_REFIT_SEGMENTS)


def continue_fit(problem: EstimationProblem, start: Fit, effect: str, rounds: int = 15) -> Fit:
    """A fit with an effect taken to its end, or for a few iterations, and to longer segments."""
    problem, found = with_stable_step(problem.with_candidates(effect), start.values), start
    for share in (MIDDLE_HORIZON_SHARE,) if start.converged else (SHORT_HORIZON_SHARE, MIDDLE_HORIZON_SHARE):
        log_segments = shortened_segments(problem, share * problem.horizon, max_segments=MAX_REFIT_SEGMENTS)
        found = fit_segments(
            problem, log_segments, found.values, start.names, start_per_log=found.per_log, rounds=rounds
        )
    return found


def fit_from_full_score_test(problem: EstimationProblem, base: Fit, candidate: Candidate) -> Fit:
    """A fit of middling segments that starts from the full ones' fit and the size that they suggest."""
    effect = candidate.effect
    problem = with_stable_step(problem.with_candidates(effect.name), base.values)
    values, size = replace_contained(problem, effect, base.values, candidate.starts[0])
    kept = _without_replaced(problem, effect, base.per_log)
    start, per_log = _start_with_sizes(values, kept, clip_to_bounds(effect, size))
    free = free_names_with(problem, base, effect.name)
    return fit_segments(problem, _middle_segments(problem), start, free, start_per_log=per_log)


def _without_replaced(
    problem: EstimationProblem, effect: Effect, per_log: Sequence[Mapping[str, float]]
) -> list[dict[str, float]]:
    """Each log's own values, without those of present effects that an effect replaces: they go with their effect."""
    replaced = problem.replaced(effect.name)
    return [{n: v for n, v in values.items() if effect_of(n) not in replaced} for values in per_log]


def _start_with_sizes(
    values: Mapping[str, float], per_log: Sequence[Mapping[str, float]], size: EffectSize
) -> tuple[dict[str, float], list[dict[str, float]]]:
    """A start, shared and of each log, with the size of an effect."""
    names = per_log_names(list(size.values))
    own = [{**v, **{n: size.value(n, log) for n in names}} for log, v in enumerate(per_log)]
    return {**values, **size.values}, own


def clip_to_bounds(effect: Effect, size: EffectSize) -> EffectSize:
    """A size moved into the physically possible range."""
    ranges = {effect.name_of(p): (p.minimum, p.maximum) for p in effect.parameters}

    def clipped(values: Mapping[str, float]) -> dict[str, float]:
        return {n: float(np.clip(v, *ranges[n])) for n, v in values.items()}

    return EffectSize(clipped(size.values), {log: clipped(v) for log, v in size.further.items()})


def refit_with(
    problem: EstimationProblem, start: dict[str, float], base: Fit, effect: str
) -> tuple[EstimationProblem, Fit]:
    """Fit the problem's model plus one effect from the sizes that its score suggests, or where an event fits best.

    Returns the problem that judges it, which is another one for an event, and the fit.
    """
    present = problem.model.effects
    if derive.effects.find(effect).event:
        candidates = [c for c in find_events(problem, base, base.error) if c.effect.name == effect]
        return fit_event(problem, base, candidates, free_names(problem, present))
    short = fit_model(problem, start, free_names(problem, present), horizons=(SHORT_HORIZON_SHARE,))
    larger = [n for n, within in problem.module.CONTAINS.items() if effect in within]
    grids = profile_grids(problem, short, [problem.effect(n) for n in (effect, *larger)])
    corrupted = base.error > MAX_EXPLAINED_ERROR_RATIO * problem.floor
    score_tests = short_score_tests(problem, short, start, grids, corrupted=corrupted)
    starts = with_equation_start(starts_for(score_tests, effect), equation_scores(problem, base.values), short)
    partial = refit(problem, short, starts)
    free = free_names(problem, extended_effects(problem.model, effect))
    extended = with_stable_step(problem.with_candidates(effect), partial.values)
    found = fit_model(extended, partial.values, free, horizons=(1.0,), start_per_log=partial.per_log)
    if found.error > MAX_EXPLAINED_ERROR_RATIO * problem.floor:  # it may have gone astray where a larger one does not
        for name in larger:
            around = refit(problem, short, starts_for(score_tests, name))
            values = with_nested_effect(problem, name, effect, around.values)
            other = fit_model(extended, values, free, horizons=(1.0,), start_per_log=partial.per_log)
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
    else:  # an effect that it approaches or covers has parameters of the same names
        alike = [full_name(larger, short_name(n)) for n in names]
        known = all(n in values for n in alike)
        found = np.array([values[n] for n in alike]) if known else np.zeros(0)
    if not known:
        return dict(values)
    rest = {n: v for n, v in values.items() if effect_of(n) != larger}
    return rest | dict(zip(names, map(float, found), strict=True))
