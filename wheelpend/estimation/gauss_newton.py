"""Gauss-Newton with Levenberg-Marquardt damping over several logs at once."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from types import ModuleType

import numpy as np

from wheelpend.estimation.covariance import block_of, has_colour, jackknife
from wheelpend.estimation.fit import Fit
from wheelpend.estimation.normal_equations import Reduced, bounded_step, covariance_of, informations, promised, reduce
from wheelpend.estimation.parameters import _limits_of, _own, _shared, _start_of, _values, layout, vector
from wheelpend.estimation.segments import Part
from wheelpend.estimation.shooting import Shot, carries_on, shoot
from wheelpend.estimation.states import fit_states, in_turn, initial_states
from wheelpend.estimation.tied_amplitudes import Phases

ENOUGH = 400  # segments that tell whether a residual is white
MEMORY = 400_000  # samples whose residuals are held for it
LITTLE, TINY = 0.01, 1e-6  # fall of the sum of squares, and share of it, that is not worth a step


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
