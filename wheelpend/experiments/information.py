"""Information that logs have on parameters, and that one more log would add: Fisher information matrices, added up.

For every log M = Σ over its segments of Jpᵀ W Jp − Jpᵀ W Jx (Jxᵀ W Jx)⁻¹ Jxᵀ W Jp, with the sensitivities J of the
readings in the parameters p and in the segments' initial states x, and W = 1/σ². Over logs I = Σ Sᵀ M S, where S says
which joint parameter each of a log's own is, and with which sign.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

import derive
from derive.effects import SensorMap
from derive.parameter_name import MISSING_FORCE, effect_of
from wheelpend.estimation.normal_equations import NormalEquations, covariance_of, without_states
from wheelpend.estimation.parameters import FreeParameter, ParameterLayout
from wheelpend.estimation.segments import Segments
from wheelpend.estimation.shooting import Simulator
from wheelpend.kernels.kernel_module import KernelModule

SignTies = Mapping[str, int]  # by name: sign with which a parameter of the last log follows from the log before; 0 none


class SimulatedSegments(NamedTuple):
    """Segments of a log with the point at which they are linearised."""

    simulator: Simulator
    segments: Segments
    states: np.ndarray  # (segments, NX) initial states
    parameters: np.ndarray  # (NP,)

    @property
    def module(self) -> KernelModule:
        """Its kernels."""
        return self.simulator.module

    def gram(self, names: Sequence[str]) -> np.ndarray:
        """Gram matrices (segments, n + 1, n + 1) in the initial states, the named parameters, and the residual."""
        columns = [self.module.PARAMETERS.index(n) for n in names]
        return self.simulator.shoot(self.segments, self.states, self.parameters, columns).gram


def information_of_segments(
    point: SimulatedSegments, names: Sequence[str], fault_free_sigma: Mapping[str, float] | None = None
) -> np.ndarray:
    """Information (names, names) of one log, the initial states eliminated.

    ``fault_free_sigma`` adds sensors that read a channel without the effects of the present one: channel to σ.
    """
    gram = point.gram(names)
    if fault_free_sigma:
        gram = gram + _fault_free_gram(point, names, fault_free_sigma)
    layout = ParameterLayout.of(map(FreeParameter, names), 1)
    return without_states(gram, point.module.NX, layout)[0].sum().information


def _fault_free_gram(
    point: SimulatedSegments, names: Sequence[str], fault_free_sigma: Mapping[str, float]
) -> np.ndarray:
    """The Gram matrices of sensors that no sensor effect touches."""
    module, segments = point.module, point.segments
    sigma = np.array([fault_free_sigma.get(c, np.inf) for c in segments.log.channels])
    plain = point.parameters.copy()
    for index, name in enumerate(module.PARAMETERS):
        if is_sensor_parameter(name):
            plain[index] = module.ABSENT[index]
    gram = point._replace(segments=replace(segments, sigma=sigma), parameters=plain).gram(names)
    silent = [module.NX + k for k, n in enumerate(names) if is_sensor_parameter(n)]
    gram[:, silent, :] = 0.0
    gram[:, :, silent] = 0.0
    return gram


def is_sensor_parameter(name: str) -> bool:
    """A parameter of one of the sensors' effects."""
    effect = effect_of(name)
    if effect in ("", MISSING_FORCE):
        return False
    return isinstance(derive.effects.find(effect).enters, SensorMap)


def add_information(
    pieces: Sequence[np.ndarray], parameters: Sequence[FreeParameter], ties: SignTies | None = None
) -> NormalEquations:
    """Normal equations, with a score of zero, that add up the information (parameters, parameters) of several logs.

    With ``ties`` those of the last log follow from the log before.
    """
    joint = [p for p in parameters if not p.is_per_log]
    rows = []
    for number in range(len(pieces)):
        last = ties is not None and number == len(pieces) - 1
        row = [_joint_parameter(p, number, ties if last else None) for p in parameters]
        joint += [p for p, _ in row if p not in joint]
        rows.append(row)
    total = np.zeros((len(joint), len(joint)))
    places = []
    for piece, row in zip(pieces, rows, strict=True):
        chosen, signs = [joint.index(p) for p, _ in row], np.array([s for _, s in row])
        total[np.ix_(chosen, chosen)] += piece * np.outer(signs, signs)
        places.append(np.array(chosen))
    layout = ParameterLayout(tuple(parameters), tuple(places), tuple(joint))
    return NormalEquations(layout, total, np.zeros(len(joint)), np.array(0.0))


def _joint_parameter(parameter: FreeParameter, number: int, ties: SignTies | None) -> tuple[FreeParameter, int]:
    """The joint parameter that a log's own one is, and its sign."""
    if ties is None or number == 0:
        return parameter.in_log(number), 1
    if ties[parameter.name] == 0:
        return parameter._replace(log=number), 1
    return parameter.in_log(number - 1), ties[parameter.name]


def separation(
    joint: NormalEquations,
    sizes: Sequence[Mapping[str, float]],
    first: Collection[str],
    other: Collection[str],
    base: Collection[str],
) -> float:
    """By how many standard errors a model with ``other`` in place of ``first`` would miss data that ``first`` made.

    √(δᵀ (I_ff − I_fr I_rr⁻¹ I_rf) δ), with the sizes δ of ``first`` in each log and r the parameters that are refitted,
    ``base`` and ``other``. Its square is the sum of squares that the best refit leaves above the noise.
    """
    first_indices, refitted = joint.layout.indices(first), joint.layout.indices([*base, *other])
    information = joint.project(refitted).information
    size = np.array([_value_of(joint.layout.elements[k], sizes) for k in first_indices])
    return float(np.sqrt(max(size @ information[np.ix_(first_indices, first_indices)] @ size, 0.0)))


def _value_of(parameter: FreeParameter, sizes: Sequence[Mapping[str, float]]) -> float:
    return sizes[min(parameter.log or 0, len(sizes) - 1)][parameter.name]


def standard_errors(joint: NormalEquations, names: Collection[str]) -> dict[str, float]:
    """Standard error of each parameter, the others being fitted too; infinite where these logs do not identify it.

    Of a parameter with a value in each log that of the last one.
    """
    indices = joint.layout.indices(names)
    parameters = [joint.layout.elements[k] for k in indices]
    covariance, _, flat = covariance_of(joint.information[np.ix_(indices, indices)], parameters)
    errors = {p.name: np.inf if p in flat else float(np.sqrt(covariance[k, k])) for k, p in enumerate(parameters)}
    return {n: errors[n] for n in names}
