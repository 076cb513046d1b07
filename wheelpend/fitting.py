"""Gauss-Newton over several logs at once, with every segment's initial state eliminated."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from types import ModuleType
from typing import NamedTuple

import numpy as np

from wheelpend.blocks import block_of, has_colour, jackknife
from wheelpend.phases import Phases
from wheelpend.shooting import (
    Fit,
    Part,
    Shot,
    carries_on,
    fit_states,
    in_turn,
    initial_states,
    shoot,
    solve_damped,
    vector,
)

ENOUGH = 400  # segments that tell whether a residual is white
MEMORY = 400_000  # samples whose residuals are held for it
LITTLE, TINY = 0.01, 1e-6  # fall of the sum of squares, and share of it, that is not worth a step
FLAT = 1e-9  # eigenvalue of the scaled information matrix below which a direction is not identifiable


class Layout(NamedTuple):
    """Where each free parameter stands: shared ones once, per-log ones once for every part."""

    names: tuple[str, ...]  # of the columns of every part
    places: tuple[np.ndarray, ...]  # per part: index of each column among all free parameters
    labels: tuple[str, ...]  # of all free parameters


class Reduced(NamedTuple):
    """The parameters' own equations, the segments' states eliminated."""

    information: np.ndarray  # (free, free)
    score: np.ndarray  # (free,)
    scores: np.ndarray  # (all segments, free), whose sum is the score
    steps: tuple[tuple[np.ndarray, np.ndarray], ...]  # per part: states' own step and their answer to the parameters


def layout(free: Sequence[str], per_log: Sequence[str], parts: int) -> Layout:
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
    return Layout(tuple(free), tuple(places), tuple(labels))


@np.errstate(over="ignore", invalid="ignore")  # what cannot be simulated gives infinities, and is not kept
def reduce(shots: Sequence[Shot], nx: int, plan: Layout, damping: float = 0.0) -> Reduced:
    """Eliminate the initial states of every segment (Schur complement)."""
    size = len(plan.labels)
    information, scores, steps = np.zeros((size, size)), [], []
    for shot, places in zip(shots, plan.places, strict=True):
        normal, mixed, own = shot.gram[:, :nx, :nx], shot.gram[:, nx:-1, :nx], shot.gram[:, nx:-1, -1]
        solved = solve_damped(normal, shot.gram[:, :nx, nx:], damping)  # states' answers to parameters, and own step
        answers, step = solved[:, :, :-1].transpose(0, 2, 1), solved[:, :, -1]
        block = (shot.gram[:, nx:-1, nx:-1] - np.einsum("skx,slx->skl", mixed, answers)).sum(axis=0)
        information[np.ix_(places, places)] += 0.5 * (block + block.T)
        row = np.zeros((len(normal), size))
        row[:, places] = own - np.einsum("skx,sx->sk", mixed, step)
        scores.append(row)
        steps.append((step, answers))
    stacked = np.concatenate(scores)
    return Reduced(information, stacked.sum(axis=0), stacked, tuple(steps))


def promised(shots: Sequence[Shot], reduced: Reduced, nx: int, plan: Layout) -> float:
    """By how much the sum of squares would fall in the next step, were the residual linear and nothing damped."""
    pairs = zip(shots, reduced.steps, strict=True)
    states = sum(float(np.einsum("sx,sx->", s.gram[:, :nx, -1], own)) for s, (own, _) in pairs)
    if not plan.labels:
        return states
    return states + float(reduced.score @ solve_scaled(reduced.information, reduced.score))


def solve_scaled(information: np.ndarray, score: np.ndarray, damping: float = 0.0) -> np.ndarray:
    """Solve the parameters' equations, scaled to a unit diagonal; flat directions stay where they are."""
    scale = np.sqrt(np.maximum(np.diag(information), 0.0))
    scale = np.where(scale > 0.0, scale, np.inf)  # a parameter without any influence does not move
    eigenvalues, vectors = np.linalg.eigh(information / np.outer(scale, scale))
    kept = eigenvalues > FLAT * eigenvalues[-1]
    inverse = np.where(kept, 1.0 / (np.where(kept, eigenvalues, 1.0) + damping), 0.0)
    return vectors @ (inverse * (vectors.T @ (score / scale))) / scale


def bounded_step(
    information: np.ndarray, score: np.ndarray, damping: float, lowest: np.ndarray, highest: np.ndarray
) -> np.ndarray:
    """Damped Gauss-Newton step within bounds on the step: what would leave them stops there."""
    step = np.zeros(len(score))
    free = np.ones(len(score), dtype=bool)
    for _ in range(len(score) + 1):
        rest = score - information[:, ~free] @ step[~free]
        step[free] = solve_scaled(information[np.ix_(free, free)], rest[free], damping) if free.any() else 0.0
        outside = free & ((step < lowest) | (step > highest))
        if not outside.any():
            break
        step[outside] = np.clip(step[outside], lowest[outside], highest[outside])
        free &= ~outside
    return step


