"""Effects added one by one where sensor noise will not be reached, and taken out where others make them needless."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import NamedTuple

import numpy as np

import derive
from derive.effects import DryForce
from wheelpend.diagnosis.criteria import MAX_BACKWARD_STEPS
from wheelpend.diagnosis.likelihood.filtered_model import FilteredModel, LogValues, filtered_from, filtered_model
from wheelpend.diagnosis.likelihood.held_out import gain_in_blocks
from wheelpend.diagnosis.likelihood.judgement import MIN_TOLD_GAIN, JudgedModel
from wheelpend.diagnosis.likelihood.meaning import without_meaning
from wheelpend.diagnosis.likelihood.one_round import Round, one_round
from wheelpend.diagnosis.likelihood.refits import (
    fitted_to_all,
    refitted,
    settled,
    without_effect,
)
from wheelpend.diagnosis.likelihood.relief import with_refits
from wheelpend.diagnosis.verdict import Diagnosis, where_chance_does_not_explain
from wheelpend.estimation.fit import Fit
from wheelpend.estimation.problem import EstimationProblem
from wheelpend.estimation.random_source import correlation_bounds
from wheelpend.identification.remainder_at import found_or_warning, refitted_remainder

SLOW_RATIO = 3.0  # of the shortest correlation time, from which a force is not white
CONSTANT_SHARE = 0.9  # of the longest correlation time, from which an error may be a constant one

Progress = Callable[[str], None]
Rounds = list[Diagnosis]


class Path(NamedTuple):
    """Rounds one after the other, and where the search might have gone another way."""

    rounds: Rounds
    begun: FilteredModel  # where they began, without the effects that were needless
    judged: FilteredModel  # the model of the last of them
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
    model, refits = with_refits(likely_model(problem, start, progress), progress, effect)
    if effect not in refits:
        return None
    return fitted_to_all(model).fitted(), fitted_to_all(settled(refits[effect])).fitted()


class OtherWay(NamedTuple):
    """Effects that another search added, none of which it found by likelihood."""

    rounds: Rounds  # each of which names one that is still there
    problem: EstimationProblem  # of the model with them all
    log_values: LogValues  # of its parameters in each log


def rounds_from(
    model: FilteredModel, is_done: Callable[[Rounds], bool], progress: Progress, other: OtherWay | None = None
) -> Rounds:
    """Diagnoses, each with the first candidate of the one before in its model, the last with none worth naming.

    An effect that later ones have made needless is taken out, and the search made once more without it. Where it ends
    with something unexplained, and an effect had a rival that it did not lead, the search is made once more with that
    one; it counts if it ends with a likelier model that predicts no worse, over the horizon and from row to row. So
    does a search that goes on from what was found the ``other`` way.
    """
    path = _to_the_end(model, [], None, is_done, progress)
    if _is_unexplained(path) and path.fork is not None:
        path = _with_rival(path, *path.fork, is_done, progress)
    if _is_unexplained(path) and other and other.rounds:
        along = partial(_along, other, path, model, is_done, progress)
        followed, lines = found_or_warning("What another search found could not be followed", along)
        path = followed or path
        for line in lines:
            progress(line)
    return path.rounds


def _is_unexplained(path: Path) -> bool:
    return where_chance_does_not_explain(path.rounds[-1]).verdict == "unexplained"


def _with_rival(
    path: Path,
    before: Rounds,
    instead: Callable[[], Round | None],
    is_done: Callable[[Rounds], bool],
    progress: Progress,
) -> Path:
    """A path, or the one by the rival of an effect that it added, where that ends likelier and predicts no worse."""
    progress("something is left unexplained: once more with a rival of an effect that was added")
    begun = instead()
    if begun is None:
        return path
    rival = _to_the_end(path.begun, before, begun, is_done, progress)
    worse = rival.rounds[-1].error > path.rounds[-1].error or _held_out_gain(rival.rounds) < _held_out_gain(path.rounds)
    return rival if _is_likelier(rival.judged, path.judged) and not worse else path


def _along(
    other: OtherWay, path: Path, model: FilteredModel, is_done: Callable[[Rounds], bool], progress: Progress
) -> Path:
    """A path, or the one that goes on from what another search found, where that is likelier and predicts no worse.

    Far from what moves a machine a random force takes the place of several effects at once, and no single step leads
    back. What the other search came to counts only with every effect of it needed, by likelihood too.
    """
    effects = [r.named[0].effect for r in other.rounds]
    if set(effects) <= set(path.judged.problem.model.effects):
        return path
    progress(f"something is left unexplained: once more from {', '.join(effects)}, which predict without likelihoods")
    near = refitted(filtered_from(other.problem, [other.log_values], progress))
    if not _is_likelier(near, path.judged) or not all(_is_needed(near, e) for e in effects):
        return path
    start, reached = (JudgedModel.of(m) for m in (model, near))
    gain = float(np.sum(gain_in_blocks(start.predicted, reached.predicted)))
    if reached.validated.error > path.rounds[-1].error or not gain > _held_out_gain(path.rounds):
        return path
    found = _forward(near, other.rounds, None, is_done, progress)
    return path if found.needless else found


def _is_needed(model: FilteredModel, effect: str) -> bool:
    """True of an effect that means what it is called, and without which a model is clearly less likely."""
    if effect in without_meaning(model):
        return False
    smaller = without_effect(model, effect)
    return smaller is None or _is_likelier(model, smaller)


def _is_likelier(one: FilteredModel, other: FilteredModel) -> bool:
    return one.deviance < other.deviance - 2.0 * MIN_TOLD_GAIN


def _held_out_gain(rounds: Rounds) -> float:
    """How much likelier held-out data are with all that rounds add [nats]."""
    return sum(r.named[0].held_out_gain or 0.0 for r in rounds if r.named)


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


def leaves_what_lasts(problem: EstimationProblem, fitted: Fit, progress: Progress) -> bool:
    """True where a model that reaches sensor noise over the horizon leaves a random force, or what may be a zero.

    However small a force is that likelihood wants, it stands for what is missing and lasts: of dry friction that takes
    a wide swing's energy, a thousandth of the drive is left beside viscous friction, which does almost as well. Where a
    surface sticks the filter, which expands about its mean, leaves a white one of its own. A sensor's error that is as
    slow as such logs can tell stands likewise for what does not change: a gyro's zero hardly shows in segments that
    each begin anew.
    Raises what `refitted_remainder` does where no filter can follow the model.
    """
    progress("looking for what lasts behind sensor noise")
    logs = problem.logs
    left = refitted_remainder(problem, [fitted.of_log(k) for k in range(len(logs))])
    shortest, longest = correlation_bounds([log.duration for log in logs], min(log.dt for log in logs))
    if any(e.correlation_time_s > CONSTANT_SHARE * longest for e in left.sensors.values()):
        return True
    force = left.strongest
    if force is None or not force.share > 0.0:
        return False
    sticks = any(isinstance(derive.effects.find(e).enters, DryForce) for e in problem.model.effects)
    return not sticks or force.correlation_time_s > SLOW_RATIO * shortest


def _forward(
    model: FilteredModel, before: Rounds, begun: Round | None, is_done: Callable[[Rounds], bool], progress: Progress
) -> Path:
    """Rounds until there is nothing to add or they are enough, from a model on, or from a round behind others."""
    rounds, fork, start = [*before], None, model

    def goes_on(found: Sequence[Diagnosis]) -> bool:
        return not is_done([*rounds, *found])

    while True:
        here = begun or one_round(model, [r.named[0].effect for r in rounds], goes_on, progress)
        if fork is None and begun is None and here.instead:
            fork = [*rounds], here.instead
        begun = None
        if here.larger is None:
            return Path([*rounds, *here.found], start, here.judged, here.displaced, fork)
        for one in here.found:
            rounds.append(one)
            if is_done(rounds):
                return Path(rounds, start, here.judged, fork=fork)
            best = one.named[0]
            progress(f"added {best.effect}: {best.held_out_gain:.4g} nats likelier on held-out data")
        model, added = here.larger, [r.named[0].effect for r in rounds[:-1]]
        for effect in (e for e in added if e in model.problem.model.effects):
            if _is_needless(model, effect):
                return Path(rounds, start, here.judged, effect, fork)


def _is_needless(model: FilteredModel, effect: str) -> bool:
    """True where a model is no less likely without one of its effects than with it, or this has no meaning in it."""
    if effect in without_meaning(model):
        return True
    smaller = without_effect(model, effect)
    return smaller is not None and smaller.deviance <= model.deviance
