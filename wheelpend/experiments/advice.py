"""Which experiment would tell effects apart, computed from the information that each of many would give.

An experiment is a command, or a part that is turned round, or a better sensor. Each is rehearsed in closed loop with
the first candidate in the model, at its fitted size, and its information is added to that of the logs at hand. The
cheapest one that separates clearly is recommended: first a command, then a screwdriver, then a new sensor.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from wheelpend.diagnosis.evidence import CandidateFit
from wheelpend.diagnosis.verdict import Diagnosis
from wheelpend.estimation.problem import EstimationProblem
from wheelpend.experiments.closed_loop import Limits, SimulatedExperiment
from wheelpend.experiments.excitation import Excitation, builtin_excitations, excitation_family
from wheelpend.experiments.question import MAX_EQUIVALENT_ERROR_DIFFERENCE, Question, question_of_fit
from wheelpend.experiments.reversals import PART_REVERSALS, PartReversal, changes_sign, sign_after_reversal

CLEAR_SEPARATION_SIGMA = 5.0  # standard errors at which two effects count as separated
MAX_DURATION_RATIO = 30  # times the length of a rehearsal that a recording may reasonably last
USUAL_LIMITS = Limits(0.4, 24.0)  # rad, V: what the paper's commands take; more where the logs have more
FINER_SENSOR_NOISE_RATIO = 0.1  # of the present σ, of a finer sensor


class Sensor(NamedTuple):
    """A sensor that the robot might get."""

    description: str
    channel: str
    finer: bool  # else one beside the present one, as noisy, that has none of its faults


SENSOR_OPTIONS = (
    Sensor("a gyro with a tenth of the noise", "dtheta_p", True),
    Sensor("a pitch sensor with a tenth of the noise", "theta_p", True),
    Sensor("an encoder with ten times the counts", "theta_w", True),
    Sensor("a second gyro whose zero and scale are known", "dtheta_p", False),
    Sensor("an absolute reference of the pitch (an inclinometer, a camera), as noisy as the present one", "theta_p",
           False),
    Sensor("a second encoder that is known to be true", "theta_w", False),
)  # fmt: skip


class Experiment(NamedTuple):
    """Something to record, and by how many standard errors it would separate the effects."""

    separation: float
    played: SimulatedExperiment
    gap: float = 1.0  # by which share the errors of the rivals would differ; large where sizes are compared instead
    turn: PartReversal | None = None
    sensor: Sensor | None = None

    @property
    def record(self) -> str:
        """What is to be recorded, for people."""
        smaller = "" if self.played.factor == 1.0 else f", times {self.played.factor:.2g},"
        return f"{self.played.log.t[-1]:.0f} s of {self.played.excitation.name}{smaller}"


def with_advice(found: Diagnosis) -> Diagnosis:
    """A diagnosis that says, if it is ambiguous, which experiment tells the first candidate from its equivalents."""
    if found.verdict != "ambiguous":
        return found
    first, *others = found.named
    return replace(found, experiment=advice(found.problem, first, others))


def advice(problem: EstimationProblem, first: CandidateFit, others: Sequence[CandidateFit] = ()) -> str:
    """What would separate the first candidate from its equivalents, in one to three sentences.

    ``others`` are the refits of other candidates, from which shapes and limits are taken.
    """
    if problem.module.RANGE_OUTPUT < 0 or len(problem.module.INPUTS) != 1:
        return _advice_without_simulation(problem, first)
    question = question_of_fit(problem, first, others)
    if settled := _already_separated_text(question, first, others):
        return settled
    found = recommend(question)
    text = recommendation_text(question, found) if found else _no_simulation_text(question)
    if not question.has_own_controller:
        text = f"{text[:-1]} ({_controller_text(question)})."
    if len(first.equivalent_to) > 3:
        logs = ", ".join(p.log.name for p in problem.training)
        return f"More than three other effects fit {logs} as well, because it moves too little to tell. {text}"
    return text


def _advice_without_simulation(problem: EstimationProblem, first: CandidateFit) -> str:
    """What to record where no command can be rehearsed: that takes a plant which is held upright."""
    names = ", ".join((first.effect, *first.equivalent_to))
    driven = "small and large commands, slow and fast, both ways, and standstills between them"
    free = "releases from small and large angles, to the very end of each swing"
    return f"To tell {names} apart, record one log with {driven if problem.module.INPUT else free}."


def recommend(question: Question) -> list[Experiment]:
    """The experiments that were looked at, best first: the cheapest clear one, then the others by separation."""
    seen: list[Experiment] = []
    for group in experiments(question):
        clear = [e for e in group if e.separation >= CLEAR_SEPARATION_SIGMA]
        seen += group
        if clear:
            best = max(clear, key=lambda e: e.separation)
            return [best, *sorted((e for e in seen if e is not best), key=lambda e: -e.separation)]
    return sorted(seen, key=lambda e: -e.separation)


def experiments(question: Question) -> Iterator[list[Experiment]]:
    """Groups of experiments, the cheapest first."""
    limits = usual_limits(question)
    known = list(_command_experiments(question, builtin_excitations(), Limits(np.pi / 2, np.inf)))
    yield known
    further = list(_command_experiments(question, excitation_family(), limits))
    yield further
    yield [
        e for turn in PART_REVERSALS if has_sign_contrast(turn, question) for e in _reversal_experiments(question, turn)
    ]
    best = max([*known, *further], key=lambda e: e.separation, default=None)
    tried = {e.played.excitation.name: e.played for e in [*known, *([best] if best else [])]}
    yield [e for sensor in SENSOR_OPTIONS for e in _sensor_experiments(question, sensor, list(tried.values()))]


def usual_limits(question: Question) -> Limits:
    """What the paper's commands take, or what the robot has done already."""
    logs = [p.log for p in question.problem.training]
    pitch = [float(np.nanmax(np.abs(log.measured[:, log.channels.index("theta_p")]))) for log in logs]
    return Limits(
        max(USUAL_LIMITS.pitch, *pitch, 0.0),
        max(USUAL_LIMITS.voltage, 0.0, *(float(np.nanmax(np.abs(x.voltage))) for x in logs)),
    )


