"""Which physical effect is missing: screen all, refit the best, judge on held-out data."""

from __future__ import annotations

import itertools
import os
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from scipy.linalg import null_space
from scipy.special import fdtrc

import derive
from derive.effects import Effect
from wheelpend.logs import Log
from wheelpend.missing_force import MissingForce, Place, concentrations, find_missing_force
from wheelpend.model import Model
from wheelpend.screening import Candidate, Screen, screen, size_names
from wheelpend.shapes import Shape, nothing, shapes_of
from wheelpend.shooting import Fit
from wheelpend.study import (
    Study,
    best_start,
    fit_model,
    fit_parts,
    free_names,
    held_residuals,
    per_log_names,
    prepare,
    shortened,
)

SIGNIFICANCE = 0.01  # family-wise, over the whole library
WORTHWHILE = 0.005  # relative fall of the held-out error below which an effect is not worth naming
EQUIVALENT = 0.01  # relative difference of the held-out errors within which effects cannot be told apart
EXPLAINED = 1.1  # error over noise floor above which something is still missing
REFITTED = 5  # best candidates of each screening that are refitted
PROMISING = 10.0  # expected fall of the sum of squares per coefficient, in noise variances, that is worth a refit
HOPEFUL = 2.0  # cost on short segments, over the best, up to which a candidate is judged on held-out data
SHORT = 0.1  # of the horizon: segments so short that the problem is almost linear
VISIBLE = 1.02  # error over noise floor above which a missing force is worth showing
FEWEST = 15  # segments over parameters below which significance is taken from shorter segments
BLOCKS = 5

Progress = Callable[[str], None]


@dataclass(frozen=True)
class Tried:
    """An effect after its refit."""

    effect: str
    family: str
    coefficients: dict[str, float]
    sigma: dict[str, float]
    unit: dict[str, str]
    p_value: float  # corrected for the size of the library
    blocks_agree: str
    error_after: float  # held out
    equivalent_to: tuple[str, ...]
    physical: bool
    fit: Fit = field(repr=False)
    beyond: dict[str, float] = field(default_factory=dict)  # p-value of what it adds to each effect it contains

    def worth_naming(self, before: float) -> bool:
        """Significant, physically possible, and lowering the held-out error by enough."""
        return self.physical and self.p_value < SIGNIFICANCE and self.error_after < (1.0 - WORTHWHILE) * before

    def worth_more_than(self, smaller: Tried) -> bool:
        """Whether what it adds to an effect that it contains is significant and lowers the held-out error by enough."""
        better = self.error_after < (1.0 - WORTHWHILE) * smaller.error_after
        return better and self.beyond.get(smaller.effect, 0.0) < SIGNIFICANCE


@dataclass(frozen=True)
class Diagnosis:
    """What is missing in a model, according to logs."""

    verdict: str
    horizon_s: float
    error: float  # held out, after refitting the model's own parameters
    noise_floor: float
    fit_percent: dict[str, float]
    candidates: tuple[Tried, ...]  # worth naming, best first; then improbable ones that are physically impossible
    experiment: str | None
    detectable: dict[str, dict[str, float]]
    where: tuple[Place, ...]
    sentences: tuple[str, ...]  # for people
    not_judged: dict[str, str]  # effects left out, and why
    warnings: tuple[str, ...]
    fit: Fit = field(repr=False)
    study: Study = field(repr=False)
    missing: MissingForce | None = field(repr=False, default=None)
    screen: Screen | None = field(repr=False, default=None)


def diagnose(
    model: Model,
    logs: Sequence[str | Path | Log],
    holdout: Sequence[str | Path | Log] = (),
    *,
    progress: Progress = lambda text: None,
) -> Diagnosis:
    """Find which effect of the library is missing. Changes nothing.

    Raises Failure where the logs or the model cannot be used.
    """
    study = prepare(model, logs, holdout)
    progress("finding a start")
    study, start = best_start(study)
    return diagnose_study(study, start, progress=progress)


def diagnose_study(
    study: Study, start: dict[str, float], *, with_force: bool = True, progress: Progress = lambda text: None
) -> Diagnosis:
    """Diagnose a prepared study from a start for its parameters."""
    present = study.model.effects
    free = free_names(study, present)
    progress("fitting the model as it is")
    short = fit_model(study, start, free, horizons=(SHORT,))
    base = fit_model(study, short.values, free, horizons=(0.3, 1.0), start_per_log=short.per_log)
    before, residuals = held_residuals(study, base)
    progress("scoring every effect")
    shapes = shapes_of(study, short, [e for e in study.effects() if e.name not in present])
    far = screen(study, base, study.training, present, shapes)
    near = near_screens(study, short, start, shapes, corrupted=before > EXPLAINED * study.floor)
    tried = refit_best(study, base, short, before, near, far, residuals, progress)
    missing = None
    if with_force:
        progress("estimating the missing force")
        missing = find_missing_force(study, base)
    return conclude(study, base, before, residuals, tried, far, missing)


