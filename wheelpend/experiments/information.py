"""What logs tell about parameters, and what one more log would: information matrices, added up.

For every log M = Σ over its segments of Jpᵀ W Jp − Jpᵀ W Jx (Jxᵀ W Jx)⁻¹ Jxᵀ W Jp, with the sensitivities J of the
readings in the parameters p and in the segments' initial states x, and W = 1/σ². Over logs I = Σ Sᵀ M S, where S says
which of the joint parameters each of a log's own is, and with which sign.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from types import ModuleType
from typing import NamedTuple

import numpy as np

import derive
from derive.effects import SensorMap
from wheelpend.diagnosis.score_test import project
from wheelpend.estimation.normal_equations import covariance_of, eliminate_initial_states
from wheelpend.estimation.parameters import parameter_layout
from wheelpend.estimation.segments import Segments
from wheelpend.estimation.shooting import ShootingLinearisation, shoot

SignTies = Mapping[
    str, int
]  # by name: how a parameter of the last log follows from that of the log before; 0 it does not


class JointInformation(NamedTuple):
    """Information on all parameters of several logs."""

    labels: tuple[str, ...]  # name, or name@log where a log has its own
    information: np.ndarray  # (labels, labels)

    def places(self, names: Collection[str]) -> list[int]:
        """Where the parameters of these names stand."""
        return [k for k, label in enumerate(self.labels) if label.split("@")[0] in names]


def information_of_segments(
    module: ModuleType,
    part: Segments,
    states: np.ndarray,
    parameters: np.ndarray,
    names: Sequence[str],
    max_step: float,
    fault_free_sigma: Mapping[str, float] | None = None,
) -> np.ndarray:
    """Information (names, names) of one log, the initial states (segments, NX) eliminated.

    ``truth`` adds sensors that read a channel without the effects of the present one: channel to σ.
    """  # fmt: skip
    columns = [module.PARAMETERS.index(n) for n in names]
    shot = shoot(module, part, states, parameters, columns, max_step=max_step)
    if fault_free_sigma:
        more = _fault_free_gram(module, part, states, parameters, names, max_step, fault_free_sigma)
        shot = ShootingLinearisation(shot.gram + more, shot.residual)
    return eliminate_initial_states([shot], module.NX, parameter_layout(names, (), 1)).information


def _fault_free_gram(
    module, part: Segments, states, parameters, names: Sequence[str], max_step: float, fault_free_sigma
) -> np.ndarray:
    """The Gram matrices of sensors that no sensor effect touches."""
    sigma = np.array([fault_free_sigma.get(c, np.inf) for c in part.log.channels])
    plain, columns = parameters.copy(), [module.PARAMETERS.index(n) for n in names]
    for place, name in enumerate(module.PARAMETERS):
        if is_sensor_parameter(name):
            plain[place] = module.ABSENT[place]
    gram = shoot(module, replace(part, sigma=sigma), states, plain, columns, max_step=max_step).gram
    silent = [module.NX + k for k, n in enumerate(names) if is_sensor_parameter(n)]
    gram[:, silent, :] = 0.0
    gram[:, :, silent] = 0.0
    return gram


def is_sensor_parameter(name: str) -> bool:
    """Whether a parameter is one of a sensor's effects."""
    effect, dot, _ = name.partition(".")
    if not dot or effect == "missing":
        return False
    return isinstance(derive.effects.find(effect).enters, SensorMap)


def add_information(
    pieces: Sequence[np.ndarray], names: Sequence[str], per_log: Collection[str], ties: SignTies | None = None
) -> JointInformation:
    """Add up the information (names, names) of several logs.

    Parameters ``per_log`` have a value in each. With ``ties`` those of the last log follow from the log before.
    """
    labels: list[str] = [n for n in names if n not in per_log]
    rows = []
    for number in range(len(pieces)):
        last = ties is not None and number == len(pieces) - 1
        row = [_joint_label(n, number, per_log, ties if last else None) for n in names]
        labels += [label for label, _ in row if label not in labels]
        rows.append(row)
    total = np.zeros((len(labels), len(labels)))
    for piece, row in zip(pieces, rows, strict=True):
        chosen, signs = [labels.index(label) for label, _ in row], np.array([s for _, s in row])
        total[np.ix_(chosen, chosen)] += piece * np.outer(signs, signs)
    return JointInformation(tuple(labels), total)


def _joint_label(name: str, number: int, per_log: Collection[str], ties: SignTies | None) -> tuple[str, int]:
    """The joint parameter that a log's own one is, and its sign."""
    if ties is None or number == 0:
        return (f"{name}@{number}" if name in per_log else name), 1
    if ties[name] == 0:
        return f"{name}@{number}", 1
    return (f"{name}@{number - 1}" if name in per_log else name), ties[name]


def separation(
    known: JointInformation,
    sizes: Sequence[Mapping[str, float]],
    first: Collection[str],
    other: Collection[str],
    base: Collection[str],
) -> float:
    """By how many standard errors a model with ``other`` in place of ``first`` would miss data that ``first`` made.

    √(δᵀ (I_ff − I_fr I_rr⁻¹ I_rf) δ), with the sizes δ of ``first`` in each log and r the parameters that are refitted,
    ``base`` and ``other``. Its square is the sum of squares that the best refit leaves above the noise.
    """  # fmt: skip
    lead, rest = known.places(first), known.places([*base, *other])
    information, _ = project(known.information, np.zeros(len(known.labels)), rest)
    size = np.array([_value_of(known.labels[k], sizes) for k in lead])
    return float(np.sqrt(max(size @ information[np.ix_(lead, lead)] @ size, 0.0)))


def _value_of(label: str, sizes: Sequence[Mapping[str, float]]) -> float:
    name, _, number = label.partition("@")
    return sizes[min(int(number or 0), len(sizes) - 1)][name]


def standard_errors(known: JointInformation, names: Collection[str]) -> dict[str, float]:
    """Standard error of each parameter, the others being fitted too; infinite where these logs say nothing of it.

    Of a parameter with a value in each log that of the last one.
    """
    places = known.places(names)
    labels = [known.labels[k] for k in places]
    covariance, _, flat = covariance_of(known.information[np.ix_(places, places)], labels)
    errors = {label.split("@")[0]: np.inf if label in flat else float(np.sqrt(covariance[k, k]))
              for k, label in enumerate(labels)}  # fmt: skip
    return {n: errors[n] for n in names}
