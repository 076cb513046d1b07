"""Fixed values and bounds of single parameters as a user gives them, checked."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from typing import Any

import numpy as np

from wheelpend.errors import Failure, did_you_mean
from wheelpend.estimation.estimate import Estimate
from wheelpend.estimation.free_parameters import bounds_of, effect_parameter
from wheelpend.estimation.restrictions import NO_RESTRICTIONS, Bounds, Restrictions
from wheelpend.kernels.kernel_module import KernelModule
from wheelpend.kernels.load import model_module
from wheelpend.model.record import Model

BOUND_ROUNDING = 1e-9  # relative distance from a bound that steps to it leave by rounding
BOUNDED_METHODS = ("filter_error", "shooting", "filtered", "energy", "inverse", "differentiation")
FITTING_METHODS = ("filter_error", "shooting")  # of these every parameter of a model is free; of the others linear ones


def given_restrictions(
    model: Model,
    method: str,
    fixed: Mapping[str, float],
    bounds: Mapping[str, tuple[float | None, float | None]],
) -> Restrictions:
    """Fixed values and bounds, by names of the model's parameters, for a method of identification.

    A bound that is None is none. Raises Failure for a name that is none of the model's, for numbers that are not
    finite, out of order or outside what a simulation allows, where nothing is left free, and where the method has no
    bounds.
    """
    if not fixed and not bounds:
        return NO_RESTRICTIONS
    module = model_module(model.plant, model.assumptions, model.effects)
    known = module.PARAMETERS[: module.FITTED]
    _check_names("fixed", fixed, known)
    _check_names("bounded", bounds, known)
    for name in fixed:
        if name in bounds:
            raise Failure(f"{name} must be fixed or bounded, but it is both. Leave one out.")
    values = {n: _fixed_value(n, v, _physical_bounds(module, model, n)) for n, v in fixed.items()}
    limits = {n: _given_bounds(n, b, _physical_bounds(module, model, n)) for n, b in bounds.items()}
    _check_method(module, method, limits)
    if not [n for n in (known if method in FITTING_METHODS else module.LINEAR) if n not in values]:
        raise Failure("At least one parameter must be free to identify something, but all are fixed. Free one; "
                      "`wheelpend compare` says how well these values predict.")  # fmt: skip
    return Restrictions(values, limits)


def _check_names(what: str, names: Collection[str], known: Sequence[str]) -> None:
    for name in names:
        if name not in known:
            raise Failure(f"No parameter named '{name}' can be {what}. The model has: {', '.join(known)}."
                          f"{did_you_mean(str(name), known)}")  # fmt: skip


def _physical_bounds(module: KernelModule, model: Model, name: str) -> Bounds:
    return bounds_of(name, effect_parameter(name, model.plant_signature), module.SIGNED)


def _fixed_value(name: str, given: Any, physical: Bounds) -> float:
    value = _number(given)
    if not np.isfinite(value):
        raise Failure(f"{name} must be fixed at a finite number, not {given!r}.")
    if not physical[0] <= value <= physical[1]:
        raise Failure(f"{name} must be {_range_text(physical)}, but it is fixed at {value:g}.")
    return value


def _given_bounds(name: str, given: Any, physical: Bounds) -> Bounds:
    """A lower and an upper bound; raises Failure unless some value of the parameter is between them."""
    try:
        low, high = given
    except (TypeError, ValueError):
        raise Failure(
            f"Bounds of {name} must be a lower and an upper one, such as (0.0, None), not {given!r}."
        ) from None
    low, high = -np.inf if low is None else _number(low), np.inf if high is None else _number(high)
    if np.isnan([low, high]).any() or low == np.inf or high == -np.inf:
        raise Failure(f"Bounds of {name} must be numbers, or None for none, not {given!r}.")
    if not low < high:
        raise Failure(f"The lower bound of {name} must be below the upper one, but they are {low:g} and {high:g}. "
                      "A parameter that is known is fixed instead.")  # fmt: skip
    if low >= physical[1] or high <= physical[0]:
        raise Failure(f"{name} must be {_range_text(physical)}, which leaves nothing between {low:g} and {high:g}.")
    return low, high


def _number(value: Any) -> float:
    try:
        return float(value)
    except (TypeError, ValueError, OverflowError):
        return float("nan")


def _range_text(bounds: Bounds) -> str:
    low, high = bounds
    if np.isfinite(bounds).all():
        return f"from {low:g} to {high:g}"
    return f"at least {low:g}" if np.isfinite(low) else f"at most {high:g}"


def _check_method(module: KernelModule, method: str, limits: Mapping[str, Bounds]) -> None:
    """Raise Failure where a method knows no bounds, or not those of a parameter that enters nonlinearly."""
    if limits and method not in BOUNDED_METHODS:
        raise Failure(f"The method '{method}' knows no bounds. Those that do: {', '.join(BOUNDED_METHODS)}.")
    for name in limits:
        if name not in module.LINEAR and method not in FITTING_METHODS:
            raise Failure(f"{name} enters nonlinearly, and the method '{method}' takes it as it stands in the model. "
                          f"Bound it with {' or '.join(FITTING_METHODS)}, or fix it.")  # fmt: skip


def check_restricted_regression(restrictions: Restrictions, auto: bool) -> None:
    """Raise Failure where time constants are to be chosen with fixed values or bounds."""
    if auto and restrictions != NO_RESTRICTIONS:
        raise Failure("Time constants are chosen by rehearsals in which every parameter is free, but some are fixed or "
                      "bounded. Give --tau T1,T2 in s.")  # fmt: skip


def with_fixed_rows(
    table: Mapping[str, Estimate], restrictions: Restrictions, module: KernelModule
) -> dict[str, Estimate]:
    """The estimates in the order of the model's parameters, with those that are fixed among them."""
    units = dict(zip(module.PARAMETERS, module.UNITS, strict=True))
    rows = {n: Estimate(v, 0.0, units[n]) for n, v in restrictions.fixed.items()}
    return {n: (rows | dict(table))[n] for n in module.PARAMETERS if n in table or n in rows}


def estimates_at_bounds(names: Sequence[str], values: np.ndarray, restrictions: Restrictions) -> dict[str, float]:
    """The bound that was given, by name, of each parameter whose value (n,) is at it."""
    rows = [(n, b, v) for n, v in zip(names, map(float, values), strict=True) for b in restrictions.bounds.get(n, ())]
    return {n: b for n, b, v in rows if np.isfinite(b) and abs(v - b) <= BOUND_ROUNDING * abs(b)}


def given_bound_warnings(at_bounds: Mapping[str, float], restrictions: Restrictions) -> tuple[str, ...]:
    """A warning for each estimate at a bound that was given."""
    return tuple(
        f"{n} ended at its bound of {v:g}: the log asks for a "
        f"{'smaller' if v == restrictions.bounds[n][0] else 'larger'} value. Its standard error says nothing, and "
        "those of the others hold only if the bound does."
        for n, v in at_bounds.items()
    )
