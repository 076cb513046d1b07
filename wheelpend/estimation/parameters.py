"""The parameter vector of a kernel module, and the layout of free parameters over one log or several."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from wheelpend.kernels.kernel_module import KernelModule
from wheelpend.logs.log import Log


def kernel_parameters(module: KernelModule, values: Mapping[str, float], log: Log) -> np.ndarray:
    """Parameter vector (NP,) of a kernel module: named values, the log's origin, else the values of absence.

    A constant that is not known is 1; what needs it has no influence while its own parameter is zero.
    """
    pairs = zip(module.PARAMETERS, module.ABSENT, strict=True)
    parameters = np.array([float(values.get(n, absent)) for n, absent in pairs])
    if module.ORIGIN >= 0:
        first = log.measured[np.isfinite(log.measured[:, 0]), 0]
        parameters[module.ORIGIN] = first[0] if first.size else 0.0
    return parameters


class ParameterLayout(NamedTuple):
    """Place of each free parameter in θ: shared ones stand there once, per-log ones once for every log."""

    names: tuple[str, ...]  # of the columns of every log's Jacobian
    places: tuple[np.ndarray, ...]  # per log: index in θ of each column
    labels: tuple[str, ...]  # of the elements of θ; name@log for per-log ones


def parameter_layout(free: Sequence[str], per_log: Sequence[str], logs: int) -> ParameterLayout:
    """Lay out free parameters over a number of logs; those in ``per_log`` get an element of θ for every log."""
    labels: list[str] = [n for n in free if n not in per_log]
    places = []
    for log in range(logs):
        row = []
        for name in free:
            label = f"{name}@{log}" if name in per_log else name
            if label not in labels:
                labels.append(label)
            row.append(labels.index(label))
        places.append(np.array(row, dtype=np.int64))
    return ParameterLayout(tuple(free), tuple(places), tuple(labels))
