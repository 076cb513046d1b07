"""Refits of a model with one effect more, or without one, the random force free from fast and slow starts.

A wrong model's slow force is no argument against a law that makes it small, so that each refit begins with the force as
it was found and with a smaller and faster one. And a wrong model may have gone astray, so that a third refit begins
with what is known of the machine before any fit.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

import derive
from wheelpend.diagnosis.equation_scores import EquationScore
from wheelpend.diagnosis.likelihood.filtered_model import (
    MAX_LAST_SAMPLES,
    SETTLED_EFFORT,
    FilteredModel,
    LogValues,
    estimator_of,
    moved_to,
    possible_sources,
)
from wheelpend.diagnosis.refit import clip_to_bounds, replace_contained
from wheelpend.diagnosis.score_test import EffectSize
from wheelpend.estimation.filter_fit import Effort, FilterEstimator
from wheelpend.estimation.free_parameters import effect_parameter, values_of_model_effects
from wheelpend.estimation.problem import EstimationProblem, extended_effects, with_stable_step
from wheelpend.estimation.profiled_starts import profiled_start_values
from wheelpend.estimation.random_source import Sources, with_forces
from wheelpend.estimation.source_search import SOURCES_ALONE, with_second_errors, without_needless

FORCE_STARTS = ((1.0, 1.0), (0.3, 0.1))  # share of the found force's size and time, from which refits start
ANEW_FORCE_SHARE = 0.03  # of the drive: a random force, at most, with which a fit begins from what is known
RANKING_SAMPLES = 5_000  # of all logs together, on which it is found which refits lead
FIRST_EFFORT = Effort(4, 1.0, False, holds_times=True)  # of a fit that finds the best of several sizes, at held forces
REFIT_EFFORT = Effort(8, 2.0, False, holds_times=True, holds_sensors=True)  # of the fit that goes on from it
LAST_EFFORT = Effort(12, 0.5, False, holds_times=True)  # of the fit that ends it, errors of sensors free too
HELD_EFFORT = Effort(8, 1.0, False)  # of a fit at held sources


class BegunRefit(NamedTuple):
    """A model refitted from fast and slow starts of the random forces, errors of sensors held: not yet to its end."""

    models: tuple[FilteredModel, ...]  # from each start

    @property
    def deviance(self) -> float:
        """The lowest so far."""
        return min((m.deviance for m in self.models if np.isfinite(m.deviance)), default=np.inf)

    def ended(self, goal: float = np.inf) -> FilteredModel | None:
        """The likeliest of the refits taken to their end; None where none can be simulated.

        Those that will hardly reach a deviance that is their goal are given up.
        """
        best: FilteredModel | None = None
        for begun in self.models:
            point, price = begun.point, begun.deviance - begun.point.deviance
            point = begun.estimator.fit(point.theta, point.sources, LAST_EFFORT, goal=goal - price)
            if np.isfinite(point.deviance) and (best is None or point.deviance < best.point.deviance):
                best = moved_to(begun, point)
        return best


def with_effect(
    model: FilteredModel, effect: str, starts: Sequence[EffectSize], regressed: EquationScore | None = None
) -> BegunRefit:
    """The model with one effect more, from the best of some sizes; of long logs on a part.

    ``regressed`` is what a regression of the filtered equations with it came to, where it is known: one more fit begins
    anew with that.
    """
    started = [_started(model.problem, model.log_values, effect, start) for start in starts]
    problem = model.problem.with_effects(extended_effects(model.problem.model, effect))
    if derive.effects.find(effect).releases:
        problem = with_stable_step(problem, started[0][0])  # what moves inside may be stiffer
    return _begun_refit(replace(model, problem=problem), started, regressed)


def with_both(model: FilteredModel, sizes: Mapping[str, EffectSize]) -> FilteredModel | None:
    """The model with further effects, by name, refitted from these sizes; None where it cannot be simulated."""
    problem, log_values = model.problem, model.log_values
    for effect, size in sizes.items():
        log_values = _started(problem, log_values, effect, size)
        problem = problem.with_effects(extended_effects(problem.model, effect))
    found = _likeliest_refit(replace(model, problem=problem), [log_values])
    return found and refined(found)


def _started(
    problem: EstimationProblem, log_values: LogValues, effect: str, start: EffectSize
) -> list[dict[str, float]]:
    """Values in each log from which a refit with one effect more starts."""
    row, started = derive.effects.find(effect), []
    for number, values in enumerate(log_values):
        rest, size = replace_contained(problem, row, values, start.in_log(number))
        started.append({**rest, **clip_to_bounds(row, size).values})
    return started


def without_effect(model: FilteredModel, effect: str, amid: Sequence[Sources] = ()) -> FilteredModel | None:
    """The model with one effect less, refitted from where it is; None where that cannot be simulated.

    One more refit begins ``amid`` other random sources, of each log: without any a long free swing holds the parameters
    where they are, however little is taken out.
    """
    effects = [e for e in model.problem.model.effects if e != effect]
    problem = model.problem.with_effects(effects)
    log_values = [values_of_model_effects(problem, values) for values in model.log_values]
    begun = _begun_refit(replace(model, problem=problem), [log_values])
    if amid:
        freer = _best_begun(problem, _ranking_estimators(problem, [log_values]), amid)
        begun = BegunRefit((*begun.models, freer))
    found = begun.ended()
    return found and refined(found)


def refitted(model: FilteredModel) -> FilteredModel:
    """The model, or what the refits that its candidates get make of it where that is likelier."""
    found = _likeliest_refit(model, [model.log_values])
    other = found and refined(found)
    return other if other is not None and other.deviance < model.deviance else model


def settled(model: FilteredModel) -> FilteredModel:
    """A model fitted to its end, without the random sources that it does not need any more."""
    estimator, point = model.estimator, model.point
    return moved_to(model, without_needless(estimator, estimator.fit(point.theta, point.sources, SETTLED_EFFORT)))


def gone_on_with(model: FilteredModel) -> FilteredModel:
    """A settled model, a sensor's error two where that is likelier: what the search goes on with.

    An effect is judged before: what the second error gains is not its merit. And in a model that lacks an effect the
    second one would stand for that.
    """
    estimator, point = model.estimator, model.point
    more = with_second_errors(estimator, point, possible_sources(model.problem)[1])
    return model if more is point else moved_to(model, estimator.fit(more.theta, more.sources))


def fitted_to_all(model: FilteredModel) -> FilteredModel:
    """A model of which the search is over, fitted to its end to the samples of long logs that the search left out."""
    whole = estimator_of(model.problem, model.log_values, samples=MAX_LAST_SAMPLES)
    if whole.problem.count == model.estimator.problem.count:
        return model
    begun = FilteredModel(model.problem, whole, whole.point(model.point.theta, model.point.sources))
    return settled(begun) if np.isfinite(begun.point.deviance) else model


def at_sources(model: FilteredModel, sources: Sequence[Sources]) -> FilteredModel:
    """The model with its parameters refitted at given sources."""
    point = model.estimator.fit(model.point.theta, sources, HELD_EFFORT, fixed_noise=True)
    return moved_to(model, point)


def _without_own(values: Mapping[str, float]) -> dict[str, float]:
    """Values but for those that each log has for itself."""
    return {n: v for n, v in values.items() if (p := effect_parameter(n)) is None or p.scope == "shared"}


def _likeliest_refit(model: FilteredModel, log_values: Sequence[LogValues]) -> FilteredModel | None:
    """The likeliest of fits of a model from several values in each log, with several starts of the random forces.

    Of long logs on a part.
    """
    return _begun_refit(model, log_values).ended()


def _begun_refit(
    model: FilteredModel, log_values: Sequence[LogValues], regressed: EquationScore | None = None
) -> BegunRefit:
    """The same, not yet to its end."""
    estimators = _ranking_estimators(model.problem, log_values)
    shortest = estimators[0].correlation_bounds[0]
    starts = [with_forces(model.point.sources, share, slowness, shortest) for share, slowness in FORCE_STARTS]
    begun = [_best_begun(model.problem, estimators, sources) for sources in starts]
    known = _without_own(model.problem.unfitted_start)
    anew = [known, {**known, **regressed.values}] if regressed else [known]
    begun += [_begun_anew(model, log_values, values) for values in anew]
    if regressed and regressed.unknown:
        begun.append(_begun_amid_forces(model, log_values, anew[-1]))
    return BegunRefit(tuple(begun))


def _begun_anew(model: FilteredModel, log_values: Sequence[LogValues], known: Mapping[str, float]) -> FilteredModel:
    """A fit that begins with what is known of the machine without any fit, and with small and fast random forces.

    A model that lacks something may have ended so far away that no refit leads back from there. Nor does one from
    where the shape of an effect has run to its bound: that one begins in the middle again.
    """
    begins = [[{**v, **known, **_from_bounds(model.problem, v)} for v in own] for own in log_values]
    estimators = _ranking_estimators(model.problem, begins)
    largest, shortest = ANEW_FORCE_SHARE * model.estimator.force_scale, estimators[0].correlation_bounds[0]
    sources = with_forces(model.point.sources, 1.0, FORCE_STARTS[-1][1], shortest, largest)
    return _best_begun(model.problem, estimators, sources)


def _from_bounds(problem: EstimationProblem, values: Mapping[str, float]) -> dict[str, float]:
    """Starting values of the shapes of a model's effects that lie at a bound: what they are called is lost there."""
    shapes = [(e.name_of(e.profiled), e.profiled) for e in map(problem.effect, problem.model.effects) if e.profiled]
    lost = [n for n, p in shapes if n in values and not p.minimum < values[n] < p.maximum]
    return {n: v for n, v in profiled_start_values(problem).items() if n in lost} if lost else {}


