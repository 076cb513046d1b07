"""Residual tests of a model at its values: are the filter's innovations white, and independent of past inputs?

They inform and do not decide: on no real machine is a residual white. What is missing is for the likelihood to say.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np

from wheelpend.errors import Failure
from wheelpend.estimation.data import prepare
from wheelpend.estimation.filter_fit import FilterEstimator, FilterPoint
from wheelpend.estimation.free_parameters import known_values
from wheelpend.estimation.problem import EstimationProblem
from wheelpend.estimation.residual_statistics import (
    autocorrelation,
    excess_kurtosis,
    normal_quantiles,
    past_input_p_value,
    spread_lags,
)
from wheelpend.estimation.source_search import as_mixture
from wheelpend.estimation.stored_sources import stored_sources
from wheelpend.identification.filter_error_method import estimator_at, filter_error_fit, remainder_at_point
from wheelpend.identification.remainder import Remainder
from wheelpend.identification.remainder_at import LogValues, likeliest_point, require_finite
from wheelpend.kernels.load import free_force_module
from wheelpend.logs.log import Log
from wheelpend.logs.sources import LogsLike
from wheelpend.model.record import Model
from wheelpend.notebook import DrawnResult, ResultTable
from wheelpend.parallel import with_one_blas_thread

SIGNIFICANCE_LEVEL = 0.01  # of each test of each channel
MAX_TESTED_SAMPLES = 200_000  # of all logs, beyond which tests beside another result would keep it waiting
NO_TESTS_WORDS = "The residuals could not be tested"

Progress = Callable[[str], None]
NoiseBasis = Literal["stated", "rounding", "log"]  # model.toml, rounding to the channel's step, or the log itself


@dataclass(frozen=True)
class ChannelResidual:
    """Tests of one channel's whitened innovations."""

    white: bool
    whiteness_p: float
    independent_of_input_p: float | None  # given the residual's own past; None where nothing is commanded
    sigma_ratio: float  # σ found over σ assumed, of all that the filter expects: 1 where both agree
    sigma_assumed: float  # of the sensor [unit of the channel]
    quantised: bool
    kurtosis: float  # excess: 0 of a normal distribution
    lags_s: tuple[float, ...]
    autocorrelation: tuple[float, ...]
    band: tuple[float, ...]  # half width that holds 95 % of the values of white noise
    quantiles: tuple[tuple[float, float], ...]  # of the normal distribution, and of the residual
    samples: int
    basis: NoiseBasis = "log"  # what the σ assumed rests on

    @property
    def sigma_found(self) -> float:
        """σ of the sensor as it was found [unit of the channel]."""
        return self.sigma_ratio * self.sigma_assumed

    def to_json(self) -> dict[str, Any]:
        """The tests under the keys of JSON."""
        return {
            "white": self.white,
            "whiteness_p": self.whiteness_p,
            "independent_of_input_p": self.independent_of_input_p,
            "sigma_ratio": self.sigma_ratio,
            "sigma_assumed": self.sigma_assumed,
            "quantised": self.quantised,
            "kurtosis": self.kurtosis,
            "lags_s": self.lags_s,
            "autocorrelation": self.autocorrelation,
            "band": self.band,
            "quantiles": self.quantiles,
            "samples": self.samples,
        }


@dataclass(frozen=True, repr=False)
class ResidualTests(DrawnResult):
    """Residual tests of a model on some logs."""

    channels: dict[str, ChannelResidual]
    remainder: Remainder  # the random sources that the filter expects
    fitted_first: bool  # the model had no values and was fitted to the logs
    warnings: tuple[str, ...]
    innovations: tuple[np.ndarray, ...] = field(repr=False, default=())  # of each log (N, channels) whitened

    def to_json(self) -> dict[str, Any]:
        """The result under the keys of JSON."""
        return {
            "channels": self.channels,
            "remainder": self.remainder,
            "fitted_first": self.fitted_first,
            "warnings": self.warnings,
        }

    def headline(self) -> str:
        """Which channels' residuals are white."""
        coloured = [name for name, found in self.channels.items() if not found.white]
        return "Residual tests: " + (f"not white in {', '.join(coloured)}" if coloured else "all channels are white")

    def table(self) -> ResultTable:
        """A row per channel."""
        columns = {
            "channel": str, "white": bool, "whiteness_p": float, "independent_of_input_p": float,
            "sigma_ratio": float, "kurtosis": float, "samples": int,
        }  # fmt: skip
        rows = [(name, *(getattr(found, key) for key in list(columns)[1:])) for name, found in self.channels.items()]
        return ResultTable(columns, rows)


@with_one_blas_thread
def residuals(model: Model, logs: LogsLike, *, progress: Progress = lambda text: None) -> ResidualTests:
    """Test the model's residuals on every sample of some logs, at its values and with its random force.

    ``logs`` are one or several, each a path, a Log, a DataFrame or a dict of arrays (N,), as of ``load_log``.
    Without identified or nominal values the model is fitted first; without a random force in it the likeliest one is
    sought. Raises Failure where the logs or the model cannot be used.
    """
    values = known_values(model)
    problem = prepare(model, logs, use_all=True, lean=True)
    fitted_first = not all(n in values for n in problem.base)
    if fitted_first:
        progress("the model has no values yet: fitting it first")
        fitted = filter_error_fit(model, logs, progress)
        problem, estimator, point = fitted.problem, fitted.estimator, fitted.point
    else:
        progress("running the filter along the logs")
        estimator, point = _filter_at(problem, values, progress)
    progress("testing the residuals")
    return _tests_at_point(problem, estimator, point, fitted_first)


