"""Starting values: nominal ones, or least squares behind filters of several time constants, the best of them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from wheelpend.errors import Failure
from wheelpend.estimation import least_squares
from wheelpend.estimation.continuation import fit_segments, kernels_for
from wheelpend.estimation.criteria import MAX_EXPLAINED_ERROR_RATIO
from wheelpend.estimation.data import shortened_segments
from wheelpend.estimation.fit import Fit
from wheelpend.estimation.free_parameters import known_values
from wheelpend.estimation.parameters import kernel_parameters
from wheelpend.estimation.prediction import segments_rms_error
from wheelpend.estimation.problem import EstimationProblem
from wheelpend.estimation.segments import Segments
from wheelpend.estimation.states import fit_states, initial_states
from wheelpend.estimation.step_size import stable_step
from wheelpend.kernels import load as kernels

MAX_START_SAMPLES = 200_000  # samples of a log that give a start
START_TIME_CONSTANTS_S = (0.03, 0.14, 0.6, 2.5)  # filter time constants tried for a start without nominal values [s]


def start_candidates(problem: EstimationProblem) -> list[dict[str, float]]:
    """Possible starts for the base parameters: the model's values, and filtered regressions of the first log.

    The parameters are sums of positive physical constants, so a regression that makes one negative is repeated with
    non-negative least squares.
    """
    complete = _complete_initial_values(problem)
    known, found = complete or _initial_values(problem), [complete] if complete else []
    plain = kernels.model_module(problem.model.plant, problem.model.assumptions, ())
    log = problem.training[0].log
    log = log.part(0, min(len(log), MAX_START_SAMPLES))
    for time in START_TIME_CONSTANTS_S:
        if 4 * log.dt < time < log.duration / 4:
            tau = (time, 1.3 * time)
            found.append(
                {
                    **known,
                    **least_squares.nonnegative_least_squares(plain, log, kernel_parameters(plain, known, log), tau),
                }
            )
    if not found:
        raise Failure(
            f"{log.name} must last at least {4 * START_TIME_CONSTANTS_S[0]} s to start without nominal values; "
            f"it lasts {log.duration:.3f} s. Give nominal values in [parameters]."
        )
    return found


def _initial_values(problem: EstimationProblem) -> dict[str, float]:
    """What the model says of its parameters, and what a log says of those that cannot start as absent."""
    from wheelpend.estimation.profiled_starts import profiled_start_values  # imported late: it needs a study

    settings = profiled_start_values(problem) if problem.model.effects else {}
    return {**settings, **known_values(problem.model)}


def _complete_initial_values(problem: EstimationProblem) -> dict[str, float] | None:
    """The same where it says all; else None."""
    known = _initial_values(problem)
    return known if all(n in known for n in problem.base) else None


def best_start(problem: EstimationProblem) -> tuple[EstimationProblem, dict[str, float]]:
    """The start from which short segments are fitted best, and the study with a step that suits it."""
    parts = shortened_segments(problem, problem.horizon / 5, max_segments=40)
    known = _complete_initial_values(problem)
    if known is not None:
        values, fitted = _short_fit(problem, parts, known)
        if fitted.error < MAX_EXPLAINED_ERROR_RATIO * problem.floor:  # in the noise: there is none better
            return replace(problem, max_step=_step_at(problem, values), fallback_starts=(known,)), values
    found = start_candidates(problem)
    ranked = sorted(found, key=lambda v: _start_cost(problem, parts[0], v))[:3]
    best, lowest = None, np.inf
    for start in ranked:
        values, fitted = _short_fit(problem, parts, start)
        if fitted.cost < lowest:
            best, lowest = values, fitted.cost
        if fitted.error < MAX_EXPLAINED_ERROR_RATIO * problem.floor:
            break
    if best is None:
        raise Failure(f"{problem.training[0].log.name}: no start was found from which the model can be simulated. "
                      "Check `wheelpend inspect`, or give nominal values in [parameters].")  # fmt: skip
    return replace(problem, max_step=_step_at(problem, best), fallback_starts=(found[0], *found[:0:-1][:2])), best


def _short_fit(
    problem: EstimationProblem, parts: Sequence[Segments], start: Mapping[str, float]
) -> tuple[dict[str, float], Fit]:
    """Values after a few rounds from a start, and their fit, with a step that suits the start."""
    suited = replace(problem, max_step=_step_at(problem, start))
    fitted = fit_segments(suited, parts, start, problem.base, rounds=8)
    return {**start, **fitted.values}, fitted


def _step_at(problem: EstimationProblem, values: Mapping[str, float]) -> float:
    """A step that resolves the machine's fastest motion at some values [s]."""
    return stable_step(problem.module, values, problem.training[0].log)


def _start_cost(problem: EstimationProblem, part: Segments, values: Mapping[str, float]) -> float:
    module = kernels_for(problem, (), values)
    parameters = kernel_parameters(module, values, part.log)
    shot = fit_states(module, part, initial_states(module, part), parameters, rounds=3, keep_residual=False)[1]
    return segments_rms_error(part, shot)