def near_screens(
    study: Study, short: Fit, start: dict[str, float], shapes: Mapping[str, Shape], corrupted: bool
) -> list[tuple[dict[str, float], Screen]]:
    """Score every effect on short segments: at the fit, and where a missing effect corrupts that, at its starts too.

    A base fit that bends every parameter to a missing effect can hide that very effect from its own linearisation.
    """
    parts, present = shortened(study, SHORT * study.horizon), study.model.effects
    found = [(short.values, screen(study, short, parts, present, shapes))]
    free = free_names(study, present)
    for origin in (start, *study.origins) if corrupted else ():
        values = {**short.values, **origin}
        there = fit_parts(study, parts, values, free, start_per_log=short.per_log, rounds=0)
        if np.isfinite(there.cost):
            found.append((values, screen(study, there, parts, present, shapes)))
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

    def finish(pair: tuple[str, Fit]) -> Tried:
        name, begun = pair
        progress(f"judging {name} on held-out data")
        fitted = fit_model(study, begun.values, _free_with(base, name), horizons=(1.0,), start_per_log=begun.per_log)
        evidence = evidence_fit(study, fitted, begun)
        return judge(study, by_name[name], fitted, evidence, before, residuals, tests)

    with ThreadPoolExecutor(max_workers=os.cpu_count() or 1) as pool:  # the kernels release the interpreter's lock
        begun = sorted(zip(names, pool.map(begin, names), strict=True), key=lambda pair: pair[1].cost)
        hopeful = [p for n, p in enumerate(begun) if n < 1 or not is_clear(begun[0][1], p[1], study.floor)][:REFITTED]
        tried = list(pool.map(finish, hopeful))
    return sorted(tried, key=lambda t: t.error_after)


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


def _free_with(base: Fit, effect: str) -> list[str]:
    return [*dict.fromkeys(n.split("@")[0] for n in base.free), *derive.effects.find(effect).full_names]


def starts_for(near: list[tuple[dict[str, float], Screen]], name: str) -> list[tuple[dict[str, float], Candidate]]:
    """Where an effect's refits may start: each screening's point with the size it suggests there."""
    return [(values, c) for values, found in near for c in found.candidates if c.effect.name == name]


def refit(study: Study, short: Fit, beginnings: Sequence[tuple[dict[str, float], Candidate]]) -> Fit:
    """Refit the model with one more effect on short segments, from several points and sizes, with fresh states.

    On short segments the problem is almost linear. Effects that are not locally linear (a delay, a threshold) start
    from a grid of sizes as well.
    """
    effect = beginnings[0][1].effect
    free = _free_with(short, effect.name)
    trials = [(values, admissible(effect, s)) for n, (values, c) in enumerate(beginnings)
              for s in c.starts[: None if n == 0 else 1]]  # fmt: skip
    for parameter in effect.parameters:
        trials += [(beginnings[0][0], {f"{effect.name}.{parameter.name}": size}) for size in parameter.grid]
    fits = []
    for values, sizes_ in trials:
        fits.append(_refit_from(study, short, sizes_, free, SHORT, values, short.per_log))
        if fits[-1].error < EXPLAINED * study.floor:
            break  # it cannot get better than the noise
    best = min(fits, key=lambda f: f.cost)
    return _refit_from(study, short, {}, free, 0.3, best.values, best.per_log)


def _refit_from(study: Study, short: Fit, sizes_: dict, free: list[str], share: float, values, per_log) -> Fit:
    own = [{**o, **{k: v for k, v in sizes_.items() if k in per_log_names(free)}} for o in per_log]
    parts = shortened(study, share * study.horizon, most=80)
    return fit_parts(study, parts, {**values, **sizes_}, free, start_per_log=own)


def admissible(effect: Effect, start: dict[str, float]) -> dict[str, float]:
    """A start moved into the physically possible range."""
    ranges = {f"{effect.name}.{p.name}": (p.minimum, p.maximum) for p in effect.parameters}
    return {n: float(np.clip(v, *ranges[n])) for n, v in start.items()}


