"""A start for an effect whose contacts make and break, from where no parameter is known well.

Where the moving part is at a moment depends on every contact before. Short segments know little of that, their
sensitivities leave out what one segment hands on to the next, and one contact too few spoils whole segments. So
segments that fit badly count less, and derivatives are differences of whole logs whose states follow in turn.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from wheelpend.estimation.continuation import fit_parts
from wheelpend.estimation.data import shortened
from wheelpend.estimation.fit import Fit
from wheelpend.estimation.free_parameters import effect_parameter, limits_of, per_log_names
from wheelpend.estimation.parameters import vector
from wheelpend.estimation.problem import Study
from wheelpend.estimation.segments import Part
from wheelpend.estimation.shooting import shoot
from wheelpend.estimation.states import fit_states, initial_states
from wheelpend.estimation.step_size import stable_step

WIDTH = 0.01  # of a parameter: so wide a difference that the roughness of single contacts averages out
FARTHEST = 0.3  # of a parameter, that one step may move it
PAYS = 0.95  # of the error without play, that the error with it has to be below for the search to go on
COARSE = tuple(float(v) for v in np.geomspace(0.0015, 0.2, 9))  # first widths tried [rad]
FINE = (0.5, 0.63, 0.8, 0.9, 1.0, 1.1, 1.25, 1.6, 2.0)  # times the size found


class Whole(NamedTuple):
    """What parameters leave over on consecutive segments whose states follow in turn."""

    residuals: list[np.ndarray]  # of each segment
    squares: np.ndarray  # (segments,) mean square of each, in noise variances
    states: list[np.ndarray]  # of each part

    @property
    def spared(self) -> float:
        """Mean logarithm of the squares: a segment that fits badly counts little more than one that fits worse."""
        return float(np.mean(np.log(np.maximum(self.squares, 1.0)))) if np.isfinite(self.squares).all() else np.inf


def start_with_contacts(study: Study, origin: Mapping[str, float], own, free: Sequence[str], size: str) -> dict | None:
    """Parameters near the best ones, from a rough start and an unknown size of a play; None where a play does not pay.

    ``size`` is the name of the play's width, ``own`` each log's own parameters.
    """
    module, log = study.module, study.training[0].log
    study = replace(study, max_step=min(study.max_step, 2.0 * stable_step(module, origin, log)))  # as logs are played
    parts = shortened(study, 0.1 * study.horizon, most=10_000)
    row = effect_parameter(size, study.plant)
    assert row is not None, f"{size} is a parameter of the library"
    values = spared_fit(study, parts, {**origin, size: 0.5 * row.typical}, own, free)
    costs = {gap: cost_at(study, parts, values, own, free, {size: gap}) for gap in (row.absent, *COARSE)}
    best = min(costs, key=costs.__getitem__)
    if not costs[best] < PAYS**2 * costs[row.absent]:
        return None
    values = {**values, size: best}
    for share, rounds in ((0.2, 5), (0.2, 4), (1.0, 5)):
        parts = shortened(study, share * study.horizon, most=10_000)
        gaps = [values[size] * factor for factor in FINE]
        values[size] = min(gaps, key=lambda gap: cost_at(study, parts, values, own, free, {size: gap}))
        values = followed_fit(study, parts, values, own, free, rounds)
    return values


def cost_at(study: Study, parts: Sequence[Part], values: Mapping[str, float], own, free, changed) -> float:
    """Sum of squares of a model as it is, with some parameters changed."""
    return fit_parts(study, parts, {**values, **changed}, free, start_per_log=own, rounds=0).cost


def spared_fit(study: Study, parts: Sequence[Part], values: Mapping[str, float], own, free: Sequence[str]) -> dict:
    """A few fits, in each of which a segment counts the less the worse it fitted before."""
    found = fit_parts(study, parts, values, free, start_per_log=own, rounds=0)
    for _ in range(3):
        squares = [squares_of(study, p, found, k) for k, p in enumerate(parts)]
        if not all(np.isfinite(s).all() for s in squares):
            break
        lighter = [replace(p, weights=1.0 / np.maximum(s, 1.0)) for p, s in zip(parts, squares, strict=True)]
        found = fit_parts(study, lighter, found.values, free, start_per_log=found.per_log, rounds=4)
    return dict(found.values)


def squares_of(study: Study, part: Part, found: Fit, number: int) -> np.ndarray:
    """Mean square of every segment's residual, in noise variances."""
    parameters = vector(study.module, found.of_log(number), part.log)
    shot = shoot(study.module, part, found.states[number], parameters, max_step=study.max_step)
    return shot.gram[:, -1, -1] / counts(part, study.module.NX)


