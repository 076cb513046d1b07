"""The vector θ of a fit to several logs: its start, bounds and ties, and the parameter values it stands for."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from wheelpend.estimation.normal_equations import NormalEquations, bounded_step
from wheelpend.estimation.parameters import FreeParameter, ParameterLayout
from wheelpend.estimation.tied_amplitudes import TiedAmplitudes


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
        layout: ParameterLayout,
        shared: Mapping[str, float],
        per_log: Sequence[Mapping[str, float]],
    ) -> ParameterSpace:
        """Lay the given values out; a free parameter without one starts at its value of absence."""
        absent = {p.name: p.absent for p in layout.columns}
        bounds = np.array([p.bounds[0] for p in layout.elements]), np.array([p.bounds[1] for p in layout.elements])
        return cls(layout, {**absent, **shared}, per_log, bounds)

    def with_tied_amplitudes(self, pairs: Sequence[tuple[str, str]], amplitude_known: bool = False) -> ParameterSpace:
        """The space in which each pair of sine and cosine has one amplitude for all logs, and a phase for each."""
        return replace(self, tied=TiedAmplitudes.of(self.layout.elements, pairs, amplitude_known)) if pairs else self

    def start(self) -> np.ndarray:
        """The first θ (free,), within the bounds and with equal amplitudes where these are tied."""
        theta = np.array([self._start_value(p) for p in self.layout.elements])
        theta = np.clip(theta, self.bounds[0], self.bounds[1])
        return self.tied.with_equal_amplitudes(theta) if self.tied else theta

    def _start_value(self, parameter: FreeParameter) -> float:
        name, log = parameter.name, parameter.log
        given = self.per_log[log] if log is not None and log < len(self.per_log) else {}
        return float(given[name] if name in given else self.shared[name])

    def shared_values(self, theta: np.ndarray) -> dict[str, float]:
        """Values of the free parameters that all logs share."""
        return {p.name: float(v) for p, v in zip(self.layout.elements, theta, strict=True) if p.log is None}

    def per_log_values(self, theta: np.ndarray, log: int) -> dict[str, float]:
        """Values of a log's own parameters, given or free."""
        own = dict(self.per_log[log]) if log < len(self.per_log) else {}
        own |= {p.name: float(v) for p, v in zip(self.layout.elements, theta, strict=True) if p.log == log}
        return own

    def values_of_log(self, theta: np.ndarray, log: int) -> dict[str, float]:
        """All parameter values of a log."""
        return {**self.shared, **self.shared_values(theta), **self.per_log_values(theta, log)}

    def after_step(self, theta: np.ndarray, equations: NormalEquations, damping: float) -> np.ndarray:
        """θ after a damped Gauss-Newton step within the bounds; tied amplitudes stay equal."""
        information, score = equations.information, equations.score
        if self.tied is None:
            lowest, highest = self.bounds
            return theta + bounded_step(information, score, damping, lowest - theta, highest - theta)
        along = self.tied.basis(theta)
        step_bounds = self.tied.bounds(self.bounds, theta)
        step = bounded_step(along.T @ information @ along, along.T @ score, damping, *step_bounds)
        return self.tied.after_step(theta, step)

    def directions(self, theta: np.ndarray) -> tuple[np.ndarray, tuple[FreeParameter, ...]]:
        """Directions (free, coordinates) in which θ may move, and the parameter that each stands for."""
        if self.tied is None:
            return np.eye(len(theta)), self.layout.elements
        return self.tied.basis(theta), self.tied.parameters(self.layout.elements)
