"""Parameters with standard errors, by the method of one's choice."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

import numpy as np

from wheelpend.errors import Failure, did_you_mean
from wheelpend.estimation import least_squares
from wheelpend.estimation.data import read_logs
from wheelpend.estimation.free_parameters import known_values
from wheelpend.estimation.least_squares import LinearFit
from wheelpend.estimation.parameter_table import parameter_table
from wheelpend.estimation.parameters import kernel_parameters
from wheelpend.identification import instrumental
from wheelpend.identification.bias_test import BiasTest, hausman_test
from wheelpend.identification.bootstrap import ParametricBootstrap, parametric_bootstrap, shooting_fit
from wheelpend.identification.recursive import TrackPoint, recursive_least_squares
from wheelpend.kernels import load as kernels
from wheelpend.logs.log import Log
from wheelpend.model.record import Model, check_finite

if TYPE_CHECKING:
    from wheelpend.identification.time_constants import Tau, TimeConstantChoice

METHOD_NAMES = ("differentiation", "filtered", "iv", "shooting", "recursive", "energy", "inverse")
PAPER_TAU = (2.25, 6.5)  # s, the paper's Tables 1 and 2
DEFAULT_TAU: dict[str, tuple[float, ...]] = {
    "filtered": PAPER_TAU,
    "recursive": PAPER_TAU,
    "iv": instrumental.IV_TIME_CONSTANTS_S,
    "energy": (np.inf,),
}
IS_FIRST_ORDER_HOLD = {"zero": False, "first": True}
DEFAULT_HOLD = {"filtered": "first", "recursive": "zero"}  # zero is the paper's (41)
LEAST_SQUARES = ("differentiation", "filtered", "recursive", "energy")  # what noise in the regressor biases
Progress = Callable[[str], None]


@dataclass(frozen=True)
class Identification:
    """Identified parameters."""

    method: str
    parameters: dict[str, dict]  # name: value, sigma, identifiable
    condition_number: float
    samples: int
    error: float | None  # of the fit in units of σ, for shooting
    noise_floor: float | None
    warnings: tuple[str, ...]
    start: Model = field(repr=False)  # whose parameters were identified
    unit: dict[str, str] = field(repr=False, default_factory=dict)
    tau: tuple[float, ...] | None = None  # s, of the filters; None where there is none, and for pure integration
    hold: str | None = None  # how measured signals go on between samples, zero or first
    forgetting: float | None = None  # of recursive
    track: tuple[TrackPoint, ...] = ()  # of recursive: the estimate as time went on
    bias: BiasTest | None = None  # of least squares: whether noise in the regressor shows
    guide: TimeConstantChoice | None = None  # for --tau auto
    force_error: float | None = None  # of inverse: what the equations leave of the input [%]

    @cached_property
    def model(self) -> Model:
        """The model with the identified values."""
        return self.start.with_fit({n: (row["value"], row["sigma"]) for n, row in self.identified.items()})

    @property
    def identified(self) -> dict[str, dict]:
        """The parameters that the log tells."""
        return {n: row for n, row in self.parameters.items() if row["identifiable"]}

    def __post_init__(self) -> None:
        for name, row in self.identified.items():
            check_finite(name, row["value"])


class RegressionOptions(NamedTuple):
    """What a regression needs beside the log."""

    method: str
    tau: tuple[float, ...]
    hold: str | None
    forgetting: float


@dataclass
class RegressionProblem:
    """A log and the model's side of its regression."""

    model: Model
    module: ModuleType
    log: Log
    parameters: np.ndarray
    progress: Progress

    @cached_property
    def bootstrap(self) -> ParametricBootstrap:
        """The log, ready to be played again; made once."""
        return parametric_bootstrap(self.model, self.module, self.log, self.parameters, self.progress)


def identify(
    model: Model,
    logs: Sequence[str | Path | Log],
    *,
    method: str = "shooting",
    tau: Sequence[float] | float | Literal["auto"] | None = None,
    hold: str | None = None,
    forgetting: float | None = None,
    test_bias: bool = True,
    progress: Progress = lambda text: None,
) -> Identification:
    """Identify the model's parameters from all samples of the logs.

    ``tau`` are the filters' time constants [s], 'auto' to choose them for the log, None for the method's own; a single
    one for the method 'energy'. ``hold`` is 'zero' or 'first' for 'filtered' and 'recursive', ``forgetting`` a factor
    for 'recursive'. ``test_bias`` rehearses the log to see whether least squares is biased on it. Raises Failure for an
    unknown method, for settings that cannot be, and for logs that cannot be used.
    """
    if method not in METHOD_NAMES:
        raise Failure(
            f"No method named '{method}'. Known methods: {', '.join(METHOD_NAMES)}.{did_you_mean(method, METHOD_NAMES)}"
        )
    settings = RegressionOptions(method, check_tau(method, tau), check_hold(method, hold), check_forgetting(forgetting))
    unused = _unused_option_warnings(method, tau, hold, forgetting)
    if method == "shooting":
        return _identify_by_shooting(model, logs, unused, progress)
    return _identify_by_regression(
        _regression_problem(model, logs, method, progress), settings, tau == "auto", test_bias, unused
    )


