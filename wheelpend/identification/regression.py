"""Identification of a single log by regression: each method, its time constants, and the test of its bias."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import NamedTuple

import numpy as np

from wheelpend.errors import Failure
from wheelpend.estimation.data import read_logs
from wheelpend.estimation.free_parameters import known_values
from wheelpend.estimation.least_squares import differentiation_least_squares, filtered_least_squares
from wheelpend.estimation.linear_fit import LinearFit
from wheelpend.estimation.long_logs import CHUNK_SAMPLES
from wheelpend.estimation.parameters import kernel_parameters
from wheelpend.estimation.restrictions import NO_RESTRICTIONS, Restrictions
from wheelpend.identification import instrumental
from wheelpend.identification.bias_test import BiasTest, hausman_test
from wheelpend.identification.bootstrap import ParametricBootstrap, parametric_bootstrap
from wheelpend.identification.energy import energy_least_squares
from wheelpend.identification.method_options import IS_FIRST_ORDER_HOLD, RegressionOptions
from wheelpend.identification.recursive import TrackPoint, recursive_least_squares
from wheelpend.identification.time_constants import Tau, TimeConstantChoice, choose_time_constants
from wheelpend.kernels.kernel_module import KernelModule
from wheelpend.kernels.load import model_module
from wheelpend.logs.commands import longest_known_part
from wheelpend.logs.log import Log
from wheelpend.logs.sources import LogsLike
from wheelpend.model.record import Model


@dataclass
class RegressionProblem:
    """A log, and the model whose linear parameters are regressed on it."""

    model: Model
    module: KernelModule
    log: Log
    parameters: np.ndarray  # (NP,) known values
    progress: Callable[[str], None]
    restrictions: Restrictions = NO_RESTRICTIONS  # of the model's parameters; fixed ones have their values in it

    @cached_property
    def bootstrap(self) -> ParametricBootstrap:
        """The parametric bootstrap of the log; made once."""
        return parametric_bootstrap(self.model, self.module, self.log, self.parameters, self.progress)


def regression_problem(
    model: Model,
    logs: LogsLike,
    method: str,
    progress: Callable[[str], None],
    restrictions: Restrictions = NO_RESTRICTIONS,
) -> RegressionProblem:
    """The regression on a log; raises Failure for more logs than one."""
    loaded = read_logs(logs, model)
    if len(loaded) != 1:
        raise Failure(f"The method '{method}' takes one log, but {len(loaded)} were given. Use `--method shooting`.")
    module = model_module(model.plant, model.assumptions, model.effects)
    parameters = kernel_parameters(module, known_values(model), loaded[0])
    log, remark = (loaded[0], "") if method == "inverse" else longest_known_part(loaded[0])  # inverse takes all parts
    log = replace(log, warnings=(*log.warnings, remark)) if remark else log
    return RegressionProblem(model, module, _settled_part(module, log), parameters, progress, restrictions)


def _settled_part(module: KernelModule, log: Log) -> Log:
    """The log from where a lagging motor no longer remembers what was commanded before it; all of it for any other."""
    if module.LAG < 0 or not log.stretches:
        return log
    return log.part(log.stretches[0].settled, len(log))


class RegressionFit(NamedTuple):
    """An estimate by regression, and what else its method tells."""

    fit: LinearFit
    track: tuple[TrackPoint, ...] = ()  # of recursive: the estimates on the way
    cutoff: float | None = None  # Hz, of inverse: of the motion's filter


def regression_fit(regression: RegressionProblem, settings: RegressionOptions, log: Log) -> RegressionFit:
    """Estimate by the method of the settings from a log."""
    common, method = (regression.module, log, regression.parameters), settings.method
    limits = regression.restrictions
    if method == "differentiation":
        return RegressionFit(differentiation_least_squares(*common, limits))
    if method == "energy":
        return RegressionFit(energy_least_squares(*common, settings.tau[0], limits))
    if method == "inverse":
        from wheelpend.identification.inverse_dynamics import inverse_dynamics  # late: it needs scipy.signal

        found = inverse_dynamics(*common, limits)
        return RegressionFit(found.fit, cutoff=found.cutoff)
    tau, first_order_hold = (settings.tau[0], settings.tau[1]), IS_FIRST_ORDER_HOLD[settings.hold or "first"]
    if method == "iv":
        instruments = instrumental.instrumental_estimate(regression.model, *common, tau, restrictions=limits)
        return RegressionFit(instruments.fit)
    if method == "recursive":
        recursive = recursive_least_squares(
            *common, tau, first_order_hold=first_order_hold, forgetting=settings.forgetting, restrictions=limits
        )  # fmt: skip
        return RegressionFit(recursive.fit, recursive.track)
    return RegressionFit(filtered_least_squares(*common, tau, first_order_hold=first_order_hold, restrictions=limits))


def choose_regression_time_constants(regression: RegressionProblem, settings: RegressionOptions) -> TimeConstantChoice:
    """Time constants with the least error of the method on replicas of the log."""
    estimator = partial(_replica_estimator, regression, settings)
    return choose_time_constants(regression.bootstrap, estimator, regression.module.LINEAR, regression.progress)


def _replica_estimator(
    regression: RegressionProblem, settings: RegressionOptions, tau: Tau
) -> Callable[[Log], np.ndarray]:
    """Estimator of the linear parameters (n,) from a replica, with some time constants."""
    if settings.method != "iv":
        return lambda log: regression_fit(regression, settings._replace(tau=tau), log).fit.estimate
    centre = regression.bootstrap.parameters
    loop = instrumental.LoggedLoop.of(regression.model, regression.module, regression.log)
    run = loop.run(centre)
    if run is None:
        words = regression.model.plant_signature.words
        raise Failure(
            f"{regression.log.name}: the simulated {words.machine} must {words.stay} to choose time constants, but it "
            f"{words.leaves}. Give --tau T1,T2."
        )
    instruments = instrumental.simulated_instruments(regression.module, regression.log, run, centre, tau)
    return partial(_estimate_with_instruments, regression, tau, instruments)


def _estimate_with_instruments(
    regression: RegressionProblem, tau: Tau, instruments: np.ndarray, log: Log
) -> np.ndarray:
    rows = instrumental.filtered_equations(regression.module, log, regression.parameters, tau)
    return instrumental.solve_instrumental(regression.module, rows, instruments).estimate


def bias_test_or_warning(
    regression: RegressionProblem, settings: RegressionOptions, fitted: LinearFit
) -> tuple[BiasTest | None, tuple[str, ...]]:
    """The test of least squares for bias on the log, or a warning why it cannot be made; of a long log on its head."""
    if len(regression.log) > CHUNK_SAMPLES:
        regression = replace(regression, log=regression.log.part(0, CHUNK_SAMPLES))
        fitted = regression_fit(regression, settings, regression.log).fit
    try:
        bootstrap = regression.bootstrap

        def refitted(log: Log) -> LinearFit:
            return regression_fit(regression, settings, log).fit

        return hausman_test(bootstrap, fitted, refitted, progress=regression.progress), ()
    except Failure as failure:
        return None, (f"Least squares was not tested for bias: {failure}",)
