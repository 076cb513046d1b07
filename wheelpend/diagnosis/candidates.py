"""Which candidates of the screenings are refitted, how far, and which of them win.

Refits take long, so they go on in steps, and end where they can no longer win.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import repeat

import numpy as np

import derive
from derive.effects import Effect
from wheelpend.diagnosis.evidence import WORTHWHILE, Tried, judge
from wheelpend.diagnosis.refit import (
    GLANCE,
    Progress,
    evidence_fit,
    first_look,
    free_with,
    from_far,
    go_on,
    starts_for,
    with_smaller,
)
from wheelpend.diagnosis.score_test import Screen
from wheelpend.errors import Failure
from wheelpend.estimation.continuation import fit_model
from wheelpend.estimation.criteria import EXPLAINED, FAR, VISIBLE
from wheelpend.estimation.fit import Fit
from wheelpend.estimation.problem import Study, steadied
from wheelpend.parallel import Together

REFITTED = 5  # best candidates of each screening that are refitted
PROMISING = 10.0  # expected fall of the sum of squares per coefficient, in noise variances, that is worth a refit
PART = 0.3  # of the fall that makes an effect worth naming, which the expected one must be where it can be trusted
LEADING = 2  # candidates whose refit goes on first
RIVAL = 1.1  # times their error, above which after a few rounds none goes on where one of those leaves only noise
SETTLED = 1.03  # error over noise floor from which on nothing is tried that frees something inside the machine
BEHIND = 1.5  # times the best error of the others on short segments, above which such a thing does not go on
RELUCTANCE = 1.5  # times its error counts where such a thing does not reach the noise: it bends to much
SIMILAR = 1.1  # times the best error, up to which the simplest effect comes first where all leave much
EQUIVALENT = 0.01  # relative difference of the held-out errors within which effects cannot be told apart
HOPEFUL = 2.0  # cost on middling segments, over the best, up to which a candidate is judged on held-out data

Begun = tuple[str, Fit]  # an effect, and how far its refit is


@dataclass(frozen=True)
class Scored:
    """A model as it is, fitted and screened."""

    study: Study
    base: Fit
    short: Fit  # of short segments
    error: float  # held out
    residuals: list[np.ndarray]  # of each held-out part [σ]
    near: list[tuple[dict[str, float], Screen]]  # screenings of short segments, and the values that each was made at
    far: Screen  # that of full segments, at the fit


class Contest:
    """Refits of the candidates of every screening with each other: those of short segments, then the best of full ones.

    What frees something inside the machine takes long to refit, and is tried unless another effect leaves only noise.
    """

    def __init__(self, scored: Scored, progress: Progress) -> None:
        self.scored, self.study, self.progress = scored, scored.study, progress
        self.candidates = {c.effect.name: c for c in scored.far.candidates}
        self.leader = next(iter(self.candidates), "")  # of the screening of full segments

    def run(self) -> list[Tried]:
        """Effects that were judged on held-out data, the best first."""
        names = self.promising()
        slow = [n for n in names if derive.effects.find(n).frees]
        quick = [n for n in names if n not in slow]
        with Together() as pool:
            looked = sorted(pool.map(self.look, quick), key=lambda pair: pair[1].cost)
            least = looked[0][1].error if looked else np.inf
            begun, rest = [*pool.map(self.go, looked[:LEADING])], looked[LEADING:]
            if self.settled(begun):
                bound = RIVAL * min(f.error for _, f in begun)
                rest = [p for p, f in zip(rest, pool.map(self.try_on, rest), strict=True) if f.error < bound]
            begun += pool.map(self.go, rest)
            if not self.settled(begun):
                looked = [*pool.map(self.look, slow)]
                begun += pool.map(self.go, [p for p in looked if p[1].error < BEHIND * least or p[0] == self.leader])
            hopeful = self.hopeful(begun)
            judged = pool.map(self.finish, hopeful, repeat(len(hopeful)))
            tried = [t for t in judged if t is not None]
        return ranked(self.study, self.with_smaller(tried, len(hopeful)) if tried else [])

    def promising(self) -> list[str]:
        """Names of the effects that are refitted."""
        scored, error = self.scored, max(self.scored.base.error, self.scored.error)
        leading = (c for s in (*(s for _, s in scored.near), scored.far) for c in s.candidates[:REFITTED])
        promising = (c for c in leading if c.gain > least_gain(self.study, scored.base, error, c.effect))
        return with_contained(self.study, list(dict.fromkeys(c.effect.name for c in promising)))

    def look(self, name: str) -> Begun:
        """A few rounds on short segments from every start."""
        self.progress(f"refitting with {name}")
        return name, first_look(self.study, self.scored.short, starts_for(self.scored.near, name))

    def try_on(self, pair: Begun) -> Fit:
        """A few rounds on middling segments."""
        return go_on(self.study, pair[1], pair[0], rounds=GLANCE)

    def go(self, pair: Begun) -> Begun:
        """To the end on middling segments; what leads on full ones starts from there too: the slow shows only there."""
        name, looked = pair
        fits = [go_on(self.study, looked, name)]
        if name == self.leader:
            fits.append(from_far(self.study, self.scored.base, self.candidates[name]))
        return name, min(fits, key=lambda f: f.cost)

    def settled(self, begun: Sequence[Begun]) -> bool:
        """Whether one of some refits leaves only noise."""
        return any(f.error < SETTLED * self.study.floor for _, f in begun)

    def hopeful(self, begun: Sequence[Begun]) -> list[Begun]:
        """Those refits that are judged: the best ones, unless the first has settled the matter."""
        ordered = sorted(begun, key=lambda pair: pair[1].cost)
        clear = [n > 0 and is_clear(ordered[0][1], f, self.study.floor) for n, (_, f) in enumerate(ordered)]
        return [p for p, lost in zip(ordered, clear, strict=True) if not lost][:REFITTED]

    def finish(self, pair: Begun, judged: int) -> Tried | None:
        """Fit full segments and judge on held-out data, as one of so many; None where that cannot be simulated."""
        scored, (name, begun) = self.scored, pair
        self.progress(f"judging {name} on held-out data")
        free, able = free_with(self.study, scored.base, name), steadied(self.study.able(name), begun.values)
        try:
            fitted = fit_model(able, begun.values, free, horizons=(1.0,), start_per_log=begun.per_log)
        except Failure:
            return None  # so that is not what is missing
        evidence, tests = evidence_fit(able, fitted, begun), sum(c.trials for c in self.candidates.values())
        return judge(
            able, self.candidates[name], fitted, evidence, scored.error, scored.residuals, tests=tests, judged=judged
        )

    def with_smaller(self, tried: Sequence[Tried], judged: int) -> list[Tried]:
        """Effects; each that a better one contains or approaches refitted from there, where that is its better fit."""
        found, done = {t.effect: t for t in tried}, set()
        for larger in sorted(tried, key=lambda t: t.error_after):
            for smaller in simpler(self.study, larger.effect):
                known = found.get(smaller)
                if smaller in done or (known and known.error_after <= larger.error_after):
                    continue
                done.add(smaller)
                again = self.finish((smaller, within(self.study, larger, smaller)), judged)
                if again and (known is None or again.fit.cost < known.fit.cost):
                    found[smaller] = again
        return list(found.values())


def least_gain(study: Study, base: Fit, error: float, effect: Effect) -> float:
    """Expected fall of the sum of squares from which an effect is refitted, in noise variances.

    What is missing in a fit whose error lies in the noise is small, and the expectation can be trusted: there it must
    be a good part of what makes an effect worth naming.
    """
    enough = PROMISING * len(effect.parameters)
    return max(enough, PART * 2.0 * WORTHWHILE * base.count) if error < VISIBLE * study.floor else enough


def within(study: Study, larger: Tried, smaller: str) -> Fit:
    """Where an effect is nearest to one that contains or approaches it: its own refit may have gone astray."""

    def turned(values: Mapping[str, float]) -> dict[str, float]:
        return with_smaller(study, larger.effect, smaller, values)

    return replace(larger.fit, values=turned(larger.fit.values), per_log=tuple(map(turned, larger.fit.per_log)))


def simpler(study: Study, effect: str) -> list[str]:
    """Effects that one contains, and the one that it approaches, as far as the model may be missing them."""
    approached = derive.effects.find(effect).approaches
    missable = {e.name for e in study.missable()}
    return [*with_contained(study, [effect])[1:], *([approached] if approached in missable else [])]


def ranked(study: Study, tried: Iterable[Tried]) -> list[Tried]:
    """Effects by held-out error, the best first; one that frees something and leaves a rest counts with reluctance.

    Where even the best leaves much, its lead over one with fewer parameters says little: more parameters bend further
    to whatever else is missing. Then the simplest of those that are nearly as good comes first; else only one that the
    best contains or approaches, and that these data cannot tell from it.
    """

    def rank(one: Tried) -> float:
        partial = derive.effects.find(one.effect).frees and one.error_after > EXPLAINED * study.floor
        return one.error_after * (RELUCTANCE if partial else 1.0)

    ordered = sorted(tried, key=rank)
    if not ordered:
        return []
    best, far = ordered[0], ordered[0].error_after >= FAR * study.floor
    alike, known = SIMILAR if far else 1.0 + EQUIVALENT, simpler(study, best.effect)
    rivals = [t for t in ordered if t.physical and rank(t) < alike * rank(best) and (far or t.effect in known)]
    simplest = min(rivals, key=lambda t: (len(t.coefficients), rank(t)), default=best)
    first = simplest if len(simplest.coefficients) < len(best.coefficients) else best
    return [first, *(t for t in ordered if t is not first)]


def with_contained(study: Study, names: Sequence[str]) -> list[str]:
    """The names, and those of the effects that they contain: an effect is judged beside what it contains."""
    judged = {e.name for e in study.missable()}
    contained = [s for n in names for s in study.module.CONTAINS.get(n, {}) if s in judged]
    return list(dict.fromkeys([*names, *contained]))


def is_clear(best: Fit, other: Fit, floor: float) -> bool:
    """Whether the best fit on short segments has settled the matter: it reaches the noise and the other does not."""
    return best.error < EXPLAINED * floor and other.cost > HOPEFUL * best.cost
