"""Ripples of several logs: one amplitude, which is the machine's, and a phase in every log, which is its origin's.

A pair of sine and cosine (a, b) has the amplitude √(a² + b²). A fit moves along the directions that keep the amplitudes
of all logs equal, and rotates and scales the pairs exactly, so that every point it reaches has equal amplitudes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from wheelpend.estimation.parameters import FreeParameter

MAX_PHASE_STEP_RAD = 1.0  # rad, largest change of a phase in one step


@dataclass(frozen=True)
class TiedAmplitudes:
    """Tied pairs among the free parameters. Coordinates: the parameters not tied, then amplitude and phases by pair."""

    pairs: tuple[np.ndarray, ...]  # per effect: (logs, 2) places of sine and cosine
    size: int  # number of free parameters
    fixed: bool  # True where the amplitude is known, so that only the phases move

    @classmethod
    def of(
        cls, elements: Sequence[FreeParameter], pairs: Sequence[tuple[str, str]], fixed: bool = False
    ) -> TiedAmplitudes:
        """Tie the pairs of names among the elements of θ."""
        place = {(p.name, p.log): k for k, p in enumerate(elements)}
        logs = {n: sum(p.name == n for p in elements) for n, _ in pairs}
        places = [[[place[n, k] for n in pair] for k in range(logs[pair[0]])] for pair in pairs]
        return cls(tuple(np.array(p, dtype=np.int64) for p in places), len(elements), fixed)

    @property
    def others(self) -> np.ndarray:
        """Places of the parameters that are not tied."""
        tied = np.concatenate([p.ravel() for p in self.pairs])
        return np.setdiff1d(np.arange(self.size), tied)

    def basis(self, theta: np.ndarray) -> np.ndarray:
        """Directions (free, coordinates) of all free parameters that keep the amplitudes equal."""
        columns = list(np.eye(self.size)[self.others])
        for places in self.pairs:
            radial, across = _polar_unit_vectors(theta[places])
            stretch = np.zeros(self.size)
            stretch[places] = radial
            columns += [] if self.fixed else [stretch]
            for log, place in enumerate(places):
                rotation = np.zeros(self.size)
                rotation[place] = across[log]
                columns.append(rotation)
        return np.column_stack(columns)

    def after_step(self, theta: np.ndarray, step: np.ndarray) -> np.ndarray:
        """Parameters after a step (coordinates,) along the basis at theta."""
        new, k = theta.copy(), len(self.others)
        new[self.others] += step[:k]
        for places in self.pairs:
            amplitude, phase = _amplitude(theta[places]), _phase(theta[places])
            scaled = amplitude if self.fixed else amplitude + step[k]
            k += not self.fixed
            rotation = step[k : k + len(places)] / max(amplitude, 1e-300)
            k += len(places)
            phase = phase + np.clip(rotation, -MAX_PHASE_STEP_RAD, MAX_PHASE_STEP_RAD)
            new[places] = scaled * np.column_stack([np.cos(phase), np.sin(phase)])
        return new

    def with_equal_amplitudes(self, theta: np.ndarray) -> np.ndarray:
        """The parameters with all amplitudes made equal."""
        return self.after_step(theta, np.zeros(len(self.others) + sum(len(p) + (not self.fixed) for p in self.pairs)))

    def bounds(self, limits: tuple[np.ndarray, np.ndarray], theta: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Bounds of a step along the basis, from those of the free parameters."""
        more = self.basis(theta).shape[1] - len(self.others)
        low, high = ((limit - theta)[self.others] for limit in limits)
        return np.append(low, np.full(more, -np.inf)), np.append(high, np.full(more, np.inf))

    def parameters(self, elements: Sequence[FreeParameter]) -> tuple[FreeParameter, ...]:
        """An element of θ for every coordinate: the first log's sine for the amplitude, the cosines for the phases."""
        found = [elements[k] for k in self.others]
        for places in self.pairs:
            found += [] if self.fixed else [elements[places[0, 0]]]
            found += [elements[p] for p in places[:, 1]]
        return tuple(found)


def _amplitude(pairs: np.ndarray) -> float:
    return float(np.sqrt(np.mean((pairs**2).sum(axis=1))))


def _phase(pairs: np.ndarray) -> np.ndarray:
    return np.arctan2(pairs[:, 1], pairs[:, 0])


def _polar_unit_vectors(pairs: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Unit vectors (logs, 2) along each pair and across it."""
    phase = _phase(pairs)
    cosine, sine = np.cos(phase), np.sin(phase)
    return np.column_stack([cosine, sine]), np.column_stack([-sine, cosine])
