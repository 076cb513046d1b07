"""Refits of a model with one effect more: the best of every screening, or one that the user names."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np

import derive
from derive.effects import Effect, InnerPlay
from wheelpend.contacts import start_with_contacts
from wheelpend.evidence import WORTHWHILE, Tried, judge
from wheelpend.failures import Failure
from wheelpend.happenings import find_happenings, found_at
from wheelpend.processes import threads
from wheelpend.screening import Candidate, Screen, linear_names, screen
from wheelpend.shapes import Shape, shapes_of
from wheelpend.shooting import Fit
from wheelpend.study import (
    EXPLAINED,
    VISIBLE,
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
PART = 0.3  # of the fall that makes an effect worth naming, which the expected one must be where it can be trusted
HOPEFUL = 2.0  # cost on short segments, over the best, up to which a candidate is judged on held-out data
LEADING = 2  # candidates whose refit goes on first
RIVAL = 1.1  # times their error, above which after a few rounds none goes on where one of those leaves only noise
SETTLED = 1.03  # error over noise floor from which on nothing is tried that frees something inside the machine
RELUCTANCE = 1.5  # times its error counts where such a thing does not reach the noise: it bends to much
GLANCE, LOOK = 4, 8  # rounds of a refit that every start is given, and those that lead after them
FOLLOWED = 3  # so many of them
BEHIND = 1.5  # times the best error of the others on short segments, above which such a thing does not go on
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


def refit_best(study, base, short, before, near, far: Screen, residuals, progress: Progress) -> list[Tried]:
    """Refit the best candidates of every screening, first on short segments, then the best of those on full ones.

    What frees something inside the machine takes long to refit, and is tried unless another effect leaves only noise.
    """
    screens, error = [*(s for _, s in near), far], max(base.error, before)
    leading = (c for s in screens for c in s.candidates[:REFITTED])
    promising = (c for c in leading if c.gain > least_gain(study, base, error, c.effect))
    names = with_contained(study, list(dict.fromkeys(c.effect.name for c in promising)))
    by_name = {c.effect.name: c for c in far.candidates}
    tests = sum(c.trials for c in far.candidates)

    def look(name: str) -> Fit:
        progress(f"refitting with {name}")
        return first_look(study, short, starts_for(near, name))

    def try_on(pair: tuple[str, Fit]) -> Fit:
        return go_on(study, pair[1], pair[0], rounds=GLANCE)

    def go(pair: tuple[str, Fit]) -> tuple[str, Fit]:
        """What is slow does not show in short segments: what leads on full ones starts from there too."""
        name, looked = pair
        fits = [go_on(study, looked, name)]
        if far.candidates[0].effect.name == name:
            fits.append(from_far(study, base, far.candidates[0]))
        return name, min(fits, key=lambda f: f.cost)

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

    def settled(begun: Sequence[tuple[str, Fit]]) -> bool:
        return any(f.error < SETTLED * study.floor for _, f in begun)

    slow = [n for n in names if derive.effects.find(n).frees]
    quick = [n for n in names if n not in slow]
    with ThreadPoolExecutor(max_workers=threads()) as pool:  # the kernels release the interpreter's lock
        looked = sorted(zip(quick, pool.map(look, quick), strict=True), key=lambda pair: pair[1].cost)
        least = looked[0][1].error if looked else np.inf
        begun, rest = [*pool.map(go, looked[:LEADING])], looked[LEADING:]
        if settled(begun):
            least = RIVAL * min(f.error for _, f in begun)
            rest = [p for p, f in zip(rest, pool.map(try_on, rest), strict=True) if f.error < least]
        begun += pool.map(go, rest)
        if not settled(begun):
            looked = [*zip(slow, pool.map(look, slow), strict=True)]
            leader = next((c.effect.name for c in far.candidates), "")
            begun += pool.map(go, [p for p in looked if p[1].error < BEHIND * least or p[0] == leader])
        begun.sort(key=lambda pair: pair[1].cost)
        hopeful = [p for n, p in enumerate(begun) if n < 1 or not is_clear(begun[0][1], p[1], study.floor)][:REFITTED]
        tried = [t for t in pool.map(finish, hopeful) if t is not None]
    return ranked(study, with_smaller(study, tried, finish) if tried else [])


def least_gain(study: Study, base: Fit, error: float, effect: Effect) -> float:
    """Expected fall of the sum of squares from which an effect is refitted, in noise variances.

    What is missing in a fit whose error lies in the noise is small, and the expectation can be trusted: there it must
    be a good part of what makes an effect worth naming.
    """
    enough = PROMISING * len(effect.parameters)
    return max(enough, PART * 2.0 * WORTHWHILE * base.count) if error < VISIBLE * study.floor else enough


def with_smaller(
    study: Study, tried: Sequence[Tried], finish: Callable[[tuple[str, Fit]], Tried | None]
) -> list[Tried]:
    """Effects, those that the best one contains refitted from there where that is a better fit of them."""
    leader, found = min(tried, key=lambda t: t.error_after), list(tried)
    for smaller in with_contained(study, [leader.effect])[1:]:
        again = finish((smaller, within(study, leader, smaller)))
        known = next((t for t in found if t.effect == smaller), None)
        if again and (known is None or again.fit.cost < known.fit.cost):
            found = [*(t for t in found if t is not known), again]
    return found


def within(study: Study, larger: Tried, smaller: str) -> Fit:
    """Where an effect is nearest to one that contains it: its refit may have gone astray where that one's has not."""
    weights = np.array(study.module.CONTAINS[larger.effect][smaller])
    sizes, names = linear_names(derive.effects.find(larger.effect)), linear_names(derive.effects.find(smaller))

    def shrunk(values: Mapping[str, float]) -> dict[str, float]:
        if not all(n in values for n in sizes):
            return dict(values)
        rest = {n: v for n, v in values.items() if n.partition(".")[0] != larger.effect}
        return rest | dict(zip(names, map(float, np.linalg.pinv(weights) @ [values[n] for n in sizes]), strict=True))

    fit = larger.fit
    return replace(fit, values=shrunk(fit.values), per_log=tuple(map(shrunk, fit.per_log)))


def ranked(study: Study, tried: Iterable[Tried]) -> list[Tried]:
    """Effects by held-out error, the best first; one that frees something and leaves a rest counts with reluctance."""

    def rank(one: Tried) -> float:
        partial = derive.effects.find(one.effect).frees and one.error_after > EXPLAINED * study.floor
        return one.error_after * (RELUCTANCE if partial else 1.0)

    return sorted(tried, key=rank)


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
    free = fitted.names
    parts = shortened(study, share * study.horizon, most=1000)
    return fit_parts(study, parts, begun.values, free, start_per_log=begun.per_log)


def _free_with(study: Study, base: Fit, effect: str) -> list[str]:
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
    study, free = steadied(study.able(effect.name), origin), _free_with(study, short, effect.name)
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
    free = _free_with(study, short, effect.name)
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
    return fit_parts(study, parts, start, _free_with(study, base, effect.name), start_per_log=own)


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
    shapes = shapes_of(study, short, [derive.effects.find(effect)])
    near = near_screens(study, short, start, shapes, corrupted=base.error > EXPLAINED * study.floor)
    begun = refit(study, short, starts_for(near, effect))
    free, able = free_names(study, enlarged(study.model, effect)), steadied(study.able(effect), begun.values)
    return study, fit_model(able, begun.values, free, horizons=(1.0,), start_per_log=begun.per_log)
