"""What happens once, in one log: when it begins and ends, and whether it accounts for what the model misses.

An effect that is an event cannot be judged on data after it, so it is judged on every second segment of its own log
while the others are fitted. It is never carried to another log.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from derive.effects import Effect
from wheelpend.diagnosis.score_test import solve
from wheelpend.estimation.continuation import fit_segments
from wheelpend.estimation.criteria import MAX_NOISE_LEVEL_ERROR_RATIO
from wheelpend.estimation.data import with_interleaved_validation
from wheelpend.estimation.fit import Fit
from wheelpend.estimation.free_parameters import event_time_names
from wheelpend.estimation.normal_equations import eliminate_initial_states, segment_informations
from wheelpend.estimation.parameters import kernel_parameters, parameter_layout
from wheelpend.estimation.problem import EstimationProblem
from wheelpend.estimation.segments import Segments
from wheelpend.estimation.shooting import shoot
from wheelpend.estimation.states import fit_states, initial_states
from wheelpend.logs.log import segment_bounds

EVENT_HORIZON_SHARE = 0.2  # of the horizon: length of the segments between whose ends an event is looked for
MIN_REMAINING_INFORMATION_SHARE = (
    1e-3  # share of an event's information left by the model's own parameters, below which it shows nothing
)
TIME_SEARCH_SPANS = (2.0, 0.5, 0.1)  # of that length, before and after a moment, among which a better one is looked for
TIME_GRID_POINTS_PER_SIDE, TIME_REFIT_ITERATIONS = (
    8,
    5,
)  # moments tried before and after, in the end at single samples; rounds in which the rest follows
TIME_BEFORE_LOGS_S = -1.0  # s: a moment before every log


class EventCandidate(NamedTuple):
    """Where in the logs an event fits best, seen from some values of the other parameters."""

    effect: Effect
    log: int
    start: dict[str, float]  # by effect.parameter
    gain: float  # expected fall of the sum of squares, in noise variances
    trials: int  # so many places were compared
    values: dict[str, float]  # from which it was seen


class EventInformation(NamedTuple):
    """What an event would change in each segment if it lasted throughout, beside the model's own parameters."""

    score: np.ndarray  # (segments,) of its size
    information: np.ndarray  # (segments,)
    cross_information: np.ndarray  # (segments, own) of its size with the model's own
    own: np.ndarray  # (own, own) of those, over all segments
    base_score: np.ndarray  # (own,)
    noise: float  # mean square of the residual in noise variances, at least 1

    def between(self, begin: np.ndarray, end: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Score and information of an event from one segment to before another, the own parameters projected out."""
        score, information, mixed = (
            np.concatenate([np.zeros((1, *x.shape[1:])), np.cumsum(x, axis=0)])
            for x in (self.score, self.information, self.cross_information)
        )
        step, inverse = solve(self.own, self.base_score)
        with_own, alone = mixed[end] - mixed[begin], information[end] - information[begin]
        pull = score[end] - score[begin] - with_own @ step
        weight = alone - np.einsum("pi,ij,pj->p", with_own, inverse, with_own)
        return np.where(weight > MIN_REMAINING_INFORMATION_SHARE * alone, pull, 0.0), np.maximum(
            weight, MIN_REMAINING_INFORMATION_SHARE * alone + 1e-300
        )


def candidate_events(problem: EstimationProblem) -> tuple[Effect, ...]:
    """Events that the model may be missing."""
    return tuple(e for e in problem.candidates() if e.event)


def find_events(problem: EstimationProblem, fitted: Fit, error: float) -> list[EventCandidate]:
    """Where each event fits best, from one linearisation of short segments at a fit and at each start before any fit.

    A fit that is bent to an event may see it where it is not; one whose error lies in the noise is not bent. The
    largest gain comes first.
    """
    found, origins = [], () if error < MAX_NOISE_LEVEL_ERROR_RATIO * problem.floor else problem.fallback_starts
    for effect in candidate_events(problem):
        for origin in ({}, *origins):
            places = [locate_event(problem, fitted, origin, effect, number) for number in range(len(problem.training))]
            found.append(max(places, key=lambda p: p.gain))
    return sorted(found, key=lambda p: -p.gain)


def locate_event(
    problem: EstimationProblem, fitted: Fit, origin: Mapping[str, float], effect: Effect, number: int
) -> EventCandidate:
    """Where in one log an event fits best: the run of short segments in which it lowers the sum of squares most."""
    log = problem.training[number].log
    bounds = np.ascontiguousarray(segment_bounds(log, EVENT_HORIZON_SHARE * problem.horizon))
    part, values = replace(problem.training[number], bounds=bounds), {**fitted.of_log(number), **origin}
    own = fitted.names
    seen = event_information(problem, part, values, effect, own)
    count, open_ended = len(bounds), len(event_time_names(effect.name)) == 1
    begin, end = np.triu_indices(count + 1, 1)
    if open_ended:
        begin, end = np.arange(1, count), np.full(count - 1, count)
    pull, weight = seen.between(begin, end)
    best = int(np.argmax(pull**2 / weight))
    middle = 0.5 * (log.t[bounds[:, 0]] + log.t[bounds[:, 1] - 1])
    times = [float(middle[begin[best]]), float(middle[end[best] - 1])]
    start = dict(zip(event_time_names(effect.name), times, strict=False))
    start |= {f"{effect.name}.{p.name}": float(pull[best] / weight[best]) for p in effect.linear}
    gain = float(pull[best] ** 2 / weight[best]) / seen.noise
    return EventCandidate(effect, number, start, gain, len(begin), dict(origin))


def event_information(
    problem: EstimationProblem, part: Segments, values: Mapping[str, float], effect: Effect, own: Sequence[str]
) -> EventInformation:
    """What an event changes in each segment of a part if it lasts throughout."""
    throughout = dict(
        zip(event_time_names(effect.name), (TIME_BEFORE_LOGS_S, float(part.log.t[-1]) + 1.0), strict=False)
    )
    parameters = kernel_parameters(problem.module, {**values, **throughout}, part.log)
    states, _ = fit_states(problem.module, part, initial_states(problem.module, part), parameters,
                           problem.max_step, rounds=2, keep_residual=False)  # fmt: skip
    names = [*own, *(f"{effect.name}.{p.name}" for p in effect.linear)]
    columns, nx = [problem.module.PARAMETERS.index(n) for n in names], problem.module.NX
    shot = shoot(problem.module, part, states, parameters, columns, max_step=problem.max_step, keep_residual=False)
    reduced = eliminate_initial_states([shot], nx, parameter_layout(names, (), 1))
    scores = np.nan_to_num(reduced.scores)
    pieces = np.nan_to_num(segment_informations([shot], nx, parameter_layout(names, (), 1), reduced))
    last, left = len(own), np.nan_to_num([float(g[-1, -1]) for g in shot.gram])
    return EventInformation(
        scores[:, last], pieces[:, last, last], pieces[:, last, :last], pieces[:, :last, :last].sum(axis=0),
        scores[:, :last].sum(axis=0), max(float(left.sum()) / max(part.values, 1), 1.0),
    )  # fmt: skip


def fit_event(
    problem: EstimationProblem, base: Fit, places: Sequence[EventCandidate], free: Sequence[str]
) -> tuple[EstimationProblem, Fit]:
    """The best fit with an event at one of several places, and the study that judges it.

    When it happened is taken from the whole log; segments in which it begins or ends are then among those that are
    fitted, and of the others every second one is held out.
    """
    alternate = with_interleaved_validation(problem)
    fits = [(fit_at_event_times(alternate, base, p, free), p) for p in places]
    best, place = min(fits, key=lambda pair: pair[0].cost)
    moments = event_time_names(place.effect.name)
    names = [*best.names, *moments]
    every = tuple(
        replace(p, bounds=np.ascontiguousarray(segment_bounds(p.log, problem.horizon), dtype=np.int64))
        for p in problem.training
    )
    best = refine_event_times(problem, every, best, place)
    found = fit_segments(problem, every, best.values, names, start_per_log=best.per_log, rounds=40)
    known, present = found.of_log(place.log), (*problem.model.effects, place.effect.name)
    around = with_interleaved_validation(
        problem, [known[n] for e in present for n in event_time_names(e) if n in known]
    )
    return around, fit_segments(around, around.training, found.values, names, start_per_log=found.per_log, rounds=40)


def fit_at_event_times(problem: EstimationProblem, base: Fit, place: EventCandidate, free: Sequence[str]) -> Fit:
    """Fit the model with an event at given moments in one log and in no other, from where it fits best."""
    moments = event_time_names(place.effect.name)
    nothing = {n: 0.0 for n in place.start if n not in moments}
    own = [dict(base.per_log[k]) if k < len(base.per_log) else {} for k in range(len(problem.training))]
    for number, values in enumerate(own):
        values |= place.start if number == place.log else {**place.start, **nothing}
    names = [n for n in dict.fromkeys([*free, *place.effect.full_names]) if n not in moments]
    return fit_segments(problem, problem.training, {**base.values, **place.values}, names, start_per_log=own)


def refine_event_times(problem: EstimationProblem, parts: Sequence[Segments], found: Fit, place: EventCandidate) -> Fit:
    """A fit with the moments of an event moved to where they fit best, from a wide search to the single sample.

    What an event does can depend on the command, which jumps at every sample: the sum of squares over a moment has a
    minimum between any two samples, and Gauss-Newton would stay in the first. So moments and the rest take turns.
    """
    t = parts[place.log].log.t
    for spread in (
        *(EVENT_HORIZON_SHARE * problem.horizon * share for share in TIME_SEARCH_SPANS),
        TIME_GRID_POINTS_PER_SIDE * parts[place.log].log.dt,
    ):
        for moment in event_time_names(place.effect.name):
            middle = found.of_log(place.log)[moment]
            near = np.searchsorted(t, np.linspace(middle - spread, middle + spread, 2 * TIME_GRID_POINTS_PER_SIDE + 1))
            places = np.unique(np.clip(near, 1, len(t) - 1))
            tried = [with_event_time(found, place.log, moment, 0.5 * float(t[k - 1] + t[k])) for k in places]
            costs = [cost_near_event(problem, parts[place.log], f.of_log(place.log), middle, spread) for f in tried]
            found = tried[int(np.argmin(costs))]
        found = fit_segments(
            problem, parts, found.values, found.names, start_per_log=found.per_log, rounds=TIME_REFIT_ITERATIONS
        )
    return found


def with_event_time(found: Fit, log: int, moment: str, when: float) -> Fit:
    """A fit's values with a moment of one log elsewhere."""
    return replace(found, per_log=tuple({**v, moment: when} if k == log else v for k, v in enumerate(found.per_log)))


def cost_near_event(
    problem: EstimationProblem, part: Segments, values: Mapping[str, float], middle: float, spread: float
) -> float:
    """Sum of squares in the segments that reach into a span of time, their initial states fitted."""
    t, bounds = part.log.t, part.bounds
    near = (t[bounds[:, 0]] <= middle + spread) & (t[bounds[:, 1] - 1] >= middle - spread)
    if not near.any():
        return np.inf
    return fit_segments(problem, [replace(part, bounds=bounds[near])], values, (), rounds=0).cost
