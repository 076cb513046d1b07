"""Smooth functions of states, input and time, as sums of basis functions: splines, waves and products of two."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from derive.plant_signature import PlantSignature
from wheelpend.diagnosis.criteria import MIN_WAVE_PHASE_RAD
from wheelpend.diagnosis.missing_force.law_terms import HARMONICS_PER_TURN
from wheelpend.diagnosis.missing_force.piecewise_force import LinearisedLogs, values_in_segments

KNOT_QUANTILES = (0.1, 0.35, 0.65, 0.9)  # quantiles of a variable at which a spline may bend
CLIP_QUANTILES = (0.005, 0.995)  # quantiles beyond which it is constant
WITHIN_TURN_SUFFIX = " within a turn"


class SplineBasis(NamedTuple):
    """Basis functions of one variable: straight, bent at knots, with a jump at zero where it has a direction."""

    centre: float
    spread: float
    clip_range: tuple[float, float]
    knots: tuple[float, ...]
    has_jump: bool

    @staticmethod
    def of(values: np.ndarray, has_direction: bool) -> SplineBasis:
        """From the values that the logs cover; a speed or an input has a direction."""
        jumps = has_direction and values.min() < 0.0 < values.max()
        knots = tuple(map(float, np.unique(np.quantile(values, KNOT_QUANTILES))))
        ends = np.quantile(values, CLIP_QUANTILES)
        clip_range = (float(ends[0]), float(ends[1]))
        return SplineBasis(float(values.mean()), float(values.std()), clip_range, knots, bool(jumps))

    def columns(self, values: np.ndarray) -> list[np.ndarray]:
        """Basis functions (N,) at some values."""
        x = np.clip(values, *self.clip_range)
        found = [(x - self.centre) / self.spread, *(np.maximum(x - k, 0.0) / self.spread for k in self.knots)]
        return [*found, np.sign(values)] if self.has_jump else found


class SmoothBasis(NamedTuple):
    """Basis functions of every variable, and of every two of them together."""

    splines: dict[str, SplineBasis]
    harmonics: tuple[tuple[str, tuple[int, ...]], ...]  # angles, and periods per turn that a function may have
    groups: dict[tuple[str, ...], list[str]]  # names of the columns of each variable, or pair

    @staticmethod
    def of(linearised: LinearisedLogs, plant: PlantSignature) -> SmoothBasis:
        """Basis functions of the variables that change in the logs of a plant."""
        return SmoothBasis.of_values({n: values_in_segments(linearised, n) for n in linearised.pieces[0].motion}, plant)

    @staticmethod
    def of_values(values: Mapping[str, np.ndarray], plant: PlantSignature) -> SmoothBasis:
        """Basis functions of variables of a plant, from the values (N,) that they take."""
        directed, angles = {*plant.speeds, *plant.inputs}, {n for n, u in plant.positions.items() if u == "rad"}
        splines = {n: SplineBasis.of(v, n in directed) for n, v in values.items() if v.std() > 0.0}
        ranges = {n: np.ptp(values[n]) for n in splines if n in angles}
        harmonics = tuple(
            (n, tuple(k for k in HARMONICS_PER_TURN if k * covered > MIN_WAVE_PHASE_RAD))
            for n, covered in ranges.items()
            if covered > MIN_WAVE_PHASE_RAD
        )
        groups: dict[tuple[str, ...], list[str]] = {(): ["constant"]}
        groups |= {(n,): [f"{n} {k}" for k in range(1 + len(b.knots) + b.has_jump)] for n, b in splines.items()}
        for n, ks in harmonics:
            groups[n + WITHIN_TURN_SUFFIX,] = [f"{f} {k} {n}" for k in ks for f in ("sin", "cos")]
        for k, one in enumerate(splines):
            groups |= {(a, one): [f"{a} {one} {i}{j}" for i in "01" for j in "01"] for a in list(splines)[:k]}
        return SmoothBasis(splines, harmonics, groups)

    @property
    def variables(self) -> list[str]:
        """Variables that a function may depend on."""
        return [group[0] for group in self.groups if len(group) == 1]

    def names(self, variables: Sequence[str]) -> list[str]:
        """Columns of a function of these variables."""
        return [n for group, names in self.groups.items() if set(group) <= set(variables) for n in names]

    def matrix(self, motion: Mapping[str, np.ndarray], names: Sequence[str]) -> np.ndarray:
        """The named columns (N, m) along a motion."""
        table = self.columns(motion)
        return np.column_stack([table[n] for n in names])

    def columns(self, motion: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
        """Every column (N,) along a motion."""
        single = {n: b.columns(motion[n]) for n, b in self.splines.items()}
        table = {"constant": np.ones_like(next(iter(single.values()))[0])}
        table |= {name: c for n, columns in single.items() for name, c in zip(self.groups[n,], columns, strict=True)}
        for n, ks in self.harmonics:
            waves = [f(k * motion[n]) for k in ks for f in (np.sin, np.cos)]
            table |= dict(zip(self.groups[n + WITHIN_TURN_SUFFIX,], waves, strict=True))
        for group, names in self.groups.items():
            if len(group) == 2:
                a, b = ((single[n][0], single[n][-1]) for n in group)
                table |= dict(zip(names, [x * y for x in a for y in b], strict=True))
        return table
