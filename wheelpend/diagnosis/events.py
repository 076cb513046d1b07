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
from wheelpend.estimation.continuation import fit_parts
from wheelpend.estimation.criteria import VISIBLE
from wheelpend.estimation.data import interleaved
from wheelpend.estimation.fit import Fit
from wheelpend.estimation.free_parameters import moments_of
from wheelpend.estimation.normal_equations import informations, reduce
from wheelpend.estimation.parameters import layout, vector
from wheelpend.estimation.problem import Study
from wheelpend.estimation.segments import Part
from wheelpend.estimation.shooting import shoot
from wheelpend.estimation.states import fit_states, initial_states
from wheelpend.logs.log import segment_bounds

RESOLUTION = 0.2  # of the horizon: length of the segments between whose ends an event is looked for
ABSORBED = 1e-3  # share of an event's information left by the model's own parameters, below which it shows nothing
SPREADS = (2.0, 0.5, 0.1)  # of that length, before and after a moment, among which a better one is looked for
REACH, FEW = 8, 5  # moments tried before and after, in the end at single samples; rounds in which the rest follows
NEVER = -1.0  # s: a moment before every log


class Happening(NamedTuple):
    """Where in the logs an event fits best, seen from some values of the other parameters."""

    effect: Effect
    log: int
    start: dict[str, float]  # by effect.parameter
    gain: float  # expected fall of the sum of squares, in noise variances
    trials: int  # so many places were compared
    values: dict[str, float]  # from which it was seen


