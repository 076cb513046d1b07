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
from wheelpend.fitting import layout, reduce
from wheelpend.logs import segment_bounds
from wheelpend.shooting import Fit, Part, fit_states, initial_states, shoot, vector
from wheelpend.study import Study, fit_parts

RESOLUTION = 0.2  # of the horizon: length of the segments between whose ends an event is looked for
NEVER = -1.0  # s: a moment before every log


class Happening(NamedTuple):
    """Where in the logs an event fits best."""

    effect: Effect
    log: int
    start: dict[str, float]  # by effect.parameter
    gain: float  # expected fall of the sum of squares, in noise variances
    trials: int  # so many places were compared


def events(study: Study) -> tuple[Effect, ...]:
    """Events that the model may be missing."""
    return tuple(e for e in study.missable() if e.event)


def find_happenings(study: Study, fitted: Fit) -> list[Happening]:
    """Where each event fits best, the best event first, from one linearisation of short segments at a fit."""
    found = []
    for effect in events(study):
        places = [place_of(study, fitted, effect, number) for number in range(len(study.training))]
        found.append(max(places, key=lambda p: p.gain))
    return sorted(found, key=lambda p: -p.gain)


def place_of(study: Study, fitted: Fit, effect: Effect, number: int) -> Happening:
    """Where in one log an event fits best: the run of short segments in which it lowers the sum of squares most."""
    log = study.training[number].log
    bounds = np.ascontiguousarray(segment_bounds(log, RESOLUTION * study.horizon))
    part = replace(study.training[number], bounds=bounds)
    score, information, noise = strength(study, part, fitted.of_log(number), effect)
    total = [np.concatenate([[0.0], np.cumsum(x)]) for x in (score, information)]
    count, open_ended = len(bounds), len(moments(effect)) == 1
    begin, end = np.triu_indices(count + 1, 1)
    if open_ended:
        begin, end = np.arange(1, count), np.full(count - 1, count)
    pull, weight = total[0][end] - total[0][begin], np.maximum(total[1][end] - total[1][begin], 1e-300)
    best = int(np.argmax(pull**2 / weight))
    middle = 0.5 * (log.t[bounds[:, 0]] + log.t[bounds[:, 1] - 1])
    times = [float(middle[begin[best]]), float(middle[end[best] - 1])]
    start = dict(zip(moments(effect), times, strict=False))
    start |= {f"{effect.name}.{p.name}": float(pull[best] / weight[best]) for p in effect.linear}
    return Happening(effect, number, start, float(pull[best] ** 2 / weight[best]) / noise, len(begin))


def strength(study: Study, part: Part, values: Mapping[str, float], effect: Effect):
    """Score and information of an event's size in each segment if it lasted throughout, and the noise variances."""
    throughout = dict(zip(moments(effect), (NEVER, float(part.log.t[-1]) + 1.0), strict=False))
    parameters = vector(study.module, {**values, **throughout}, part.log)
    states, _ = fit_states(study.module, part, initial_states(study.module, part, study.relative), parameters,
                           study.max_step, rounds=2)  # fmt: skip
    names = [f"{effect.name}.{p.name}" for p in effect.linear]
    columns = [study.module.PARAMETERS.index(n) for n in names]
    shot = shoot(study.module, part, states, parameters, columns, max_step=study.max_step)
    each = [reduce([replace(shot, gram=g[None])], study.module.NX, layout(names, (), 1)) for g in shot.gram]
    scores = np.nan_to_num([float(r.score[0]) for r in each])
    informations = np.nan_to_num([float(r.information[0, 0]) for r in each])
    left = np.nan_to_num([float(g[-1, -1]) for g in shot.gram])
    return scores, informations, max(float(left.sum()) / max(part.values, 1), 1.0)


def moments(effect: Effect) -> list[str]:
    """Full names of the times at which an event begins and ends."""
    return [f"{effect.name}.{p.name}" for p in effect.parameters if p.moment]


def fit_happening(study: Study, base: Fit, place: Happening, free: Sequence[str]) -> Fit:
    """Fit the model with an event that happens in one log and in no other, from where it fits best."""
    nothing = {n: 0.0 for n in place.start if n not in moments(place.effect)}
    own = [dict(base.per_log[k]) if k < len(base.per_log) else {} for k in range(len(study.training))]
    for number, values in enumerate(own):
        values |= place.start if number == place.log else {**place.start, **nothing}
    names = list(dict.fromkeys([*free, *place.effect.full_names]))
    return fit_parts(study, study.training, base.values, names, start_per_log=own, rounds=40)
