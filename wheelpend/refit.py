"""Refits of a model with one effect more: the best of every screening, or one that the user names."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor

import numpy as np

import derive
from derive.effects import Effect, InnerPlay
from wheelpend.contacts import start_with_contacts
from wheelpend.evidence import Tried, judge
from wheelpend.failures import Failure
from wheelpend.happenings import find_happenings, fit_happening
from wheelpend.screening import Candidate, Screen, linear_names, screen
from wheelpend.shapes import Shape, shapes_of
from wheelpend.shooting import Fit
from wheelpend.study import (
    EXPLAINED,
    Study,
    enlarged,
    fit_model,
    fit_parts,
    free_names,
    per_log_names,
    shortened,
    steadied,
)

STARTED = 2  # best settings of a profiled parameter from which a refit starts
REFITTED = 5  # best candidates of each screening that are refitted
PROMISING = 10.0  # expected fall of the sum of squares per coefficient, in noise variances, that is worth a refit
HOPEFUL = 2.0  # cost on short segments, over the best, up to which a candidate is judged on held-out data
SHORT = 0.1  # of the horizon: segments so short that the problem is almost linear
FEWEST = 15  # segments over parameters below which significance is taken from shorter segments

Progress = Callable[[str], None]


def near_screens(
    study: Study, short: Fit, start: dict[str, float], shapes: Mapping[str, Shape], corrupted: bool
) -> list[tuple[dict[str, float], Screen]]:
    """Score every effect on short segments: at the fit, and where a missing effect corrupts that, at its starts too.

    A base fit that bends every parameter to a missing effect can hide that very effect from its own linearisation.
    """
    parts, present = shortened(study, SHORT * study.horizon), study.model.effects
    found = [(short.values, screen(study, short, parts, shapes))]
    free = free_names(study, present)
    for origin in (start, *study.origins) if corrupted else ():
        values = {**short.values, **origin}
        there = fit_parts(study, parts, values, free, start_per_log=short.per_log, rounds=0)
        if np.isfinite(there.cost):
            found.append((values, screen(study, there, parts, shapes)))
    return found


def refit_best(study, base, short, before, near, far: Screen, residuals, progress: Progress) -> list[Tried]:
    """Refit the best candidates of every screening, first on short segments, then the best of those on full ones."""
    screens = [*(s for _, s in near), far]
    promising = (c for s in screens for c in s.candidates[:REFITTED] if c.gain > PROMISING * len(c.effect.parameters))
    names = with_contained(study, list(dict.fromkeys(c.effect.name for c in promising)))
    by_name = {c.effect.name: c for c in far.candidates}
    tests = sum(c.trials for c in far.candidates)

    def begin(name: str) -> Fit:
        progress(f"refitting with {name}")
        return refit(study, short, starts_for(near, name))

    def finish(pair: tuple[str, Fit]) -> Tried | None:
        name, begun = pair
        progress(f"judging {name} on held-out data")
        free, able = _free_with(study, base, name), steadied(study.able(name), begun.values)
        try:
            fitted = fit_model(able, begun.values, free, horizons=(1.0,), start_per_log=begun.per_log)
        except Failure:
            return None  # with it the model cannot be simulated over the horizon, so that is not what is missing
        evidence = evidence_fit(able, fitted, begun)
        return judge(able, by_name[name], fitted, evidence, before, residuals, tests=tests, judged=len(hopeful))

    with ThreadPoolExecutor(max_workers=os.cpu_count() or 1) as pool:  # the kernels release the interpreter's lock
        begun = sorted(zip(names, pool.map(begin, names), strict=True), key=lambda pair: pair[1].cost)
        hopeful = [p for n, p in enumerate(begun) if n < 1 or not is_clear(begun[0][1], p[1], study.floor)][:REFITTED]
        tried = [t for t in pool.map(finish, hopeful) if t is not None]
    return sorted(tried, key=lambda t: t.error_after)


def with_contained(study: Study, names: Sequence[str]) -> list[str]:
    """The names, and those of the effects that they contain: an effect is judged beside what it contains."""
    judged = {e.name for e in study.missable()}
    within = [s for n in names for s in study.module.CONTAINS.get(n, {}) if s in judged]
    return list(dict.fromkeys([*names, *within]))


def is_clear(best: Fit, other: Fit, floor: float) -> bool:
    """Whether the best fit on short segments has settled the matter: it reaches the noise and the other does not."""
    return best.error < EXPLAINED * floor and other.cost > HOPEFUL * best.cost


def evidence_fit(study: Study, fitted: Fit, begun: Fit) -> Fit:
    """The fit whose segments are counted for significance: the full one, or on a short log one with more segments."""
    segments = sum(len(p.bounds) for p in study.training)
    if segments - len(fitted.free) >= FEWEST:
        return fitted
    share = max(SHORT, segments / (len(fitted.free) + 2.0 * FEWEST))
    free = list(dict.fromkeys(n.split("@")[0] for n in fitted.free))
    parts = shortened(study, share * study.horizon, most=1000)
    return fit_parts(study, parts, begun.values, free, start_per_log=begun.per_log)


def _free_with(study: Study, base: Fit, effect: str) -> list[str]:
    own = dict.fromkeys(n.split("@")[0] for n in base.free)
    gone = study.replaced(effect)
    return [*(n for n in own if n.partition(".")[0] not in gone), *derive.effects.find(effect).full_names]


def in_place(study: Study, effect: Effect, values: Mapping[str, float], size: Mapping[str, float]) -> tuple[dict, dict]:
    """A start, and the size of an effect there, once it has taken the place of the present effects that it contains."""
    left, grown = dict(values), dict(size)
    for smaller in study.replaced(effect.name):
        names, weights = linear_names(derive.effects.find(smaller)), study.module.CONTAINS[effect.name][smaller]
        for name, row in zip(linear_names(effect), weights, strict=True):
            grown[name] = grown.get(name, 0.0) + float(np.dot(row, [values[n] for n in names]))
        left |= dict.fromkeys(names, 0.0)
    return left, grown


def starts_for(near: list[tuple[dict[str, float], Screen]], name: str) -> list[tuple[dict[str, float], Candidate]]:
    """Where an effect's refits may start: each screening's point with the size it suggests there."""
    return [(values, c) for values, found in near for c in found.candidates if c.effect.name == name]


def refit(study: Study, short: Fit, beginnings: Sequence[tuple[dict[str, float], Candidate]]) -> Fit:
    """Refit the model with one more effect on short segments, from several points and sizes, with fresh states.

    On short segments the problem is almost linear. Effects that are not locally linear (a delay, a threshold) start
    from a grid of sizes as well.
    """
    effect = beginnings[0][1].effect
    study = steadied(study.able(effect.name), short.values)
    free = _free_with(study, short, effect.name)
    placed = [in_place(study, effect, values, s) for n, (values, c) in enumerate(beginnings)
              for s in c.starts[:STARTED]]  # fmt: skip
    trials = [(values, admissible(effect, size)) for values, size in placed]
    for parameter in effect.parameters:
        name = f"{effect.name}.{parameter.name}"
        trials += [(trials[0][0], {**trials[0][1], name: size}) for size in parameter.grid]
    fits = []
    for values, sizes_ in trials:
        fits.append(_refit_from(study, short, sizes_, free, SHORT, values, short.per_log))
        if fits[-1].error < EXPLAINED * study.floor:
            break  # it cannot get better than the noise
    best = min(fits, key=lambda f: f.cost)
    best = _refit_from(study, short, {}, free, 0.3, best.values, best.per_log)
    if isinstance(effect.enters, InnerPlay) and not best.error < EXPLAINED * study.floor:
        best = min([best, *_with_contacts(study, short, effect, free)], key=lambda f: f.cost)
    return best


def _with_contacts(study: Study, short: Fit, effect: Effect, free: list[str]) -> list[Fit]:
    """The refit of a play from the first start before any fit, if it pays there: contacts mislead a fit from afar."""
    origin = {**short.values, **(study.origins[0] if study.origins else {})}
    study = steadied(study.able(effect.name), origin)
    begun = start_with_contacts(study, origin, short.per_log, free, effect.full_names[0])
    return [_refit_from(study, short, {}, free, 0.3, begun, short.per_log)] if begun else []


def _refit_from(study: Study, short: Fit, sizes_: dict, free: list[str], share: float, values, per_log) -> Fit:
    first = {n: v for n, v in sizes_.items() if "@" not in n}
    own = [{**o, **{n: sizes_.get(f"{n}@{log}", first[n]) for n in per_log_names(list(first))}}
           for log, o in enumerate(per_log)]  # fmt: skip
    parts = shortened(study, share * study.horizon, most=80)
    return fit_parts(study, parts, {**values, **first}, free, start_per_log=own)


def admissible(effect: Effect, start: dict[str, float]) -> dict[str, float]:
    """A start moved into the physically possible range."""
    ranges = {f"{effect.name}.{p.name}": (p.minimum, p.maximum) for p in effect.parameters}
    return {n: float(np.clip(v, *ranges[n.split("@")[0]])) for n, v in start.items()}


def refit_with(study: Study, start: dict[str, float], base: Fit, effect: str) -> Fit:
    """Fit the study's model plus one effect from the sizes that the screening suggests, or where an event fits best."""
    present = study.model.effects
    if derive.effects.find(effect).event:
        place = next(p for p in find_happenings(study, base) if p.effect.name == effect)
        return fit_happening(study, base, place, free_names(study, present))
    short = fit_model(study, start, free_names(study, present), horizons=(SHORT,))
    shapes = shapes_of(study, short, [derive.effects.find(effect)])
    near = near_screens(study, short, start, shapes, corrupted=base.error > EXPLAINED * study.floor)
    begun = refit(study, short, starts_for(near, effect))
    free, able = free_names(study, enlarged(study.model, effect)), steadied(study.able(effect), begun.values)
    return fit_model(able, begun.values, free, horizons=(1.0,), start_per_log=begun.per_log)