def has_sign_contrast(turn: PartReversal, question: Question) -> bool:
    """Whether turning a part changes the sign of some effect in question, but not of all."""
    return len({changes_sign(turn, e) for e in (question.first, *question.others)}) > 1


def _command_experiments(question: Question, excitations: Sequence[Excitation], limits: Limits) -> Iterator[Experiment]:
    for excitation in excitations:
        played = question.loop.play_within(excitation, limits)
        if played is not None:
            apart = question.separation(question.information_of(played))
            yield Experiment(apart, played, question.gap(apart, played))


def _reversal_experiments(question: Question, turn: PartReversal) -> Iterator[Experiment]:
    """A second log with a part turned round: sizes keep their values or change their signs."""
    ties = {n: sign_after_reversal(turn, n) for n in question.names}
    values: dict[str, float] = {n: v * (sign_after_reversal(turn, n) or 1) for n, v in question.sizes[-1].items()}
    loop = question.loop.with_values(values)
    for excitation in builtin_excitations():
        played = loop.play(excitation)
        if played is not None:
            yield Experiment(question.separation(question.information_of(played), ties), played, turn=turn)


def _sensor_experiments(
    question: Question, sensor: Sensor, rehearsals: Sequence[SimulatedExperiment]
) -> Iterator[Experiment]:
    """Rehearsed records, had they been made with a sensor."""
    channels = question.problem.module.OUTPUTS
    if sensor.channel not in channels:
        return
    sigma = float(question.problem.noise[0].sigma[channels.index(sensor.channel)])
    chosen: Mapping[str, float] = {sensor.channel: FINER_SENSOR_NOISE_RATIO if sensor.finer else sigma}
    for played in rehearsals:
        told = (
            question.information_of(played, sigma_factors=chosen)
            if sensor.finer
            else question.information_of(played, fault_free_sigma=chosen)
        )
        apart = question.separation(told)
        yield Experiment(apart, played, question.gap(apart, played), sensor=sensor)


