"""Parameters with standard errors, by the method of one's choice."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np

from wheelpend.errors import Failure
from wheelpend.estimation.criteria import MAX_EXPLAINED_ERROR_RATIO, WRONG_START_ERROR_RATIO
from wheelpend.estimation.estimate import Covariance, Estimate
from wheelpend.estimation.fit import Fit
from wheelpend.estimation.free_parameters import free_names, known_values
from wheelpend.estimation.linear_fit import LinearFit
from wheelpend.estimation.noise_alarm import overstated_noise
from wheelpend.estimation.parameter_table import covariance_of_table, parameter_table
from wheelpend.estimation.prediction import prediction_error
from wheelpend.estimation.problem import EstimationProblem
from wheelpend.estimation.restrictions import NO_RESTRICTIONS, Restrictions
from wheelpend.estimation.validation import unpredicted_share
from wheelpend.identification.bias_test import BiasTest
from wheelpend.identification.bootstrap import shooting_fit
from wheelpend.identification.filter_error_method import FilterErrorFit, filter_error_fit
from wheelpend.identification.given_restrictions import (
    check_restricted_regression,
    estimates_at_bounds,
    given_bound_warnings,
    given_restrictions,
    with_fixed_rows,
)
from wheelpend.identification.method_options import (
    DEFAULT_METHOD,
    LEAST_SQUARES,
    METHOD_NAMES,
    RegressionOptions,
    TauOption,
    check_method,
    check_options,
    unused_option_warnings,
)
from wheelpend.identification.recursive import TrackPoint
from wheelpend.identification.regression import (
    RegressionProblem,
    bias_test_or_warning,
    choose_regression_time_constants,
    regression_fit,
    regression_problem,
)
from wheelpend.identification.remainder import Remainder, with_remainder
from wheelpend.identification.remainder_warnings import (
    bound_warnings,
    inertia_warnings,
    is_mostly_chance,
    remainder_warnings,
    undetermined_warnings,
    with_astray_marked,
)
from wheelpend.identification.time_constants import TimeConstantChoice
from wheelpend.identification.widening import Widening, widening_of
from wheelpend.kernels.kernel_module import KernelModule
from wheelpend.logs.sources import LogsLike
from wheelpend.model.record import Model, check_finite
from wheelpend.notebook import DrawnResult, ResultTable
from wheelpend.parallel import with_one_blas_thread

BIAS_UNTESTED_TEXT = "Least squares was not tested for bias: in the rehearsals every parameter would be free."
Progress = Callable[[str], None]
MIN_PROMISED_SHARE = 0.01  # of the sum of squares, that the gradient at an unmoved start promises: it is no optimum


@dataclass(frozen=True, repr=False)
class Identification(DrawnResult):
    """Identified parameters; every value that is identifiable is finite."""

    method: str
    parameters: dict[str, Estimate]  # by name
    condition_number: float
    samples: int
    error: float | None  # of the fit [σ], for filter_error and shooting
    noise_floor: float | None  # σ, likewise
    warnings: tuple[str, ...]
    start: Model = field(repr=False)  # whose parameters were identified
    unit: dict[str, str] = field(repr=False, default_factory=dict)
    tau: tuple[float, ...] | None = None  # s, of the filters; None where there is none, and for pure integration
    hold: str | None = None  # interpolation of measured signals between samples, zero or first
    forgetting: float | None = None  # of recursive
    track: tuple[TrackPoint, ...] = ()  # of recursive: the estimates on the way
    bias: BiasTest | None = None  # of least squares: the test for bias by noise in the regressor
    guide: TimeConstantChoice | None = None  # for --tau auto
    force_error: float | None = None  # of inverse: residual of the equations relative to the input [%]
    cutoff_hz: float | None = None  # Hz, of inverse: up to which the motion was differentiated
    remainder: Remainder | None = None  # of filter_error: what is left to chance
    covariance: Covariance | None = None  # of the estimates
    widening: Widening | None = None  # of filter_error: of intervals by what is assumed of the force
    fixed: tuple[str, ...] = ()  # names of parameters that were given, not estimated; their standard error is zero
    at_bounds: dict[str, float] = field(default_factory=dict)  # by name, a bound that was given and holds the estimate

    def to_json(self) -> dict[str, Any]:
        """The result under the keys of JSON."""
        return {
            "method": self.method,
            "parameters": self.parameters,
            "condition_number": self.condition_number,
            "samples": self.samples,
            "error": self.error,
            "noise_floor": self.noise_floor,
            "warnings": self.warnings,
            "tau": self.tau,
            "hold": self.hold,
            "forgetting": self.forgetting,
            "track": self.track,
            "bias": self.bias,
            "guide": self.guide,
            "force_error": self.force_error,
            "cutoff_hz": self.cutoff_hz,
            "remainder": self.remainder,
            "covariance": self.covariance,
            "widening": self.widening,
            "fixed": self.fixed,
            "at_bounds": self.at_bounds,
        }

    def headline(self) -> str:
        """The method, the samples, and the error where the method tells it."""
        left = "" if self.error is None else f", error {self.error:.3g} σ"
        floor = "" if self.noise_floor is None else f" at a noise floor of {self.noise_floor:.3g} σ"
        held = f"; fixed: {', '.join(self.fixed)}" if self.fixed else ""
        ended = f"; at a bound: {', '.join(self.at_bounds)}" if self.at_bounds else ""
        return f"Identification by {self.method} from {self.samples} samples{left}{floor}{held}{ended}"

    def table(self) -> ResultTable:
        """A row per parameter; a value that is not identifiable means nothing."""
        columns = {"parameter": str, "value": float, "sigma": float, "unit": str, "identifiable": bool}
        rows = [(n, e.value, e.sigma, e.unit, e.identifiable) for n, e in self.parameters.items()]
        return ResultTable(columns, rows)

    @cached_property
    def model(self) -> Model:
        """The model with the identified values, and with what they leave to chance where that is known."""
        held = (*self.fixed, *self.at_bounds)  # without a standard error that would mean something
        values = {n: (e.value, None if n in held else e.sigma) for n, e in self.identified.items()}
        fitted = self.start.with_fit(values)
        return with_remainder(fitted, self.remainder)

    @property
    def is_explained(self) -> bool:
        """True where the fit leaves no more than noise; a regression does not tell."""
        if self.error is None or self.noise_floor is None:
            return False
        return self.error <= MAX_EXPLAINED_ERROR_RATIO * self.noise_floor

    @property
    def identified(self) -> dict[str, Estimate]:
        """The parameters that are identifiable from the log."""
        return {n: e for n, e in self.parameters.items() if e.identifiable}

    def __post_init__(self) -> None:
        for name, found in self.identified.items():
            check_finite(name, found.value)


@with_one_blas_thread
def identify(
    model: Model,
    logs: LogsLike,
    *,
    method: str = DEFAULT_METHOD,
    tau: TauOption = None,
    hold: str | None = None,
    forgetting: float | None = None,
    test_bias: bool = True,
    fixed: Mapping[str, float] | None = None,
    bounds: Mapping[str, tuple[float | None, float | None]] | None = None,
    progress: Progress = lambda text: None,
) -> Identification:
    """Identify the model's parameters from all samples of the logs.

    ``logs`` are one or several, each a path, a Log, a DataFrame or a dict of arrays (N,), as of ``load_log``.
    ``tau`` are the filters' time constants [s], 'auto' to choose them for the log, None for the method's own; a single
    one for the method 'energy'. ``hold`` is 'zero' or 'first' for 'filtered' and 'recursive', ``forgetting`` a factor
    for 'recursive'. ``test_bias`` tests least squares for bias by a parametric bootstrap of the log. ``fixed`` are
    values of single parameters that are not estimated, by X1 or effect.parameter, ``bounds`` a lower and an upper value
    of others, None for none, all in the parameters' units; 'iv' and 'recursive' know no bounds. Raises Failure for an
    unknown method or parameter, for settings that cannot be, and for logs that cannot be used.
    """
    check_method(method)
    settings = check_options(method, tau, hold, forgetting)
    unused = unused_option_warnings(method, tau, hold, forgetting)
    limits = given_restrictions(model, method, fixed or {}, bounds or {})
    begin = model.with_fit({n: (v, None) for n, v in limits.fixed.items()}) if limits.fixed else model
    if method == "filter_error":
        found = _identify_by_filter_error(begin, logs, unused, progress, limits)
    elif method == "shooting":
        found = _identify_by_shooting(begin, logs, unused, progress, limits)
    else:
        check_restricted_regression(limits, tau == "auto")
        regression = regression_problem(begin, logs, method, progress, limits)
        found = _identify_by_regression(regression, settings, tau == "auto", test_bias, unused)
    return replace(found, start=model, fixed=tuple(limits.fixed))


def _unpredicted(found: FilterErrorFit) -> float | None:
    """Share of the motion over the horizon that a fit misses, where a random force makes one ask; else None."""
    if not is_mostly_chance(found.remainder):
        return None
    problem, space = found.problem, found.estimator.problem.space
    values = [space.values_of_log(found.point.theta, k) for k in range(len(problem.logs))]
    parts = problem.data.estimation
    found_in = [prediction_error(problem.simulator, p, v)[1] for p, v in zip(parts, values, strict=True)]
    return unpredicted_share(parts, found_in)


def _identify_by_filter_error(
    model: Model, logs: LogsLike, unused: tuple[str, ...], progress: Progress, limits: Restrictions
) -> Identification:
    found = filter_error_fit(model, logs, progress, limits)
    problem, module = found.problem, found.problem.module
    left = replace(found.remainder, unpredicted=_unpredicted(found))
    table = with_fixed_rows(with_astray_marked(found.table), limits, module)
    elements = found.estimator.problem.space.layout.elements
    at_bounds = estimates_at_bounds([p.name for p in elements], found.point.theta, limits)
    warnings = (
        *problem.warnings,
        *overstated_noise(problem, found.error, problem.data.estimation),
        *remainder_warnings(left, problem.plant),
        *bound_warnings(elements, found.point.theta, found.covariance, at_bounds),
        *given_bound_warnings(at_bounds, limits),
        *undetermined_warnings(module, problem.plant, table, (*limits.fixed, *at_bounds), left),
        *inertia_warnings(problem, table, left),
        *_unexcited_warnings(_lost_names(table)),
        *unused,
    )
    return Identification(
        "filter_error", table, found.condition, problem.samples, found.error, problem.floor, warnings,
        model, _units(problem.module), remainder=left, covariance=Covariance(found.names, found.covariance),
        widening=widening_of(found), at_bounds=at_bounds,
    )  # fmt: skip


def _identify_by_shooting(
    model: Model, logs: LogsLike, unused: tuple[str, ...], progress: Progress, limits: Restrictions
) -> Identification:
    problem, fitted = shooting_fit(model, logs, progress, limits)
    _require_moved(problem, fitted)
    table = with_fixed_rows(parameter_table(problem, fitted), limits, problem.module)
    theta = np.array([fitted.of_log(p.log or 0)[p.name] for p in fitted.free])
    at_bounds = estimates_at_bounds([p.name for p in fitted.free], theta, limits)
    warnings = (
        *problem.warnings,
        *_unexplained_warnings(fitted.error, problem.floor),
        *overstated_noise(problem, fitted.error, problem.data.estimation),
        *bound_warnings(fitted.free, theta, fitted.covariance, at_bounds),
        *given_bound_warnings(at_bounds, limits),
        *undetermined_warnings(problem.module, problem.plant, table, (*limits.fixed, *at_bounds)),
        *_unexcited_warnings(_lost_names(table)),
        *unused,
    )
    return Identification(
        "shooting", table, fitted.condition, problem.samples, fitted.error, problem.floor, warnings,
        model, _units(problem.module), covariance=covariance_of_table(problem, fitted), at_bounds=at_bounds,
    )  # fmt: skip


def _lost_names(table: Mapping[str, Estimate]) -> list[str]:
    return [n for n, e in table.items() if not e.identifiable]


def _unexplained_warnings(error: float, floor: float) -> tuple[str, ...]:
    """A warning where a fit leaves so much that its values are those of no machine."""
    if error <= WRONG_START_ERROR_RATIO * floor:
        return ()
    return (f"The fitted model leaves {error / floor:.3g} times the noise: something is missing in it, or wrong in the "
            "log. Its values and their errors mean nothing yet. Run `wheelpend diagnose`.",)  # fmt: skip


def _require_moved(problem: EstimationProblem, fitted: Fit) -> None:
    """Raise Failure where a fit ends at the model's values to the last digit although better ones must be near."""
    known, names = known_values(problem.model), free_names(problem, problem.model.effects)
    moved = [n for n in names if fitted.of_log(0)[n] != known.get(n)]
    if moved or fitted.promised_decrease < MIN_PROMISED_SHARE * fitted.cost:
        return
    share = np.sqrt(max(1.0 - fitted.promised_decrease / fitted.cost, 0.0))
    raise Failure(
        f"{problem.logs[0].name}: a fit must move from its start or begin at the optimum, but it came back with the "
        f"model's own values to the last digit: every step made the prediction worse, at an error of "
        f"{fitted.error:.4g} of which the gradient promises to leave {share:.0%}. Remove the values from model.toml, "
        "so that a start is found from the log, or give other nominal ones."
    )


