"""Stepwise selection: effects are added one after the other, and removed where later ones make them redundant."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import replace
from functools import partial
from typing import NamedTuple

from wheelpend.diagnosis.alternatives import with_backlash
from wheelpend.diagnosis.block_evidence import evidence_in_blocks, is_clear_lead
from wheelpend.diagnosis.criteria import (
    MAX_ADDED_EFFECTS,
    MAX_BACKWARD_STEPS,
    MAX_EQUIVALENT_ERROR_DIFFERENCE,
    MIDDLE_HORIZON_SHARE,
    MIN_RELATIVE_ERROR_DECREASE,
)
from wheelpend.diagnosis.evidence import ValidatedFit
from wheelpend.diagnosis.likelihood.filtered_model import FilteredModel
from wheelpend.diagnosis.likelihood.search import (
    OtherWay,
    leaves_what_lasts,
    likely_model,
    rounds_by_likelihood,
    rounds_from,
)
from wheelpend.diagnosis.outside_force import is_far_calmer, without_outside_forces
from wheelpend.diagnosis.ranking import nested_effects
from wheelpend.diagnosis.refit import Progress
from wheelpend.diagnosis.rounds import RoundStart, diagnose_problem, first_round, next_round, with_partner
from wheelpend.diagnosis.verdict import (
    Diagnosis,
    revise_verdict,
    with_law,
    with_missing_force,
    with_remainder,
    with_repeating_force,
    with_steps,
    with_structures,
)
from wheelpend.errors import Failure
from wheelpend.estimation.continuation import fit_model, fit_segments
from wheelpend.estimation.criteria import MAX_EXPLAINED_ERROR_RATIO, MAX_NOISE_LEVEL_ERROR_RATIO
from wheelpend.estimation.data import prepare, shortened_segments
from wheelpend.estimation.fit import Fit
from wheelpend.estimation.free_parameters import free_names, values_of_model_effects
from wheelpend.estimation.problem import EstimationProblem, extended_effects, with_stable_step
from wheelpend.estimation.starts import best_start
from wheelpend.estimation.validation import validation_residuals
from wheelpend.estimation.workable_horizon import over_workable_horizon
from wheelpend.identification.remainder_at import found_or_warning
from wheelpend.logs.sources import LogsLike
from wheelpend.model.record import Model
from wheelpend.parallel import with_one_blas_thread

MAX_TRIED_SEGMENTS = 40  # on which it is tried whether a model without a random force reaches sensor noise
MAX_REMAINING_ERROR_RATIO = 0.9  # of the error, that a further effect may leave for the search to go on behind a first

Rounds = list[Diagnosis]


@with_one_blas_thread
def diagnose(
    model: Model,
    logs: LogsLike,
    holdout: LogsLike = (),
    *,
    without: Sequence[str] = (),
    law: bool = False,
    progress: Progress = lambda text: None,
) -> Diagnosis:
    """Find which effect of the library is missing, those named in ``without`` apart. Changes nothing.

    With ``law`` a free-form law is fitted to what no effect explains; that takes about a minute.
    Raises Failure where the logs or the model cannot be used.
    """
    rounds = over_workable_horizon(
        lambda horizon: prepare(model, logs, holdout, horizon=horizon, without=without),
        lambda problem, start: stepwise(problem, start, selection_done, progress),
        progress,
    )
    last = with_structures(revise_verdict(rounds[-1], rounds[-1]), rounds)
    result = with_steps(with_structures(revise_verdict(rounds[0], last), rounds) if rounds[1:] else last, rounds)
    result = with_missing_force(with_remainder(result, progress=progress), progress=progress)
    result = with_repeating_force(result, progress=progress)
    return with_law(result, progress=progress) if law else result


def selection_done(rounds: Rounds) -> bool:
    """Enough rounds to know that the effects explain the rest, or that at this pace none will."""
    last = rounds[-1]
    if last.by_likelihood:  # the rest may repeat though the error hardly falls
        return len(rounds) >= MAX_ADDED_EFFECTS
    slow = len(rounds) > 1 and last.named[0].error_after > MAX_REMAINING_ERROR_RATIO * last.error
    return last.is_explained or slow or len(rounds) >= MAX_ADDED_EFFECTS


def stepwise(
    problem: EstimationProblem,
    start: dict[str, float],
    is_done: Callable[[Rounds], bool],
    progress: Progress = lambda text: None,
    *,
    leaves_out: bool = True,
) -> Rounds:
    """Diagnoses, each with the first candidate of the one before in its model, until they are enough.

    An effect that resembles two others lowers the error more than either alone, and is redundant beside both. So
    where everything is explained, each effect but the last is taken out again; if the error does not rise by enough
    to name it, the selection is repeated without it, and that one counts if it gets as far; if it does not, once more
    with the other effects alone to choose from. Backlash that explains
    more than a selection that leaves a rest takes its place. Where all this leaves more than sensor noise, effects are
    judged by likelihood; and where that names none though something repeats, two effects that hide each other are
    sought. Where the model at their end leaves sensor noise alone without any random force, that is the answer.
    Where only sensor noise is left, but a random force along the whole log, what lasts is judged by likelihood.
    Where something outside moves the machine for a short time, the logs are searched without that time, which this
    ``leaves_out`` once.
    """
    first = first_round(problem, start, progress)
    rounds = forward_pass(first, is_done, progress)
    if not rounds[-1].is_explained:
        rounds = _with_backlash_instead(rounds, is_done, progress)
    if rounds[-1].is_explained:
        rounds, problem = _without_redundant(rounds, problem, start, is_done, progress)
        return _with_what_shows_later(rounds, problem, start, is_done, progress)
    model = likely_model(problem, start, progress)
    calm = _rounds_aside(model, rounds[-1], is_done, progress) if leaves_out else []
    if calm and _names_and_explains(calm):
        return calm
    likely = down_to_noise(rounds_from(model, is_done, progress, _way_of(rounds)), is_done, progress)
    if calm and not _names_and_explains(likely) and is_far_calmer(calm[-1], likely[-1]):
        return calm
    if _explains_nothing(first) and not likely[0].named and likely[-1].verdict == "unexplained":
        rounds = forward_pass(with_partner(first, progress), is_done, progress)
        if rounds[-1].is_explained:
            return _without_redundant(rounds, problem, start, is_done, progress, is_paired=True)[0]
    return likely


def _way_of(rounds: Rounds) -> OtherWay:
    """What a search without likelihoods came to, as one by likelihood may go on from it.

    Of an effect in whose place a wider one came there is nothing to go on from.
    """
    reached = best_result(rounds)
    there = reached.problem.model.effects
    kept = [r for r in rounds if r.named and r.named[0].effect in there]
    return OtherWay(kept, reached.problem, [reached.fit.of_log(k) for k in range(len(reached.problem.logs))])


def down_to_noise(rounds: Rounds, is_done: Callable[[Rounds], bool], progress: Progress) -> Rounds:
    """Rounds by likelihood, the last of its model without a random force where that leaves nothing but sensor noise.

    A filter expands about its mean, and ends beside the likeliest values where a surface sticks; from there these are
    near. Nothing reaches the noise over the horizon, in what is held out too, by chance.
    """
    last = rounds[-1]
    if last.named:
        return rounds
    progress("fitting what was found without a random force")
    problem, fitted = last.problem, last.fit
    part = shortened_segments(problem, problem.horizon, max_segments=MAX_TRIED_SEGMENTS)
    names = free_names(problem, problem.model.effects)
    tried = fit_segments(problem, part, fitted.values, names, start_per_log=fitted.per_log)
    if not tried.error <= MAX_EXPLAINED_ERROR_RATIO * problem.floor:
        return rounds
    reached = reduced_model(problem, problem.model.effects, fitted)
    if not max(reached.error, reached.fit.error) <= MAX_EXPLAINED_ERROR_RATIO * reached.problem.floor:
        return rounds
    start = RoundStart(reached.fit.values, reached.fit.per_log, reached.fit)
    first, before = diagnose_problem(reached.problem, start, progress=progress), rounds[:-1]
    return [*before, *forward_pass(first, lambda later: is_done([*before, *later]), progress)]


def _rounds_aside(
    model: FilteredModel, last: Diagnosis, is_done: Callable[[Rounds], bool], progress: Progress
) -> Rounds:
    """The rounds of a search on logs without the times in which something outside moves the machine.

    ``last`` is the diagnosis that the search with these times came to without likelihoods. None where it does so at no
    such times, or what is left is too little for a search.
    """
    progress("looking for times in which something outside moves the machine")

    def sought() -> Rounds:
        problem = without_outside_forces(model, last.error / last.noise_floor)
        return stepwise(*best_start(problem), is_done, progress, leaves_out=False) if problem else []

    rounds, warnings = found_or_warning("Logs without these times could not be searched", sought)
    for warning in warnings:
        progress(warning)
    return rounds or []


def _names_and_explains(rounds: Rounds) -> bool:
    """True where rounds name an effect and explain the rest."""
    return bool(rounds[0].named) and rounds[-1].is_explained


def _without_redundant(
    rounds: Rounds,
    problem: EstimationProblem,
    start: dict[str, float],
    is_done: Callable[[Rounds], bool],
    progress: Progress,
    *,
    is_paired: bool = False,
) -> tuple[Rounds, EstimationProblem]:
    """Rounds that explain everything, without effects that others make needless, and the problem that bars these.

    Where two that hide each other were sought together, so they are in what takes the place of the rounds.
    """
    for _ in range(MAX_BACKWARD_STEPS):
        redundant = find_redundant_effect(rounds, progress)
        if redundant is None:
            break
        progress(f"{redundant} is needless beside the others: once more without it")
        problem = replace(problem, redundant_effects=(*problem.redundant_effects, redundant))
        ways = (
            partial(_anew, problem, start, is_done, progress, is_paired=is_paired),
            partial(_among_the_others, rounds, problem, start, is_done, progress),
            partial(_likely_among_the_others, rounds, problem, start, is_done, progress),
        )
        best = best_result(rounds)
        other = next((found for way in ways if is_as_good(best_result(found := way()), best)), None)
        if other is None:
            break
        rounds = other
    return rounds, problem


def _anew(
    problem: EstimationProblem, start: dict[str, float], is_done: Callable[[Rounds], bool], progress: Progress, *,
    is_paired: bool,
) -> Rounds:  # fmt: skip
    """Rounds from the beginning, of two that hide each other first where these were sought."""
    first = first_round(problem, start, progress)
    first = with_partner(first, progress) if is_paired and _explains_nothing(first) else first
    return forward_pass(first, is_done, progress)


def _among_the_others(
    rounds: Rounds, problem: EstimationProblem, start: dict[str, float], is_done: Callable[[Rounds], bool],
    progress: Progress,
) -> Rounds:  # fmt: skip
    """Rounds that choose from the effects of given ones alone, as far as a problem does not bar them, until all are in.

    Far from what explains the logs an effect that others will make needless can look like the only way on.
    """
    progress("not from here: once more with the others alone")
    narrow = _narrowed_to(rounds, problem)
    found = forward_pass(first_round(narrow, start, progress), is_done, progress)
    named = [r for r in found if r.named]
    if not named:
        return found
    last = replace(named[-1], problem=replace(named[-1].problem, redundant_effects=problem.redundant_effects))
    return [*named[:-1], *forward_pass(last, lambda later: is_done([*named[:-1], *later]), progress)]


def _likely_among_the_others(
    rounds: Rounds, problem: EstimationProblem, start: dict[str, float], is_done: Callable[[Rounds], bool],
    progress: Progress,
) -> Rounds:  # fmt: skip
    """The same by likelihood: of two that hide each other, either alone may raise the error and yet be seen.

    None by which this cannot be done.
    """
    progress("nor so: once more with the others alone, by likelihood")
    narrow = _narrowed_to(rounds, problem)
    likely, _ = found_or_warning("", lambda: rounds_by_likelihood(narrow, start, is_done, progress))
    return likely or rounds[:1]


def _narrowed_to(rounds: Rounds, problem: EstimationProblem) -> EstimationProblem:
    """A problem with no candidates but those that rounds added, their twins, and what these contain or approach."""
    added = [r.named[0] for r in rounds if r.named]
    simpler = [s for c in added for s in nested_effects(problem, c.effect)]
    kept = {*(c.effect for c in added), *(e for c in added for e in c.equivalent_to), *simpler}
    others = [e.name for e in problem.candidates() if e.name not in kept]
    return replace(problem, redundant_effects=(*problem.redundant_effects, *others))


def _with_what_shows_later(
    rounds: Rounds,
    problem: EstimationProblem,
    start: dict[str, float],
    is_done: Callable[[Rounds], bool],
    progress: Progress,
) -> Rounds:
    """The rounds that reached sensor noise, or those by likelihood where these say more.

    Every segment has a start of its own, and what is small and lasts, damping above all, hardly shows over so short a
    time. The filter sees it over the whole log, and a random force takes its place. What it finds counts only if it
    predicts as well, or at the noise floor; and where effects were named already, if it leaves nothing that repeats.
    """
    if rounds[-1].by_likelihood:
        return rounds
    error, reached, fitted = best_result(rounds)

    def sought() -> Rounds:
        if not leaves_what_lasts(reached, fitted, progress):
            return []
        return rounds_by_likelihood(replace(problem, only_lasting=True), start, is_done, progress)

    likely, warnings = found_or_warning("What sensor noise hides could not be sought", sought)
    if not likely:
        return _with_warnings(rounds, warnings)
    as_good = best_result(likely)[0] <= (1.0 + MIN_RELATIVE_ERROR_DECREASE) * max(error, problem.floor)
    if not as_good and (others := _names(likely) - _names(rounds)):
        return _with_warnings(rounds, (_not_followed(others, best_result(likely)[0], error),))
    if not any(r.named for r in rounds):
        return likely if as_good and any(r.named or not r.is_explained for r in likely) else rounds
    return likely if as_good and likely[-1].is_explained and _names(likely) != _names(rounds) else rounds


def _with_warnings(rounds: Rounds, warnings: Sequence[str]) -> Rounds:
    """The rounds, with further warnings of the last."""
    return [*rounds[:-1], replace(rounds[-1], warnings=(*rounds[-1].warnings, *warnings))] if warnings else rounds


def _not_followed(effects: Collection[str], error: float, best: float) -> str:
    return (f"A search with random forces adds {', '.join(sorted(effects))}, but predicts held-out data worse so "
            f"({error:.3g} σ, without it {best:.3g}): it is not followed.")  # fmt: skip


def _names(rounds: Rounds) -> set[str]:
    """Effects that rounds name first."""
    return {r.named[0].effect for r in rounds if r.named}


def _with_backlash_instead(rounds: Rounds, is_done: Callable[[Rounds], bool], progress: Progress) -> Rounds:
    """The rounds that begin with backlash, where that leaves less than all of the given ones."""
    first = with_backlash(rounds[0], progress)
    if first is rounds[0] or not best_result([first])[0] < best_result(rounds)[0]:
        return rounds
    return forward_pass(first, is_done, progress) if first.is_explained else [first]


def _explains_nothing(found: Diagnosis) -> bool:
    """True where no effect alone is worth naming, and something is missing."""
    return found.verdict == "unexplained" and not found.named


def forward_pass(first: Diagnosis, is_done: Callable[[Rounds], bool], progress: Progress) -> Rounds:
    """A diagnosis and those that follow it, until there is nothing to add or they are enough."""
    rounds = [first]
    while rounds[-1].named and not is_done(rounds):
        rounds.append(next_round(rounds[-1], progress))
    return rounds


class Result(NamedTuple):
    """What a search came to."""

    error: float  # on validation data [σ]
    problem: EstimationProblem  # of the model with all that was added
    fit: Fit


def best_result(rounds: Rounds) -> Result:
    """The lowest validation error of some rounds, with the problem and the fit that have it."""
    last = rounds[-1]
    if not last.named:
        return Result(last.error, last.problem, last.fit)
    best = last.named[0]
    larger = last.problem.with_effects(extended_effects(last.problem.model, best.effect))
    return Result(best.error_after, larger, best.fit)


def is_as_good(other: Result, best: Result) -> bool:
    """True of a result whose error is not higher by what makes a step; or of a simpler one, if data do not tell."""
    if other.error <= (1.0 + MIN_RELATIVE_ERROR_DECREASE) * best.error:
        return True
    if not other.error <= (1.0 + MAX_EQUIVALENT_ERROR_DIFFERENCE) * best.error:
        return False
    simpler = len(other.fit.free) < len(best.fit.free) and other.fit.count == best.fit.count
    return simpler and not _leads(best, other)


def _leads(best: Result, other: Result) -> bool:
    """True of a result with clearly more evidence than another."""
    before, after = (ValidatedFit.of(r.problem, r.fit) for r in (other, best))
    lead = evidence_in_blocks(before.fit, after.fit, before.residuals, after.residuals)
    return is_clear_lead(lead, scatters=best.error >= MAX_NOISE_LEVEL_ERROR_RATIO * best.problem.floor)


def find_redundant_effect(rounds: Rounds, progress: Progress) -> str | None:
    """The effect, the last added apart, that the others need least, where without it the error does not rise by enough.

    Or with a simpler one in its place, which it contains or approaches: what bends to more was worth naming while the
    others were missing. Else an effect in whose place a simpler one, which was worth naming beside it, leaves a result
    that is as good; or one that has a simpler one in it and leaves a rest, as that one may not with another effect.
    None unless the rounds explain everything but the noise.
    """
    if not rounds[-1].is_explained:
        return None
    best = best_result(rounds)
    added = [r.named[0].effect for r in rounds if r.named]
    present = best.problem.model.effects
    errors = {}
    for effect in (e for e in added[:-1] if e in present):
        progress(f"is {effect} still needed?")
        others = [e for e in present if e != effect]
        simpler = [[*others, s] for s in nested_effects(best.problem.with_effects(others), effect)]
        errors[effect] = min(reduced_model(best.problem, kept, best.fit).error for kept in (others, *simpler))
    least = min(errors, key=errors.__getitem__, default=None)
    if least is not None and errors[least] < (1.0 + MIN_RELATIVE_ERROR_DECREASE) * best.error:
        return least
    named = [r for r in rounds if r.named]
    exchangeable = next((r.named[0].effect for r in named if _is_exchangeable(r, best, progress)), None)
    if exchangeable or best.error < MAX_NOISE_LEVEL_ERROR_RATIO * best.problem.floor:
        return exchangeable
    return next((r.named[0].effect for r in named if _has_simpler_beside(r, best)), None)


def _has_simpler_beside(found: Diagnosis, best: Result) -> bool:
    """True where the first effect of a round is in the result, and contains one that was worth naming beside it."""
    first = found.named[0].effect
    if first not in best.problem.model.effects:
        return False
    return not {c.effect for c in found.named[1:]}.isdisjoint(nested_effects(found.problem, first))


def _is_exchangeable(found: Diagnosis, best: Result, progress: Progress) -> bool:
    """True where a simpler effect that was worth naming does as well as the first one of its round in the result."""
    first, present = found.named[0], best.problem.model.effects
    if first.effect not in present:
        return False
    simpler = [c.effect for c in found.named[1:] if len(c.coefficients) < len(first.coefficients)]
    others = [e for e in present if e != first.effect]
    for effect in (e for e in simpler if e not in present):
        progress(f"does {effect} do as well as {first.effect}?")
        if is_as_good(reduced_model(best.problem, [*others, effect], best.fit), best):
            return True
    return False


def reduced_model(problem: EstimationProblem, effects: Sequence[str], fitted: Fit) -> Result:
    """A problem's model with these effects instead, refitted from a fit; of infinite error where it diverges."""
    smaller = problem.with_effects(effects)
    values = values_of_model_effects(smaller, fitted.values)
    per_log = [values_of_model_effects(smaller, v) for v in fitted.per_log]
    smaller, names = with_stable_step(smaller, values), free_names(smaller, effects)
    try:
        refitted = fit_model(smaller, values, names, horizons=(MIDDLE_HORIZON_SHARE, 1.0), start_per_log=per_log)
        return Result(validation_residuals(smaller, refitted)[0], smaller, refitted)
    except Failure:
        return Result(float("inf"), smaller, fitted)  # without it the model cannot be simulated
