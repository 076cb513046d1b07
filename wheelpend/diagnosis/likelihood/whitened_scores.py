"""Scores of effects behind a model's filter: by how much each is expected to raise the likelihood.

Residual and sensitivities are whitened by the same filter. A random force that was fitted to a wrong model hides just
what is missing, so that effects are scored behind filters that leave less to chance too.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from derive.effects import Effect, InternalPlay
from derive.parameter_name import effect_of, short_name
from wheelpend.diagnosis.equation_scores import EquationScore
from wheelpend.diagnosis.likelihood.filtered_model import FilteredModel, estimator_of
from wheelpend.diagnosis.score_test import EffectSize, linear_names
from wheelpend.estimation.filter_fit import FilterPoint
from wheelpend.estimation.fit import Fit
from wheelpend.estimation.normal_equations import NormalEquations
from wheelpend.estimation.profiled_starts import profile_grids
from wheelpend.estimation.random_source import Sources, scaled_sources

FORCE_SHARES = (1.0, 0.3, 0.1)  # of the fitted random force, behind which effects are scored
MAX_LEADERS = 7  # effects of each score that are refitted
MIN_GAIN_PER_COEFFICIENT = 10.0  # expected fall of −2 log-likelihood from which an effect is refitted
DETECTABLE_SIGMAS, MAX_DETECTABLE_SIZE = 5.0, 1e6  # standard errors that a size must have; beyond that it shows nowhere
MAX_SETTINGS = 2  # of a profiled parameter from which a refit starts


class ScoredEffect(NamedTuple):
    """An effect with the sizes from which its refits start."""

    effect: Effect
    gain: float  # expected fall of −2 log-likelihood, in units of the innovations' mean square; inf where none can tell
    starts: tuple[EffectSize, ...]  # best first


class LinearScores(NamedTuple):
    """Normal equations of effects' linear parameters behind a filter, without what the model's own explain."""

    rest: NormalEquations
    unit: float  # mean square of the innovations, at least 1

    def together(self, effects: Sequence[Effect]) -> tuple[float, tuple[EffectSize, ...]]:
        """Expected fall of −2 log-likelihood with some effects at once [unit], and the size that each has then."""
        names = [n for e in effects for n in linear_names(e)]
        places = self.rest.layout.indices(names)
        step, _ = self.rest.solve(places)
        sizes = {e.name: EffectSize({}, {}) for e in effects}
        for place, value in zip(places, step, strict=True):
            element = self.rest.layout.elements[place]
            size = sizes[effect_of(element.name)]
            (size.further.setdefault(element.log, {}) if element.log else size.values)[element.name] = float(value)
        return float(self.rest.score[places] @ step) / self.unit, tuple(sizes.values())


def leading_effects(model: FilteredModel) -> list[ScoredEffect]:
    """The union of the leaders behind all filters, the largest gain first, each with its starts of all of them."""
    found: dict[str, ScoredEffect] = {}
    for scores in _behind_each_filter(model, scorable_effects(model)):
        for one in scores[:MAX_LEADERS]:
            if one.gain > MIN_GAIN_PER_COEFFICIENT * len(one.effect.parameters):
                known = found.get(one.effect.name, one._replace(starts=()))
                starts = tuple(s for s in one.starts if s not in known.starts)
                found[one.effect.name] = ScoredEffect(one.effect, max(one.gain, known.gain), (*known.starts, *starts))
    return sorted(found.values(), key=lambda s: -s.gain)


def scored_effect(model: FilteredModel, effect: Effect) -> ScoredEffect:
    """One effect with its starts behind all filters, however little it promises; with usual sizes where none tells."""
    inside = next((e for e in internal_effects(model) if e.effect.name == effect.name), None)
    if inside is not None:
        return inside
    scored = [one for scores in _behind_each_filter(model, [effect]) for one in scores]
    typical = EffectSize({effect.name_of(p): p.typical for p in effect.parameters}, {})
    sizes = [size for one in scored for size in one.starts] or [typical]
    return ScoredEffect(effect, max((one.gain for one in scored), default=0.0), tuple(sizes))


def _behind_each_filter(model: FilteredModel, effects: Sequence[Effect]) -> Iterator[list[ScoredEffect]]:
    """Scores of effects, best first, behind each of the filters that leave less to chance."""
    grids = profile_grids(model.problem, Fit.at(model.log_values[0]), [e for e in effects if e.profiled])
    settings = {name: grid.settings for name, grid in grids.items()}
    for share in FORCE_SHARES:
        yield scored_effects(model, effects, settings, scaled_sources(model.point.sources, share))


def with_leading_by_equations(
    leaders: Sequence[ScoredEffect], by_equations: Mapping[str, EquationScore]
) -> list[ScoredEffect]:
    """Leaders, and the effects that lead by what they leave of the equations where these are not among them."""
    known = {one.effect.name for one in leaders}
    others = [one for name, one in by_equations.items() if name not in known]
    return [*leaders, *(ScoredEffect(o.effect, 0.0, (EffectSize(o.size(), {}),)) for o in others)]


def with_plain_twins(model: FilteredModel, leaders: Sequence[ScoredEffect]) -> list[ScoredEffect]:
    """Leaders, and beside a difference between directions what the equations cannot tell from it and is none.

    A constant force that a motor meets one way and has the other way is an offset before it is worn teeth.
    """
    known, candidates = {one.effect.name for one in leaders}, {e.name: e for e in scorable_effects(model)}
    twins = [t for one in leaders if one.effect.varies for t in model.problem.module.TWINS.get(one.effect.name, ())]
    plain = [t for t in dict.fromkeys(twins) if t not in known and t in candidates and not candidates[t].varies]
    return [*leaders, *(scored_effect(model, candidates[t]) for t in plain)]


def judged_effects(model: FilteredModel) -> list[Effect]:
    """Effects that are judged with a random force: all that the model may be missing but events and play.

    Whether play is closed at a moment depends on every contact before: a filter that expands the motion about its mean
    cannot follow it.
    """
    return [e for e in model.problem.candidates() if not e.event and not isinstance(e.enters, InternalPlay)]


def scorable_effects(model: FilteredModel) -> list[Effect]:
    """Judged effects of which a score can tell by how much they raise the likelihood: those without a motion inside."""
    return [e for e in judged_effects(model) if not e.releases]


def internal_effects(model: FilteredModel) -> list[ScoredEffect]:
    """Judged effects that move by themselves inside the machine, with every start that their parameters have.

    Their motion changes all others so much that no score at a start tells what a refit would reach from there: a model
    without an elastic shaft may have five times the inertia. So each is refitted.
    """
    effects = [e for e in judged_effects(model) if e.releases]
    grids = profile_grids(model.problem, Fit.at(model.log_values[0]), effects)
    found = []
    for effect in effects:
        typical = {effect.name_of(p): p.typical for p in effect.parameters}
        starts = tuple(EffectSize({**typical, **setting}, {}) for setting in grids[effect.name].settings)
        found.append(ScoredEffect(effect, np.inf, starts))
    return found


def scored_effects(
    model: FilteredModel,
    effects: Sequence[Effect],
    settings: Mapping[str, Sequence[Mapping[str, float]]],
    sources: Sequence[Sources],
) -> list[ScoredEffect]:
    """Effects with their expected gains behind a filter with these sources, best first.

    settings are the values, by effect.parameter, at which an effect with a profiled parameter is scored.
    """
    point, scores = _linear_scores(model, [e for e in effects if e.profiled is None], {}, sources)
    if scores is None:
        return []
    found = [_scored(e, scores) for e in effects if e.profiled is None]
    for effect in (e for e in effects if e.name in settings):
        tried = []
        for setting in settings[effect.name]:
            there, own = _linear_scores(model, [effect], setting, sources)
            if own is not None:
                fall = (point.deviance - there.deviance) / scores.unit
                tried.append(_scored(effect, own._replace(unit=scores.unit), fall, setting))
        tried.sort(key=lambda s: -s.gain)
        if tried:
            starts = tuple(s.starts[0] for s in tried[:MAX_SETTINGS])
            found.append(tried[0]._replace(starts=starts))
    return sorted((f for f in found if np.isfinite(f.gain)), key=lambda s: -s.gain)


def linear_scores(model: FilteredModel) -> Iterator[LinearScores]:
    """Scores of all effects without an inner parameter, behind each of the filters that leave less to chance."""
    effects = linear_effects(model)
    for share in FORCE_SHARES:
        scores = _linear_scores(model, effects, {}, scaled_sources(model.point.sources, share))[1]
        if scores is not None:
            yield scores


def detectable_sizes(model: FilteredModel) -> dict[str, dict[str, float]]:
    """The smallest size of each effect, by parameter, that the logs would have shown beside the random force."""
    effects = linear_effects(model)
    scores, found = _linear_scores(model, effects, {}, model.point.sources)[1], dict[str, dict[str, float]]()
    if scores is None:
        return found
    rest = scores.rest
    for effect in sorted(effects, key=lambda e: e.name):
        places = rest.layout.indices(linear_names(effect))
        sigma = np.sqrt(np.maximum(np.diag(rest.solve(places)[1]), 0.0))
        sizes: dict[str, float] = {}
        for place, value in zip(places, sigma, strict=True):
            sizes.setdefault(short_name(rest.layout.elements[place].name), DETECTABLE_SIGMAS * float(value))
        if all(0.0 < s < MAX_DETECTABLE_SIZE for s in sizes.values()):
            found[effect.name] = sizes
    return found


def linear_effects(model: FilteredModel) -> list[Effect]:
    """Scorable effects that are scored at their absence, without an inner parameter."""
    return [e for e in scorable_effects(model) if e.profiled is None]


def _linear_scores(
    model: FilteredModel, effects: Sequence[Effect], setting: Mapping[str, float], sources: Sequence[Sources]
) -> tuple[FilterPoint, LinearScores | None]:
    """The point with some values set otherwise, and the scores there of effects; None where the filter diverged."""
    more = [n for e in effects for n in linear_names(e)]
    estimator = estimator_of(model.problem, [{**values, **setting} for values in model.log_values], more)
    point = estimator.point(estimator.problem.space.start(), sources)
    if not np.isfinite(point.deviance):
        return point, None
    total = estimator.problem.equations(point.runs).sum().finite()
    rest = total.project(total.layout.indices(model.names))
    return point, LinearScores(rest, max(float(rest.cost) / max(model.estimator.problem.count, 1), 1.0))


def _scored(
    effect: Effect, scores: LinearScores, fall: float = 0.0, setting: Mapping[str, float] = MappingProxyType({})
) -> ScoredEffect:
    """An effect scored by its linear parameters, beside a fall of the deviance that its setting brings by itself."""
    gain, (size,) = scores.together([effect])
    return ScoredEffect(effect, gain + fall, (EffectSize({**setting, **size.values}, size.further),))