@np.errstate(over="ignore", invalid="ignore")  # a trial that runs away gives infinities, and is rejected
def fit(
    module: ModuleType,
    parts: Sequence[Part],
    start: Mapping[str, float],
    free: Sequence[str],
    *,
    per_log: Sequence[str] = (),
    limits: Mapping[str, tuple[float, float]] | None = None,
    start_per_log: Sequence[Mapping[str, float]] = (),
    states: Sequence[np.ndarray] | None = None,
    phased: Sequence[tuple[str, str]] = (),
    amplitude_known: bool = False,
    max_step: float = 0.002,
    rounds: int = 40,
) -> Fit:
    """Fit the free parameters of a module to all parts; per-log ones get a value for every part.

    Pairs in ``phased`` are the sine and cosine of one amplitude for all parts and a phase for each. Stops when a step
    lowers the sum of squares by less than 0.01 and a millionth of it, promises no more, or can no longer lower it.
    """
    plan = layout(free, [n for n in per_log if n in free], len(parts))
    columns = [module.PARAMETERS.index(n) for n in free]
    start = {**{n: module.ABSENT[c] for n, c in zip(free, columns, strict=True)}, **start}
    bounds = _limits_of(plan, limits or {})
    theta = np.array([_start_of(label, start, start_per_log) for label in plan.labels])
    theta = np.clip(theta, bounds[0], bounds[1])
    tied = Phases.of(plan.labels, phased, amplitude_known) if phased else None
    theta = tied.onto(theta) if tied else theta

    def vectors_at(theta: np.ndarray) -> list[np.ndarray]:
        return [vector(module, _values(start, plan, theta, k, start_per_log), p.log) for k, p in enumerate(parts)]

    def shots_at(theta: np.ndarray, states: Sequence[np.ndarray]) -> list[Shot]:
        return [
            shoot(module, p, x, v, columns, max_step=max_step, keep=False)
            for p, x, v in zip(parts, states, vectors_at(theta), strict=True)
        ]

    def settle(theta: np.ndarray, states: Sequence[np.ndarray]) -> list[np.ndarray]:
        """What a segment hands on to the next is not in the linearisation: there the states follow in turn."""
        vectors = vectors_at(theta)
        if not any(carries_on(module, v) for v in vectors):
            return list(states)
        return [in_turn(module, p, x, v, max_step, 2) for p, x, v in zip(parts, states, vectors, strict=True)]

    if states is None:
        states = [
            fit_states(module, p, initial_states(module, p), v, max_step, 2, keep=False)[0]
            for p, v in zip(parts, vectors_at(theta), strict=True)
        ]
    states = list(states)
    shots, damping, converged = shots_at(theta, states), 1e-3, False
    cost, count = sum(s.cost for s in shots), sum(p.values for p in parts)
    for _ in range(rounds):
        reduced = reduce(shots, module.NX, plan, damping)
        if not np.isfinite(cost) or not np.isfinite(reduced.information).all():
            break  # the start cannot be simulated: nothing to go by
        trial_theta = _stepped(reduced, damping, bounds, theta, tied)
        step = trial_theta - theta
        trial_states = [
            x + own - np.einsum("skx,k->sx", answers, step[places])
            for x, (own, answers), places in zip(states, reduced.steps, plan.places, strict=True)
        ]
        trial_states = settle(trial_theta, trial_states)
        if damping < 0.01 and promised(shots, reduced, module.NX, plan) < LITTLE + TINY * cost:
            theta, states, converged = trial_theta, trial_states, True  # the last step, too small to be looked at again
            break
        trial = shots_at(trial_theta, trial_states)
        trial_cost = sum(s.cost for s in trial)
        if trial_cost <= cost:
            gain = cost - trial_cost
            theta, states, shots, cost = trial_theta, trial_states, trial, trial_cost
            damping = max(damping * 0.1, 1e-12)
            if gain < LITTLE + TINY * cost + 5e-3 * max(cost - 2.0 * count, 0.0):  # a wrong model need not be exact
                converged = True
                break
        else:
            if trial_cost - cost < 1e-9 * cost:
                converged = True
                break
            damping = max(damping * 10.0, 1e-8)
            if damping > 1e6:
                break
    coloured = any(_coloured(module, *each, max_step) for each in zip(parts, states, vectors_at(theta), strict=True))
    return _result(module, parts, plan, theta, states, shots, start, start_per_log, converged, tied, coloured)


def _coloured(module: ModuleType, part: Part, states: np.ndarray, parameters: np.ndarray, max_step: float) -> bool:
    """Whether the residual is correlated from sample to sample, told by the first segments, as many as lie close by."""
    near = part.bounds[:, 1] <= part.bounds[0, 1] + MEMORY
    bounds = part.bounds[near][:ENOUGH]
    few = replace(part, log=part.log.part(0, int(bounds[-1, 1])), bounds=bounds, weights=None)
    return has_colour(shoot(module, few, states[: len(bounds)], parameters, max_step=max_step).residual, bounds)


