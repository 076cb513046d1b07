"""The command that adds most to the information of the logs at hand, within limits of angle and input."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from derive.plant_signature import PlantSignature
from wheelpend.errors import Failure
from wheelpend.estimation.free_parameters import effect_parameter
from wheelpend.experiments.excitation import builtin_excitations
from wheelpend.experiments.pose import DesignProblem, pose_problem
from wheelpend.experiments.question import MAX_SAMPLE_INTERVAL_S, MIN_SAMPLE_INTERVAL_S, Question
from wheelpend.experiments.recommendation import USUAL_TILT_RAD, usual_limits
from wheelpend.experiments.search import MAX_GENERATIONS, RatedTrajectory, best_trajectory, search_trajectory
from wheelpend.experiments.simulated_experiment import Limits, SimulatedExperiment
from wheelpend.logs.log import Log
from wheelpend.model.record import Model
from wheelpend.simulation.references import BUILT_IN_DURATION_S

MIN_DURATION_S, MAX_DURATION_S = 2.0, 600.0  # s of a command
MIN_RELATIVE_SCALE = 0.1  # of an effect's typical size, against which an error counts at least
MIN_PARAMETER_SCALE = 1e-3  # the same of a base parameter


@dataclass(frozen=True)
class Peaks:
    """Peaks of a command, as simulated."""

    pitch: float  # rad, of the angle that must stay in range
    voltage: float  # of the input [its unit]
    wheel_travel: float  # between the ends of the first coordinate's track [its unit]
    factor: float  # by which the command was made smaller to keep the limits

    def to_json(self) -> dict[str, Any]:
        """The peaks under the keys of JSON."""
        return {"pitch": self.pitch, "voltage": self.voltage, "wheel_travel": self.wheel_travel, "factor": self.factor}


@dataclass(frozen=True)
class ExpectedErrors:
    """A parameter and its expected standard errors; infinite where it would not be known."""

    value: float
    logs: float | None  # from the logs at hand alone
    builtin: float | None  # with the best built-in command beside them
    designed: float  # with the designed command beside them

    def to_json(self) -> dict[str, Any]:
        """The errors under the keys of JSON."""
        return {"value": self.value, "logs": self.logs, "builtin": self.builtin, "designed": self.designed}


@dataclass(frozen=True)
class Design:
    """A designed command and the standard errors expected with it."""

    between: tuple[str, ...]  # effects to be distinguished; empty where the parameters are the aim
    command: str  # the trajectory, in words
    duration_s: float
    sample_s: float
    limits: Limits
    separation: dict[str, float | None] | None  # standard errors with logs, builtin, designed; None without effects
    gap: float | None  # relative difference of the rivals' errors over all logs then; None without effects
    parameters: dict[str, ExpectedErrors]
    builtin: str | None  # the best built-in command; None where none keeps the limits
    peaks: dict[str, Peaks]  # of builtin and designed
    gains: tuple[float, ...]  # of the controller it was simulated with
    own_controller: bool
    sentences: tuple[str, ...]  # what was assumed
    t: np.ndarray = field(repr=False)  # (N,) s
    theta_ref: np.ndarray = field(repr=False)  # (N,) rad
    dtheta_ref: np.ndarray = field(repr=False)  # (N,) rad/s
    question: Question = field(repr=False)

    def to_json(self) -> dict[str, Any]:
        """The result under the keys of JSON, without the command's samples."""
        return {
            "between": self.between,
            "command": self.command,
            "duration_s": self.duration_s,
            "sample_s": self.sample_s,
            "limits": self.limits,
            "separation": self.separation,
            "gap": self.gap,
            "parameters": self.parameters,
            "builtin": self.builtin,
            "peaks": self.peaks,
            "gains": self.gains,
            "own_controller": self.own_controller,
            "sentences": self.sentences,
        }


