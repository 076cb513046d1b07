"""Events, which happen once, in one log: when they begin and end, and how much of the error they account for.

An effect that is an event cannot be judged on data after it, so it is judged on every second segment of its own log
while the others are fitted. It is never carried to another log.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from derive.effects import Effect
from wheelpend.diagnosis.criteria import MIN_REMAINING_INFORMATION_SHARE
from wheelpend.diagnosis.score_test import linear_names
from wheelpend.estimation.continuation import fit_segments
from wheelpend.estimation.criteria import MAX_NOISE_LEVEL_ERROR_RATIO
from wheelpend.estimation.data import with_interleaved_validation
from wheelpend.estimation.fit import Fit
from wheelpend.estimation.free_parameters import event_time_names
from wheelpend.estimation.normal_equations import NormalEquations, reduced_equations
from wheelpend.estimation.parameters import FreeParameter, ParameterLayout, kernel_parameters
from wheelpend.estimation.problem import EstimationProblem
from wheelpend.estimation.segments import Segments
from wheelpend.estimation.states import fit_states, initial_states
from wheelpend.logs.log import segment_bounds

EVENT_HORIZON_SHARE = 0.2  # of the horizon: length of the segments between whose ends an event is looked for
TIME_SEARCH_SPANS = (2.0, 0.5, 0.1)  # of that length, before and after a moment, among which a better one is looked for
TIME_GRID_POINTS_PER_SIDE = 8  # moments tried before and after, in the end at single samples
TIME_REFIT_ITERATIONS = 5  # of the other parameters, after each of the searches
TIME_BEFORE_LOGS_S = -1.0  # s: a moment before every log


class EventCandidate(NamedTuple):
    """The place in the logs where an event fits best, linearised at some values of the other parameters."""

    effect: Effect
    log: int
    start: dict[str, float]  # by effect.parameter
    gain: float  # expected fall of the sum of squares, in noise variances
    trials: int  # number of places that were compared
    values: dict[str, float]  # of other parameters, at which it was found
    throughout: float = 0.0  # what of that gain the same would bring that lasts for the whole log

    @property
    def gain_by_time(self) -> float:
        """Expected fall of the sum of squares because it lasts for a time: what acts all the time is no event."""
        return self.gain - self.throughout


class EventInformation(NamedTuple):
    """Normal equations, segment by segment, of an event that lasts throughout, beside the model's own parameters."""

    segments: NormalEquations  # the own parameters first, the event's size last
    noise: float  # mean square of the residual in noise variances, at least 1

    def between(self, begin: np.ndarray, end: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Score and information (pairs,) of an event from one segment to before another, own parameters refitted."""
        last = len(self.segments.layout.elements) - 1
        score, information, mixed = (
            np.concatenate([np.zeros((1, *x.shape[1:])), np.cumsum(x, axis=0)])
            for x in (
                self.segments.score[:, last],
                self.segments.information[:, last, last],
                self.segments.information[:, last, :last],
            )
        )
        step, inverse = self.segments.sum().solve(range(last))
        with_own, alone = mixed[end] - mixed[begin], information[end] - information[begin]
        pull = score[end] - score[begin] - with_own @ step
        weight = alone - np.einsum("pi,ij,pj->p", with_own, inverse, with_own)
        pull = np.where(weight > MIN_REMAINING_INFORMATION_SHARE * alone, pull, 0.0)
        return pull, np.maximum(weight, MIN_REMAINING_INFORMATION_SHARE * alone + 1e-300)


def candidate_events(problem: EstimationProblem) -> tuple[Effect, ...]:
    """Events that the model may be missing."""
    return tuple(e for e in problem.candidates() if e.event)


def find_events(problem: EstimationProblem, fitted: Fit, error: float) -> list[EventCandidate]:
    """The best place of each event, from one linearisation of short segments at a fit and at each start before any fit.

    A fit that is bent to an event may see it where it is not; one whose error lies in the noise is not bent. The
    largest gain comes first.
    """
    bent = not error < MAX_NOISE_LEVEL_ERROR_RATIO * problem.floor
    origins: tuple[Mapping[str, float], ...] = ({}, *(problem.fallback_starts if bent else ()))
    found = []
    for effect in candidate_events(problem):
        for origin in origins:
            candidates = [locate_event(problem, fitted, origin, effect, k) for k in range(len(problem.data.estimation))]
            found.append(max(candidates, key=lambda c: c.gain))
    return sorted(found, key=lambda c: -c.gain)


def locate_event(
    problem: EstimationProblem, fitted: Fit, origin: Mapping[str, float], effect: Effect, number: int
) -> EventCandidate:
    """The run of short segments of one log in which an event lowers the sum of squares most."""
    log, times = problem.data.estimation[number].log, event_time_names(effect.name)
    bounds = np.ascontiguousarray(segment_bounds(log, EVENT_HORIZON_SHARE * problem.horizon))
    segments = replace(problem.data.estimation[number], bounds=bounds)
    values = {**fitted.of_log(number), **origin}
    information = event_information(problem, segments, values, effect, fitted.names)
    count = len(bounds)
    begin, end = np.triu_indices(count + 1, 1)
    if len(times) == 1:  # it lasts to the end of the log
        begin, end = np.arange(1, count), np.full(count - 1, count)
    pull, weight = information.between(begin, end)
    best = int(np.argmax(pull**2 / weight))
    lasting, weight_of_all = information.between(np.array([0]), np.array([count]))
    throughout = float(lasting[0] ** 2 / weight_of_all[0]) / information.noise
    middle = 0.5 * (log.t[bounds[:, 0]] + log.t[bounds[:, 1] - 1])
    start = dict(zip(times, [float(middle[begin[best]]), float(middle[end[best] - 1])], strict=False))
    start |= dict.fromkeys(linear_names(effect), float(pull[best] / weight[best]))
    gain = float(pull[best] ** 2 / weight[best]) / information.noise
    return EventCandidate(effect, number, start, gain, len(begin), dict(origin), throughout)


def event_information(
    problem: EstimationProblem, segments: Segments, values: Mapping[str, float], effect: Effect, own: Sequence[str]
) -> EventInformation:
    """Normal equations of an event that lasts throughout a log's segments, beside the model's own parameters."""
    module = problem.module
    span = (TIME_BEFORE_LOGS_S, float(segments.log.t[-1]) + 1.0)
    throughout = dict(zip(event_time_names(effect.name), span, strict=False))
    parameters = kernel_parameters(module, {**values, **throughout}, segments.log)
    first = initial_states(module, segments)
    states, _ = fit_states(problem.simulator, segments, first, parameters, rounds=2, keep_residual=False)
    names = [*own, *linear_names(effect)]
    columns = [module.PARAMETERS.index(n) for n in names]
    layout = ParameterLayout.of(map(FreeParameter, names), 1)
    linearisation = problem.simulator.shoot(segments, states, parameters, columns, keep_residual=False)
    equations = reduced_equations([linearisation], module.NX, layout).segments.finite()
    squares = np.nan_to_num([float(g[-1, -1]) for g in linearisation.gram])
    return EventInformation(equations, max(float(squares.sum()) / max(segments.values, 1), 1.0))


def fit_event(
    problem: EstimationProblem, base: Fit, candidates: Sequence[EventCandidate], free: Sequence[str]
) -> tuple[EstimationProblem, Fit]:
    """The best fit with an event at one of several places, and the problem that judges it.

    When it happened is taken from the whole log; segments in which it begins or ends are then among those that are
    fitted, and of the others every second one is held out.
    """
    alternate = with_interleaved_validation(problem)
    fits = [(fit_at_event_times(alternate, base, c, free), c) for c in candidates]
    best, candidate = min(fits, key=lambda pair: pair[0].cost)
    names = [*best.names, *event_time_names(candidate.effect.name)]
    whole_logs = tuple(
        replace(s, bounds=np.ascontiguousarray(segment_bounds(s.log, problem.horizon), dtype=np.int64))
        for s in problem.data.estimation
    )
    best = refine_event_times(problem, whole_logs, best, candidate)
    found = fit_segments(problem, whole_logs, best.values, names, start_per_log=best.per_log, rounds=40)
    known, present = found.of_log(candidate.log), (*problem.model.effects, candidate.effect.name)
    moments = [known[n] for e in present for n in event_time_names(e) if n in known]
    judging = with_interleaved_validation(problem, moments)
    fitted = fit_segments(judging, judging.data.estimation, found.values, names, start_per_log=found.per_log, rounds=40)
    return judging, fitted


def fit_at_event_times(problem: EstimationProblem, base: Fit, candidate: EventCandidate, free: Sequence[str]) -> Fit:
    """Fit the model with an event at given moments in one log and in no other, from where it fits best."""
    moments = event_time_names(candidate.effect.name)
    absent = {n: 0.0 for n in candidate.start if n not in moments}
    per_log = [dict(base.per_log[k]) if k < len(base.per_log) else {} for k in range(len(problem.data.estimation))]
    for number, values in enumerate(per_log):
        values |= candidate.start if number == candidate.log else {**candidate.start, **absent}
    names = [n for n in dict.fromkeys([*free, *candidate.effect.full_names]) if n not in moments]
    return fit_segments(
        problem, problem.data.estimation, {**base.values, **candidate.values}, names, start_per_log=per_log
    )


def refine_event_times(
    problem: EstimationProblem, log_segments: Sequence[Segments], found: Fit, candidate: EventCandidate
) -> Fit:
    """A fit with the moments of an event moved to where they fit best, from a wide search to the single sample.

    What an event does can depend on the command, which jumps at every sample: the sum of squares over a moment has a
    minimum between any two samples, and Gauss-Newton would stay in the first. So moments and the rest take turns.
    """
    length, dt = EVENT_HORIZON_SHARE * problem.horizon, log_segments[candidate.log].log.dt
    for spread in (*(length * share for share in TIME_SEARCH_SPANS), TIME_GRID_POINTS_PER_SIDE * dt):
        for moment in event_time_names(candidate.effect.name):
            found = _with_best_event_time(problem, log_segments[candidate.log], found, candidate.log, moment, spread)
        found = fit_segments(
            problem, log_segments, found.values, found.names, start_per_log=found.per_log, rounds=TIME_REFIT_ITERATIONS
        )
    return found


def _with_best_event_time(
    problem: EstimationProblem, segments: Segments, found: Fit, log: int, moment: str, spread: float
) -> Fit:
    """A fit's values with a moment moved to the best point of a grid, up to a spread [s] before and after."""
    t, middle = segments.log.t, found.of_log(log)[moment]
    near = np.searchsorted(t, np.linspace(middle - spread, middle + spread, 2 * TIME_GRID_POINTS_PER_SIDE + 1))
    samples = np.unique(np.clip(near, 1, len(t) - 1))
    moved = [with_event_time(found, log, moment, 0.5 * float(t[k - 1] + t[k])) for k in samples]
    costs = [cost_near_event(problem, segments, f.of_log(log), middle, spread) for f in moved]
    return moved[int(np.argmin(costs))]


def with_event_time(found: Fit, log: int, moment: str, when: float) -> Fit:
    """A fit's values with a moment of one log elsewhere [s]."""
    return replace(found, per_log=tuple({**v, moment: when} if k == log else v for k, v in enumerate(found.per_log)))


def cost_near_event(
    problem: EstimationProblem, segments: Segments, values: Mapping[str, float], middle: float, spread: float
) -> float:
    """Sum of squares in the segments that reach into a span of time, their initial states fitted."""
    t, bounds = segments.log.t, segments.bounds
    near = (t[bounds[:, 0]] <= middle + spread) & (t[bounds[:, 1] - 1] >= middle - spread)
    if not near.any():
        return np.inf
    return fit_segments(problem, [replace(segments, bounds=bounds[near])], values, (), rounds=0).cost
