"""Continuation: a fit that goes from short segments to full ones, with fresh initial states at each length."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from wheelpend.errors import NotSimulable
from wheelpend.estimation.criteria import (
    MAX_EXPLAINED_ERROR_RATIO,
    MAX_NOISE_LEVEL_ERROR_RATIO,
    WRONG_START_ERROR_RATIO,
)
from wheelpend.estimation.data import shortened_segments
from wheelpend.estimation.fit import Fit
from wheelpend.estimation.free_parameters import free_parameters, tied_pairs
from wheelpend.estimation.gauss_newton import fit
from wheelpend.estimation.parameter_space import ParameterSpace
from wheelpend.estimation.parameters import ParameterLayout
from wheelpend.estimation.problem import EstimationProblem
from wheelpend.estimation.segments import Segments
from wheelpend.estimation.shooting import Simulator
from wheelpend.estimation.shooting_problem import ShootingProblem
from wheelpend.kernels.kernel_module import KernelModule
from wheelpend.kernels.load import model_module

SAME_FIT_RELATIVE_TOLERANCE = 1e-3  # relative difference of the errors of two fits that ended at the same minimum
SEGMENT_HORIZON_SHARES = (0.1, 0.3, 1.0)  # lengths of the segments that a fit goes through, in horizons
SHORT_FIT_ROUNDS, FULL_FIT_ROUNDS = 15, 25  # rounds on short segments, and on those of a whole horizon


def fit_segments(
    problem: EstimationProblem,
    segments: Sequence[Segments],
    start: Mapping[str, float],
    free: Sequence[str],
    *,
    start_per_log: Sequence[Mapping[str, float]] = (),
    rounds: int = SHORT_FIT_ROUNDS,
) -> Fit:
    """Fit free parameters to segments of one log or several, with the problem's kernels, scopes and bounds.

    A ripple is first fitted in every log by itself, which finds the phases; then its amplitudes are made equal.
    """
    shooting = shooting_problem(problem, segments, start, free, start_per_log)
    found = fit(shooting, rounds=rounds)
    pairs = tied_pairs(free)
    if len(segments) == 1 or not pairs or not rounds:
        return found
    return fit(
        shooting_problem(problem, segments, found.values, free, found.per_log, pairs),
        states=found.states,
        rounds=rounds,
    )


def shooting_problem(
    problem: EstimationProblem,
    segments: Sequence[Segments],
    start: Mapping[str, float],
    free: Sequence[str],
    start_per_log: Sequence[Mapping[str, float]] = (),
    tied: Sequence[tuple[str, str]] = (),
) -> ShootingProblem:
    """The multiple-shooting problem of free parameters, with the scopes and bounds that the effect library gives them.

    ``tied`` are pairs of sine and cosine with one amplitude for all logs.
    """
    module = kernels_for(problem, free, start, start_per_log)
    layout = ParameterLayout.of(free_parameters(problem, free), len(segments))
    space = ParameterSpace.of(layout, start, start_per_log).with_tied_amplitudes(tied)
    return ShootingProblem(Simulator(module, problem.max_step), segments, space)


def kernels_for(
    problem: EstimationProblem, free: Sequence[str], *values: Mapping[str, float] | Sequence[Mapping[str, float]]
) -> KernelModule:
    """The problem's kernels, or those of the bare plant, several times faster, where no effect is fitted or present."""
    first, last = problem.module.OWN_PARAMETERS, problem.module.FITTED  # of the effects' parameters
    absent = dict(zip(problem.module.PARAMETERS[first:last], problem.module.ABSENT[first:last], strict=True))
    given = [v for each in values for v in ([each] if isinstance(each, Mapping) else each)]
    present = any(n in absent and x != absent[n] for v in given for n, x in v.items())
    if problem.model.effects or present or any(n not in problem.base for n in free):
        return problem.module
    return model_module(problem.model.plant, problem.model.assumptions, ())


class ContinuationResult(NamedTuple):
    """Values at the end of fits to short segments."""

    values: dict[str, float]
    per_log: tuple[Mapping[str, float], ...]
    errors: tuple[float, ...]  # σ, of each length


