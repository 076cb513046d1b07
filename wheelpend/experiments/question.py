"""What is to be found out: which of some effects it is, or the parameters themselves; and what the logs at hand say."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

import derive
from wheelpend.diagnosis.evidence import Tried
from wheelpend.estimation.free_parameters import effect_parameter, free_names, per_log_names
from wheelpend.estimation.parameters import vector
from wheelpend.estimation.problem import Study
from wheelpend.estimation.segments import Part
from wheelpend.experiments.closed_loop import Loop, Played, balancing_gains
from wheelpend.experiments.information import Joint, Ties, joint, of_part, separation, standard_errors
from wheelpend.logs.log import segment_bounds

ALIKE = 0.01  # relative difference of two errors within which a diagnosis lists both effects
SLOWEST, FINEST = 0.02, 5e-4  # s between samples of a rehearsal, at most and at least


@dataclass(frozen=True)
class Question:
    """Effects to be told apart, or none: then the model's parameters are to be known better."""

    study: Study
    loop: Loop
    base: tuple[str, ...]  # names of the parameters that every rival has: of the plant and of the model's effects
    first: str  # the effect that the rehearsed machine has; empty where no effects are to be told apart
    others: tuple[str, ...]  # effects that may be it instead
    sizes: tuple[Mapping[str, float], ...]  # parameter values in each log at hand, the first effect's among them
    pieces: tuple[np.ndarray, ...]  # information (names, names) of each log at hand
    density: float = 1.0  # samples of the record to be made, per sample of its rehearsal

    @property
    def names(self) -> tuple[str, ...]:
        """Parameters in which everything is linearised."""
        return (*self.base, *columns(self.first, self.others))

    @property
    def with_controller(self) -> bool:
        """Whether the rehearsals use the robot's own controller."""
        return self.study.model.controller is not None

    def told_by(
        self, played: Played, finer: Mapping[str, float] | None = None, truth: Mapping[str, float] | None = None
    ) -> np.ndarray:
        """Information (names, names) of a rehearsed log.

        ``finer`` multiplies the σ of channels, ``truth`` adds sensors without faults: channel to σ.
        """
        study = self.study
        sigma = study.noise[0].sigma * np.array([(finer or {}).get(c, 1.0) for c in played.log.channels])
        part = Part(played.log, sigma, np.ascontiguousarray(segment_bounds(played.log, study.horizon)))
        states = played.states[part.bounds[:, 0]]
        told = of_part(study.module, part, states, played.parameters, self.names, study.max_step, truth)
        return self.density * told

    def with_piece(self, piece: np.ndarray | None, ties: Ties | None = None) -> Joint:
        """What the logs at hand say, with one more log where it is given."""
        pieces = self.pieces if piece is None else (*self.pieces, piece)
        return joint(pieces, self.names, per_log_names(self.names), ties if self.pieces else None)

    def separation(self, piece: np.ndarray | None, ties: Ties | None = None) -> float:
        """Standard errors between the first effect and the closest of the others."""
        known = self.with_piece(piece, ties)
        lead = columns(self.first, ())
        each = [separation(known, self.sizes, lead, columns("", [o]), self.base) for o in self.others]
        return min(each, default=np.inf)

    def gap(self, separation: float, played: Played) -> float:
        """By which share the rivals' errors over all logs would differ: √(1 + separation²/values) − 1."""
        values = sum(p.values for p in self.study.training) + self.density * played.log.measured.size
        return float(np.sqrt(1.0 + separation**2 / values) - 1.0)

    def errors(self, piece: np.ndarray | None) -> dict[str, float]:
        """Standard errors of the parameters of the model that was rehearsed."""
        return standard_errors(self.with_piece(piece), (*self.base, *columns(self.first, ())))


def columns(first: str, others: Sequence[str]) -> tuple[str, ...]:
    """Parameters in which effects are linearised: the size of the first, everything of the others."""
    lead = [f"{first}.{p.name}" for p in derive.effects.find(first).sizes] if first else []
    return (*lead, *(n for o in others for n in derive.effects.find(o).full_names))


def of_fit(study: Study, first: Tried, others: Sequence[Tried] = ()) -> Question:
    """The question that a diagnosis leaves: is it the first candidate, or one of its equivalents?"""
    fitted, rivals = first.fit, first.equivalent_to
    kept = [e for e in study.model.effects if e not in study.replaced(first.effect)]
    base = tuple(free_names(study, kept))
    shapes = shapes_of(rivals, {f"{t.effect}.{p}": v for t in others for p, v in t.coefficients.items()})
    sizes = tuple({**fitted.of_log(k), **shapes} for k in range(len(study.training)))
    names = (*base, *columns(first.effect, rivals))
    pieces = tuple(
        of_part(study.module, part, states, vector(study.module, own, part.log), names, study.max_step)
        for part, states, own in zip(study.training, fitted.states, sizes, strict=True)
    )
    log = study.training[-1].log
    t = times(20.0, log.dt)
    loop = loop_of(study, sizes[-1], t)
    return Question(study, loop, base, first.effect, rivals, sizes, pieces, (t[1] - t[0]) / log.dt)


def shapes_of(effects: Sequence[str], known: Mapping[str, float]) -> dict[str, float]:
    """Values that rivals need to have any influence: shapes, and limits that are absent at infinity."""
    names = [n for e in effects for n in derive.effects.find(e).full_names]
    needed = {n: p for n in names if (p := effect_parameter(n)) and p.absent != 0.0}
    return {n: known.get(n, p.typical) for n, p in needed.items()}


def times(duration: float, sample: float) -> np.ndarray:
    """Sample times (N,) of a rehearsal [s]: within what a controller can balance with, and what is worth computing."""
    step = round(float(np.clip(sample, FINEST, SLOWEST)), 9)
    return np.arange(round(duration / step) + 1) * step


def loop_of(study: Study, values: Mapping[str, float], t: np.ndarray) -> Loop:
    """The robot under its own controller, or under one that balances the model."""
    own = study.model.controller
    gains = np.array(own.gains) if own else balancing_gains(study.module, values, float(t[1] - t[0]))
    return Loop.of(study.module, values, gains, t, study.noise[0], study.max_step)