def _begun_amid_forces(
    model: FilteredModel, log_values: Sequence[LogValues], known: Mapping[str, float]
) -> FilteredModel:
    """A fit that begins with values of which one is hardly known, and with the random forces that are likeliest there.

    Much smaller ones would hold the parameters where they are, and amid much larger ones these hardly matter.
    """
    (estimator,) = _ranking_estimators(model.problem, [[{**v, **known} for v in log_values[0]]])
    begun = estimator.fit(estimator.problem.space.start(), model.point.sources, SOURCES_ALONE)
    return FilteredModel(model.problem, estimator, estimator.fit(begun.theta, begun.sources, REFIT_EFFORT))


def _ranking_estimators(problem: EstimationProblem, log_values: Sequence[LogValues]) -> list[FilterEstimator]:
    """Estimators at several values in each log, of long logs on a part."""
    return [estimator_of(problem, values).on_part(RANKING_SAMPLES) for values in log_values]


def _best_begun(
    problem: EstimationProblem, estimators: Sequence[FilterEstimator], sources: Sequence[Sources]
) -> FilteredModel:
    """The likeliest of short fits at held sources, gone on with."""
    begun = [e.fit(e.problem.space.start(), sources, FIRST_EFFORT, fixed_noise=True) for e in estimators]
    number = int(np.argmin([p.deviance for p in begun]))
    point = estimators[number].fit(begun[number].theta, sources, REFIT_EFFORT)
    return FilteredModel(problem, estimators[number], point)


def on_ranking_part(model: FilteredModel) -> FilteredModel:
    """A model where it is, on the part of long logs on which refits are ranked."""
    part = model.estimator.on_part(RANKING_SAMPLES)
    return FilteredModel(model.problem, part, part.point(model.point.theta, model.point.sources))


def refined(model: FilteredModel) -> FilteredModel:
    """A model that was refitted on a part of long logs, refitted on all samples that are used."""
    whole = estimator_of(model.problem, model.log_values)
    if whole.problem.count == model.estimator.problem.count:
        return model
    return FilteredModel(model.problem, whole, whole.fit(model.point.theta, model.point.sources, LAST_EFFORT))