# ---- what may be set


def check_tau(method: str, tau: Sequence[float] | float | Literal["auto"] | None) -> tuple[float, ...]:
    """Time constants of a method; its own where none are given or they are to be chosen."""
    default = DEFAULT_TAU.get(method, ())
    if tau is None or (tau == "auto" and len(default) != 1) or not default:
        return default
    if tau == "auto":
        raise Failure(f"The time constants of '{method}' cannot be chosen with auto. Give --tau T in s, or none.")
    assert not isinstance(tau, str)
    given = tuple(map(float, tau)) if isinstance(tau, Sequence) else (float(tau),)
    if len(given) != len(default):
        needs = "one time constant" if len(default) == 1 else "two time constants"
        raise Failure(f"The method '{method}' takes {needs} in s, but {len(given)} came. "
                      f"Give --tau {','.join(('0.5', '1')[: len(default)])}.")  # fmt: skip
    if not all(0.0 < t < (np.inf if len(given) == 2 else 1e300) for t in given) and given != (np.inf,):
        raise Failure(f"Time constants must be positive and finite, in s, not {', '.join(f'{t:g}' for t in given)}.")
    return given


def check_hold(method: str, hold: str | None) -> str | None:
    """How measured signals go on between samples; None for methods that do not ask."""
    if hold is not None and hold not in IS_FIRST_ORDER_HOLD:
        raise Failure(
            f"No hold named '{hold}'. Known holds: {', '.join(IS_FIRST_ORDER_HOLD)}."
            f"{did_you_mean(hold, IS_FIRST_ORDER_HOLD)}"
        )
    return (hold or DEFAULT_HOLD[method]) if method in DEFAULT_HOLD else None


def check_forgetting(forgetting: float | None) -> float:
    """The factor by which a sample's weight falls with each that follows."""
    if forgetting is None:
        return 1.0
    if not 0.0 < forgetting <= 1.0:
        raise Failure(f"The forgetting factor must be above 0 and at most 1, not {forgetting:g}. "
                      "1 forgets nothing; 0.9999 remembers about 10000 samples.")  # fmt: skip
    return float(forgetting)


def _unused_option_warnings(method: str, tau, hold: str | None, forgetting: float | None) -> tuple[str, ...]:
    ignored: list[tuple[str, object, Collection[str]]] = [
        ("--tau", tau, DEFAULT_TAU),
        ("--hold", hold, DEFAULT_HOLD),
        ("--forgetting", forgetting, ("recursive",)),
    ]
    return tuple(f"{option} is not used by the method '{method}'."
                 for option, given, users in ignored if given is not None and method not in users)  # fmt: skip


# ---- the methods


def _identify_by_shooting(model: Model, logs: Sequence, unused: tuple[str, ...], progress: Progress) -> Identification:
    problem, fitted = shooting_fit(model, logs, progress)
    table = parameter_table(problem, fitted)
    lost = {n for n, row in table.items() if not row["identifiable"]}
    return Identification(
        "shooting", table, fitted.condition, sum(len(p.log) for p in problem.training), fitted.error, problem.floor,
        (*problem.warnings, *_unexcited_warnings(lost), *unused), model, _units(problem.module),
    )  # fmt: skip


def _regression_problem(model: Model, logs: Sequence, method: str, progress: Progress) -> RegressionProblem:
    loaded = read_logs(logs, model)
    if len(loaded) != 1:
        raise Failure(f"The method '{method}' takes one log, but {len(loaded)} were given. Use `--method shooting`.")
    module = kernels.model_module(model.plant, model.assumptions, model.effects)
    parameters = kernel_parameters(module, known_values(model), loaded[0])
    return RegressionProblem(model, module, loaded[0], parameters, progress)


def _identify_by_regression(
    regression: RegressionProblem, settings: RegressionOptions, auto: bool, test_bias: bool, warnings: tuple[str, ...]
) -> Identification:
    guide, bias = None, None
    if auto and settings.tau:
        from wheelpend.identification import time_constants

        guide = time_constants.choose_time_constants(
            regression.bootstrap,
            partial(_replica_estimator, regression, settings),
            regression.module.LINEAR,
            regression.progress,
        )
        settings = settings._replace(tau=guide.chosen)
    regression.progress("regression")
    fitted, track = _regression_fit(regression, settings, regression.log)
    if test_bias and settings.method in LEAST_SQUARES:
        bias, untested = _bias_test_or_warning(regression, settings, fitted)
        warnings = (*warnings, *untested)
    values = {**dict(zip(regression.module.PARAMETERS, regression.parameters, strict=True)), **fitted.values}
    left = None
    if settings.method == "inverse":
        from wheelpend.identification.inverse_dynamics import force_error

        left = force_error(regression.module, regression.log, values)
    return _result(regression, settings, fitted, warnings, track=track, bias=bias, guide=guide, force_error=left)