def judge(
    study: Study, candidate: Candidate, fitted: Fit, evidence: Fit, before: float, old: list[np.ndarray], tests: int
) -> Tried:
    """Evidence for one effect: significance, agreement of blocks, fall of the held-out error."""
    effect = candidate.effect
    after, residuals = held_residuals(study, fitted)
    names = [n for n in fitted.free if n.split("@")[0] in effect.full_names]
    coefficients = {p.name: coefficient(fitted, f"{effect.name}.{p.name}") for p in effect.parameters}
    sigma = {p.name: honest_sigma(fitted, f"{effect.name}.{p.name}") for p in effect.parameters}
    sized = [n for n in names if n.split("@")[0] in size_names(effect)]
    away = distance(evidence, sized, nothing(study, effect))
    p_value = min(1.0, wald(evidence, sized, away) * tests)
    return Tried(
        effect.name, effect.family, coefficients, sigma, {p.name: p.unit for p in effect.parameters},
        p_value, agreement(old, residuals), after, (), possible(effect, coefficients, sigma), fitted,
        beyond(study, effect, evidence, tests),
    )  # fmt: skip


def beyond(study: Study, effect: Effect, evidence: Fit, tests: int) -> dict[str, float]:
    """Probability, by chance, of what an effect adds to each effect that it contains."""
    names = [f"{effect.name}.{p.name}" for p in effect.linear]
    found = {}
    for smaller, weights in study.module.CONTAINS.get(effect.name, {}).items():
        if all(n in evidence.free for n in names):
            added = null_space(np.array(weights).T).T  # combinations that vanish where it is but the smaller one
            found[smaller] = min(1.0, wald(evidence, names, distance(evidence, names, {}), added) * tests)
    return found


def coefficient(fitted: Fit, name: str) -> float:
    """Fitted value of a parameter; of a per-log one the first log's."""
    return fitted.of_log(0)[name]


def honest_sigma(fitted: Fit, name: str) -> float:
    """The larger of the standard errors that the information matrix and the scatter of the segments give."""
    return max(fitted.sigma(name), fitted.sigma(name, robust=True))


def distance(fitted: Fit, names: Sequence[str], absent: Mapping[str, float]) -> np.ndarray:
    """How far coefficients are from those at which they do nothing, zero where none is given."""
    parts = [(n.split("@")[0], int(n.partition("@")[2] or 0)) for n in names]
    return np.array([fitted.of_log(log)[name] - absent.get(name, 0.0) for name, log in parts])


def wald(fitted: Fit, names: Sequence[str], away: np.ndarray, combined: np.ndarray | None = None) -> float:
    """Probability of coefficients this far away by chance, with the more cautious of two covariances.

    ``combined`` (n, names) tests combinations of them instead.
    """
    places = [fitted.free.index(n) for n in names]
    mixed = np.eye(len(names)) if combined is None else combined
    values = mixed @ away
    segments = sum(len(s) for s in fitted.states)
    freedom = max(segments - len(fitted.free), 2)
    worst = 0.0
    for matrix in (fitted.covariance * max(fitted.error, 1.0) ** 2, fitted.robust):
        block = mixed @ matrix[np.ix_(places, places)] @ mixed.T
        statistic = float(values @ np.linalg.pinv(block, rcond=1e-12, hermitian=True) @ values) / len(values)
        worst = max(worst, float(fdtrc(len(values), freedom, max(statistic, 0.0))))
    return worst


def possible(effect: Effect, coefficients: dict[str, float], sigma: dict[str, float]) -> bool:
    """Whether every coefficient lies in its physical range and order, within two standard errors."""
    pairs = itertools.pairwise(effect.ordered)
    return all(
        p.minimum - 2.0 * sigma[p.name] <= coefficients[p.name] <= p.maximum + 2.0 * sigma[p.name]
        for p in effect.parameters
    ) and all(coefficients[a] <= coefficients[b] + 2.0 * (sigma[a] + sigma[b]) for a, b in pairs)


def agreement(old: list[np.ndarray], new: list[np.ndarray]) -> str:
    """In how many of five blocks of the held-out data the error falls."""
    falls = []
    for before, after in zip(old, new, strict=True):
        used = np.flatnonzero(np.isfinite(before).any(axis=1))
        for block in np.array_split(used, BLOCKS):
            falls.append(np.nansum(after[block] ** 2) < np.nansum(before[block] ** 2))
    return f"{sum(falls)}/{len(falls)}"


