"""Warnings about a fit: a bound that holds it, an inertia that cannot be, chance as large as the drive.

And a parameter that is positive by what it means, and that the logs do not determine.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace

import numpy as np

import derive
from derive.effects import SensorDelay, SensorMap
from derive.parameter_name import MISSING_FORCE, effect_of
from derive.plant_signature import PlantSignature
from wheelpend.errors import Failure
from wheelpend.estimation.estimate import Estimate
from wheelpend.estimation.free_parameters import effect_parameter
from wheelpend.estimation.parameter_table import astray_names
from wheelpend.estimation.parameters import FreeParameter, kernel_parameters
from wheelpend.estimation.problem import EstimationProblem
from wheelpend.identification.remainder import Remainder
from wheelpend.kernels.kernel_module import KernelModule

LARGE_FORCE_SHARE = 0.5  # of the modelled forces on a row: from there on chance has more weight than they
ABOUT_AS_LARGE = 0.8  # of the same
HIDING_FORCE_SHARE = 0.02  # of the same: from there on what it stands for may hide a parameter
LARGE_ERROR_SHARE = 0.5  # of a channel's standard deviation: from there on its error is what it reads
LARGE_UNPREDICTED_SHARE = 0.25  # of the motion's mean square over the horizon, half of its size: the model misses it
MAX_INERTIA_RATIO = 2.0  # of two estimates of an inertia, beyond which one of them is wrong
MAX_KNOWN_SIGMA_SHARE = 0.5  # of its value, standard error up to which a parameter is known: 95 % end before zero
MIN_DISAGREEMENT_SIGMAS = 2.0  # standard errors of both together, within which two estimates agree
BOUND_TOLERANCE_SIGMAS = 1e-6  # standard errors: by chance no estimate comes so near to a bound


def is_mostly_chance(left: Remainder | None) -> bool:
    """True where chance pushes with half the weight of all that is modelled, or more, and the model predicts little.

    A force that changes from sample to sample may be large and move next to nothing. Or where what the model does not
    predict is taken for errors of sensors half as large as what they read.
    """
    if left is None or (left.unpredicted is not None and left.unpredicted < LARGE_UNPREDICTED_SHARE):
        return False
    return left.share >= LARGE_FORCE_SHARE or bool(_erring_sensors(left))


def _erring_sensors(left: Remainder) -> list[str]:
    """Channels that are said to err by half of all that they read, where it is known that the model predicts little."""
    known = left.unpredicted is not None
    return [channel for channel, error in left.sensors.items() if known and error.share_of_signal >= LARGE_ERROR_SHARE]


def remainder_warnings(left: Remainder | None, plant: PlantSignature) -> tuple[str, ...]:
    """A warning where chance pushes half as hard as all that is modelled, or harder; of the input where there is one.

    Or where sensors are said to err by what the model misses.
    """
    if left is None or not is_mostly_chance(left):
        return ()
    if left.share < LARGE_FORCE_SHARE:
        return (f"The model misses half of the motion or more, and that is taken for errors of "
                f"{' and '.join(_erring_sensors(left))}. Values mean little yet. Check units, signs and clock with "
                "`wheelpend inspect LOG`, and whether the machine is one that the plant describes.",)  # fmt: skip
    of_input = ", and log the mean of the input from row to row where the controller is faster than the log"
    further = of_input if plant.driven_ports else ""
    size = "as large as" if left.share >= ABOUT_AS_LARGE else "more than half as large as"
    return (f"More than half of the motion's forces are unmodelled: a random force {size} {plant.drive_words} is "
            f"left. Values mean little yet. Check units, signs and clock with `wheelpend inspect LOG`{further}; "
            "what is missing `wheelpend diagnose LOG` says.",)  # fmt: skip


def say_that_something_is_missing(warnings: Sequence[str]) -> bool:
    """True where one of a fit's warnings sends its reader to a diagnosis."""
    return any("`wheelpend diagnose" in warning for warning in warnings)


def bound_warnings(
    parameters: Sequence[FreeParameter], theta: np.ndarray, covariance: np.ndarray, given: Mapping[str, float]
) -> tuple[str, ...]:
    """A warning for each parameter θ (free,) that stopped at a bound, other than one that was given by its name."""
    found = []
    for parameter, value, variance in zip(parameters, theta, np.diag(covariance), strict=True):
        near = BOUND_TOLERANCE_SIGMAS * np.sqrt(max(float(np.nan_to_num(variance, posinf=0.0)), 0.0))
        for bound, beyond in zip(parameter.bounds, ("below", "above"), strict=True):
            if np.isfinite(bound) and bound != given.get(parameter.name) and abs(value - bound) <= near:
                found.append(_bound_sentence(parameter, bound, beyond))
    return tuple(dict.fromkeys(found))


def _bound_sentence(parameter: FreeParameter, bound: float, beyond: str) -> str:
    unit = "" if parameter.unit == "1" else f" {parameter.unit}"
    first = f"{parameter.name} stopped at its bound of {bound:g}{unit}, {beyond} which "
    if parameter.effect and bound == parameter.absent:
        return first + f"it would be no {parameter.effect}: the log does not ask for this effect, or asks for another."
    if effect_of(parameter.name):
        return first + "it cannot be simulated: the log asks for another law, or tells too little about this one."
    return first + ("no machine has it: something is missing in the model, or the log does not excite it. "
                    "Its standard error says nothing. Run `wheelpend diagnose`.")  # fmt: skip