def _stepped(reduced: Reduced, damping: float, limits, theta: np.ndarray, tied: Phases | None) -> np.ndarray:
    """Parameters after a damped Gauss-Newton step within limits; tied ones stay tied."""
    information, score = reduced.information, reduced.score
    if tied is None:
        return theta + bounded_step(information, score, damping, limits[0] - theta, limits[1] - theta)
    along = tied.basis(theta)
    step = bounded_step(along.T @ information @ along, along.T @ score, damping, *tied.bounds(limits, theta))
    return tied.moved(theta, step)


def _result(module, parts, plan, theta, states, shots, start, start_per_log, converged, tied, coloured) -> Fit:
    reduced = reduce(shots, module.NX, plan)
    information = np.nan_to_num(reduced.information, posinf=0.0, neginf=0.0)
    along = tied.basis(theta) if tied else np.eye(len(theta))
    labels = tied.labels(plan.labels) if tied else plan.labels
    covariance, condition, flat = covariance_of(along.T @ information @ along, labels)
    covariance = along @ covariance @ along.T
    pieces = np.nan_to_num(informations(shots, module.NX, plan, reduced), posinf=0.0, neginf=0.0)
    scores = np.nan_to_num(reduced.scores, posinf=0.0, neginf=0.0)
    block = block_of([len(s) for s in states])
    robust = jackknife(covariance, pieces, scores, block) if len(theta) else covariance
    return Fit(
        values={**{k: float(v) for k, v in start.items()}, **_shared(plan, theta)},
        per_log=tuple(_own(plan, theta, k, start_per_log) for k in range(len(parts))),
        free=plan.labels,
        covariance=covariance,
        robust=robust,
        states=tuple(states),
        cost=sum(s.cost for s in shots),
        count=sum(p.values for p in parts),
        condition=condition,
        unidentifiable=flat,
        converged=converged,
        blocks=int(block.max(initial=-1)) + 1,
        coloured=coloured,
    )


def informations(shots: Sequence[Shot], nx: int, plan: Layout, reduced: Reduced) -> np.ndarray:
    """Information of each segment of all parts about the free parameters (segments, free, free)."""
    found = []
    for shot, places, (_, answers) in zip(shots, plan.places, reduced.steps, strict=True):
        piece = np.zeros((len(shot.gram), len(plan.labels), len(plan.labels)))
        own = shot.gram[:, nx:-1, nx:-1] - np.einsum("skx,slx->skl", shot.gram[:, nx:-1, :nx], answers)
        piece[:, places[:, None], places[None, :]] = 0.5 * (own + own.transpose(0, 2, 1))
        found.append(piece)
    return np.concatenate(found)


def covariance_of(information: np.ndarray, labels: Sequence[str]) -> tuple[np.ndarray, float, tuple[str, ...]]:
    """Inverse of an information matrix, its scaled condition number, and the parameters it says nothing about."""
    if not len(labels):
        return np.zeros((0, 0)), 1.0, ()
    scale = np.sqrt(np.maximum(np.diag(information), 0.0))
    silent = scale <= 1e-150
    scale = np.where(silent, 1.0, scale)
    eigenvalues, vectors = np.linalg.eigh(information / np.outer(scale, scale) + np.diag(silent * 1.0))
    kept = eigenvalues > FLAT * eigenvalues[-1]
    inverse = vectors[:, kept] / eigenvalues[kept] @ vectors[:, kept].T / np.outer(scale, scale)
    lost = (vectors[:, ~kept] ** 2).sum(axis=1)
    flat = tuple(label for label, s, w in zip(labels, silent, lost, strict=True) if s or w > 1e-3)
    return inverse, float(eigenvalues[-1] / max(eigenvalues[0], 1e-300)), flat


def _limits_of(plan: Layout, limits: Mapping[str, tuple[float, float]]) -> tuple[np.ndarray, np.ndarray]:
    pairs = [limits.get(label.split("@")[0], (-np.inf, np.inf)) for label in plan.labels]
    return np.array([p[0] for p in pairs]), np.array([p[1] for p in pairs])


def _start_of(label: str, start: Mapping[str, float], start_per_log: Sequence[Mapping[str, float]]) -> float:
    name, _, number = label.partition("@")
    if number and int(number) < len(start_per_log) and name in start_per_log[int(number)]:
        return float(start_per_log[int(number)][name])
    return float(start[name])


def _shared(plan: Layout, theta: np.ndarray) -> dict[str, float]:
    return {label: float(v) for label, v in zip(plan.labels, theta, strict=True) if "@" not in label}


def _own(plan: Layout, theta: np.ndarray, part: int, start_per_log: Sequence[Mapping[str, float]]) -> dict[str, float]:
    own = dict(start_per_log[part]) if part < len(start_per_log) else {}
    for label, v in zip(plan.labels, theta, strict=True):
        name, _, number = label.partition("@")
        if number and int(number) == part:
            own[name] = float(v)
    return own


def _values(start, plan: Layout, theta: np.ndarray, part: int, start_per_log) -> dict[str, float]:
    return {**start, **_shared(plan, theta), **_own(plan, theta, part, start_per_log)}
