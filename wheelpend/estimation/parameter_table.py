"""Fitted parameters with their standard errors."""

from __future__ import annotations

from wheelpend.estimation.fit import Fit
from wheelpend.estimation.free_parameters import free_names, per_log_names
from wheelpend.estimation.problem import EstimationProblem

MAX_WHITE_NOISE_ERROR_RATIO = 1.05  # error over noise floor up to which the noise explains a residual


def parameter_table(problem: EstimationProblem, fitted: Fit) -> dict[str, dict]:
    """Value, standard error and identifiability of every parameter; per-log ones of the first log, all in per_log.

    A value that is not identifiable means nothing, nor does its standard error.
    """
    names = free_names(problem, problem.model.effects)
    unidentifiable = {p.name for p in fitted.unidentifiable}
    table: dict[str, dict] = {
        n: {
            "value": fitted.of_log(0)[n],
            "sigma": standard_error(problem, fitted, n),
            "identifiable": n not in unidentifiable,
        }
        for n in names
    }
    for n in per_log_names(names) if len(problem.logs) > 1 else ():
        table[n]["per_log"] = [
            {"log": log.name, "value": fitted.of_log(k)[n], "sigma": standard_error(problem, fitted, n, k)}
            for k, log in enumerate(problem.logs)
        ]
    return table


def standard_error(problem: EstimationProblem, fitted: Fit, name: str, log: int = 0) -> float:
    """Standard error from the information where the residual is white and at noise level, else the conservative one."""
    ideal = fitted.error < MAX_WHITE_NOISE_ERROR_RATIO * problem.floor and not fitted.coloured
    return fitted.sigma(name, log=log) if ideal else conservative_standard_error(fitted, name, log)


def conservative_standard_error(fitted: Fit, name: str, log: int = 0) -> float:
    """The larger of the standard errors from the information matrix and from the block jackknife."""
    return max(fitted.sigma(name, log=log), fitted.sigma(name, robust=True, log=log))