def design(
    model: Model,
    logs: Sequence[str | Path | Log] = (),
    *,
    between: Sequence[str] = (),
    pitch_limit: float | None = None,
    voltage_limit: float | None = None,
    duration: float = BUILT_IN_DURATION_S,
    sample: float | None = None,
    generations: int = MAX_GENERATIONS,
    progress: Callable[[str], None] = lambda text: None,
) -> Design:
    """Find the most informative reference trajectory beside the logs, within limits of angle [rad] and input.

    With two effects in ``between`` it is to distinguish these; else what a diagnosis of the logs leaves ambiguous; else
    it is to sharpen the parameters that are known worst. The limits are those
    of the plant's ordinary use, or what the logs show. ``sample`` [s] is that of the log, or 1 ms. Raises Failure for
    what cannot be judged or simulated, and where the limits leave no room.
    """
    plant = model.plant_signature
    _check_arguments(plant, pitch_limit, voltage_limit, duration, sample)
    if not plant.is_balanced:
        what = "with one input that is held upright"
        raise Failure(f"A command can be designed for a plant {what}, but this {model.plant} is none. Record "
                      "small and large commands, slow and fast, both ways, and standstills between them.")  # fmt: skip
    found = pose_problem(model, logs, between, duration, sample, progress)
    question = found.question
    limits = _limits_of(question, pitch_limit, voltage_limit)
    criterion = criterion_of(question)
    progress("rehearsing the built-in commands")
    check_room_within_limits(question, limits)
    builtin = [b for b in builtin_excitations() if b.builtin != "upright"]
    known = best_trajectory(builtin, question.loop, limits, criterion)
    best = search_trajectory(question.loop, limits, criterion, generations=generations, progress=progress)
    if best is None:
        raise Failure(_no_room_text(plant, limits, "no trajectory keeps them"))
    if known and known.criterion > best.criterion:
        best = known
    return _result(found, limits, known, best)


def _limits_of(question: Question, pitch: float | None, voltage: float | None) -> Limits:
    """The limits that were asked for, else the plant's usual ones, else those that the logs show."""
    plant = question.problem.plant
    usual = Limits(*(plant.usual_limits or (USUAL_TILT_RAD, 0.0)))
    if voltage is None and not usual.voltage:
        usual = usual._replace(voltage=usual_limits(question).voltage)
        if not usual.voltage:
            raise Failure(f"--voltage-limit must say how large {plant.input} [{plant.input_unit}] may become, as "
                          "neither the plant nor a log does.")  # fmt: skip
    return Limits(usual.pitch if pitch is None else pitch, usual.voltage if voltage is None else voltage)


def _check_arguments(
    plant: PlantSignature, pitch: float | None, voltage: float | None, duration: float, sample: float | None
) -> None:
    if pitch is not None and not (0.0 < pitch < np.pi / 2):
        raise Failure(f"--pitch-limit must be an angle in rad between 0 and π/2, not {pitch:g}.")
    if voltage is not None and not voltage > 0.0:
        raise Failure(f"--voltage-limit must be a {plant.input_word} above 0, not {voltage:g}.")
    if not MIN_DURATION_S <= duration <= MAX_DURATION_S:
        raise Failure(f"--duration must be a time of {MIN_DURATION_S:g} to {MAX_DURATION_S:g} s, not {duration:g}.")
    if sample is not None and not MIN_SAMPLE_INTERVAL_S <= sample <= MAX_SAMPLE_INTERVAL_S:
        raise Failure(
            f"--sample must be an interval of {MIN_SAMPLE_INTERVAL_S:g} to {MAX_SAMPLE_INTERVAL_S:g} s, not {sample:g}."
        )


def check_room_within_limits(question: Question, limits: Limits) -> None:
    """Raise Failure where the limits leave no room even to stand still."""
    plant = question.problem.plant
    upright = next(b for b in builtin_excitations() if b.builtin == "upright")
    played = question.loop.play(upright)
    if played is None:
        words = plant.words
        raise Failure(f"The {words.machine} must {words.stay} to rehearse a command, but the simulated one "
                      f"{words.leaves} while it stands still. Check the values of the model and the gains in "
                      "[controller].")  # fmt: skip
    if not played.is_within(limits):
        takes = f"{played.peak_pitch:.3g} rad and {played.peak_voltage:.3g} {plant.input_unit}"
        why = f"standing still alone takes {takes}, because the controller answers to the noise of the sensors"
        raise Failure(_no_room_text(plant, limits, why))


