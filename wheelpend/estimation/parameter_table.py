"""Fitted parameters with their standard errors."""

from __future__ import annotations

from wheelpend.estimation.estimate import Estimate, LogValue
from wheelpend.estimation.fit import Fit
from wheelpend.estimation.free_parameters import free_names, per_log_names
from wheelpend.estimation.problem import EstimationProblem

MAX_WHITE_NOISE_ERROR_RATIO = 1.05  # error over noise floor up to which the noise explains a residual


def parameter_table(problem: EstimationProblem, fitted: Fit) -> dict[str, Estimate]:
    """Estimate of every parameter of a model, by name."""
    names = free_names(problem, problem.model.effects)
    lost = {p.name for p in fitted.unidentifiable}
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
