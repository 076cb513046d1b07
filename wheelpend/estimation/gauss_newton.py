"""Gauss-Newton with Levenberg-Marquardt damping over several logs at once."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from types import ModuleType

import numpy as np

from wheelpend.estimation.covariance import block_numbers, is_autocorrelated, jackknife_covariance
from wheelpend.estimation.fit import Fit
from wheelpend.estimation.normal_equations import (
    ReducedNormalEquations,
    bounded_step,
    covariance_of,
    eliminate_initial_states,
    predicted_decrease,
    segment_informations,
)
from wheelpend.estimation.parameters import (
    _limits_of,
    _per_log_values,
    _shared_values,
    _start_value,
    _values_of_part,
    kernel_parameters,
    parameter_layout,
)
from wheelpend.estimation.segments import Segments
from wheelpend.estimation.shooting import ShootingLinearisation, has_coupled_segments, shoot
from wheelpend.estimation.states import fit_states, initial_states, sequential_states
from wheelpend.estimation.tied_amplitudes import TiedAmplitudes

MAX_COLOUR_TEST_SEGMENTS = 400  # segments that tell whether a residual is white
MAX_COLOUR_TEST_SAMPLES = 400_000  # samples whose residuals are held for it
MIN_COST_DECREASE, MIN_RELATIVE_COST_DECREASE = (
    0.01,
    1e-6,
)  # fall of the sum of squares, and share of it, that is not worth a step


@np.errstate(over="ignore", invalid="ignore")  # a trial that runs away gives infinities, and is rejected
def fit(
    module: ModuleType,
    parts: Sequence[Segments],
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
    plan = parameter_layout(free, [n for n in per_log if n in free], len(parts))
    columns = [module.PARAMETERS.index(n) for n in free]
    start = {**{n: module.ABSENT[c] for n, c in zip(free, columns, strict=True)}, **start}
    bounds = _limits_of(plan, limits or {})
    theta = np.array([_start_value(label, start, start_per_log) for label in plan.labels])
    theta = np.clip(theta, bounds[0], bounds[1])
    tied = TiedAmplitudes.of(plan.labels, phased, amplitude_known) if phased else None
    theta = tied.with_equal_amplitudes(theta) if tied else theta

    def vectors_at(theta: np.ndarray) -> list[np.ndarray]:
        return [
            kernel_parameters(module, _values_of_part(start, plan, theta, k, start_per_log), p.log)
            for k, p in enumerate(parts)
        ]

    def shots_at(theta: np.ndarray, states: Sequence[np.ndarray]) -> list[ShootingLinearisation]:
        return [
            shoot(module, p, x, v, columns, max_step=max_step, keep_residual=False)
            for p, x, v in zip(parts, states, vectors_at(theta), strict=True)
        ]

    def settle(theta: np.ndarray, states: Sequence[np.ndarray]) -> list[np.ndarray]:
        """What a segment hands on to the next is not in the linearisation: there the states follow in turn."""
        vectors = vectors_at(theta)
        if not any(has_coupled_segments(module, v) for v in vectors):
            return list(states)
        return [sequential_states(module, p, x, v, max_step, 2) for p, x, v in zip(parts, states, vectors, strict=True)]

    if states is None:
        states = [
            fit_states(module, p, initial_states(module, p), v, max_step, 2, keep_residual=False)[0]
            for p, v in zip(parts, vectors_at(theta), strict=True)
        ]
    states = list(states)
    shots, damping, converged = shots_at(theta, states), 1e-3, False
    cost, count = sum(s.cost for s in shots), sum(p.values for p in parts)
    for _ in range(rounds):
        reduced = eliminate_initial_states(shots, module.NX, plan, damping)
        if not np.isfinite(cost) or not np.isfinite(reduced.information).all():
            break  # the start cannot be simulated: nothing to go by
        trial_theta = _parameters_after_step(reduced, damping, bounds, theta, tied)
        step = trial_theta - theta
        trial_states = [
            x + own - np.einsum("skx,k->sx", answers, step[places])
            for x, (own, answers), places in zip(states, reduced.steps, plan.places, strict=True)
        ]
        trial_states = settle(trial_theta, trial_states)
        if (
            damping < 0.01
            and predicted_decrease(shots, reduced, module.NX, plan)
            < MIN_COST_DECREASE + MIN_RELATIVE_COST_DECREASE * cost
        ):
            theta, states, converged = trial_theta, trial_states, True  # the last step, too small to be looked at again
            break
        trial = shots_at(trial_theta, trial_states)
        trial_cost = sum(s.cost for s in trial)
        if trial_cost <= cost:
            gain = cost - trial_cost
            theta, states, shots, cost = trial_theta, trial_states, trial, trial_cost
            damping = max(damping * 0.1, 1e-12)
            if gain < MIN_COST_DECREASE + MIN_RELATIVE_COST_DECREASE * cost + 5e-3 * max(
                cost - 2.0 * count, 0.0
            ):  # a wrong model need not be exact
                converged = True
                break
        else:
            if trial_cost - cost < 1e-9 * cost:
                converged = True
                break
            damping = max(damping * 10.0, 1e-8)
            if damping > 1e6:
                break
    coloured = any(
        _has_coloured_residual(module, *each, max_step) for each in zip(parts, states, vectors_at(theta), strict=True)
    )
    return _result(module, parts, plan, theta, states, shots, start, start_per_log, converged, tied, coloured)


def _has_coloured_residual(
    module: ModuleType, part: Segments, states: np.ndarray, parameters: np.ndarray, max_step: float
) -> bool:
    """Whether the residual is correlated from sample to sample, told by the first segments, as many as lie close by."""
    near = part.bounds[:, 1] <= part.bounds[0, 1] + MAX_COLOUR_TEST_SAMPLES
    bounds = part.bounds[near][:MAX_COLOUR_TEST_SEGMENTS]
    few = replace(part, log=part.log.part(0, int(bounds[-1, 1])), bounds=bounds, weights=None)
    return is_autocorrelated(shoot(module, few, states[: len(bounds)], parameters, max_step=max_step).residual, bounds)


def _parameters_after_step(
    reduced: ReducedNormalEquations, damping: float, limits, theta: np.ndarray, tied: TiedAmplitudes | None
) -> np.ndarray:
    """Parameters after a damped Gauss-Newton step within limits; tied ones stay tied."""
    information, score = reduced.information, reduced.score
    if tied is None:
        return theta + bounded_step(information, score, damping, limits[0] - theta, limits[1] - theta)
    along = tied.basis(theta)
    step = bounded_step(along.T @ information @ along, along.T @ score, damping, *tied.bounds(limits, theta))
    return tied.after_step(theta, step)


def _result(module, parts, plan, theta, states, shots, start, start_per_log, converged, tied, coloured) -> Fit:
    reduced = eliminate_initial_states(shots, module.NX, plan)
    information = np.nan_to_num(reduced.information, posinf=0.0, neginf=0.0)
    along = tied.basis(theta) if tied else np.eye(len(theta))
    labels = tied.labels(plan.labels) if tied else plan.labels
    covariance, condition, flat = covariance_of(along.T @ information @ along, labels)
    covariance = along @ covariance @ along.T
    pieces = np.nan_to_num(segment_informations(shots, module.NX, plan, reduced), posinf=0.0, neginf=0.0)
    scores = np.nan_to_num(reduced.scores, posinf=0.0, neginf=0.0)
    block = block_numbers([len(s) for s in states])
    robust = jackknife_covariance(covariance, pieces, scores, block) if len(theta) else covariance
    return Fit(
        values={**{k: float(v) for k, v in start.items()}, **_shared_values(plan, theta)},
        per_log=tuple(_per_log_values(plan, theta, k, start_per_log) for k in range(len(parts))),
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