def _identify_by_regression(
    regression: RegressionProblem, settings: RegressionOptions, auto: bool, test_bias: bool, warnings: tuple[str, ...]
) -> Identification:
    guide, bias, units, limits = None, None, _units(regression.module), regression.restrictions
    if auto and settings.tau:
        guide = choose_regression_time_constants(regression, settings)
        settings = settings._replace(tau=guide.chosen)
    regression.progress("regression")
    found = regression_fit(regression, settings, regression.log)
    fitted = found.fit
    at_bounds = estimates_at_bounds(fitted.names, fitted.estimate, limits)
    warnings = (*given_bound_warnings(at_bounds, limits), *warnings)
    if test_bias and settings.method in LEAST_SQUARES and limits != NO_RESTRICTIONS:
        warnings = (*warnings, BIAS_UNTESTED_TEXT)
    elif test_bias and settings.method in LEAST_SQUARES:
        bias, untested = bias_test_or_warning(regression, settings, fitted)
        warnings = (*warnings, *untested)
    table = with_fixed_rows(_linear_parameter_table(fitted, units), limits, regression.module)
    plant = regression.model.plant_signature
    undetermined = undetermined_warnings(regression.module, plant, table, (*limits.fixed, *at_bounds))
    return Identification(
        settings.method, table, fitted.condition, len(regression.log), None, None,
        (*_regression_warnings(regression, fitted), *undetermined, *warnings), regression.model, units,
        tau=settings.tau if np.isfinite(settings.tau).all() and settings.tau else None,
        hold=settings.hold,
        forgetting=settings.forgetting if settings.method == "recursive" else None,
        track=found.track,
        bias=bias,
        guide=guide,
        force_error=_force_error(regression, fitted) if settings.method == "inverse" else None,
        cutoff_hz=found.cutoff,
        covariance=_linear_covariance(fitted, limits),
        at_bounds=at_bounds,
    )  # fmt: skip


