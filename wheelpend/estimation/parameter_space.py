"""The vector θ of a fit to several logs: its start, bounds and ties, and the parameter values it stands for."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from wheelpend.estimation.normal_equations import ReducedNormalEquations, bounded_step
from wheelpend.estimation.parameters import ParameterLayout
from wheelpend.estimation.tied_amplitudes import TiedAmplitudes
from wheelpend.kernels.kernel_module import KernelModule


@dataclass(frozen=True)
class ParameterSpace:
    """The free parameters θ (free,) of a fit, and the given values of all others."""

    layout: ParameterLayout
    shared: Mapping[str, float]  # given values of all logs; the start of shared free parameters
    per_log: Sequence[Mapping[str, float]]  # given values of single logs; the start of their free parameters
    bounds: tuple[np.ndarray, np.ndarray]  # lowest and highest θ, (free,) each
    tied: TiedAmplitudes | None = None

    @classmethod
    def of(
        cls,
        module: KernelModule,
        layout: ParameterLayout,
        shared: Mapping[str, float],
        per_log: Sequence[Mapping[str, float]],
        limits: Mapping[str, tuple[float, float]],
    ) -> ParameterSpace:
        """Lay the given values out; a free parameter without one starts at its value of absence."""
        absent = {n: module.ABSENT[module.PARAMETERS.index(n)] for n in layout.names}
        pairs = [limits.get(label.split("@")[0], (-np.inf, np.inf)) for label in layout.labels]
        bounds = np.array([p[0] for p in pairs]), np.array([p[1] for p in pairs])
        return cls(layout, {**absent, **shared}, per_log, bounds)

    def with_tied_amplitudes(self, pairs: Sequence[tuple[str, str]], amplitude_known: bool = False) -> ParameterSpace:
        """The space in which each pair of sine and cosine has one amplitude for all logs, and a phase for each."""
        return replace(self, tied=TiedAmplitudes.of(self.layout.labels, pairs, amplitude_known)) if pairs else self

    def start(self) -> np.ndarray:
        """The first θ (free,), within the bounds and with equal amplitudes where these are tied."""
        theta = np.array([self._start_value(label) for label in self.layout.labels])
        theta = np.clip(theta, self.bounds[0], self.bounds[1])
        return self.tied.with_equal_amplitudes(theta) if self.tied else theta

    def _start_value(self, label: str) -> float:
        name, _, log = label.partition("@")
        given = self.per_log[int(log)] if log and int(log) < len(self.per_log) else {}
        return float(given[name] if name in given else self.shared[name])

    def shared_values(self, theta: np.ndarray) -> dict[str, float]:
        """Values of the free parameters that all logs share."""
        return {label: float(v) for label, v in zip(self.layout.labels, theta, strict=True) if "@" not in label}

    def per_log_values(self, theta: np.ndarray, log: int) -> dict[str, float]:
        """Values of a log's own parameters, given or free."""
        own = dict(self.per_log[log]) if log < len(self.per_log) else {}
        for label, v in zip(self.layout.labels, theta, strict=True):
            name, _, number = label.partition("@")
            if number and int(number) == log:
                own[name] = float(v)
        return own

    def values_of_log(self, theta: np.ndarray, log: int) -> dict[str, float]:
        """All parameter values of a log."""
        return {**self.shared, **self.shared_values(theta), **self.per_log_values(theta, log)}

    def after_step(self, theta: np.ndarray, reduced: ReducedNormalEquations, damping: float) -> np.ndarray:
        """θ after a damped Gauss-Newton step within the bounds; tied amplitudes stay equal."""
        information, score = reduced.information, reduced.score
        if self.tied is None:
            lowest, highest = self.bounds
            return theta + bounded_step(information, score, damping, lowest - theta, highest - theta)
        along = self.tied.basis(theta)
        step_bounds = self.tied.bounds(self.bounds, theta)
        step = bounded_step(along.T @ information @ along, along.T @ score, damping, *step_bounds)
        return self.tied.after_step(theta, step)

    def directions(self, theta: np.ndarray) -> tuple[np.ndarray, Sequence[str]]:
        """Directions (free, coordinates) in which θ may move, and a label for each."""
        if self.tied is None:
            return np.eye(len(theta)), self.layout.labels
        return self.tied.basis(theta), self.tied.labels(self.layout.labels)
