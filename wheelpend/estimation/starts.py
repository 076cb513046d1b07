"""Starting values: nominal ones, or least squares behind filters of several time constants, the best of them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from wheelpend.errors import Failure
from wheelpend.estimation.continuation import fit_segments, kernels_for
from wheelpend.estimation.criteria import MAX_EXPLAINED_ERROR_RATIO
from wheelpend.estimation.data import shortened_segments
from wheelpend.estimation.fit import Fit
from wheelpend.estimation.free_parameters import free_names, known_values
from wheelpend.estimation.nonnegative import nonnegative_least_squares
from wheelpend.estimation.parameters import kernel_parameters
from wheelpend.estimation.prediction import segments_rms_error
from wheelpend.estimation.problem import EstimationProblem
from wheelpend.estimation.profiled_starts import profiled_start_values
from wheelpend.estimation.segments import Segments
from wheelpend.estimation.shooting import Simulator
from wheelpend.estimation.states import fit_states, initial_states
from wheelpend.estimation.step_size import shortest_time_constant, step_within
from wheelpend.kernels.load import model_module
from wheelpend.logs.commands import longest_known_part
from wheelpend.logs.log import Log

MAX_START_SAMPLES = 200_000  # samples of a log that give a start
START_TIME_CONSTANTS_S = (0.03, 0.14, 0.6, 2.5)  # s, of the filters behind which a start is estimated
TIME_CONSTANT_RATIO = 1.3  # of the second filter's to the first's
MAX_START_SEGMENTS = 40  # short segments of a log on which starts are compared
START_SEGMENTS_PER_HORIZON = 5  # which are so much shorter than the horizon
START_FIT_ROUNDS, START_STATE_ROUNDS = 8, 3  # of a fit to them, and of one of the initial states alone
SHOWN_SHARE_OF_ROW = 0.1  # of the time between rows: the longest step in which what settles faster is but followed
SHORT_SHARE_OF_ROW = 0.01  # of the time between rows, below which no step need be: no row shows what settles within it
LONGEST_LEAST_STEP_S = 5e-4  # s, however far rows are apart: it is stable down to a time constant of 0.2 ms
MAX_FITTED_STARTS = 3  # of the candidates, those with the least cost before any fit


def start_candidates(problem: EstimationProblem) -> list[dict[str, float]]:
    """Possible starts for the base parameters: the model's values, and filtered regressions of a log.

    That is the first one which is long enough for any filter. The parameters are sums of positive physical constants,
    so the regressions are nonnegative least squares. Raises Failure where the model gives no values and the log is too
    short for the fastest filter.
    """
    complete = _complete_initial_values(problem)
    known = complete or _initial_values(problem)
    pieces = [longest_known_part(log)[0] for log in problem.logs]
    log = next((piece for piece in pieces if start_time_constants(piece)), pieces[0])
    log = log.part(0, min(len(log), MAX_START_SAMPLES))
    found = [*([complete] if complete else []), *_regressed_starts(problem, log, known)]
    if not found:
        shortest = next((t for t in START_TIME_CONSTANTS_S if t > 4 * log.dt), START_TIME_CONSTANTS_S[-1])
        raise Failure(
            f"{log.name} must last more than {4 * shortest:g} s in one piece to start without nominal values; "
            f"it lasts {log.duration:.3f} s. Give nominal values in [parameters]."
        )
    return found


def start_time_constants(log: Log) -> list[tuple[float, float]]:
    """Filter time constants [s] that lie between the sampling and the duration of a log, fast ones first."""
    times = [t for t in START_TIME_CONSTANTS_S if 4 * log.dt < t < log.duration / 4]
    return [(t, TIME_CONSTANT_RATIO * t) for t in times]


def _regressed_starts(problem: EstimationProblem, log: Log, known: Mapping[str, float]) -> list[dict[str, float]]:
    """Known values with the linear parameters that are not fixed estimated behind each pair of filters."""
    plain, fixed = model_module(problem.model.plant, problem.model.assumptions, ()), problem.restrictions.fixed
    return [
        {**known, **nonnegative_least_squares(plain, log, kernel_parameters(plain, known, log), tau), **fixed}
        for tau in start_time_constants(log)
    ]


def _initial_values(problem: EstimationProblem) -> dict[str, float]:
    """Values that the model gives, and starts from a log for parameters that mean nothing at the effect's absence."""
    settings = profiled_start_values(problem) if problem.model.effects else {}
    return {**settings, **known_values(problem.model)}