def _linear_parameter_table(fitted: LinearFit, units: Mapping[str, str]) -> dict[str, Estimate]:
    """Estimate of every linear parameter, by name."""
    rows = zip(fitted.names, fitted.estimate, fitted.sigma, strict=True)
    return {n: Estimate(float(v), float(s), units[n], n not in fitted.unidentifiable) for n, v, s in rows}


def _linear_covariance(fitted: LinearFit, limits: Restrictions) -> Covariance:
    """Covariance of the linear parameters that were free."""
    free = limits.is_free(fitted.names)
    return Covariance(tuple(limits.free(fitted.names)), fitted.covariance[np.ix_(free, free)])


def _regression_warnings(regression: RegressionProblem, fitted: LinearFit) -> tuple[str, ...]:
    """Warnings of the log, of parameters that it does not excite, and of those that no regression estimates."""
    names = regression.module.PARAMETERS[: regression.module.FITTED]
    nonlinear = tuple(f"{n} enters nonlinearly; the regression takes it as it stands in the model."
                      for n in names if n not in (*fitted.names, *regression.restrictions.fixed))  # fmt: skip
    undefined = tuple(
        f"{n} was left out: with the model's other values its part of the equations is no finite number. "
        f"Give [effect.{n.partition('.')[0]}] values other than zero."
        for n in fitted.undefined
    )
    unexcited = _unexcited_warnings(n for n in fitted.unidentifiable if n not in fitted.undefined)
    return (*regression.log.warnings, *undefined, *unexcited, *nonlinear)


def _force_error(regression: RegressionProblem, fitted: LinearFit) -> float | None:
    """Residual of the equations at the estimate relative to the input [%]; None where there is nothing to compare."""
    from wheelpend.identification.inverse_dynamics import force_error  # imported late: it needs scipy.signal

    known = dict(zip(regression.module.PARAMETERS, regression.parameters, strict=True))
    return force_error(regression.module, regression.log, {**known, **fitted.values})


def _unexcited_warnings(names: Iterable[str]) -> tuple[str, ...]:
    return tuple(f"{n} is not excited by this log: its value means nothing. Record faster or larger motion."
                 for n in sorted(names))  # fmt: skip


def _units(module: KernelModule) -> dict[str, str]:
    return dict(zip(module.PARAMETERS, module.UNITS, strict=True))


__all__ = ["METHOD_NAMES", "Identification", "identify"]
