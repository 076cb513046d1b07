"""A model refitted with every effect that leads the scores, and the way out of a minimum to which refits may lead."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from itertools import repeat

import numpy as np

import derive
from derive.effects import Effect
from wheelpend.diagnosis.equation_scores import equation_scores, leading_by_equations
from wheelpend.diagnosis.likelihood.filtered_model import FilteredModel
from wheelpend.diagnosis.likelihood.refits import (
    BegunRefit,
    on_ranking_part,
    refined,
    with_effect,
    without_effect,
)
from wheelpend.diagnosis.likelihood.whitened_scores import (
    ScoredEffect,
    internal_effects,
    leading_effects,
    scored_effect,
    with_leading_by_equations,
    with_plain_twins,
)
from wheelpend.estimation.validation import validation_residuals
from wheelpend.parallel import KernelPool

MAX_JUDGED = 5  # effects that are judged on held-out data, the likeliest refits
MAX_RELIEFS, MIN_RELIEF = 2, 10.0  # times that a model is led out of a minimum, and fall of −2 log-likelihood by that

Progress = Callable[[str], None]


def with_refits(
    model: FilteredModel, progress: Progress, only: str = ""
) -> tuple[FilteredModel, dict[str, FilteredModel]]:
    """The model, as likely as its refits show that it can be, and these refits with one effect more, by effect.

    ``only`` is an effect that alone is refitted, where it is given.
    Where the way out of a minimum in which the model was stuck gains more than the best effect then adds, refits from
    that minimum tell nothing: they are made once more from where it led.
    """
    progress("scoring every effect behind the filter")
    refits = leading_refits(model, progress, only)
    for _ in range(MAX_RELIEFS):
        likelier = _relieved(model, refits, progress)
        added = likelier.deviance - min((m.deviance for m in refits.values()), default=np.inf)
        if model.deviance - likelier.deviance <= max(MIN_RELIEF, added):
            return likelier, refits
        progress("scoring every effect once more, behind a likelier filter")
        refits = _likelier_of_each(refits, leading_refits(likelier, progress, only))
        model = likelier
    return _relieved(model, refits, progress), refits


def _likelier_of_each(
    refits: Mapping[str, FilteredModel], anew: Mapping[str, FilteredModel]
) -> dict[str, FilteredModel]:
    """Refits from where they are likelier: so many as are judged, and what may move inside by those made anew."""
    found: dict[str, FilteredModel] = {}
    for one in sorted([*refits.values(), *anew.values()], key=lambda m: m.deviance):
        found.setdefault(_added_effect(one).name, one)
    inside = {e for e, m in anew.items() if _added_effect(m).releases}
    return {e: m for k, (e, m) in enumerate(found.items()) if k < MAX_JUDGED or e in inside}


def leading_refits(model: FilteredModel, progress: Progress, only: str = "") -> dict[str, FilteredModel]:
    """The model refitted with each effect that leads the scores or moves inside, by effect: those that are judged.

    Or with ``only`` one, where it is given.
    """
    scores = equation_scores(model.problem, model.log_values[0])
    if only:
        leaders, by_equations = [scored_effect(model, model.problem.effect(only))], scores
    else:
        by_equations = leading_by_equations(scores)
        leaders = with_leading_by_equations([*internal_effects(model), *leading_effects(model)], by_equations)
        leaders = with_plain_twins(model, leaders)

    def begin(one: ScoredEffect, of: FilteredModel) -> BegunRefit:
        progress(f"refitting with {one.effect.name} and a random force")
        return with_effect(of, one.effect.name, one.starts, by_equations.get(one.effect.name))

    with KernelPool() as pool:
        begun = sorted(pool.map(begin, leaders, repeat(model)), key=lambda r: r.deviance)
        goal = begun[MAX_JUDGED - 1].deviance if len(begun) >= MAX_JUDGED else np.inf
        found = [f for f in pool.map(lambda refit: refit.ended(goal), begun) if f is not None]
        leading = _leading(model, sorted(found, key=lambda f: f.deviance))
        return {_added_effect(f).name: f for f in pool.map(refined, leading)}


def _leading(model: FilteredModel, found: Sequence[FilteredModel]) -> list[FilteredModel]:
    """Refits that are judged, of all with the likeliest first: so many of them, and what may move inside.

    A motion inside has more freedom than other effects, which only longer data pay for: on the part on which refits are
    ranked it is enough that data are likelier than without it, whatever its freedom is worth.
    """
    inside = [f for f in found[MAX_JUDGED:] if _added_effect(f).releases]
    limit = on_ranking_part(model).point.deviance if inside else np.inf
    return [*found[:MAX_JUDGED], *(f for f in inside if f.point.deviance < limit)]


def _added_effect(model: FilteredModel) -> Effect:
    """The effect that a refit added."""
    return derive.effects.find(model.problem.model.effects[-1])


def _relieved(model: FilteredModel, refits: Mapping[str, FilteredModel], progress: Progress) -> FilteredModel:
    """The model refitted from where the likeliest effect led its parameters, if that is likelier than where it is.

    Else an effect would be credited with a way out of a minimum in which the model without it was stuck. A place from
    which nothing can be predicted over the horizon is no way out.
    """
    beside = {e: m for e, m in refits.items() if not model.problem.replaced(e)}
    if not beside:
        return model
    effect, larger = min(beside.items(), key=lambda pair: pair[1].deviance)
    progress(f"refitting without {effect}")
    other = without_effect(larger, effect)
    if other is None or not other.point.deviance < model.point.deviance:
        return model
    likelier = replace(other, problem=model.problem)
    return model if _runs_away(likelier) and not _runs_away(model) else likelier


def _runs_away(model: FilteredModel) -> bool:
    """True of a model whose predictions over the horizon leave the finite numbers."""
    return not np.isfinite(validation_residuals(model.problem, model.fitted())[0])