def undetermined_warnings(
    module: KernelModule,
    plant: PlantSignature,
    table: Mapping[str, Estimate],
    told: Collection[str] = (),
    left: Remainder | None = None,
) -> tuple[str, ...]:
    """A warning of the positive parameters whose 95 % interval reaches to zero, but for those already told.

    Where logs determine nothing of the machine they judge no model at all, unless much is ``left`` to chance: it may be
    what is missing that hides the parameters.
    """
    found = {
        n: e
        for n, e in table.items()
        if e.identifiable and n not in told and _is_positive(n, module, plant)
        and e.value != 0.0 and _is_unknown(e)
    }  # fmt: skip
    zero = [n for n in found if (row := effect_parameter(n, plant)) and row.absent == 0.0]
    own = [n for n in found if n not in zero]
    cure = (
        "`wheelpend design` writes the command for a log that does." if plant.is_balanced else "Record larger motion."
    )
    judges = not determine_nothing(table, plant) or any(effect_parameter(n, plant) is None for n in told)
    nothing = "" if judges else " They judge no model: what they are said to miss, or not, means nothing."
    share = left.share if left else 0.0
    if share >= HIDING_FORCE_SHARE:
        by = f"a random force of {100 * share:.2g} % of {plant.drive_words}"
        hidden = (
            f"Or a missing effect hides {_them(own)}, which {by} stands for: `wheelpend diagnose LOG` looks for it."
        )
        nothing, cure = f" {cure}", hidden
    said = (f"{_values_text(own, found)}: these logs do not determine {_them(own)}.{nothing} {cure}",) if own else ()
    return said + tuple(
        f"{_values_text([n], found)}: these logs do not tell it from zero. Whether the model does without "
        f"{effect_of(n)}, `wheelpend remove {effect_of(n)} LOG` says."
        for n in zero
    )


def determine_nothing(table: Mapping[str, Estimate], plant: PlantSignature) -> bool:
    """True where logs determine no parameter of the plant, some being free, and of no effect but a sensor's."""
    acting = {n: e for n, e in table.items() if not _is_of_sensor(n) and (e.value or not e.identifiable)}
    known = any(e.identifiable and not _is_unknown(e) for e in acting.values())
    return not known and any(effect_parameter(n, plant) is None for n in acting)


def _is_of_sensor(name: str) -> bool:
    effect = effect_of(name)
    return effect not in ("", MISSING_FORCE) and isinstance(derive.effects.find(effect).enters, SensorMap | SensorDelay)


def _is_unknown(estimate: Estimate) -> bool:
    return estimate.sigma > MAX_KNOWN_SIGMA_SHARE * abs(estimate.value)


def _values_text(names: Sequence[str], table: Mapping[str, Estimate]) -> str:
    rows = [(n, table[n], "" if table[n].unit == "1" else f" {table[n].unit}") for n in names]
    return ", ".join(f"{n} = {e.value:.3g} ± {e.sigma:.2g}{unit}" for n, e, unit in rows)


def _them(names: Sequence[str]) -> str:
    return "it" if len(names) == 1 else "them"


def _is_positive(name: str, module: KernelModule, plant: PlantSignature) -> bool:
    """True of a parameter that is positive by what it means: a mass, a friction, a delay, but no slope or bias."""
    row = effect_parameter(name, plant)
    return name not in module.SIGNED if row is None else row.minimum >= 0.0


def with_astray_marked(table: Mapping[str, Estimate]) -> dict[str, Estimate]:
    """The table with those parameters not identifiable whose standard error is many times all values of their unit."""
    lost = astray_names(table)
    return {n: replace(e, identifiable=False) if n in lost else e for n, e in table.items()}


def inertia_warnings(
    problem: EstimationProblem, table: Mapping[str, Estimate], left: Remainder | None
) -> tuple[str, ...]:
    """A warning for each inertia that inverse dynamics finds very different, where a model leaves a random force."""
    if not (left and left.force):
        return ()
    found = []
    for name, other, sigma in _inertias_by_inverse_dynamics(problem, table):
        own = table[name]
        apart = abs(own.value - other) > MIN_DISAGREEMENT_SIGMAS * np.hypot(own.sigma, sigma)
        within = other / MAX_INERTIA_RATIO <= own.value <= other * MAX_INERTIA_RATIO
        if own.identifiable and apart and not within and name not in problem.restrictions.fixed:
            found.append(
                f"{name} is an inertia and came out as {own.value:.4g}, but inverse dynamics on {problem.logs[0].name} "
                f"finds {other:.4g} ± {sigma:.2g} {own.unit}: one of them is wrong. What is missing in the model bends "
                "either; run `wheelpend diagnose`, and believe no inertia before nothing is missing."
            )
    return tuple(found)


def _inertias_by_inverse_dynamics(
    problem: EstimationProblem, table: Mapping[str, Estimate]
) -> list[tuple[str, float, float]]:
    """Name, value and standard error of the inertias that inverse dynamics knows; none where it cannot be made."""
    from wheelpend.identification.inverse_dynamics import accelerated_columns, inverse_dynamics  # it needs scipy.signal

    module, log = problem.module, problem.logs[0]
    parameters = kernel_parameters(module, {n: e.value for n, e in table.items()} | problem.model.constants, log)
    try:
        fitted = inverse_dynamics(module, log, parameters).fit
        inertias = {n for n, a in zip(module.LINEAR, accelerated_columns(module, parameters), strict=True) if a}
    except (Failure, ValueError, ZeroDivisionError, np.linalg.LinAlgError):
        return []
    lost = {*fitted.unidentifiable, *fitted.undefined}
    rows = zip(fitted.names, map(float, fitted.estimate), map(float, fitted.sigma), strict=True)
    known = [r for r in rows if r[0] in inertias and r[0] in table and r[0] not in lost]
    return [(n, v, s) for n, v, s in known if v > 0.0 and s <= MAX_KNOWN_SIGMA_SHARE * v]