class _Continuation(NamedTuple):
    """Free parameters, and the segment lengths through which they are fitted."""

    problem: EstimationProblem
    free: Sequence[str]
    horizons: Sequence[float]  # shares of the horizon

    def short_fits(
        self, start: Mapping[str, float], per_log: Sequence[Mapping[str, float]], shares: Sequence[float] | None = None
    ) -> ContinuationResult:
        """Fits to short segments that grow, until one reaches the noise level.

        Each length starts from fresh initial states: states fitted to a wrong model can trap the next fit.
        """
        result = ContinuationResult(dict(start), tuple(per_log), ())
        for share in self.horizons[:-1] if shares is None else shares:
            fitted = self.fit_at_length(result.values, result.per_log, share)
            result = ContinuationResult(fitted.values, fitted.per_log, (*result.errors, fitted.error))
            if fitted.converged and fitted.error < MAX_EXPLAINED_ERROR_RATIO * self.problem.floor:
                break
        return result

    def full_fit(self, values: Mapping[str, float], per_log: Sequence[Mapping[str, float]]) -> Fit:
        """Fit to segments of the last length."""
        return self.fit_at_length(values, per_log, self.horizons[-1])

    def fit_at_length(self, values: Mapping[str, float], per_log: Sequence[Mapping[str, float]], share: float) -> Fit:
        """Fit to segments that are a share of the horizon long."""
        problem = self.problem
        segments = problem.data.estimation if share == 1.0 else shortened_segments(problem, share * problem.horizon)
        rounds = FULL_FIT_ROUNDS if share == 1.0 else SHORT_FIT_ROUNDS
        return fit_segments(problem, segments, values, self.free, start_per_log=per_log, rounds=rounds)


def fit_model(
    problem: EstimationProblem,
    start: Mapping[str, float],
    free: Sequence[str],
    *,
    horizons: Sequence[float] = SEGMENT_HORIZON_SHARES,
    start_per_log: Sequence[Mapping[str, float]] = (),
) -> Fit:
    """Fit the free parameters to the training segments, from short to long ones, given as shares of the horizon.

    A fit that has not converged at the noise level or near it is resumed with fresh states. One that ends far above it
    is repeated from the fallback starts: a model that lacks an effect can be bent, on short segments, into one that
    cannot be simulated over long ones. Raises Failure where no start leads to a model that can.
    """
    steps = _Continuation(problem, free, horizons)
    first = steps.short_fits(start, start_per_log)
    best = steps.full_fit(first.values, first.per_log)
    if best.error < MAX_NOISE_LEVEL_ERROR_RATIO * problem.floor:  # no other start leads further than going on does
        resumed = best if best.converged else steps.full_fit(best.values, best.per_log)
        return min(best, resumed, key=lambda f: f.cost)
    if horizons[-1] == 1.0 and not best.converged and best.error < WRONG_START_ERROR_RATIO * problem.floor:
        best = _with_fresh_states(steps, best)
    best = _best_of_fallback_starts(steps, best, first, start, start_per_log)
    if not np.isfinite(best.cost):
        raise NotSimulable(
            f"{problem.logs[0].name}: the model must be one that can be simulated over "
            f"{problem.horizon} s, but no start led to one. Check `wheelpend inspect`, or give nominal values "
            "in [parameters]."
        )
    return best


def _with_fresh_states(steps: _Continuation, best: Fit) -> Fit:
    """The better of a fit, and one that goes through all lengths again from its values."""
    again = steps.short_fits(best.values, best.per_log, SEGMENT_HORIZON_SHARES[:-1])
    other = steps.full_fit(again.values, again.per_log)
    return other if other.cost < best.cost else best


def _best_of_fallback_starts(
    steps: _Continuation,
    best: Fit,
    first: ContinuationResult,
    start: Mapping[str, float],
    start_per_log: Sequence[Mapping[str, float]],
) -> Fit:
    """The best of a fit and those from the fallback starts, of which one is enough where the fit is finite."""
    passed = [first]
    for number, origin in enumerate(steps.problem.fallback_starts):
        arrived = best.converged and best.error < WRONG_START_ERROR_RATIO * steps.problem.floor
        if np.isfinite(best.cost) and (number > 0 or arrived):
            break
        again = steps.short_fits({**start, **origin}, start_per_log)
        if any(_is_same_fit(again, earlier) for earlier in passed):
            continue  # from there the full fit would be the same again
        passed.append(again)
        other = steps.full_fit(again.values, again.per_log)
        best = other if not best.cost <= other.cost else best
    return best


def _is_same_fit(one: ContinuationResult, other: ContinuationResult) -> bool:
    """True where two continuations through as many lengths ended at the same error, so presumably the same values."""
    same = bool(one.errors) and len(one.errors) == len(other.errors)
    return same and abs(one.errors[-1] - other.errors[-1]) < SAME_FIT_RELATIVE_TOLERANCE * one.errors[-1]
