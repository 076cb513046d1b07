"""The experiments that would distinguish effects, rated by the information that each would add.

An experiment is a command, or a part that is turned round, or a better sensor. Each is simulated in closed loop with
the first candidate in the model, at its fitted size, and its information is added to that of the logs at hand. The
cheapest one that separates clearly is recommended: first a command, then a screwdriver, then a new sensor.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from derive.plant_signature import PlantSignature, Reversal
from wheelpend.experiments.excitation import Excitation, builtin_excitations, excitation_family
from wheelpend.experiments.question import Question
from wheelpend.experiments.reversals import changes_sign, sign_after_reversal
from wheelpend.experiments.simulated_experiment import Limits, SimulatedExperiment

CLEAR_SEPARATION_SIGMA = 5.0  # standard errors at which two effects count as separated
USUAL_TILT_RAD = 0.4  # rad, limit of a plant that states none
FINER_SENSOR_NOISE_RATIO = 0.1  # of the present σ, of a finer sensor


class Sensor(NamedTuple):
    """A sensor that the machine might get."""

    description: str
    channel: str
    finer: bool  # else one beside the present one, as noisy, that has none of its faults


def sensor_options(plant: PlantSignature) -> tuple[Sensor, ...]:
    """Sensors that a machine might get: a finer one of every channel, and a true one beside each."""
    channels = plant.channels[::-1]
    return (*(Sensor(c.finer, c.name, True) for c in channels), *(Sensor(c.truer, c.name, False) for c in channels))


class Experiment(NamedTuple):
    """Something to record, and by how many standard errors it would separate the effects."""

    separation: float
    played: SimulatedExperiment
    gap: float = 1.0  # relative difference of the rivals' errors; large where sizes are compared instead
    reversal: Reversal | None = None
    sensor: Sensor | None = None

    @property
    def record(self) -> str:
        """Duration and excitation, for people."""
        smaller = "" if self.played.factor == 1.0 else f", times {self.played.factor:.2g},"
        return f"{self.played.log.t[-1]:.0f} s of {self.played.excitation.name}{smaller}"


def recommend(question: Question) -> list[Experiment]:
    """The experiments that were rated, the best first: the cheapest clear one, then the others by separation."""
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
    builtin = list(_command_experiments(question, builtin_excitations(), Limits(np.pi / 2, np.inf)))
    yield builtin
    family = list(_command_experiments(question, excitation_family(), limits))
    yield family
    yield [
        e
        for reversal in question.problem.plant.reversals
        if has_sign_contrast(reversal, question)
        for e in _reversal_experiments(question, reversal)
    ]
    best = max([*builtin, *family], key=lambda e: e.separation, default=None)
    played_by_name = {e.played.excitation.name: e.played for e in [*builtin, *([best] if best else [])]}
    yield [
        e
        for sensor in sensor_options(question.problem.plant)
        for e in _sensor_experiments(question, sensor, list(played_by_name.values()))
    ]


def usual_limits(question: Question) -> Limits:
    """The plant's usual limits, or what the machine has done already."""
    plant, logs = question.problem.plant, list(question.problem.logs)
    pitch = [float(np.nanmax(np.abs(log.measured[:, log.channels.index(plant.range_channel)]))) for log in logs]
    tilt, most = plant.usual_limits or (USUAL_TILT_RAD, 0.0)
    return Limits(max(tilt, *pitch, 0.0), max(most, 0.0, *(float(np.nanmax(np.abs(x.voltage))) for x in logs)))


def has_sign_contrast(reversal: Reversal, question: Question) -> bool:
    """A reversal that changes the sign of some effect in question, but not of all."""
    return len({changes_sign(reversal, e) for e in (question.first, *question.others)}) > 1


def _command_experiments(question: Question, excitations: Sequence[Excitation], limits: Limits) -> Iterator[Experiment]:
    for excitation in excitations:
        played = question.loop.play_within(excitation, limits)
        if played is not None:
            separation = question.separation(question.information_of(played))
            yield Experiment(separation, played, question.gap(separation, played))


def _reversal_experiments(question: Question, reversal: Reversal) -> Iterator[Experiment]:
    """A second log with a part turned round: sizes keep their values or change their signs."""
    ties = {n: sign_after_reversal(reversal, n) for n in question.names}
    values: dict[str, float] = {n: v * (sign_after_reversal(reversal, n) or 1) for n, v in question.sizes[-1].items()}
    loop = question.loop.with_values(values)
    for excitation in builtin_excitations():
        played = loop.play(excitation)
        if played is not None:
            yield Experiment(question.separation(question.information_of(played), ties), played, reversal=reversal)


def _sensor_experiments(
    question: Question, sensor: Sensor, simulated: Sequence[SimulatedExperiment]
) -> Iterator[Experiment]:
    """Simulated experiments, had they been recorded with a sensor."""
    channels = question.problem.module.OUTPUTS
    if sensor.channel not in channels:
        return
    sigma = float(question.problem.noise[0].sigma[channels.index(sensor.channel)])
    chosen: Mapping[str, float] = {sensor.channel: FINER_SENSOR_NOISE_RATIO if sensor.finer else sigma}
    for played in simulated:
        information = (
            question.information_of(played, sigma_factors=chosen)
            if sensor.finer
            else question.information_of(played, fault_free_sigma=chosen)
        )
        separation = question.separation(information)
        yield Experiment(separation, played, question.gap(separation, played), sensor=sensor)