def residual_tests_beside(
    problem: EstimationProblem, log_values: LogValues, part: FilterEstimator, likeliest: FilterPoint
) -> ResidualTests:
    """Test a model's residuals at its values in each log of a problem, where the likeliest random sources are known.

    They are those of ``likeliest_point``, on a part of the logs; where the model has some of its own, these count.
    Raises Failure where no filter can follow the model along the logs, or they are longer than MAX_TESTED_SAMPLES.
    """
    require_short(problem.logs)
    whole = estimator_at(problem, part.problem.module, (), log_values, lambda: log_values)
    stored = stored_sources(problem.model, problem.module.OUTPUTS)
    sources = whole.in_all_logs(stored) if stored else likeliest.sources
    estimator, point = as_mixture(whole, whole.point(whole.problem.space.start(), sources))
    require_finite(point)
    return _tests_at_point(problem, estimator, point, fitted_first=False)


def require_short(logs: Sequence[Log]) -> None:
    """Raise Failure for logs whose residuals are tested on request alone."""
    samples = sum(map(len, logs))
    if samples > MAX_TESTED_SAMPLES:
        raise Failure(f"beside another result logs may have {MAX_TESTED_SAMPLES} samples, but they have {samples}. "
                      "`wheelpend residuals LOG` tests them.")  # fmt: skip


def _tests_at_point(
    problem: EstimationProblem, estimator: FilterEstimator, point: FilterPoint, fitted_first: bool
) -> ResidualTests:
    """The tests of every channel, of the innovations at a point."""
    whitened = [i[..., 0] for i in estimator.problem.innovations(point.theta, point.sources)]
    return ResidualTests(
        {name: _channel(problem, whitened, number) for number, name in enumerate(problem.module.OUTPUTS)},
        remainder_at_point(problem, estimator, point),
        fitted_first,
        problem.warnings,
        tuple(whitened),
    )


def _filter_at(
    problem: EstimationProblem, values: Mapping[str, float], progress: Progress
) -> tuple[FilterEstimator, FilterPoint]:
    """The filter at given values, with the model's random sources, or the likeliest ones where it has none."""
    model = problem.model
    module = free_force_module(model.plant, model.assumptions, model.effects)
    log_values = [values] * len(problem.logs)
    whole = estimator_at(problem, module, (), log_values, lambda: log_values)
    sources = whole.in_all_logs(stored_sources(model, problem.module.OUTPUTS))
    if not sources[0]:
        progress("measuring what is left to chance")
        sources = likeliest_point(problem, log_values, ())[1].sources
    estimator, point = as_mixture(whole, whole.point(whole.problem.space.start(), sources))
    require_finite(point)
    return estimator, point


def _channel(problem: EstimationProblem, whitened: Sequence[np.ndarray], number: int) -> ChannelResidual:
    """The tests of a channel in all logs together."""
    runs, inputs = [], []
    for log, residual in zip(problem.logs, whitened, strict=True):
        for stretch in log.stretches:
            runs.append(residual[stretch.begin : stretch.end, number])
            inputs.append(log.inputs[:, stretch.begin : stretch.end])
    own = np.concatenate(runs)
    known, interval = own[np.isfinite(own)], min(log.dt for log in problem.logs)
    longest = max(1, min(round(problem.horizon / interval), max(map(len, runs)) // 4))
    found = autocorrelation(runs, spread_lags(longest))
    driven = any(np.ptp(u[np.isfinite(u)]) > 0.0 for log in problem.logs for u in log.inputs if np.isfinite(u).any())
    noise = problem.noise[0]
    return ChannelResidual(
        white=found.p_value >= SIGNIFICANCE_LEVEL,
        whiteness_p=found.p_value,
        independent_of_input_p=past_input_p_value(runs, inputs, longest) if driven else None,
        sigma_ratio=float(np.sqrt(np.mean(known**2))) if known.size else 0.0,
        sigma_assumed=float(problem.data.estimation[0].sigma[number]),
        quantised=bool(noise.quantum[number]),
        kurtosis=excess_kurtosis(own),
        lags_s=tuple((found.lags * interval).tolist()),
        autocorrelation=tuple(found.values.tolist()),
        band=tuple(found.band.tolist()),
        quantiles=tuple(normal_quantiles(own)),
        samples=int(known.size),
        basis=_noise_basis(problem, number),
    )


def _noise_basis(problem: EstimationProblem, number: int) -> NoiseBasis:
    """What the σ of a channel rests on."""
    channel, noise = problem.plant.channels[number], problem.noise[0]
    if problem.model.sensors.noise_of(channel) is not None:
        return "stated"
    return "rounding" if noise.quantum[number] and not noise.sigma_before_rounding[number] else "log"