def _no_room_text(plant: PlantSignature, limits: Limits, why: str) -> str:
    bounds = f"{limits.pitch:g} rad and {limits.voltage:g} {plant.input_unit}"
    return (f"The limits, {bounds}, must leave room for a command, but {why}. "
            "Raise --pitch-limit or --voltage-limit, or use a gentler controller.")  # fmt: skip


def criterion_of(question: Question) -> Callable[[SimulatedExperiment], float]:
    """The criterion of a simulated log: the least separation of the effects, or A-optimality of the parameters."""
    if question.first:
        return lambda played: question.separation(question.information_of(played))
    return lambda played: a_optimality(question, question.information_of(played))


def a_optimality(question: Question, piece: np.ndarray | None) -> float:
    """−log of the root mean square relative standard error of the shared parameters, none counted above 100 %.

    The mean of squares (A-optimality) is ruled by what is known worst. The bound enters as a prior of that width.
    """
    known, values = question.information_with(piece), question.sizes[-1]
    scale = np.array([_scale(question.problem.plant, p.name, values) for p in known.layout.elements])
    prior = np.eye(len(scale))
    covariance = np.linalg.inv(known.information * np.outer(scale, scale) + prior)
    shared = [k for k, p in enumerate(known.layout.elements) if p.log is None]
    return float(-0.5 * np.log(np.mean(np.diag(covariance)[shared])))


def _scale(plant: PlantSignature, name: str, values: Mapping[str, float]) -> float:
    """Size against which a parameter's error counts: its value, of an effect at least a tenth of a typical one."""
    parameter, value = effect_parameter(name, plant), abs(values.get(name, 0.0))
    least = MIN_RELATIVE_SCALE * abs(parameter.typical) if parameter else MIN_PARAMETER_SCALE
    return max(value, least) if np.isfinite(value) else least


def _result(found: DesignProblem, limits: Limits, known: RatedTrajectory | None, best: RatedTrajectory) -> Design:
    """The design with the best trajectory, compared with the best known one and with the logs alone."""
    question, t = found.question, best.played.log.t
    pieces = {
        "logs": None,
        "builtin": question.information_of(known.played) if known else None,
        "designed": question.information_of(best.played),
    }
    there = {"logs": bool(question.pieces), "builtin": known is not None, "designed": True}
    errors = {k: question.errors(p) if there[k] else {} for k, p in pieces.items()}
    values = {
        n: ExpectedErrors(question.sizes[-1].get(n, 0.0), errors["logs"].get(n), errors["builtin"].get(n), e)
        for n, e in errors["designed"].items()
    }
    separation = {k: question.separation(p) if there[k] else None for k, p in pieces.items()}
    reference = best.played.log.reference
    assert reference is not None
    return Design(
        between=(question.first, *question.others) if question.first else (),
        command=_trajectory_text(best),
        duration_s=float(t[-1]),
        sample_s=float(t[1] - t[0]),
        limits=limits,
        separation=separation if question.first else None,
        gap=question.gap(separation["designed"] or 0.0, best.played) if question.first else None,
        parameters=values,
        builtin=known.excitation.builtin if known else None,
        peaks={k: peaks(f.played) for k, f in (("builtin", known), ("designed", best)) if f},
        gains=tuple(float(g) for g in question.loop.gains),
        own_controller=question.has_own_controller,
        sentences=found.sentences,
        t=t,
        theta_ref=reference,
        dtheta_ref=best.played.rate,
        question=question,
    )


def _trajectory_text(found: RatedTrajectory) -> str:
    """A trajectory, with the factor by which it was made smaller."""
    factor, excitation = found.played.factor, found.excitation
    return excitation.name if factor == 1.0 else f"{excitation.name}, times {factor:.3g}"


def peaks(played: SimulatedExperiment) -> Peaks:
    """Peaks of a simulated command."""
    return Peaks(played.peak_pitch, played.peak_voltage, played.travel, played.factor)
