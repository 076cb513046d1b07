"""Diagnosing and adding in turn, and going back where later effects make an earlier one needless."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

from wheelpend.diagnosis.evidence import WORTHWHILE
from wheelpend.diagnosis.refit import Progress
from wheelpend.diagnosis.rounds import first_round, next_round, with_play
from wheelpend.diagnosis.verdict import Diagnosis, located, settled, with_law
from wheelpend.errors import Failure
from wheelpend.estimation.continuation import fit_model
from wheelpend.estimation.data import prepare
from wheelpend.estimation.fit import Fit
from wheelpend.estimation.free_parameters import free_names, without_others
from wheelpend.estimation.problem import Study, enlarged, steadied
from wheelpend.estimation.starts import best_start
from wheelpend.estimation.validation import held_residuals
from wheelpend.logs.log import Log
from wheelpend.model.record import Model

MOST_EFFECTS = 4  # added one after the other before the search ends
FOLLOWED = 0.9  # share of the error that a further effect may leave for the search behind a first one to go on
BACKS = 2  # times that a climb is begun anew without an effect that proved needless

Rounds = list[Diagnosis]


def diagnose(
    model: Model,
    logs: Sequence[str | Path | Log],
    holdout: Sequence[str | Path | Log] = (),
    *,
    without: Sequence[str] = (),
    law: bool = False,
    progress: Progress = lambda text: None,
) -> Diagnosis:
    """Find which effect of the library is missing, those named in ``without`` apart. Changes nothing.

    With ``law`` a free-form law is fitted to what no effect explains; that takes about a minute.
    Raises Failure where the logs or the model cannot be used.
    """
    study = prepare(model, logs, holdout, without=without)
    progress("finding a start")
    study, start = best_start(study)
    rounds = climb(study, start, told_enough, progress)
    result = located(settled(rounds[0], rounds[-1]), progress=progress)
    return with_law(result, progress=progress) if law else result


def told_enough(rounds: Rounds) -> bool:
    """Whether it is known that the first effect and those after it explain the rest, or that at this pace none will."""
    last = rounds[-1]
    slow = len(rounds) > 1 and last.named[0].error_after > FOLLOWED * last.error
    return last.accounted or slow or len(rounds) == MOST_EFFECTS


def climb(
    study: Study, start: dict[str, float], enough: Callable[[Rounds], bool], progress: Progress = lambda text: None
) -> Rounds:
    """Diagnoses, each with the first candidate of the one before in its model, until they are enough.

    An effect that resembles two others lowers the error more than either alone, and is not needed beside both. So
    where the whole is accounted for, each effect but the last is taken out again; if the error does not rise by enough
    to name it, the climb is begun anew without it, and that one counts if it gets as far. A play that explains more
    than a climb that does not arrive takes its place.
    """
    rounds = one_climb(first_round(study, start, progress), enough, progress)
    if not rounds[-1].accounted:
        first = with_play(rounds[0], progress)
        if first is not rounds[0] and reached([first])[0] < reached(rounds)[0]:
            rounds = one_climb(first, enough, progress) if first.accounted else [first]
    for _ in range(BACKS):
        needless = find_needless(rounds, progress)
        if needless is None:
            break
        progress(f"{needless} is needless beside the others: once more without it")
        study = replace(study, needless=(*study.needless, needless))
        other = one_climb(first_round(study, start, progress), enough, progress)
        if not (reached(other)[0] <= (1.0 + WORTHWHILE) * reached(rounds)[0]):
            break
        rounds = other
    return rounds


def one_climb(first: Diagnosis, enough: Callable[[Rounds], bool], progress: Progress) -> Rounds:
    """A diagnosis and those that follow it, until there is nothing to add or they are enough."""
    rounds = [first]
    while rounds[-1].named and not enough(rounds):
        rounds.append(next_round(rounds[-1], progress))
    return rounds


def reached(rounds: Rounds) -> tuple[float, Study, Fit]:
    """The lowest error of a climb, with the study and the fit that have it."""
    last = rounds[-1]
    if not last.named:
        return last.error, last.study, last.fit
    best = last.named[0]
    return best.error_after, last.study.having(enlarged(last.study.model, best.effect)), best.fit


def find_needless(rounds: Rounds, progress: Progress) -> str | None:
    """The effect of a climb, its last apart, that is missed least, where it is not missed; only if all is accounted."""
    if not rounds[-1].accounted:
        return None
    error, study, fitted = reached(rounds)
    added = [r.named[0].effect for r in rounds if r.named]
    present = study.model.effects
    errors = {}
    for effect in (e for e in added[:-1] if e in present):
        progress(f"is {effect} still needed?")
        errors[effect] = error_of(study, [e for e in present if e != effect], fitted)
    least = min(errors, key=errors.__getitem__, default=None)
    return least if least is not None and errors[least] < (1.0 + WORTHWHILE) * error else None


def error_of(study: Study, effects: Sequence[str], fitted: Fit) -> float:
    """Held-out error of a study's model with these of its effects, refitted from a fit that has more."""
    smaller = study.having(effects)
    values, own = without_others(smaller, fitted.values), [without_others(smaller, v) for v in fitted.per_log]
    smaller, names = steadied(smaller, values), free_names(smaller, effects)
    try:
        return held_residuals(smaller, fit_model(smaller, values, names, horizons=(0.3, 1.0), start_per_log=own))[0]
    except Failure:
        return float("inf")  # without it the model cannot be simulated