def counts(part: Part, states: int) -> np.ndarray:
    """Measured values of every segment, less its fitted states."""
    values = [np.isfinite(part.log.measured[a:b]).sum() - states for a, b in part.bounds]
    return np.maximum(np.array(values, dtype=float), 1.0)


def followed(study: Study, parts: Sequence[Part], values, own, states=None, rounds: int = 3) -> Whole:
    """What parameters leave over once the states have followed them."""
    residuals, squares, found = [], [], []
    for k, part in enumerate(parts):
        parameters = vector(study.module, {**values, **(own[k] if k < len(own) else {})}, part.log)
        begun = states[k] if states else initial_states(study.module, part)
        begun, shot = fit_states(study.module, part, begun, parameters, study.max_step, rounds)
        residuals += [np.nan_to_num(shot.residual[a:b].ravel()) for a, b in part.bounds]
        squares.append(shot.gram[:, -1, -1] / counts(part, study.module.NX))
        found.append(begun)
    return Whole(residuals, np.concatenate(squares), found)


def followed_fit(study: Study, parts: Sequence[Part], values, own, free: Sequence[str], rounds: int) -> dict:
    """Gauss-Newton by differences on the logarithm of the segments' squares, for the parameters that logs share."""
    names = [n for n in free if n not in per_log_names(free)]
    limits = limits_of(names, study.plant, study.module.SIGNED)
    values, damping = dict(values), 1e-3
    here = followed(study, parts, values, own)
    for _ in range(rounds):
        scale = np.array([abs(values[n]) or WIDTH for n in names])
        normal, right = differences(study, parts, values, own, names, scale, here)
        diagonal = np.sqrt(np.diag(normal)) + 1e-300
        while damping < 10.0:
            damped = normal / np.outer(diagonal, diagonal) + damping * np.eye(len(names))
            step = np.clip(np.linalg.solve(damped, right / diagonal) / diagonal, -FARTHEST, FARTHEST) * scale
            moved = {n: float(np.clip(values[n] + s, *limits.get(n, (-np.inf, np.inf))))
                     for n, s in zip(names, step, strict=True)}  # fmt: skip
            there = followed(study, parts, {**values, **moved}, own)
            if there.spared < here.spared:
                break
            damping *= 10.0
        else:
            break
        values, here, damping = {**values, **moved}, there, damping * 0.1
    return values


def differences(
    study: Study, parts, values, own, names: Sequence[str], scale: np.ndarray, here: Whole
) -> tuple[np.ndarray, np.ndarray]:
    """Normal equations in units of scale, every segment weighted by its squares."""
    weights = 1.0 / np.sqrt(np.maximum(here.squares, 1.0))

    def weighted(whole: Whole) -> np.ndarray:
        return np.concatenate([w * r for w, r in zip(weights, whole.residuals, strict=True)])

    base, columns = weighted(here), []
    for name, size in zip(names, scale, strict=True):
        aside = followed(study, parts, {**values, name: values[name] + WIDTH * size}, own, here.states, rounds=1)
        columns.append((weighted(aside) - base) / WIDTH if np.isfinite(aside.squares).all() else np.zeros_like(base))
    jacobian = np.array(columns).T
    return jacobian.T @ jacobian, -jacobian.T @ base