def _complete_initial_values(problem: EstimationProblem) -> dict[str, float] | None:
    """Initial values where the model gives all base parameters; else None."""
    known = _initial_values(problem)
    return known if all(n in known for n in problem.base) else None


def best_start(problem: EstimationProblem) -> tuple[EstimationProblem, dict[str, float]]:
    """The problem with its integration step and fallback starts, and the start with the best fit to short segments.

    Raises Failure where the model cannot be simulated from any start.
    """
    segments = shortened_segments(
        problem, problem.horizon / START_SEGMENTS_PER_HORIZON, max_segments=MAX_START_SEGMENTS
    )
    known = _complete_initial_values(problem)
    if known is not None:
        values, fitted = _short_fit(problem, segments, known)
        if _is_at_noise_level(problem, fitted):  # no start can be better
            return replace(problem, max_step=_step_at(problem, values), fallback_starts=(known,)), values
    candidates = start_candidates(problem)
    best = _best_candidate(problem, segments, candidates)
    if best is None:
        raise Failure(f"{problem.logs[0].name}: no start was found from which the model can be simulated. "
                      "Check `wheelpend inspect`, or give nominal values in [parameters].")  # fmt: skip
    fallback_starts = (candidates[0], *candidates[:0:-1][:2])
    return replace(problem, max_step=_step_at(problem, best), fallback_starts=fallback_starts), best


def _best_candidate(
    problem: EstimationProblem, segments: Sequence[Segments], candidates: Sequence[dict[str, float]]
) -> dict[str, float] | None:
    """Values of the best of the most promising candidates after a short fit; None where none can be simulated."""
    ranked = sorted(candidates, key=lambda v: _start_error(problem, segments[0], v))[:MAX_FITTED_STARTS]
    best, lowest = None, np.inf
    for start in ranked:
        values, fitted = _short_fit(problem, segments, start)
        if fitted.cost < lowest:
            best, lowest = values, fitted.cost
        if _is_at_noise_level(problem, fitted):
            break
    return best


def _is_at_noise_level(problem: EstimationProblem, fitted: Fit) -> bool:
    return fitted.error < MAX_EXPLAINED_ERROR_RATIO * problem.floor


def _short_fit(
    problem: EstimationProblem, segments: Sequence[Segments], start: Mapping[str, float]
) -> tuple[dict[str, float], Fit]:
    """Values after a few rounds from a start, and their fit, with an integration step for the start."""
    stepped = replace(problem, max_step=_step_at(problem, start))
    fitted = fit_segments(stepped, segments, start, free_names(problem, ()), rounds=START_FIT_ROUNDS)
    return {**start, **fitted.values}, fitted


def _step_at(problem: EstimationProblem, values: Mapping[str, float]) -> float:
    """Integration step [s] that resolves the machine's fastest motion at some values, as far as rows can show it.

    An inertia that is too small for them to show would else cost thousands of steps for each; what settles within a
    tenth of a row is followed without being resolved. What moves inside is given a step of its own.
    """
    apart = min(log.dt for log in problem.logs)
    needed, shown = (min(share * apart, LONGEST_LEAST_STEP_S) for share in (SHORT_SHARE_OF_ROW, SHOWN_SHARE_OF_ROW))
    settling = shortest_time_constant(problem.module, values, problem.logs[0])
    return max(step_within(settling), needed, min(shown, settling))


def _start_error(problem: EstimationProblem, segments: Segments, values: Mapping[str, float]) -> float:
    """Error [σ] of a start on segments, with only the initial states fitted."""
    module = kernels_for(problem, (), values)
    first, parameters = initial_states(module, segments), kernel_parameters(module, values, segments.log)
    linearisation = fit_states(
        Simulator(module), segments, first, parameters, rounds=START_STATE_ROUNDS, keep_residual=False
    )[1]
    return segments_rms_error(segments, linearisation)