def conclude(study, base, before, residuals, tried, far: Screen, missing: MissingForce | None) -> Diagnosis:
    """Turn the refits into a verdict."""
    named = [t for t in tried if t.worth_naming(before) and stands_alone(study, t, tried)]
    impossible = [t for t in tried if not t.physical and t.error_after < (1.0 - WORTHWHILE) * before]
    named = [_with_equivalents(study, t, named, far) for t in named]
    unexplained = before > EXPLAINED * study.floor
    if not named:
        verdict = "unexplained" if unexplained else "nothing_missing"
    else:
        verdict = "ambiguous" if named[0].equivalent_to else "effect_missing"
    if verdict == "effect_missing" and len(study.held) == 0:
        verdict = "ambiguous"
    return Diagnosis(
        verdict=verdict,
        horizon_s=study.horizon,
        error=before,
        noise_floor=study.floor,
        fit_percent=fit_percent(study, residuals),
        candidates=(*named, *impossible),
        experiment=experiment(study, named[0]) if verdict == "ambiguous" else None,
        detectable=detectable(study, far) if verdict == "nothing_missing" else {},
        where=concentrations(study, missing) if missing and before > VISIBLE * study.floor else (),
        sentences=(),
        not_judged={e.name: why for e in derive.effects.LIBRARY.values() if (why := study.lacking(e))},
        warnings=study.warnings,
        fit=base,
        study=study,
        missing=missing,
        screen=far,
    )


def with_contained(study: Study, names: Sequence[str]) -> list[str]:
    """The names, and those of the effects that they contain: an effect is judged beside what it contains."""
    judged = {e.name for e in study.effects() if e.name not in study.model.effects}
    within = [s for n in names for s in study.module.CONTAINS.get(n, {}) if s in judged]
    return list(dict.fromkeys([*names, *within]))


def stands_alone(study: Study, tried: Tried, others: Sequence[Tried]) -> bool:
    """Whether an effect is worth naming over every effect that it contains."""
    contained = study.module.CONTAINS.get(tried.effect, {})
    return all(tried.worth_more_than(o) for o in others if o.effect in contained)


def always_alike(study: Study, tried: Tried) -> set[str]:
    """Effects that the equations cannot tell from one.

    With several logs one with a value in each is not matched by one with a value for all.
    """
    own = derive.effects.find(tried.effect)
    single = len(study.noise) == 1
    judged = {e.name: e for e in study.effects() if e.name not in study.model.effects}
    alike = [judged[n] for n in study.module.TWINS.get(tried.effect, ()) if n in judged]
    return {e.name for e in alike if single or per_log_names(e.full_names) or not per_log_names(own.full_names)}


def _with_equivalents(study: Study, tried: Tried, named: Sequence[Tried], far: Screen) -> Tried:
    from dataclasses import replace

    close = {o.effect for o in named if o is not tried and abs(o.error_after / tried.error_after - 1.0) <= EQUIVALENT}
    close |= set(far.twins.get(tried.effect, ())) | always_alike(study, tried)
    return replace(tried, equivalent_to=tuple(sorted(close)))


def fit_percent(study: Study, residuals: list[np.ndarray]) -> dict[str, float]:
    """100 (1 − NRMSE) of each channel over the held-out segments."""
    found = {}
    parts = [h.part for h in study.held] or list(study.training)
    for c, channel in enumerate(parts[0].log.channels):
        error = np.concatenate([r[:, c] * p.sigma[c] for r, p in zip(residuals, parts, strict=False)] or [np.zeros(1)])
        values = np.concatenate([np.where(np.isfinite(r[:, c]), p.log.measured[:, c], np.nan)
                                 for r, p in zip(residuals, parts, strict=False)] or [np.zeros(1)])  # fmt: skip
        spread = np.nanstd(values) * np.sqrt(np.isfinite(values).sum())
        found[channel] = float(100.0 * (1.0 - np.sqrt(np.nansum(error**2)) / spread)) if spread > 0 else 0.0
    return found


def detectable(study: Study, far: Screen) -> dict[str, dict[str, float]]:
    """The smallest size of each effect that this log would have shown.

    It must stand 5 standard errors clear of zero and lower the error by what makes it worth naming.
    """
    values = sum(p.values for p in study.training)
    factor = max(5.0, float(np.sqrt(2.0 * WORTHWHILE * values)))
    return {
        c.effect.name: {n.partition(".")[2]: factor * s for n, s in c.sigma.items()}
        for c in sorted(far.candidates, key=lambda c: c.effect.name)
        if c.sigma and all(0.0 < s < 1e6 for s in c.sigma.values())
    }


def experiment(study: Study, first: Tried) -> str:
    """What would tell the first candidate from its equivalents."""
    from wheelpend.separation import advice

    return advice(study, first)
