"""Continuation: a fit that goes from short segments to full ones, with fresh initial states at each length."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from wheelpend.errors import Failure
from wheelpend.estimation.criteria import (
    MAX_EXPLAINED_ERROR_RATIO,
    MAX_NOISE_LEVEL_ERROR_RATIO,
    WRONG_START_ERROR_RATIO,
)
from wheelpend.estimation.data import shortened_segments
from wheelpend.estimation.fit import Fit
from wheelpend.estimation.free_parameters import limits_of, per_log_names, tied_pairs
from wheelpend.estimation.gauss_newton import fit
from wheelpend.estimation.problem import EstimationProblem
from wheelpend.estimation.segments import Segments
from wheelpend.kernels import load as kernels

SAME_FIT_RELATIVE_TOLERANCE = (
    1e-3  # of the error, by which two fits of the same segments may differ that ended in the same place
)
SEGMENT_HORIZON_SHARES = (0.1, 0.3, 1.0)  # of the segments that a fit goes through, in horizons


def fit_segments(
    problem: EstimationProblem,
    parts: Sequence[Segments],
    start: Mapping[str, float],
    free: Sequence[str],
    *,
    start_per_log: Sequence[Mapping[str, float]] = (),
    rounds: int = 15,
) -> Fit:
    """Fit free parameters to some parts with the study's kernels, scopes and bounds.

    Ripples are first fitted in every log by itself, which finds the phases; then their amplitudes are made one.
    """
    found = _fit_with_scopes(problem, parts, start, free, start_per_log, rounds)
    pairs = tied_pairs(free)
    if len(parts) == 1 or not pairs or not rounds:
        return found
    return _fit_with_scopes(
        problem, parts, found.values, free, found.per_log, rounds, states=found.states, phased=pairs
    )


def _fit_with_scopes(problem: EstimationProblem, parts, start, free, start_per_log, rounds: int, **ties) -> Fit:
    return fit(
        kernels_for(problem, free, start, start_per_log),
        parts,
        start,
        free,
        per_log=per_log_names(free),
        limits=limits_of(free, problem.plant, problem.module.SIGNED),
        start_per_log=start_per_log,
        max_step=problem.max_step,
        rounds=rounds,
        **ties,
    )


def kernels_for(
    problem: EstimationProblem, free: Sequence[str], *values: Mapping[str, float] | Sequence[Mapping[str, float]]
):
    """The study's kernels, or those of the bare plant, several times faster, where no effect is fitted or given."""
    given = [v for found in values for v in ([found] if isinstance(found, Mapping) else found)]
    named = {n for v in given for n, x in v.items() if "." in n and n in problem.module.PARAMETERS
             and x != problem.module.ABSENT[problem.module.PARAMETERS.index(n)]}  # fmt: skip
    if problem.model.effects or named or any("." in n for n in free):
        return problem.module
    return kernels.model_module(problem.model.plant, problem.model.assumptions, ())


class ContinuationResult(NamedTuple):
    """Where fits to short segments lead."""

    values: dict[str, float]
    per_log: tuple[Mapping[str, float], ...]
    errors: tuple[float, ...]  # of each length


def fit_model(
    problem: EstimationProblem,
    start: Mapping[str, float],
    free: Sequence[str],
    *,
    horizons: Sequence[float] = SEGMENT_HORIZON_SHARES,
    start_per_log: Sequence[Mapping[str, float]] = (),
) -> Fit:
    """Fit the free parameters to the training parts, from short to long segments, given as shares of the horizon.

    Where that ends far from the noise, underway or nowhere, the starts from before any fit get their chance too: a
    model that lacks an effect can be bent, on short segments, into one that cannot be simulated over long ones. Where
    it ends underway in the noise or near it, it goes on with fresh states.
    Raises Failure where no start leads to a model that can.
    """
    first = _fit_growing_segments(problem, start, free, horizons[:-1], start_per_log)
    best, begun = _fit_at_length(problem, first.values, free, first.per_log, horizons[-1]), [first]
    if (
        best.error < MAX_NOISE_LEVEL_ERROR_RATIO * problem.floor
    ):  # in the noise no other start leads further than going on does
        on = best if best.converged else _fit_at_length(problem, best.values, free, best.per_log, horizons[-1])
        return min(best, on, key=lambda f: f.cost)
    if horizons[-1] == 1.0 and not best.converged and best.error < WRONG_START_ERROR_RATIO * problem.floor:
        again = _fit_growing_segments(
            problem, best.values, free, SEGMENT_HORIZON_SHARES[:-1], best.per_log
        )  # with fresh states
        other = _fit_at_length(problem, again.values, free, again.per_log, 1.0)
        best = other if other.cost < best.cost else best
    for number, origin in enumerate(problem.fallback_starts):
        arrived = best.converged and best.error < WRONG_START_ERROR_RATIO * problem.floor
        if np.isfinite(best.cost) and (number > 0 or arrived):
            break
        again = _fit_growing_segments(problem, {**start, **origin}, free, horizons[:-1], start_per_log)
        if any(_is_same_fit(again, earlier) for earlier in begun):
            continue  # from there it would go the same way again
        begun.append(again)
        other = _fit_at_length(problem, again.values, free, again.per_log, horizons[-1])
        best = other if not best.cost <= other.cost else best
    if not np.isfinite(best.cost):
        raise Failure(
            f"{problem.training[0].log.name}: the model must be one that can be simulated over "
            f"{problem.horizon} s, but no start led to one. Check `wheelpend inspect`, or give nominal values "
            "in [parameters]."
        )
    return best


def _fit_growing_segments(
    problem: EstimationProblem,
    start: Mapping[str, float],
    free: Sequence[str],
    shares: Sequence[float],
    start_per_log: Sequence[Mapping[str, float]],
) -> ContinuationResult:
    """Values, and those of each log, after fits to short segments that grow, until one lies in the noise.

    Each length starts from fresh initial states: states fitted to a wrong model can trap the next fit.
    """
    begun = ContinuationResult(dict(start), tuple(start_per_log), ())
    for share in shares:
        result = _fit_at_length(problem, begun.values, free, begun.per_log, share)
        begun = ContinuationResult(result.values, result.per_log, (*begun.errors, result.error))
        if result.converged and result.error < MAX_EXPLAINED_ERROR_RATIO * problem.floor:
            break
    return begun


def _fit_at_length(
    problem: EstimationProblem, values: Mapping[str, float], free: Sequence[str], own, share: float
) -> Fit:
    """Fit to segments that are a share of the horizon long."""
    parts = problem.training if share == 1.0 else shortened_segments(problem, share * problem.horizon)
    return fit_segments(problem, parts, values, free, start_per_log=own, rounds=25 if share == 1.0 else 15)


def _is_same_fit(one: ContinuationResult, other: ContinuationResult) -> bool:
    """Whether two ways through short segments ended at the same error, and so in the same place as it seems."""
    same = bool(one.errors) and len(one.errors) == len(other.errors)
    return same and abs(one.errors[-1] - other.errors[-1]) < SAME_FIT_RELATIVE_TOLERANCE * one.errors[-1]
