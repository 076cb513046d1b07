"""Refits of a model with one effect more: the best of every screening, or one that the user names."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np

import derive
from derive.effects import Effect, InnerPlay
from wheelpend.diagnosis.backlash_start import start_with_contacts
from wheelpend.diagnosis.events import find_happenings, found_at
from wheelpend.diagnosis.score_test import Candidate, Screen, linear_names, screen
from wheelpend.estimation.continuation import fit_model, fit_parts
from wheelpend.estimation.criteria import EXPLAINED
from wheelpend.estimation.data import shortened
from wheelpend.estimation.fit import Fit
from wheelpend.estimation.free_parameters import free_names, per_log_names
from wheelpend.estimation.problem import Study, enlarged, steadied
from wheelpend.estimation.profiled_starts import Shape, shapes_of

STARTED = 2  # best settings of a profiled parameter from which a refit starts
GLANCE, LOOK = 4, 8  # rounds of a refit that every start is given, and those that lead after them
FOLLOWED = 3  # so many of them
MOST, LESS = 80, 40  # segments of a refit that only prepares, and of what only tells where to start
SHORT = 0.1  # of the horizon: segments so short that the problem is almost linear
FEWEST = 15  # segments over parameters below which significance is taken from shorter segments

Progress = Callable[[str], None]


def near_screens(
    study: Study, short: Fit, start: dict[str, float], shapes: Mapping[str, Shape], corrupted: bool
) -> list[tuple[dict[str, float], Screen]]:
    """Score every effect on short segments: at the fit, and where a missing effect corrupts that, at its starts too.

    A base fit that bends every parameter to a missing effect can hide that very effect from its own linearisation.
    """
    found = [(short.values, screen(study, short, shortened(study, SHORT * study.horizon), shapes))]
    free, parts = free_names(study, study.model.effects), shortened(study, SHORT * study.horizon, most=LESS)
    for origin in (start, *study.origins) if corrupted else ():
        values = {**short.values, **origin}
        there = fit_parts(study, parts, values, free, start_per_log=short.per_log, rounds=0)
        if np.isfinite(there.cost):
            found.append((values, screen(study, there, parts, shapes)))
    return found


def evidence_fit(study: Study, fitted: Fit, begun: Fit) -> Fit:
    """The fit whose segments are counted for significance: the full one, or on a short log one with more segments."""
    segments = sum(len(p.bounds) for p in study.training)
    if segments - len(fitted.free) >= FEWEST:
        return fitted
    share = max(SHORT, segments / (len(fitted.free) + 2.0 * FEWEST))
    free = fitted.names
    parts = shortened(study, share * study.horizon, most=1000)
    return fit_parts(study, parts, begun.values, free, start_per_log=begun.per_log)


def free_with(study: Study, base: Fit, effect: str) -> list[str]:
    """Names of what a fit has, with an effect more in place of those that it contains."""
    own = base.names
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
    """Refit the model with one more effect on short segments, from several points and sizes, with fresh states."""
    effect = beginnings[0][1].effect
    found = go_on(study, first_look(study, short, beginnings), effect.name)
    if not isinstance(effect.enters, InnerPlay) or found.error < EXPLAINED * study.floor:
        return found
    return min((f for f in (found, refit_play(study, short, effect)) if f is not None), key=lambda f: f.cost)


def refit_play(study: Study, short: Fit, effect: Effect) -> Fit | None:
    """Refit with a play from a start before any fit that follows its contacts; None where that does not pay."""
    origin = {**short.values, **(study.origins[0] if study.origins else {})}
    study, free = steadied(study.able(effect.name), origin), free_with(study, short, effect.name)
    begun = start_with_contacts(study, origin, short.per_log, free, effect.full_names[0])
    if begun is None:
        return None
    parts = shortened(study, 0.3 * study.horizon, most=MOST)
    return fit_parts(study, parts, begun, free, start_per_log=short.per_log)


def first_look(study: Study, short: Fit, beginnings: Sequence[tuple[dict[str, float], Candidate]]) -> Fit:
    """The best of a few rounds from each of several points and sizes, on segments so short that it is almost linear.

    Effects that are not locally linear (a delay, a threshold) start from a grid of sizes as well.
    """
    effect = beginnings[0][1].effect
    study = steadied(study.able(effect.name), short.values)
    free = free_with(study, short, effect.name)
    placed = [in_place(study, effect, values, s) for n, (values, c) in enumerate(beginnings)
              for s in c.starts[:STARTED]]  # fmt: skip
    trials = [(values, admissible(effect, size)) for values, size in placed]
    for parameter in effect.parameters:
        name = f"{effect.name}.{parameter.name}"
        trials += [(trials[0][0], {**trials[0][1], name: size}) for size in parameter.grid]
    parts, fits = shortened(study, SHORT * study.horizon, most=LESS if effect.frees else MOST), []

    def reaches(start: Mapping[str, float], own: Sequence[Mapping[str, float]], rounds: int) -> bool:
        fits.append(fit_parts(study, parts, start, free, start_per_log=own, rounds=rounds))
        return fits[-1].error < EXPLAINED * study.floor  # it cannot get better than the noise

    glance = LOOK if effect.frees else GLANCE  # what frees something goes astray at first
    places = (_begun(values, short.per_log, size) for values, size in trials)
    if not any(reaches(start, own, glance) for start, own in places):
        for f in sorted(fits, key=lambda f: f.cost)[:FOLLOWED]:
            if not f.converged and reaches(f.values, f.per_log, LOOK):
                break
    return min(fits, key=lambda f: f.cost)


def go_on(study: Study, begun: Fit, effect: str, rounds: int = 15) -> Fit:
    """A fit with an effect taken to its end, or for a few rounds, and to longer segments."""
    study = steadied(study.able(effect), begun.values)
    free = begun.names
    for share in (0.3,) if begun.converged else (SHORT, 0.3):
        parts = shortened(study, share * study.horizon, most=MOST)
        begun = fit_parts(study, parts, begun.values, free, start_per_log=begun.per_log, rounds=rounds)
    return begun


def from_far(study: Study, base: Fit, candidate: Candidate) -> Fit:
    """A fit of middling segments that starts from the full ones' fit and the size that they suggest."""
    effect = candidate.effect
    study = steadied(study.able(effect.name), base.values)
    values, size = in_place(study, effect, base.values, candidate.starts[0])
    start, own = _begun(values, base.per_log, admissible(effect, size))
    parts = shortened(study, 0.3 * study.horizon, most=MOST)
    return fit_parts(study, parts, start, free_with(study, base, effect.name), start_per_log=own)