# ---- in words


def recommendation_text(question: Question, found: Sequence[Experiment]) -> str:
    """The recommendation, or that there is none."""
    best, effects = found[0], effects_text(question)
    commands = [e for e in found if not e.turn and not e.sensor]
    most = max((e.separation for e in commands), default=0.0)
    if best.separation < CLEAR_SEPARATION_SIGMA:
        return _no_experiment_text(question, best)
    record = best.record
    clearly = f"{best.separation:.0f} standard errors"
    if best.turn:
        return (f"{best.turn.instruction} and record {record}: {_sign_changes_text(best.turn, question)}, which is "
                f"{clearly}. {_command_limit_text(most, question)}.")  # fmt: skip
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
    """Warn where the diagnosis will not look as clear as the statistics are."""
    if best.gap >= MAX_EQUIVALENT_ERROR_DIFFERENCE:
        return ""
    return (f"; the errors would differ by {100 * best.gap:.2g} % only, so that `diagnose` would still list both, and "
            "the smaller error decides")  # fmt: skip


def _already_separated_text(question: Question, first: CandidateFit, others: Sequence[CandidateFit]) -> str:
    """That no experiment is needed, where the logs tell already; a diagnosis looks at the errors alone."""
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
    if most < 0.5:
        return f"No command of these sensors separates {effects_text(question)}: {_equivalence_text(question)}"
    return f"No command alone separates {effects_text(question)} by more than {most:.1f}"


def _equivalence_text(question: Question) -> str:
    """In what sense the rivals look the same: for all sizes, if the equations say so, else while they are small."""
    twins = question.problem.module.TWINS.get(question.first, ())
    exactly = any(o in twins for o in question.others)
    return "they change every log in the same way" + ("" if exactly else ", to first order in their sizes")


def _sign_changes_text(turn: PartReversal, question: Question) -> str:
    """Whose size changes its sign, and whose does not."""
    effects = (question.first, *question.others)
    turning = [e for e in effects if changes_sign(turn, e)]
    keeping = [e for e in effects if e not in turning]
    return f"the size of {' or '.join(turning)} would change its sign, that of {' or '.join(keeping)} would not"


def _no_experiment_text(question: Question, best: Experiment) -> str:
    """No experiment is clear: say how long the best would have to last, if that is within reason."""
    effects, seconds = effects_text(question), float(question.loop.t[-1])
    longer = (CLEAR_SEPARATION_SIGMA / max(best.separation, 1e-9)) ** 2
    if longer > MAX_DURATION_RATIO:
        return (f"No command, no part turned round and no better sensor of angle, pitch or rate separates {effects}: "
                f"{_equivalence_text(question)}. Measure one of them by other means.")  # fmt: skip
    how = f" with {best.sensor.description}" if best.sensor else ""
    how = f" with the {best.turn.part} turned round" if best.turn else how
    name, minutes = best.played.excitation.name, longer * seconds / 60
    return (
        f"No record of {seconds:.0f} s separates {effects} by {CLEAR_SEPARATION_SIGMA:.0f} standard errors. "
        f"About {minutes:.0f} min of {name}{how} would; {seconds:.0f} s give {best.separation:.1f}."
    )


def _no_simulation_text(question: Question) -> str:
    return (f"No command could be rehearsed with {question.first} in the model, because the simulated robot falls. "
            "Give the robot's own [controller] in model.toml.")  # fmt: skip


def _controller_text(question: Question) -> str:
    gains = ", ".join(f"{g:.4g}" for g in question.loop.gains)
    return (f"rehearsed with a PID on the pitch made for the fitted model, gains = [{gains}]; give your own in "
            "[controller]")  # fmt: skip
