"""Fitted parameters with their standard errors."""

from __future__ import annotations

from wheelpend.estimation.fit import Fit
from wheelpend.estimation.free_parameters import free_names, per_log_names
from wheelpend.estimation.problem import Study


def parameter_table(study: Study, fitted: Fit) -> dict[str, dict]:
    """Every fitted parameter with its standard error; of several logs' own ones the first log's, and all in per_log.

    A value that is not identifiable means nothing, nor does its standard error.
    """
    names, lost = free_names(study, study.model.effects), {n.split("@")[0] for n in fitted.unidentifiable}
    table: dict[str, dict] = {
        n: {"value": fitted.of_log(0)[n], "sigma": standard_error(study, fitted, n), "identifiable": n not in lost}
        for n in names
    }
    for n in per_log_names(names) if len(study.logs) > 1 else ():
        table[n]["per_log"] = [
            {"log": log.name, "value": fitted.of_log(k)[n], "sigma": standard_error(study, fitted, n, k)}
            for k, log in enumerate(study.logs)
        ]
    return table


def standard_error(study: Study, fitted: Fit, name: str, log: int = 0) -> float:
    """From the information matrix where the residual is white and at noise level, else the more cautious of two."""
    ideal = fitted.error < 1.05 * study.floor and not fitted.coloured
    return fitted.sigma(name, log=log) if ideal else honest_sigma(fitted, name, log)


def honest_sigma(fitted: Fit, name: str, log: int = 0) -> float:
    """The larger of the standard errors that the information matrix and the scatter of blocks give."""
    return max(fitted.sigma(name, log=log), fitted.sigma(name, robust=True, log=log))