class Strength(NamedTuple):
    """What an event would change in each segment if it lasted throughout, beside the model's own parameters."""

    score: np.ndarray  # (segments,) of its size
    information: np.ndarray  # (segments,)
    mixed: np.ndarray  # (segments, own) of its size with the model's own
    own: np.ndarray  # (own, own) of those, over all segments
    own_score: np.ndarray  # (own,)
    noise: float  # mean square of the residual in noise variances, at least 1

    def between(self, begin: np.ndarray, end: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Score and information of an event from one segment to before another, the own parameters projected out."""
        score, information, mixed = (
            np.concatenate([np.zeros((1, *x.shape[1:])), np.cumsum(x, axis=0)])
            for x in (self.score, self.information, self.mixed)
        )
        step, inverse = solve(self.own, self.own_score)
        with_own, alone = mixed[end] - mixed[begin], information[end] - information[begin]
        pull = score[end] - score[begin] - with_own @ step
        weight = alone - np.einsum("pi,ij,pj->p", with_own, inverse, with_own)
        return np.where(weight > ABSORBED * alone, pull, 0.0), np.maximum(weight, ABSORBED * alone + 1e-300)


def events(study: Study) -> tuple[Effect, ...]:
    """Events that the model may be missing."""
    return tuple(e for e in study.missable() if e.event)


def find_happenings(study: Study, fitted: Fit, error: float) -> list[Happening]:
    """Where each event fits best, from one linearisation of short segments at a fit and at each start before any fit.

    A fit that is bent to an event may see it where it is not; one whose error lies in the noise is not bent. The
    largest gain comes first.
    """
    found, origins = [], () if error < VISIBLE * study.floor else study.origins
    for effect in events(study):
        for origin in ({}, *origins):
            places = [place_of(study, fitted, origin, effect, number) for number in range(len(study.training))]
            found.append(max(places, key=lambda p: p.gain))
    return sorted(found, key=lambda p: -p.gain)


def place_of(study: Study, fitted: Fit, origin: Mapping[str, float], effect: Effect, number: int) -> Happening:
    """Where in one log an event fits best: the run of short segments in which it lowers the sum of squares most."""
    log = study.training[number].log
    bounds = np.ascontiguousarray(segment_bounds(log, RESOLUTION * study.horizon))
    part, values = replace(study.training[number], bounds=bounds), {**fitted.of_log(number), **origin}
    own = fitted.names
    seen = strength(study, part, values, effect, own)
    count, open_ended = len(bounds), len(moments_of(effect.name)) == 1
    begin, end = np.triu_indices(count + 1, 1)
    if open_ended:
        begin, end = np.arange(1, count), np.full(count - 1, count)
    pull, weight = seen.between(begin, end)
    best = int(np.argmax(pull**2 / weight))
    middle = 0.5 * (log.t[bounds[:, 0]] + log.t[bounds[:, 1] - 1])
    times = [float(middle[begin[best]]), float(middle[end[best] - 1])]
    start = dict(zip(moments_of(effect.name), times, strict=False))
    start |= {f"{effect.name}.{p.name}": float(pull[best] / weight[best]) for p in effect.linear}
    gain = float(pull[best] ** 2 / weight[best]) / seen.noise
    return Happening(effect, number, start, gain, len(begin), dict(origin))


def strength(study: Study, part: Part, values: Mapping[str, float], effect: Effect, own: Sequence[str]) -> Strength:
    """What an event changes in each segment of a part if it lasts throughout."""
    throughout = dict(zip(moments_of(effect.name), (NEVER, float(part.log.t[-1]) + 1.0), strict=False))
    parameters = vector(study.module, {**values, **throughout}, part.log)
    states, _ = fit_states(study.module, part, initial_states(study.module, part), parameters,
                           study.max_step, rounds=2, keep=False)  # fmt: skip
    names = [*own, *(f"{effect.name}.{p.name}" for p in effect.linear)]
    columns, nx = [study.module.PARAMETERS.index(n) for n in names], study.module.NX
    shot = shoot(study.module, part, states, parameters, columns, max_step=study.max_step, keep=False)
    reduced = reduce([shot], nx, layout(names, (), 1))
    scores = np.nan_to_num(reduced.scores)
    pieces = np.nan_to_num(informations([shot], nx, layout(names, (), 1), reduced))
    last, left = len(own), np.nan_to_num([float(g[-1, -1]) for g in shot.gram])
    return Strength(
        scores[:, last], pieces[:, last, last], pieces[:, last, :last], pieces[:, :last, :last].sum(axis=0),
        scores[:, :last].sum(axis=0), max(float(left.sum()) / max(part.values, 1), 1.0),
    )  # fmt: skip


def found_at(study: Study, base: Fit, places: Sequence[Happening], free: Sequence[str]) -> tuple[Study, Fit]:
    """The best fit with an event at one of several places, and the study that judges it.

    When it happened is taken from the whole log; segments in which it begins or ends are then among those that are
    fitted, and of the others every second one is held out.
    """
    alternate = interleaved(study)
    fits = [(fit_happening(alternate, base, p, free), p) for p in places]
    best, place = min(fits, key=lambda pair: pair[0].cost)
    moments = moments_of(place.effect.name)
    names = [*best.names, *moments]
    every = tuple(
        replace(p, bounds=np.ascontiguousarray(segment_bounds(p.log, study.horizon), dtype=np.int64))
        for p in study.training
    )
    best = timed(study, every, best, place)
    found = fit_parts(study, every, best.values, names, start_per_log=best.per_log, rounds=40)
    known, present = found.of_log(place.log), (*study.model.effects, place.effect.name)
    around = interleaved(study, [known[n] for e in present for n in moments_of(e) if n in known])
    return around, fit_parts(around, around.training, found.values, names, start_per_log=found.per_log, rounds=40)


def fit_happening(study: Study, base: Fit, place: Happening, free: Sequence[str]) -> Fit:
    """Fit the model with an event at given moments in one log and in no other, from where it fits best."""
    moments = moments_of(place.effect.name)
    nothing = {n: 0.0 for n in place.start if n not in moments}
    own = [dict(base.per_log[k]) if k < len(base.per_log) else {} for k in range(len(study.training))]
    for number, values in enumerate(own):
        values |= place.start if number == place.log else {**place.start, **nothing}
    names = [n for n in dict.fromkeys([*free, *place.effect.full_names]) if n not in moments]
    return fit_parts(study, study.training, {**base.values, **place.values}, names, start_per_log=own)


def timed(study: Study, parts: Sequence[Part], found: Fit, place: Happening) -> Fit:
    """A fit with the moments of an event moved to where they fit best, from a wide search to the single sample.

    What an event does can depend on the command, which jumps at every sample: the sum of squares over a moment has a
    minimum between any two samples, and Gauss-Newton would stay in the first. So moments and the rest take turns.
    """
    t = parts[place.log].log.t
    for spread in (*(RESOLUTION * study.horizon * share for share in SPREADS), REACH * parts[place.log].log.dt):
        for moment in moments_of(place.effect.name):
            middle = found.of_log(place.log)[moment]
            near = np.searchsorted(t, np.linspace(middle - spread, middle + spread, 2 * REACH + 1))
            places = np.unique(np.clip(near, 1, len(t) - 1))
            tried = [moved(found, place.log, moment, 0.5 * float(t[k - 1] + t[k])) for k in places]
            costs = [cost_around(study, parts[place.log], f.of_log(place.log), middle, spread) for f in tried]
            found = tried[int(np.argmin(costs))]
        found = fit_parts(study, parts, found.values, found.names, start_per_log=found.per_log, rounds=FEW)
    return found


def moved(found: Fit, log: int, moment: str, when: float) -> Fit:
    """A fit's values with a moment of one log elsewhere."""
    return replace(found, per_log=tuple({**v, moment: when} if k == log else v for k, v in enumerate(found.per_log)))


def cost_around(study: Study, part: Part, values: Mapping[str, float], middle: float, spread: float) -> float:
    """Sum of squares in the segments that reach into a span of time, their initial states fitted."""
    t, bounds = part.log.t, part.bounds
    near = (t[bounds[:, 0]] <= middle + spread) & (t[bounds[:, 1] - 1] >= middle - spread)
    if not near.any():
        return np.inf
    return fit_parts(study, [replace(part, bounds=bounds[near])], values, (), rounds=0).cost