def _begun(values: Mapping[str, float], per_log: Sequence[Mapping[str, float]], size: Mapping[str, float]):
    """A start with sizes, which may be those of each log, by name@log."""
    first = {n: v for n, v in size.items() if "@" not in n}
    own = [{**o, **{n: size.get(f"{n}@{log}", first[n]) for n in per_log_names(list(first))}}
           for log, o in enumerate(per_log)]  # fmt: skip
    return {**values, **first}, own


def admissible(effect: Effect, start: dict[str, float]) -> dict[str, float]:
    """A start moved into the physically possible range."""
    ranges = {f"{effect.name}.{p.name}": (p.minimum, p.maximum) for p in effect.parameters}
    return {n: float(np.clip(v, *ranges[n.split("@")[0]])) for n, v in start.items()}


def refit_with(study: Study, start: dict[str, float], base: Fit, effect: str) -> tuple[Study, Fit]:
    """Fit the study's model plus one effect from the sizes that the screening suggests, or where an event fits best.

    Returns the study that judges it, which is another one for an event, and the fit.
    """
    present = study.model.effects
    if derive.effects.find(effect).event:
        places = [p for p in find_happenings(study, base, base.error) if p.effect.name == effect]
        return found_at(study, base, places, free_names(study, present))
    short = fit_model(study, start, free_names(study, present), horizons=(SHORT,))
    larger = [n for n, within in study.module.CONTAINS.items() if effect in within]
    shapes = shapes_of(study, short, [study.effect(n) for n in (effect, *larger)])
    near = near_screens(study, short, start, shapes, corrupted=base.error > EXPLAINED * study.floor)
    begun = refit(study, short, starts_for(near, effect))
    free, able = free_names(study, enlarged(study.model, effect)), steadied(study.able(effect), begun.values)
    found = fit_model(able, begun.values, free, horizons=(1.0,), start_per_log=begun.per_log)
    for name in larger if found.error > EXPLAINED * study.floor else ():  # a larger one may go where it goes astray
        around = refit(study, short, starts_for(near, name))
        other = fit_model(
            able, with_smaller(study, name, effect, around.values), free, horizons=(1.0,), start_per_log=begun.per_log
        )
        found = other if other.cost < found.cost else found
    return study, found


def with_smaller(study: Study, larger: str, smaller: str, values: Mapping[str, float]) -> dict[str, float]:
    """Values with an effect in place of a larger one that contains or approaches it, as near to that as it can be.

    They stay as they are where the larger effect is not among them.
    """
    sizes, names = (linear_names(derive.effects.find(e)) for e in (larger, smaller))
    if smaller in study.module.CONTAINS.get(larger, {}):
        weights = np.array(study.module.CONTAINS[larger][smaller])
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
