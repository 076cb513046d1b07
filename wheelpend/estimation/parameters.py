"""The parameter vector of a kernel module, and where free parameters stand in it for one log and for several."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from types import ModuleType
from typing import NamedTuple

import numpy as np

from wheelpend.logs.log import Log


def kernel_parameters(module: ModuleType, values: Mapping[str, float], log: Log) -> np.ndarray:
    """The parameter vector of a module: named values, the log's origin, and where none is given that of absence.

    A constant that is not known is 1; what needs it has no influence while its own parameter is zero.
    """
    pairs = zip(module.PARAMETERS, module.ABSENT, strict=True)
    parameters = np.array([float(values.get(n, absent)) for n, absent in pairs])
    if module.ORIGIN >= 0:
        first = log.measured[np.isfinite(log.measured[:, 0]), 0]
        parameters[module.ORIGIN] = first[0] if first.size else 0.0
    return parameters


class ParameterLayout(NamedTuple):
    """Where each free parameter stands: shared ones once, per-log ones once for every part."""

    names: tuple[str, ...]  # of the columns of every part
    places: tuple[np.ndarray, ...]  # per part: index of each column among all free parameters
    labels: tuple[str, ...]  # of all free parameters


def parameter_layout(free: Sequence[str], per_log: Sequence[str], parts: int) -> ParameterLayout:
    """Lay out free parameters over parts."""
    labels: list[str] = [n for n in free if n not in per_log]
    places = []
    for part in range(parts):
        row = []
        for name in free:
            label = f"{name}@{part}" if name in per_log else name
            if label not in labels:
                labels.append(label)
            row.append(labels.index(label))
        places.append(np.array(row, dtype=np.int64))
    return ParameterLayout(tuple(free), tuple(places), tuple(labels))


def _limits_of(plan: ParameterLayout, limits: Mapping[str, tuple[float, float]]) -> tuple[np.ndarray, np.ndarray]:
    pairs = [limits.get(label.split("@")[0], (-np.inf, np.inf)) for label in plan.labels]
    return np.array([p[0] for p in pairs]), np.array([p[1] for p in pairs])


def _start_value(label: str, start: Mapping[str, float], start_per_log: Sequence[Mapping[str, float]]) -> float:
    name, _, number = label.partition("@")
    if number and int(number) < len(start_per_log) and name in start_per_log[int(number)]:
        return float(start_per_log[int(number)][name])
    return float(start[name])


def _shared_values(plan: ParameterLayout, theta: np.ndarray) -> dict[str, float]:
    return {label: float(v) for label, v in zip(plan.labels, theta, strict=True) if "@" not in label}


def _per_log_values(
    plan: ParameterLayout, theta: np.ndarray, part: int, start_per_log: Sequence[Mapping[str, float]]
) -> dict[str, float]:
    own = dict(start_per_log[part]) if part < len(start_per_log) else {}
    for label, v in zip(plan.labels, theta, strict=True):
        name, _, number = label.partition("@")
        if number and int(number) == part:
            own[name] = float(v)
    return own


def _values_of_part(start, plan: ParameterLayout, theta: np.ndarray, part: int, start_per_log) -> dict[str, float]:
    return {**start, **_shared_values(plan, theta), **_per_log_values(plan, theta, part, start_per_log)}
