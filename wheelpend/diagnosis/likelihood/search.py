"""Effects added one by one where sensor noise will not be reached, and taken out where others make them needless."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from itertools import repeat
from math import comb
from typing import NamedTuple

import numpy as np

import derive
from derive.effects import DryForce, Effect, InternalPlay
from wheelpend.diagnosis.criteria import MAX_BACKWARD_STEPS
from wheelpend.diagnosis.equation_scores import equation_scores, leading_by_equations
from wheelpend.diagnosis.likelihood.filtered_model import FilteredModel, filtered_model
from wheelpend.diagnosis.likelihood.judgement import (
    Judged,
    JudgedModel,
    certain_within,
    judge,
    most_telling_first,
    not_led,
    simpler_than,
)
from wheelpend.diagnosis.likelihood.meaning import without_meaning
from wheelpend.diagnosis.likelihood.pairs import FoundPair, leading_pairs, supported_pair
from wheelpend.diagnosis.likelihood.refits import (
    NO_VALUES,
    BegunRefit,
    fitted_to_all,
    on_ranking_part,
    refined,
    refitted,
    settled,
    with_effect,
    without_effect,
)
from wheelpend.diagnosis.likelihood.remaining import searched_remainder
from wheelpend.diagnosis.likelihood.whitened_scores import (
    ScoredEffect,
    detectable_sizes,
    internal_effects,
    judged_effects,
    leading_effects,
    linear_effects,
    scored_effect,
    with_leading_by_equations,
)
from wheelpend.diagnosis.missing_force.smoothed_force import where_it_shows
from wheelpend.diagnosis.negligible import negligible_sentences
from wheelpend.diagnosis.verdict import Diagnosis, structurally_equivalent
from wheelpend.estimation.fit import Fit
from wheelpend.estimation.problem import EstimationProblem
from wheelpend.estimation.random_source import correlation_bounds
from wheelpend.estimation.validation import validation_residuals
from wheelpend.identification.remainder_at import refitted_remainder
from wheelpend.identification.remainder_warnings import is_mostly_chance
from wheelpend.parallel import KernelPool

MAX_JUDGED = 5  # effects that are judged on held-out data, the likeliest refits
MAX_RELIEFS, MIN_RELIEF = 2, 10.0  # times that a model is led out of a minimum, and fall of −2 log-likelihood by that
MIN_SEARCHED_SHARE = 5e-3  # of the drive: a random force below is not worth a search
SLOW_RATIO = 3.0  # of the shortest correlation time, from which a force is not white
PLAY_REASON = "depends on every contact before, and is judged only where sensor noise is reached with it"

Progress = Callable[[str], None]
Rounds = list[Diagnosis]


class Round(NamedTuple):
    """What one round of the search adds, and the model with it."""

    found: tuple[Diagnosis, ...]  # one for each effect that is added, or one that has none
    larger: FilteredModel | None  # None where there is nothing to add
    displaced: str = ""  # effect that was added before, and in whose place another one is likelier
    instead: Callable[[], Round | None] | None = None  # the round of a rival that the first effect does not lead


class Path(NamedTuple):
    """Rounds one after the other, and where the search might have gone another way."""

    rounds: Rounds
    model: FilteredModel  # that the last of them judged
    needless: str = ""  # the first effect that they made needless
    fork: tuple[Rounds, Callable[[], Round | None]] | None = None  # the first rounds, and another one behind them


def rounds_by_likelihood(
    problem: EstimationProblem,
    start: Mapping[str, float],
    is_done: Callable[[Rounds], bool],
    progress: Progress,
) -> Rounds:
    """Diagnoses, each with the first candidate of the one before in its model, the last with none worth naming."""
    return rounds_from(likely_model(problem, start, progress), is_done, progress)


def likely_model(problem: EstimationProblem, start: Mapping[str, float], progress: Progress) -> FilteredModel:
    """The model of a problem, made likely with random forces: where a search by likelihood begins."""
    progress("fitting with random forces")
    return refitted(filtered_model(problem, [start], progress))


def likely_fits(
    problem: EstimationProblem, start: Mapping[str, float], effect: str, progress: Progress
) -> tuple[Fit, Fit] | None:
    """Likeliest fits of a problem's model, and of it with one effect more, with random forces, as a search makes them.

    None where no filter can follow the larger one.
    """
    model, refits = _with_refits(likely_model(problem, start, progress), progress, effect)
    if effect not in refits:
        return None
    return fitted_to_all(model).fitted(), fitted_to_all(settled(refits[effect])).fitted()


def rounds_from(model: FilteredModel, is_done: Callable[[Rounds], bool], progress: Progress) -> Rounds:
    """Diagnoses, each with the first candidate of the one before in its model, the last with none worth naming.

    An effect that later ones have made needless is taken out, and the search made once more without it. Where it ends
    with something unexplained, and an effect had a rival that it did not lead, the search is made once more with that
    one; it counts if it ends with a likelier model that predicts no worse.
    """
    path = _to_the_end(model, [], None, is_done, progress)
    if path.fork is None or path.rounds[-1].verdict != "unexplained":
        return path.rounds
    before, instead = path.fork
    progress("something is left unexplained: once more with a rival of an effect that was added")
    other = instead()
    if other is None:
        return path.rounds
    rival = _to_the_end(model, before, other, is_done, progress)
    worse = rival.rounds[-1].error > path.rounds[-1].error
    return path.rounds if worse or rival.model.deviance >= path.model.deviance else rival.rounds


def _to_the_end(
    model: FilteredModel, before: Rounds, begun: Round | None, is_done: Callable[[Rounds], bool], progress: Progress
) -> Path:
    """A search from a model on, or from a round behind others, and once more without every effect that was needless."""
    path = _forward(model, before, begun, is_done, progress)
    for _ in range(MAX_BACKWARD_STEPS):
        if not path.needless:
            break
        progress(f"{path.needless} is needless beside the others: once more without it")
        problem = replace(model.problem, redundant_effects=(*model.problem.redundant_effects, path.needless))
        model = replace(model, problem=problem)
        path = _forward(model, [], None, is_done, progress)
    return path


def leaves_a_force(problem: EstimationProblem, fitted: Fit, progress: Progress) -> bool:
    """True where a model that reaches sensor noise over the horizon leaves a random force worth a search.

    Where a surface sticks the filter, which expands about its mean, leaves a white one of its own.
    Raises what `refitted_remainder` does where no filter can follow the model.
    """
    progress("looking for a random force behind sensor noise")
    logs = problem.logs
    left = refitted_remainder(problem, [fitted.of_log(k) for k in range(len(logs))]).strongest
    if left is None or left.share_of_drive < MIN_SEARCHED_SHARE:
        return False
    shortest, _ = correlation_bounds([log.duration for log in logs], min(log.dt for log in logs))
    sticks = any(isinstance(derive.effects.find(e).enters, DryForce) for e in problem.model.effects)
    return not sticks or left.correlation_time_s > SLOW_RATIO * shortest


def _forward(
    model: FilteredModel, before: Rounds, begun: Round | None, is_done: Callable[[Rounds], bool], progress: Progress
) -> Path:
    """Rounds until there is nothing to add or they are enough, from a model on, or from a round behind others."""
    rounds, fork = [*before], None

    def goes_on(found: Sequence[Diagnosis]) -> bool:
        return not is_done([*rounds, *found])

    while True:
        here = begun or _round(model, [r.named[0].effect for r in rounds], goes_on, progress)
        if fork is None and begun is None and here.instead:
            fork = [*rounds], here.instead
        begun = None
        if here.larger is None:
            return Path([*rounds, *here.found], model, here.displaced, fork)
        for one in here.found:
            rounds.append(one)
            if is_done(rounds):
                return Path(rounds, model, fork=fork)
            best = one.named[0]
            progress(f"added {best.effect}: {best.held_out_gain:.4g} nats likelier on held-out data")
        model, added = here.larger, [r.named[0].effect for r in rounds[:-1]]
        for effect in (e for e in added if e in model.problem.model.effects):
            if _is_needless(model, effect):
                return Path(rounds, model, effect, fork)


def _is_needless(model: FilteredModel, effect: str) -> bool:
    """True where a model is no less likely without one of its effects than with it, or this has no meaning in it."""
    if effect in without_meaning(model):
        return True
    smaller = without_effect(model, effect)
    return smaller is not None and smaller.deviance <= model.deviance


def _round(
    model: FilteredModel,
    added: Collection[str],
    goes_on: Callable[[Sequence[Diagnosis]], bool],
    progress: Progress,
) -> Round:
    """One diagnosis of a model, which is first made as likely as its refits show that it can be.

    ``added`` are the effects of it that the search has added.

    A pair is added only where the search ``goes_on`` after both: the first of the two alone is worth no step.
    """
    model, refits = _with_refits(model, progress)
    base = JudgedModel.of(model)
    tests = _single_tests(model)
    judged = [judge(base, larger, effect, tests) for effect, larger in refits.items()]
    able = [j for j in judged if j.is_supported(base.validated.error)]
    able += certain_within(judged, able, base.validated.error)
    named = not_led(able, judged)
    stand_ins = _effects_of(able) - _effects_of(named)
    worth = _effects_of(j for j in judged if j.improves(base.validated.error)) - stand_ins
    one = _round_of_supported(base, most_telling_first(named), judged, worth, added, progress)
    if one:
        return one
    pair = supported_pair(base, leading_pairs(base.model), _pair_tests(base.model), progress)
    both = pair and _round_of_pair(pair, _with_evidence_of(worth, judged), added, progress)
    if both and both.larger is not None and goes_on(both.found):
        return both
    last = _last_round(base, judged, worth, progress)
    return last if last.larger else last._replace(displaced=_displaced(base.model, judged, added, progress))


def _round_of_supported(
    base: JudgedModel,
    supported: Sequence[Judged],
    judged: Sequence[Judged],
    worth: Collection[str],
    added: Collection[str],
    progress: Progress,
) -> Round | None:
    """A round that adds the first of the supported effects that can stay, once fitted to its end; None without one."""
    tests = _single_tests(base.model)
    for k, one in enumerate(supported):
        effect, behind = one.candidate.effect, supported[k + 1 :]
        progress(f"settling {effect}")
        larger = settled(one.model)
        ended = judge(base, larger, effect, tests)
        if not _can_stay(larger, base.model, added) or ended.raises_error(base.validated.error):
            continue
        first = _as_settled(base, one, ended)
        known = [first if j.candidate.effect == effect else j for j in judged]
        found = _diagnosis(base, [first, *behind], _with_evidence_of(worth, known), progress)
        rivals = [j for j in behind if _is_rival(j, one)]
        behind = [first, *(j for j in behind if not _is_rival(j, one))]
        instead = partial(_round_of_supported, base, [*rivals, *behind], known, worth, added, progress)
        return Round((found,), larger, instead=instead if rivals else None)
    return None


def _is_rival(one: Judged, first: Judged) -> bool:
    """True of an effect that does as well as the first in some way and worse in another, and does not contain it."""
    contains = first.candidate.effect in simpler_than(one)
    return not contains and not first.clearly_leads(one) and not one.is_like(first)


def _displaced(model: FilteredModel, judged: Sequence[Judged], added: Collection[str], progress: Progress) -> str:
    """The effect in whose place another one is likelier, where both together leave it a size that nothing has; or ''.

    Two laws in turn can do what one did that was added before them: viscous friction, before dry friction and drag.
    """
    for one in sorted(judged, key=lambda j: j.model.deviance):
        effect = one.candidate.effect
        if one.is_certain or not one.is_followed or effect in without_meaning(one.model):
            continue
        for lost in without_meaning(one.model):
            progress(f"is {effect} likelier in place of {lost}?")
            if lost in added and _is_replaced(lost, model, one.model):
                return lost
    return ""


def _as_settled(base: JudgedModel, one: Judged, ended: Judged) -> Judged:
    """An effect that is named, as judged in the model fitted to its end: with the size that it will have there.

    A refit may end short of it (a delay of 4 ms on its way to 12).
    """
    if not ended.is_supported(base.validated.error):
        return one
    return ended._replace(candidate=replace(ended.candidate, equivalent_to=one.candidate.equivalent_to))


def _last_round(base: JudgedModel, judged: Sequence[Judged], worth: set[str], progress: Progress) -> Round:
    """A round in which no effect lowers the error or the force: it adds none, or one without which something repeats.

    ``worth`` are effects whose evidence counts in what may be missing.
    """
    progress("fitting all samples")
    small = [j for j in judged if j.is_negligible(base.validated.error)]
    last = fitted_to_all(base.model)
    ended = base if last is base.model else JudgedModel.of(last)
    found = _diagnosis(ended, (), _with_evidence_of(worth, judged), progress)
    accounting = most_telling_first(not_led(small, judged)) if _repeats(found) else []
    if accounting and (larger := _without_rest(accounting[0], progress)):
        told = _with_evidence_of(worth | _effects_of(accounting), judged)
        return Round((_diagnosis(base, accounting, told, progress),), larger)
    lines = negligible_sentences([j.candidate for j in small], "the error and the random force")
    return Round((replace(found, warnings=(*found.warnings, *lines)),), None)


def _repeats(found: Diagnosis) -> bool:
    """True where something repeats in what a diagnosis leaves, laws of impossible size aside.

    These are known only of a model with which every effect was judged, and so cannot be seen to go with one of them.
    """
    return found.remainder is not None and bool(replace(found.remainder, impossible=()).what_repeats)


def _effects_of(judged: Iterable[Judged]) -> set[str]:
    """Names of effects."""
    return {j.candidate.effect for j in judged}


def _with_evidence_of(worth: Collection[str], judged: Sequence[Judged]) -> list[Judged]:
    """Effects that were judged, with evidence only of those that would be worth naming: other ones are not missing."""
    return [j if j.candidate.effect in worth else j.without_evidence() for j in judged]


def _without_rest(one: Judged, progress: Progress) -> FilteredModel | None:
    """The model with an effect that is certain, if nothing repeats in it any more; else None.

    Such an effect is worth naming though it lowers neither the error nor the force.
    """
    progress(f"looking for what repeats with {one.candidate.effect}")
    larger = settled(one.model)
    accounts = not without_meaning(larger) and not searched_remainder(fitted_to_all(larger)).what_repeats
    return larger if accounts else None


def _round_of_pair(pair: FoundPair, judged: Sequence[Judged], added: Collection[str], progress: Progress) -> Round:
    """A round that adds two effects, one after the other.

    They may take the place of one that was ``added`` before.
    """
    progress(f"settling {pair.first.candidate.effect} and {pair.second.candidate.effect}")
    larger = settled(pair.second.model)
    first, second = (_with_twins(pair.base.model.problem, j) for j in (pair.first, pair.second))
    others = [j for j in judged if j.candidate.effect != first.candidate.effect]
    found = (
        _diagnosis(pair.base, [first], [first, *others], progress),
        _diagnosis(pair.with_first, [second], [second], progress),
    )
    return Round(found, larger if _can_stay(larger, pair.base.model, added) else None)


def _can_stay(larger: FilteredModel, model: FilteredModel, added: Collection[str]) -> bool:
    """True of a model with more effects, all of which mean what they are called, but such as they take the place of.

    Those were ``added`` before, and can end at a size below zero: they will be taken out.
    """
    return all(e in added and _is_replaced(e, model, larger) for e in without_meaning(larger))


def _is_replaced(effect: str, model: FilteredModel, larger: FilteredModel) -> bool:
    """True where what is in the larger model besides is likelier without an effect than the model with it."""
    other = without_effect(larger, effect)
    return other is not None and other.deviance < model.deviance


def _with_twins(problem: EstimationProblem, one: Judged) -> Judged:
    """An effect of a pair with those that the equations cannot tell from it: of these none was refitted beside it."""
    twins = tuple(sorted(structurally_equivalent(problem, one.candidate)))
    return one._replace(candidate=replace(one.candidate, equivalent_to=twins))


def _single_tests(model: FilteredModel) -> int:
    """Number of tests that a search among single effects makes: every start of a refit is one."""
    return sum(1 + sum(len(p.grid) for p in e.parameters) for e in judged_effects(model))


def _pair_tests(model: FilteredModel) -> int:
    """Number of tests of a search that comes to pairs: the single ones, and every pair that was scored."""
    return _single_tests(model) + comb(len(linear_effects(model)), 2)


def _with_refits(
    model: FilteredModel, progress: Progress, only: str = ""
) -> tuple[FilteredModel, dict[str, FilteredModel]]:
    """The model, as likely as its refits show that it can be, and these refits with one effect more, by effect.

    ``only`` is an effect that alone is refitted, where it is given.
    Where the way out of a minimum in which the model was stuck gains more than the best effect then adds, refits from
    that minimum tell nothing: they are made once more from where it led.
    """
    progress("scoring every effect behind the filter")
    refits = _refits(model, progress, only)
    for _ in range(MAX_RELIEFS):
        likelier = _relieved(model, refits, progress)
        added = likelier.deviance - min((m.deviance for m in refits.values()), default=np.inf)
        if model.deviance - likelier.deviance <= max(MIN_RELIEF, added):
            return likelier, refits
        progress("scoring every effect once more, behind a likelier filter")
        refits = _likelier_of_each(refits, _refits(likelier, progress, only))
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


def _refits(model: FilteredModel, progress: Progress, only: str) -> dict[str, FilteredModel]:
    """The model refitted with each effect that leads the scores or moves inside, by effect: those that are judged.

    Or with ``only`` one, where it is given.
    """
    scores = equation_scores(model.problem, model.log_values[0])
    if only:
        leaders, by_equations = [scored_effect(model, model.problem.effect(only))], scores
    else:
        by_equations = leading_by_equations(scores)
        leaders = with_leading_by_equations([*internal_effects(model), *leading_effects(model)], by_equations)

    def begin(one: ScoredEffect, of: FilteredModel) -> BegunRefit:
        progress(f"refitting with {one.effect.name} and a random force")
        known = by_equations.get(one.effect.name)
        return with_effect(of, one.effect.name, one.starts, known.values if known else NO_VALUES)

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


def _diagnosis(
    base: JudgedModel, supported: Sequence[Judged], judged: Sequence[Judged], progress: Progress
) -> Diagnosis:
    """What a round found, as a diagnosis."""
    problem = base.model.problem
    named = tuple(j.candidate for j in supported)
    impossible = tuple(j.candidate for j in judged if not j.candidate.physical and j.evidence > 0.0)
    missing = base.model.smoothed_forces()
    play = {e.name: PLAY_REASON for e in problem.candidates() if isinstance(e.enters, InternalPlay)}
    if named:
        verdict, remainder = "ambiguous" if named[0].equivalent_to else "effect_missing", base.model.remainder()
    else:
        progress("looking for what repeats")
        remainder = searched_remainder(base.model, judged)
        left = remainder.what_repeats or is_mostly_chance(remainder)
        verdict = "unexplained" if left else "nothing_missing"
    found = Diagnosis.of(problem, base.validated, verdict, [*named, *impossible])
    return replace(
        found,
        detectable=detectable_sizes(base.model) if verdict == "nothing_missing" else {},
        where=where_it_shows(problem, missing, found.fit),
        not_judged={**found.not_judged, **play},
        missing=missing,
        refitted=tuple(j.candidate for j in judged),
        remainder=remainder,
        by_likelihood=True,
    )
