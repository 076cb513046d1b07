"""What a model leaves to chance: sizes and times of random sources, at given values or refitted with them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TypeVar

import numpy as np

from wheelpend.errors import Failure
from wheelpend.estimation.filter_fit import FilterEstimator, FilterPoint
from wheelpend.estimation.free_parameters import free_names
from wheelpend.estimation.problem import EstimationProblem
from wheelpend.estimation.random_source import possible_errors, possible_forces
from wheelpend.estimation.source_search import likeliest_sources
from wheelpend.identification.filter_error_method import estimator_at, remainder_at_point
from wheelpend.identification.remainder import Remainder
from wheelpend.kernels.kernel_module import KernelModule
from wheelpend.kernels.load import free_force_module

MAX_REMAINDER_SAMPLES = 4_000  # of all logs together: enough for a size to some percent, in a second or a few

NO_REMAINDER_WORDS = "What the model leaves to chance could not be found"

Found = TypeVar("Found")
LogValues = Sequence[Mapping[str, float]]  # values of all parameters in each log


def refitted_remainder(problem: EstimationProblem, log_values: LogValues) -> Remainder:
    """The random sources that a model needs with its parameters refitted beside them, from values of each log.

    A fit without random forces bends the parameters to what is missing, so that more seems to be missing than is.
    Raises Failure where no filter can follow the model along a part of the logs.
    """
    free = free_names(problem, problem.model.effects)
    return remainder_at_point(problem, *likeliest_point(problem, log_values, free))


def remainder_or_warning(
    find: Callable[[EstimationProblem, LogValues], Remainder], problem: EstimationProblem, log_values: LogValues
) -> tuple[Remainder | None, tuple[str, ...]]:
    """What the one above finds; or None, and why."""
    return found_or_warning(NO_REMAINDER_WORDS, lambda: find(problem, log_values))


def found_or_warning(lacking: str, find: Callable[[], Found]) -> tuple[Found | None, tuple[str, ...]]:
    """What a filter along the logs finds; or None, and what is ``lacking`` and why."""
    try:
        return find(), ()
    except Failure as failure:
        return None, (f"{lacking}: {failure}",)
    except (ZeroDivisionError, np.linalg.LinAlgError):
        return None, (f"{lacking}: with these values the model cannot be simulated.",)


def _kernels(problem: EstimationProblem) -> KernelModule:
    """Kernels with a free force on each row: the plain plant's, or with effects the problem's, compiled for any."""
    model = problem.model
    if model.effects and problem.module.MISSING_FORCES:
        return problem.module
    return free_force_module(model.plant, model.assumptions, model.effects)


def likeliest_point(
    problem: EstimationProblem, log_values: LogValues, free: Sequence[str]
) -> tuple[FilterEstimator, FilterPoint]:
    """The random sources that a model needs at or near its values in each log, on a part of long logs.

    Raises Failure where no filter can follow the model along them.
    """
    module = _kernels(problem)
    estimator = estimator_at(problem, module, free, log_values, lambda: log_values).on_part(MAX_REMAINDER_SAMPLES)
    forces, errors = possible_forces(problem.plant, module.NY), possible_errors(module.OUTPUTS, module.NQ)
    point = likeliest_sources(estimator, [estimator.problem.space.start()], forces, errors, lambda text: None)
    require_finite(point)
    return estimator, point


def require_finite(point: FilterPoint) -> None:
    """Raise Failure where no filter could follow the model along the logs."""
    if not np.isfinite(point.deviance):
        raise Failure("the likelihood of the logs must be a number, but with these values the filter left the finite "
                      "numbers. Identify the model first: `wheelpend identify LOG --save`.")  # fmt: skip
