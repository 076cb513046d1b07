"""Estimates: a parameter's value, standard error and unit; those of all parameters of an effect; covariances."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np


class LogValue(NamedTuple):
    """A parameter that each log has for itself, in one of them."""

    log: str
    value: float
    sigma: float

    def to_json(self) -> dict[str, Any]:
        """The value under the keys of JSON."""
        return {"log": self.log, "value": self.value, "sigma": self.sigma}


@dataclass(frozen=True)
class Estimate:
    """A parameter as estimated from logs. A value that is not identifiable means nothing, nor does its error."""

    value: float  # of a parameter that each log has for itself the first log's
    sigma: float  # standard error
    unit: str
    identifiable: bool = True
    per_log: tuple[LogValue, ...] = ()  # of several logs, where each has its own

    def __getitem__(self, key: str) -> Any:
        """A field by its name, as in JSON: ``estimate["value"]``."""
        return getattr(self, key)

    def to_json(self) -> dict[str, Any]:
        """The estimate as a table, without its unit; values of single logs only where there are some."""
        table = {"value": self.value, "sigma": self.sigma, "identifiable": self.identifiable}
        return {**table, "per_log": self.per_log} if self.per_log else table


@dataclass(frozen=True)
class Covariance:
    """Covariance of estimates."""

    names: tuple[str, ...]  # of its rows; of a parameter that each log has for itself with the log
    matrix: np.ndarray

    def to_json(self) -> dict[str, Any]:
        """The covariance under the keys of JSON."""
        return {"names": self.names, "matrix": self.matrix}


@dataclass(frozen=True)
class EffectEstimate:
    """The parameters of an effect as estimated from logs."""

    effect: str
    estimates: dict[str, Estimate]  # by the parameter's name within the effect

    @property
    def coefficients(self) -> dict[str, float]:
        """Values by parameter; of one that each log has for itself the first log's."""
        return {name: found.value for name, found in self.estimates.items()}

    @property
    def sigma(self) -> dict[str, float]:
        """Standard errors by parameter."""
        return {name: found.sigma for name, found in self.estimates.items()}

    @property
    def unit(self) -> dict[str, str]:
        """Units by parameter."""
        return {name: found.unit for name, found in self.estimates.items()}
