"""Advice: which experiment would distinguish the effects that a diagnosis cannot, in sentences."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from derive.plant_signature import Reversal
from wheelpend.diagnosis.criteria import MAX_EQUIVALENT_ERROR_DIFFERENCE
from wheelpend.diagnosis.evidence import CandidateFit
from wheelpend.diagnosis.verdict import Diagnosis
from wheelpend.estimation.problem import EstimationProblem
from wheelpend.experiments.question import Question, question_of_fit
from wheelpend.experiments.recommendation import CLEAR_SEPARATION_SIGMA, Experiment, recommend
from wheelpend.experiments.reversals import changes_sign

SECONDS_BELOW_S = 120.0  # of a duration that is told in seconds
MAX_DURATION_RATIO = 30  # times the length of a simulated experiment that a recording may reasonably last
MIN_NAMED_SEPARATION_SIGMA = 0.5  # standard errors below which commands separate nothing


def with_advice(found: Diagnosis) -> Diagnosis:
    """A diagnosis that says, if it is ambiguous, which experiment tells the first candidate from its equivalents."""
    if found.verdict != "ambiguous":
        return found
    first, *others = found.named
    return replace(found, experiment=advice(found.problem, first, others))


def advice(problem: EstimationProblem, first: CandidateFit, others: Sequence[CandidateFit] = ()) -> str:
    """The experiment that would separate the first candidate from its equivalents, in one to three sentences.

    ``others`` are the refits of other candidates, from which profiled parameters are taken.
    """
    rehearsed = tuple(e for e in first.equivalent_to if problem.knows(e))
    upright = problem.module.RANGE_OUTPUT >= 0 and len(problem.module.INPUTS) == 1
    if not (upright and rehearsed and problem.knows(first.effect)):
        return _advice_without_simulation(problem, first)
    if left := [e for e in first.equivalent_to if e not in rehearsed]:
        text = advice(problem, replace(first, equivalent_to=rehearsed), others)
        return f"{text} Not rehearsed, since a motion of its own goes with it: {', '.join(left)}."
    question = question_of_fit(problem, first, others)
    if settled := _already_separated_text(question, first, others):
        return settled
    found = recommend(question)
    text = recommendation_text(question, found) if found else _no_simulation_text(question)
    if not question.has_own_controller:
        text = f"{text[:-1]} ({_controller_text(question)})."
    if len(first.equivalent_to) > 3:
        logs = ", ".join(p.log.name for p in problem.data.estimation)
        return f"More than three other effects fit {logs} as well, because it moves too little to tell. {text}"
    return text


def _advice_without_simulation(problem: EstimationProblem, first: CandidateFit) -> str:
    """The log to record where no command can be simulated: that takes a plant which is held upright."""
    twins = [e for e in first.equivalent_to if e in problem.module.TWINS.get(first.effect, ())]
    others = [e for e in first.equivalent_to if e not in twins]
    same = f"No log of this plant tells {first.effect} from {' or '.join(twins)}, which change every one alike"
    if twins and not others:
        return f"{same}: look at the machine, or measure it by another sensor."
    names = ", ".join((first.effect, *others))
    driven = "small and large commands, slow and fast, both ways, and standstills between them"
    free = "releases from small and large angles, to the very end of each swing"
    told = f"To tell {names} apart, record one log with {driven if problem.module.INPUT else free}."
    return f"{told} {same}." if twins else told


def recommendation_text(question: Question, found: Sequence[Experiment]) -> str:
    """The recommendation, or that there is none."""
    best, effects = found[0], effects_text(question)
    commands = [e for e in found if not e.reversal and not e.sensor]
    most = max((e.separation for e in commands), default=0.0)
    if best.separation < CLEAR_SEPARATION_SIGMA:
        return _no_experiment_text(question, best)
    record = best.record
    clearly = f"{best.separation:.0f} standard errors"
    if best.reversal:
        changes = _sign_changes_text(best.reversal, question)
        return (f"{best.reversal.instruction} and record {record}: {changes}, which is {clearly}. "
                f"{_command_limit_text(most, question)}.")  # fmt: skip
    if best.sensor:
        return (
            f"{_command_limit_text(most, question)}. Record {record} with "
            f"{best.sensor.description}: it would separate them by {clearly}{_equivalence_warning_text(best)}."
        )
    alone = f" ({question.separation(None):.1f} without it)" if question.pieces else ""
    how = (
        ""
        if best.played.excitation.builtin
        else f"; `wheelpend design LOG {_between_option_text(question)}` writes the like"
    )
    beside = f"{alone}{_equivalence_warning_text(best)}{how}"
    return f"Record {record} as well: it would separate {effects} by {clearly}{beside}."


def _between_option_text(question: Question) -> str:
    return f"--between {question.first},{question.others[0]}"


def _equivalence_warning_text(best: Experiment) -> str:
    """A warning where the validation errors will differ less than the statistics say."""
    if best.gap >= MAX_EQUIVALENT_ERROR_DIFFERENCE:
        return ""
    return (f"; the errors would differ by {100 * best.gap:.2g} % only, so that `diagnose` would still list both, and "
            "the smaller error decides")  # fmt: skip


def _already_separated_text(question: Question, first: CandidateFit, others: Sequence[CandidateFit]) -> str:
    """Advice that no experiment is needed, where the logs at hand separate the effects already."""
    rivals = [t for t in others if t.effect in first.equivalent_to]
    if len(rivals) < len(first.equivalent_to) or question.separation(None) < CLEAR_SEPARATION_SIGMA:
        return ""
    more = min(t.fit.cost for t in rivals) - first.fit.cost
    if more < CLEAR_SEPARATION_SIGMA**2:
        return ""
    return (
        f"No further record is needed to tell {effects_text(question)}: their errors differ by less than 1 %, but the "
        f"other's sum of squares is larger by {more:.0f} noise variances, {np.sqrt(more):.0f} standard errors."
    )


def effects_text(question: Question) -> str:
    """The effects in question: A from B and C."""
    return f"{question.first} from {' and '.join(question.others)}"


def _command_limit_text(most: float, question: Question) -> str:
    if most < MIN_NAMED_SEPARATION_SIGMA:
        return f"No command of these sensors separates {effects_text(question)}: {_equivalence_text(question)}"
    return f"No command alone separates {effects_text(question)} by more than {most:.1f}"


def _equivalence_text(question: Question) -> str:
    """The sense in which rivals are equivalent: for all sizes, if the equations say so, else while they are small."""
    twins = question.problem.module.TWINS.get(question.first, ())
    exactly = any(o in twins for o in question.others)
    return "they change every log in the same way" + ("" if exactly else ", to first order in their sizes")


def _sign_changes_text(reversal: Reversal, question: Question) -> str:
    """Effects whose size changes its sign, and those whose does not."""
    effects = (question.first, *question.others)
    turning = [e for e in effects if changes_sign(reversal, e)]
    keeping = [e for e in effects if e not in turning]
    return f"the size of {' or '.join(turning)} would change its sign, that of {' or '.join(keeping)} would not"


def records_needed(reached: float, known: float) -> float:
    """How many records like one it takes for a clear separation [standard errors].

    ``reached`` is that of one beside the logs at hand, ``known`` that of the logs alone: squares add up.
    """
    more = reached**2 - known**2
    return max(CLEAR_SEPARATION_SIGMA**2 - known**2, 0.0) / more if more > 0.0 else float("inf")


def duration_text(seconds: float) -> str:
    """A duration in s, or in min where it is long."""
    return f"{seconds:.0f} s" if seconds < SECONDS_BELOW_S else f"{seconds / 60.0:.0f} min"


def _no_experiment_text(question: Question, best: Experiment) -> str:
    """Advice where no experiment is clear: how long the best would have to last, if that is within reason."""
    effects, seconds = effects_text(question), float(question.loop.t[-1])
    sensed = question.problem.plant.sensed_words
    longer = records_needed(best.separation, question.separation(None) if question.pieces else 0.0)
    if longer > MAX_DURATION_RATIO:
        return (f"No command, no part turned round and no better sensor of {sensed} separates {effects}: "
                f"{_equivalence_text(question)}. Measure one of them by other means.")  # fmt: skip
    how = f" with {best.sensor.description}" if best.sensor else ""
    how = f" with the {best.reversal.part} turned round" if best.reversal else how
    name = best.played.excitation.name
    return (
        f"No record of {seconds:.0f} s separates {effects} by {CLEAR_SEPARATION_SIGMA:.0f} standard errors. "
        f"About {duration_text(longer * seconds)} of {name}{how} would; {seconds:.0f} s give {best.separation:.1f}."
    )


def _no_simulation_text(question: Question) -> str:
    words = question.problem.plant.words
    return (f"No command could be rehearsed with {question.first} in the model, because the simulated {words.machine} "
            f"{words.leaves}. Give the {words.machine}'s own [controller] in model.toml.")  # fmt: skip


def _controller_text(question: Question) -> str:
    gains = ", ".join(f"{g:.4g}" for g in question.loop.gains)
    controlled = question.problem.plant.what_is_controlled
    return (f"rehearsed with a PID on {controlled} made for the fitted model, gains = [{gains}]; give your own in "
            "[controller]")  # fmt: skip
