"""One round of a search by likelihood: which effect, or pair, a model gets next, and what is said where none is."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Sequence
from dataclasses import replace
from functools import partial
from math import comb
from typing import NamedTuple

from derive.effects import InternalPlay
from wheelpend.diagnosis.likelihood.filtered_model import FilteredModel
from wheelpend.diagnosis.likelihood.judgement import (
    Judged,
    JudgedModel,
    certain_within,
    judge,
    most_telling_first,
    not_led,
    simpler_than,
    with_likelier_besides,
    with_weight,
)
from wheelpend.diagnosis.likelihood.meaning import without_meaning
from wheelpend.diagnosis.likelihood.pairs import MAX_FIRSTS, FoundPair, refitted_pairs, supported_pair
from wheelpend.diagnosis.likelihood.refits import (
    fitted_to_all,
    gone_on_with,
    settled,
    without_effect,
)
from wheelpend.diagnosis.likelihood.relief import with_refits
from wheelpend.diagnosis.likelihood.remaining import searched_remainder
from wheelpend.diagnosis.likelihood.whitened_scores import (
    detectable_sizes,
    judged_effects,
    linear_effects,
)
from wheelpend.diagnosis.missing_force.smoothed_force import where_it_shows
from wheelpend.diagnosis.negligible import instead_of_chance_sentences, negligible_sentences
from wheelpend.diagnosis.verdict import Diagnosis, structurally_equivalent
from wheelpend.estimation.problem import EstimationProblem
from wheelpend.estimation.validation import unpredicted_share
from wheelpend.identification.remainder_warnings import is_mostly_chance

MAX_SURPRISE = 2.0  # times the variance of innovations that a model expects, from which on it does not cover the data
PLAY_REASON = "depends on every contact before, and is judged only where sensor noise is reached with it"

Progress = Callable[[str], None]


class Round(NamedTuple):
    """What one round of the search adds, and the model with it."""

    found: tuple[Diagnosis, ...]  # one for each effect that is added, or one that has none
    judged: FilteredModel  # the model that they are about, as likely as its refits made it
    larger: FilteredModel | None  # None where there is nothing to add
    displaced: str = ""  # effect that was added before, and in whose place another one is likelier
    instead: Callable[[], Round | None] | None = None  # the round of a rival that the first effect does not lead


def one_round(
    model: FilteredModel,
    added: Collection[str],
    goes_on: Callable[[Sequence[Diagnosis]], bool],
    progress: Progress,
) -> Round:
    """One diagnosis of a model, which is first made as likely as its refits show that it can be.

    ``added`` are the effects of it that the search has added.

    A pair is added only where the search ``goes_on`` after both: the first of the two alone is worth no step.
    """
    model, refits = with_refits(model, progress)
    base = JudgedModel.of(model)
    tests = _single_tests(model)
    judged = [judge(base, larger, effect, tests) for effect, larger in refits.items()]
    able = [j for j in judged if j.is_supported(base.validated.error)]
    able += certain_within(judged, able, base.validated.error)
    named = not_led(able, judged)
    stand_ins = _effects_of(able) - _effects_of(named)
    worth = _effects_of(j for j in judged if j.improves(base.validated.error)) - stand_ins
    telling = with_likelier_besides(most_telling_first(named), judged, base.validated.error)
    one = _round_of_supported(base, telling, (), judged, worth, added, progress)
    if one:
        return one
    pair = supported_pair(base, refitted_pairs(base, refits, progress), _pair_tests(base.model))
    both = pair and _round_of_pair(pair, _with_evidence_of(worth, judged), added, progress)
    if both and both.larger is not None and goes_on(both.found):
        return both
    last = _last_round(base, judged, worth, added, progress)
    return last if last.larger else last._replace(displaced=_displaced(base.model, judged, added, progress))


def _round_of_supported(
    base: JudgedModel,
    supported: Sequence[Judged],
    others: Sequence[Judged],
    judged: Sequence[Judged],
    worth: Collection[str],
    added: Collection[str],
    progress: Progress,
) -> Round | None:
    """A round that adds the first of the supported effects that can stay, once fitted to its end; None without one.

    ``others`` are supported too, and named behind them.
    """
    tests = _single_tests(base.model)
    for k, one in enumerate(supported):
        effect, behind = one.candidate.effect, [*supported[k + 1 :], *others]
        progress(f"settling {effect}")
        larger = settled(one.model)
        ended = judge(base, larger, effect, tests)
        if not _can_stay(larger, base.model, added) or ended.raises_error(base.validated.error):
            continue
        if one.is_negligible(base.validated.error) and not ended.is_certain:
            continue
        first = _as_settled(base, one, ended)
        known = [first if j.candidate.effect == effect else j for j in judged]
        found = _diagnosis(base, [first, *behind], _with_evidence_of(worth, known), progress)
        twins = structurally_equivalent(base.model.problem, one.candidate)
        rivals = [j for j in behind if j.candidate.effect not in twins and _is_rival(j, one)]
        tried = _effects_of(rivals)
        rest = [first, *(j for j in behind if j.candidate.effect not in tried)]
        instead = partial(_round_of_supported, base, rivals, rest, known, worth, added, progress)
        return Round((found,), base.model, gone_on_with(larger), instead=instead if rivals else None)
    return None


def _is_rival(one: Judged, first: Judged) -> bool:
    """True of an effect that does not contain the first, and that this does not clearly lead, or that is likelier.

    Of few blocks the lead over the horizon may be chance. What data do not tell from the first is one too, since with
    the next effect they may.
    """
    contains = first.candidate.effect in simpler_than(one)
    return not contains and (one.is_likelier_than(first) or not first.clearly_leads(one))


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
    still = ended.is_certain if one.is_negligible(base.validated.error) else ended.is_supported(base.validated.error)
    if not still:
        return one
    return ended._replace(candidate=replace(ended.candidate, equivalent_to=one.candidate.equivalent_to))


def _last_round(
    base: JudgedModel, judged: Sequence[Judged], worth: set[str], added: Collection[str], progress: Progress
) -> Round:
    """A round in which no effect lowers the error or the force: it adds none, or one that is certain nevertheless.

    That is one with weight, or one without which something repeats. ``worth`` are effects whose evidence counts in what
    may be missing.
    """
    small = [j for j in judged if j.is_negligible(base.validated.error)]
    weighty = most_telling_first(not_led(with_weight(small), judged))
    if one := _round_of_supported(base, weighty, (), judged, {*worth, *_effects_of(weighty)}, added, progress):
        return one
    progress("fitting all samples")
    last = fitted_to_all(base.model)
    ended = base if last is base.model else JudgedModel.of(last)
    found = _diagnosis(ended, (), _with_evidence_of(worth, judged), progress)
    accounting = most_telling_first(not_led(small, judged)) if _repeats(found) else []
    if accounting and (larger := _without_rest(accounting[0], progress)):
        told = _with_evidence_of(worth | _effects_of(accounting), judged)
        return Round((_diagnosis(base, accounting, told, progress),), base.model, larger)
    lines = negligible_sentences([j.candidate for j in small], "the error and the random force")
    if found.verdict == "nothing_missing" and found.remainder:
        sparing = [j for j in judged if j not in small and j.spares_force(base.validated.error)]
        instead = [j.candidate for j in sorted(sparing, key=lambda j: -j.evidence)]
        found = replace(found, remainder=replace(found.remainder, instead=tuple(c.effect for c in instead)))
        lines += instead_of_chance_sentences(instead)
    return Round((replace(found, warnings=(*found.warnings, *lines)),), base.model, None)


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
    return gone_on_with(larger) if accounts else None


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
    return Round(found, pair.base.model, gone_on_with(larger) if _can_stay(larger, pair.base.model, added) else None)


def _can_stay(larger: FilteredModel, model: FilteredModel, added: Collection[str]) -> bool:
    """True of a model with more effects, all of which mean what they are called, but such as they take the place of.

    Those were ``added`` before, and can end at a size below zero: they will be taken out.
    """
    return all(e in added and _is_replaced(e, model, larger) for e in without_meaning(larger))


def _is_replaced(effect: str, model: FilteredModel, larger: FilteredModel) -> bool:
    """True where what is in the larger model besides is likelier without an effect than the model with it."""
    other = without_effect(larger, effect, amid=model.point.sources)
    return other is not None and other.deviance < model.deviance


def _with_twins(problem: EstimationProblem, one: Judged) -> Judged:
    """An effect of a pair with those that the equations cannot tell from it: of these none was refitted beside it."""
    twins = tuple(sorted(structurally_equivalent(problem, one.candidate)))
    return one._replace(candidate=replace(one.candidate, equivalent_to=twins))


def _single_tests(model: FilteredModel) -> int:
    """Number of tests that a search among single effects makes: every start of a refit is one."""
    return sum(1 + sum(len(p.grid) for p in e.parameters) for e in judged_effects(model))


def _pair_tests(model: FilteredModel) -> int:
    """Number of tests of a search that comes to pairs: the single ones, also behind refits, and every scored pair."""
    return (1 + MAX_FIRSTS) * _single_tests(model) + comb(len(linear_effects(model)), 2)


def _diagnosis(
    base: JudgedModel, supported: Sequence[Judged], judged: Sequence[Judged], progress: Progress
) -> Diagnosis:
    """What a round found, as a diagnosis."""
    problem = base.model.problem
    named = tuple(j.candidate for j in supported)
    impossible = tuple(j.candidate for j in judged if not j.candidate.physical and j.evidence > 0.0)
    missing = base.model.smoothed_forces()
    unpredicted = unpredicted_share(problem.data.held_out, base.validated.residuals)
    surprised: list[str] = []
    play = {e.name: PLAY_REASON for e in problem.candidates() if isinstance(e.enters, InternalPlay)}
    if named:
        verdict = "ambiguous" if named[0].equivalent_to else "effect_missing"
        remainder = replace(base.model.remainder(), unpredicted=unpredicted)
    else:
        progress("looking for what repeats")
        remainder = replace(searched_remainder(base.model, judged), unpredicted=unpredicted)
        surprised = surprise_sentences(base.predicted.surprise)
        left = remainder.what_repeats or is_mostly_chance(remainder) or surprised
        verdict = "unexplained" if left else "nothing_missing"
    found = Diagnosis.of(problem, base.validated, verdict, [*named, *impossible])
    found = replace(found, remainder=remainder, by_likelihood=True)
    if surprised:
        found = replace(found, warnings=(*found.warnings, *surprised), p_rest=base.predicted.p_value_of_surprise)
    if verdict == "nothing_missing" and found.leaves_unknown:
        found = replace(found, verdict="unexplained")
    return replace(
        found,
        detectable=detectable_sizes(base.model) if found.verdict == "nothing_missing" else {},
        where=where_it_shows(problem, missing, found.fit),
        not_judged={**found.not_judged, **play},
        missing=missing,
        refitted=tuple(j.candidate for j in judged),
    )


def surprise_sentences(surprise: float) -> list[str]:
    """That what is held out is further off than the model says, if it is: what acts there was not fitted."""
    if surprise <= MAX_SURPRISE:
        return []
    return [
        f"From row to row what is held out is off by {surprise**0.5:.2g} times as much as the model says that it would "
        "be: something acts there that does not show in what was fitted. Fit to more logs, or hold out another stretch."
    ]
