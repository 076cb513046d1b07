"""Estimates: a parameter's value, standard error and unit; those of all parameters of an effect; covariances."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

if TYPE_CHECKING:
    import polars as pl


class LogValue(NamedTuple):
    """A parameter that each log has for itself, in one of them."""

    log: str
    value: float
    sigma: float

    def to_json(self) -> dict[str, Any]:
        """The value under the keys of JSON."""
        return {"log": self.log, "value": self.value, "sigma": self.sigma}


def is_known_to_its_size(value: float, sigma: float) -> bool:
    """True of a value whose standard error is smaller than itself; else the logs tell not even its size."""
    return sigma < abs(value)


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

    def to_frame(self) -> pl.DataFrame:
        """The covariance as a Polars DataFrame: a row and a column per name, in products of the units."""
        import polars as pl  # imported late: it is slow to load

        columns = dict(zip(self.names, self.matrix.T, strict=True))
        return pl.DataFrame({"parameter": self.names, **columns})


ESTIMATE_COLUMNS = {"effect": str, "parameter": str, "value": float, "sigma": float, "unit": str}  # of rows of these


@dataclass(frozen=True)
class EffectEstimate:
    """The parameters of an effect as estimated from logs."""

    effect: str
    estimates: dict[str, Estimate]  # by the parameter's name within the effect

    def rows(self) -> list[tuple[str, str, float, float, str]]:
        """A row of ESTIMATE_COLUMNS per parameter."""
        return [(self.effect, name, e.value, e.sigma, e.unit) for name, e in self.estimates.items()]

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
