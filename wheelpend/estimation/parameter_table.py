"""Fitted parameters with their standard errors."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from derive.parameter_name import effect_of
from wheelpend.estimation.criteria import WRONG_START_ERROR_RATIO
from wheelpend.estimation.estimate import Covariance, Estimate, LogValue
from wheelpend.estimation.fit import Fit
from wheelpend.estimation.free_parameters import free_names, per_log_names
from wheelpend.estimation.problem import EstimationProblem

MAX_ASTRAY_SIGMA_RATIO = 10.0  # standard error over the largest value of its unit above which an astray value is none
MAX_WHITE_NOISE_ERROR_RATIO = 1.05  # error over noise floor up to which the noise explains a residual


def parameter_table(problem: EstimationProblem, fitted: Fit) -> dict[str, Estimate]:
    """Estimate of every parameter of a model, by name."""
    names = free_names(problem, problem.model.effects)
    lost = {p.name for p in fitted.unidentifiable} | _runaway_names(problem, fitted, names)
    units = dict(zip(problem.module.PARAMETERS, problem.module.UNITS, strict=True))
    several = per_log_names(names) if len(problem.logs) > 1 else ()
    return {
        n: Estimate(
            value=fitted.of_log(0)[n],
            sigma=standard_error(problem, fitted, n),
            unit=units[n],
            identifiable=n not in lost,
            per_log=_values_of_logs(problem, fitted, n) if n in several else (),
        )
        for n in names
    }


def _runaway_names(problem: EstimationProblem, fitted: Fit, names: Sequence[str]) -> set[str]:
    """Parameters of the plant whose standard error is many times all values of their unit, in a fit that went astray.

    A fit that explains its log may well find one at zero, whatever its error: there the error is small in its unit.
    """
    if fitted.error <= WRONG_START_ERROR_RATIO * problem.floor:
        return set()
    units = dict(zip(problem.module.PARAMETERS, problem.module.UNITS, strict=True))
    values = fitted.of_log(0)
    table = {n: Estimate(values[n], standard_error(problem, fitted, n), units[n]) for n in names}
    return astray_names(table)


def astray_names(table: Mapping[str, Estimate]) -> set[str]:
    """Parameters of the plant whose standard error is many times all values of their unit."""
    own = {n: e for n, e in table.items() if not effect_of(n)}
    size = {e.unit: max(abs(o.value) for o in own.values() if o.unit == e.unit) for e in own.values()}
    return {n for n, e in own.items() if e.sigma > MAX_ASTRAY_SIGMA_RATIO * size[e.unit]}


def covariance_of_table(problem: EstimationProblem, fitted: Fit) -> Covariance:
    """Covariance of a fit's parameters, with the standard errors of their table."""
    error = np.array([standard_error(problem, fitted, p.name, p.log or 0) for p in fitted.free])
    ideal = np.sqrt(np.maximum(np.diag(fitted.covariance), 1e-300))
    names = tuple(p.name if p.log is None else f"{p.name} in {problem.logs[p.log].name}" for p in fitted.free)
    return Covariance(names, fitted.covariance * np.outer(error / ideal, error / ideal))


def _values_of_logs(problem: EstimationProblem, fitted: Fit, name: str) -> tuple[LogValue, ...]:
    return tuple(
        LogValue(log.name, fitted.of_log(k)[name], standard_error(problem, fitted, name, k))
        for k, log in enumerate(problem.logs)
    )


def standard_error(problem: EstimationProblem, fitted: Fit, name: str, log: int = 0) -> float:
    """Standard error from the information where the residual is white and at noise level, else the conservative one.

    The error of an encoder that repeats its counts is a function of the motion: never white, whatever it looks like.
    """
    white = not fitted.coloured and not any(n.repeats for n in problem.noise[: len(problem.logs)])
    ideal = white and fitted.error < MAX_WHITE_NOISE_ERROR_RATIO * problem.floor
    return fitted.sigma(name, log=log) if ideal else conservative_standard_error(fitted, name, log)


def conservative_standard_error(fitted: Fit, name: str, log: int = 0) -> float:
    """The larger of the standard errors from the information matrix and from the block jackknife."""
    return max(fitted.sigma(name, log=log), fitted.sigma(name, robust=True, log=log))