def _regression_fit(
    regression: RegressionProblem, settings: RegressionOptions, log: Log
) -> tuple[LinearFit, tuple[TrackPoint, ...]]:
    """One regression of a log, with the way to it where it is recursive."""
    common = (regression.module, log, regression.parameters)
    method, tau, held = settings.method, settings.tau, IS_FIRST_ORDER_HOLD[settings.hold or "first"]
    if method == "differentiation":
        return least_squares.differentiation_least_squares(*common), ()
    if method == "energy":
        from wheelpend.identification.energy import energy_least_squares

        return energy_least_squares(*common, tau[0]), ()
    if method == "inverse":
        from wheelpend.identification.inverse_dynamics import inverse_dynamics  # imported late: it needs scipy.signal

        return inverse_dynamics(*common), ()
    pair = (tau[0], tau[1])
    if method == "iv":
        return instrumental.instrumental_estimate(
            regression.model, regression.module, log, regression.parameters, pair
        ).fit, ()
    if method == "recursive":
        found = recursive_least_squares(*common, pair, first_order_hold=held, forgetting=settings.forgetting)
        return found.fit, found.track
    return least_squares.filtered_least_squares(*common, pair, first_order_hold=held), ()


def _replica_estimator(
    regression: RegressionProblem, settings: RegressionOptions, tau: Tau
) -> Callable[[Log], np.ndarray]:
    """What makes an estimate of a replica with some time constants."""
    if settings.method != "iv":
        return lambda log: _regression_fit(regression, settings._replace(tau=tau), log)[0].estimate
    rehearsal, loop = (
        regression.bootstrap,
        instrumental.ClosedLoop.of(regression.model, regression.module, regression.log),
    )
    run = loop.run(rehearsal.parameters)
    if run is None:
        raise Failure(
            f"{regression.log.name}: the simulated robot must stay up to choose time constants, but it falls. "
            "Give --tau T1,T2."
        )
    chosen = instrumental.simulated_instruments(regression.module, regression.log, run, rehearsal.parameters, tau)
    return partial(_estimate_with_instruments, regression, tau, chosen)


def _estimate_with_instruments(
    regression: RegressionProblem, tau: Tau, instrument_columns: np.ndarray, log: Log
) -> np.ndarray:
    rows = instrumental.filtered_equations(regression.module, log, regression.parameters, tau)
    return instrumental.solve_instrumental(regression.module, rows, instrument_columns).estimate


def _bias_test_or_warning(
    regression: RegressionProblem, settings: RegressionOptions, fitted: LinearFit
) -> tuple[BiasTest | None, tuple[str, ...]]:
    """Whether least squares is biased on the log, or why that cannot be said; of a long log its beginning tells."""
    if len(regression.log) > least_squares.CHUNK_SAMPLES:
        regression = replace(regression, log=regression.log.part(0, least_squares.CHUNK_SAMPLES))
        fitted = _regression_fit(regression, settings, regression.log)[0]
    try:
        rehearsal = regression.bootstrap
        regression.progress("rehearsing the log")
        return hausman_test(rehearsal, fitted, lambda log: _regression_fit(regression, settings, log)[0]), ()
    except Failure as failure:
        return None, (f"Least squares was not tested for bias: {failure}",)


def _result(
    regression: RegressionProblem,
    settings: RegressionOptions,
    fitted: LinearFit,
    warnings: tuple[str, ...],
    **more: Any,
) -> Identification:
    table = {
        n: {"value": float(v), "sigma": float(s), "identifiable": n not in fitted.unidentifiable}
        for n, v, s in zip(fitted.names, fitted.estimate, fitted.sigma, strict=True)
    }
    held = tuple(
        f"{n} enters nonlinearly; the regression takes it as it stands in the model."
        for n in regression.module.PARAMETERS[: regression.module.FITTED]
        if n not in fitted.names
    )
    warnings = (*regression.log.warnings, *_unexcited_warnings(fitted.unidentifiable), *held, *warnings)
    tau = settings.tau if np.isfinite(settings.tau).all() and settings.tau else None
    forgetting = settings.forgetting if settings.method == "recursive" else None
    return Identification(
        settings.method, table, fitted.condition, len(regression.log), None, None, warnings, regression.model,
        _units(regression.module), tau, settings.hold, forgetting, **more,
    )  # fmt: skip


def _unexcited_warnings(names) -> tuple[str, ...]:
    return tuple(f"{n} is not excited by this log: its value means nothing. Record faster or larger motion."
                 for n in sorted(names))  # fmt: skip


def _units(module) -> dict[str, str]:
    return dict(zip(module.PARAMETERS, module.UNITS, strict=True))


__all__ = ["METHOD_NAMES", "Identification", "identify"]
