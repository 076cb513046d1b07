"""The parameter vector of a kernel module, and the layout of free parameters over one log or several."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from typing import Literal, NamedTuple

import numpy as np

from wheelpend.kernels.kernel_module import KernelModule
from wheelpend.logs.log import Log

Role = Literal["own", "size", "shape", "event time", "missing force", "column"]  # column: of a law, in no kernel
PER_LOG_SCOPES = ("per log", "event")  # of parameters with a value of their own in every log


def kernel_parameters(module: KernelModule, values: Mapping[str, float], log: Log) -> np.ndarray:
    """Parameter vector (NP,) of a kernel module: named values, the log's origin, else the values of absence.

    A constant that is not known is some number; what needs it has no influence while its own parameter is zero.
    """
    pairs = zip(module.PARAMETERS, module.ABSENT, strict=True)
    parameters = np.array([float(values.get(n, absent)) for n, absent in pairs])
    if module.ORIGIN >= 0:
        first = log.measured[np.isfinite(log.measured[:, 0]), 0]
        parameters[module.ORIGIN] = first[0] if first.size else 0.0
    return parameters


def plant_values(module: KernelModule, values: Mapping[str, float]) -> dict[str, float]:
    """Values of the plant's own parameters and of constants, without those of effects."""
    names = (*module.PARAMETERS[: module.OWN_PARAMETERS], *module.PARAMETERS[module.FITTED :])
    return {n: values[n] for n in names if n in values}


class FreeParameter(NamedTuple):
    """A parameter that is fitted: a column of a log's Jacobian, or an element of θ, where a log may have its own."""

    name: str  # in the kernels' parameter vector; of a column of a law any
    effect: str = ""  # that it belongs to; "" for the plant's own
    log: int | None = None  # whose own value it is; None for a shared one
    scope: str = "shared"  # by all logs, "per log", or of an "event" in one log
    unit: str = ""
    bounds: tuple[float, float] = (-np.inf, np.inf)  # lowest and highest value with which a simulation can be made
    absent: float = 0.0  # value without influence
    role: Role = "own"

    @property
    def is_per_log(self) -> bool:
        """True where every log has a value of its own."""
        return self.scope in PER_LOG_SCOPES

    def in_log(self, number: int) -> FreeParameter:
        """The element of θ that it is in a log."""
        return self._replace(log=number) if self.is_per_log else self


class ParameterLayout(NamedTuple):
    """Place of each free parameter in θ: shared ones stand there once, per-log ones once for every log."""

    columns: tuple[FreeParameter, ...]  # of every log's Jacobian
    places: tuple[np.ndarray, ...]  # per log: index in θ of each column
    elements: tuple[FreeParameter, ...]  # of θ

    @classmethod
    def of(cls, parameters: Iterable[FreeParameter], logs: int) -> ParameterLayout:
        """Lay out free parameters over a number of logs."""
        columns = tuple(parameters)
        elements = [p for p in columns if not p.is_per_log]
        places = []
        for log in range(logs):
            own = [p.in_log(log) for p in columns]
            elements += [p for p in dict.fromkeys(own) if p not in elements]
            places.append(np.array([elements.index(p) for p in own], dtype=np.int64))
        return cls(columns, tuple(places), tuple(elements))

    def indices(self, names: Collection[str]) -> list[int]:
        """Places in θ of the parameters of these names, in all logs."""
        return [k for k, p in enumerate(self.elements) if p.name in names]
