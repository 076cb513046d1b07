"""The score test: every effect's gain at once, from one linearisation of the shooting problem.

At the fitted model all candidates' coefficients are zero, and the sensitivities say how the residual would change with
each. States and base parameters are eliminated first, so that a candidate is credited only with what they cannot
explain.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

import derive
from derive.effects import Effect
from wheelpend import kernels, regression
from wheelpend.fitting import layout, reduce
from wheelpend.shooting import Fit, Part, shoot, vector
from wheelpend.study import Study, per_log_names

TWINS = 0.99999  # correlation of two effects' projected sensitivities above which no size tells them apart


class Candidate(NamedTuple):
    """An effect with the size that the linearisation gives it."""

    effect: Effect
    start: dict[str, float]
    gain: float  # expected fall of the sum of squares
    sigma: dict[str, float]  # of each coefficient, if nothing else were missing
    trials: int  # how many independent shapes were tried for it


class Screen(NamedTuple):
    """Result of the score test."""

    candidates: tuple[Candidate, ...]  # best first
    twins: dict[str, tuple[str, ...]]  # effects that these data cannot tell from another, at any size


def screen(
    study: Study, fitted: Fit, parts: Sequence[Part], present: Sequence[str], ripple: tuple[float, int]
) -> Screen:
    """Score every effect that is not in the model yet, at a fit to these very parts.

    ripple is what ripple_shape found.
    """
    effects = [e for e in study.effects() if e.name not in present]
    shapes = {e.name: ripple for e in effects if e.name == "cogging"}
    base = [n.split("@")[0] for n in fitted.free]
    base = list(dict.fromkeys(base))
    names = base + [f"{e.name}.{p.name}" for e in effects for p in e.linear]
    plan = layout(names, per_log_names(names), len(parts))
    columns = [study.module.PARAMETERS.index(n) for n in names]
    shots = []
    for number, part in enumerate(parts):
        values = {**fitted.of_log(number), "cogging.periods": ripple[0]}
        parameters = vector(study.module, values, part.log)
        shots.append(shoot(study.module, part, fitted.states[number], parameters, columns, max_step=study.max_step))
    reduced = reduce(shots, study.module.NX, plan)
    information, score = project(reduced.information, reduced.score, _places(plan.labels, base))
    own = {e.name: _places(plan.labels, [f"{e.name}.{p.name}" for p in e.linear]) for e in effects}
    noise = max(sum(s.cost for s in shots) / max(sum(p.values for p in parts), 1), 1.0)
    found = [_candidate(e, own[e.name], plan.labels, information, score, shapes.get(e.name), noise) for e in effects]
    return Screen(
        tuple(sorted(found, key=lambda c: -c.gain)), find_twins(own, information, np.diag(reduced.information))
    )


def project(information: np.ndarray, score: np.ndarray, base: list[int]) -> tuple[np.ndarray, np.ndarray]:
    """Take out of every column what the base columns explain."""
    scale = np.sqrt(np.maximum(np.diag(information), 0.0))
    scale = np.where(scale > 0.0, scale, np.inf)  # a column without any influence stays without
    scaled, right = information / np.outer(scale, scale), score / scale
    solved = np.linalg.lstsq(scaled[np.ix_(base, base)], np.column_stack([scaled[base], right[base]]), rcond=1e-11)[0]
    rest = scaled - scaled[:, base] @ solved[:, :-1]
    back = np.where(np.isfinite(scale), scale, 0.0)
    return rest * np.outer(back, back), (right - scaled[:, base] @ solved[:, -1]) * back


def _places(labels: Sequence[str], names: Sequence[str]) -> list[int]:
    return [k for k, label in enumerate(labels) if label.split("@")[0] in names]


def _candidate(effect, places, labels, information, score, shape, noise) -> Candidate:
    block, right = information[np.ix_(places, places)], score[places]
    scale = np.sqrt(np.maximum(np.diag(block), 1e-300))
    inverse = np.linalg.pinv(block / np.outer(scale, scale), rcond=1e-9, hermitian=True) / np.outer(scale, scale)
    step = inverse @ right
    start: dict[str, float] = {}
    sigma: dict[str, float] = {}
    for k, place in enumerate(places):
        name = labels[place].split("@")[0]
        start.setdefault(name, float(step[k]))
        sigma.setdefault(name, float(np.sqrt(max(inverse[k, k], 0.0))))
    trials = 1 + sum(len(p.grid) for p in effect.parameters)  # every start that is tried counts
    if shape is not None:
        start[f"{effect.name}.periods"], trials = shape
    return Candidate(effect, start, float(right @ step) / noise, sigma, trials)


def _bent(name: str) -> bool:
    """Whether an effect is not locally linear: what it resembles at zero it need not resemble at its size."""
    return any(p.grid for p in derive.effects.find(name).parameters)


def find_twins(own: Mapping[str, list[int]], information: np.ndarray, raw: np.ndarray) -> dict[str, tuple[str, ...]]:
    """Pairs of effects with one coefficient whose projected sensitivities are parallel."""
    single = {n: p[0] for n, p in own.items()
              if len(p) == 1 and information[p[0], p[0]] > 1e-7 * raw[p[0]] and not _bent(n)}  # fmt: skip
    twins: dict[str, tuple[str, ...]] = {}
    for name, a in single.items():
        scale = np.sqrt(information[a, a])
        close = [
            other for other, b in single.items()
            if other != name and abs(information[a, b]) > TWINS * scale * np.sqrt(information[b, b])
        ]  # fmt: skip
        twins[name] = tuple(sorted(close))
    return twins


def ripple_shape(study: Study, fitted: Fit, seed: int = 0) -> tuple[float, int]:
    """Periods per turn of the strongest ripple in the drive's missing force, and how many were in effect tried.

    The residual of the filtered equations is compared with sines of the drive's angle over a fine grid of periods. How
    many independent trials that grid amounts to is calibrated by surrogates whose segments have random signs.
    """
    plain = kernels.lean(study.model.plant, study.model.assumptions, ())
    log, segment = study.training[0].log, study.training[0].bounds
    states, voltage = regression.measured_states(log, study.relative), regression.fill_gaps(log.t, log.voltage)
    tau = max(0.01, 4 * log.dt)
    sides, regressors = plain.filter_regressor(
        log.t, states, voltage, vector(plain, fitted.values, log), tau, 1.3 * tau, True, states[0]
    )
    rows = (sides - regressors @ np.array([fitted.values[n] for n in plain.LINEAR]))[segment[0, 0] : segment[-1, 1]]
    missing = rows @ (1.0 / rows.var(axis=0))  # the row with less noise says more
    angle = (states[:, 0] - states[:, 1])[segment[0, 0] : segment[-1, 1]]
    thin = max(1, len(missing) // 4000)
    missing, angle = missing[::thin], angle[::thin]
    span = max(float(np.ptp(angle)), 1.0)
    grid = np.arange(1.0, 60.0, min(0.5, 2.0 / span))
    waves = np.exp(1j * np.outer(grid, angle)).astype(np.complex64)
    block = np.arange(len(missing)) * 40 // len(missing)
    amplitudes = np.stack([waves[:, block == b] @ missing[block == b] for b in range(40)], axis=1)
    power = np.abs(amplitudes.sum(axis=1)) ** 2
    signs = np.random.default_rng(seed).choice([-1.0, 1.0], size=(40, 200))
    surrogate = np.abs(amplitudes @ signs) ** 2 / (np.abs(amplitudes) ** 2).sum(axis=1, keepdims=True)
    typical = float(np.median(surrogate.max(axis=0)))
    trials = int(np.clip(np.log(0.5) / np.log1p(-np.exp(-typical)), 1, len(grid)))
    return float(grid[np.argmax(power)]), trials


def sizes(effect: Effect) -> tuple[str, ...]:
    """Full names of an effect's coefficients without its shape parameters."""
    return tuple(f"{effect.name}.{p.name}" for p in derive.effects.find(effect.name).linear)
