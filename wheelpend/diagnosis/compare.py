"""The model as it stands against measurements: how well it predicts, how far ahead, and where it fails."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

import numpy as np

import derive
from wheelpend.diagnosis.horizons import HorizonError, errors_over, horizons_of
from wheelpend.diagnosis.missing_force.estimate import ForceConcentration, MissingForce
from wheelpend.diagnosis.missing_force.smoothed_force import missing_forces, where_it_shows
from wheelpend.diagnosis.model_errors import OWN_LABEL, ModelErrors, labelled_models
from wheelpend.diagnosis.refit import Progress
from wheelpend.diagnosis.replay import ClosedLoopReplay, replay_closed_loop, replayed_together
from wheelpend.estimation.continuation import fit_model
from wheelpend.estimation.criteria import DEFAULT_HORIZON_S, MAX_NOISE_LEVEL_ERROR_RATIO
from wheelpend.estimation.data import prepare
from wheelpend.estimation.fit import Fit
from wheelpend.estimation.free_parameters import free_names, known_values, per_log_names
from wheelpend.estimation.noise_alarm import overstated_noise
from wheelpend.estimation.parameters import kernel_parameters
from wheelpend.estimation.prediction import prediction_error, sum_of_squares
from wheelpend.estimation.problem import EstimationProblem
from wheelpend.estimation.segments import Segments, ValidationData
from wheelpend.estimation.starts import best_start
from wheelpend.estimation.states import fit_states, initial_states
from wheelpend.estimation.step_size import stable_step
from wheelpend.estimation.validation import calibrated_values, fit_percent, unpredicted_share
from wheelpend.identification.filter_error_method import remainder_at_point
from wheelpend.identification.inverse_dynamics import force_error_and_bursts
from wheelpend.identification.remainder import Remainder
from wheelpend.identification.remainder_at import NO_REMAINDER_WORDS, LogValues, found_or_warning, likeliest_point
from wheelpend.identification.remainder_warnings import remainder_warnings
from wheelpend.identification.residual_tests import NO_TESTS_WORDS, ResidualTests, residual_tests_beside
from wheelpend.logs.sources import LogsLike, as_list
from wheelpend.model.record import Model
from wheelpend.notebook import DrawnResult, ResultTable
from wheelpend.parallel import with_one_blas_thread


@dataclass(frozen=True, repr=False)
class Comparison(DrawnResult):
    """Prediction errors of a model on logs, and where they come from."""

    error: float  # [σ]
    noise_floor: float
    horizon_s: float
    fit_percent: dict[str, float]
    rmse: dict[str, float]
    horizons: tuple[HorizonError, ...]
    closed_loop: ClosedLoopReplay | None
    where: tuple[ForceConcentration, ...]
    fitted_first: bool  # the model had no values and was fitted to the log
    warnings: tuple[str, ...]
    force_error: dict[str, float | None] = field(default_factory=dict)  # by log, of the equations [% of input]
    bursts: list[dict] = field(default_factory=list)  # where in time the equations miss far more force than usual
    missing: tuple[MissingForce, ...] = field(repr=False, default=())  # of each log, where the model fails
    problem: EstimationProblem | None = field(repr=False, default=None)
    per_log: list[dict] = field(default_factory=list)  # parameters that each log has for itself, as estimated on it
    remainder: Remainder | None = None  # what the model at its values leaves to chance
    residual_tests: ResidualTests | None = None  # of the filter with that; they inform and decide nothing
    against: tuple[ModelErrors, ...] = ()  # other models on the same logs

    def to_json(self) -> dict[str, Any]:
        """The result under the keys of JSON."""
        return {
            "error": self.error,
            "noise_floor": self.noise_floor,
            "horizon_s": self.horizon_s,
            "fit_percent": self.fit_percent,
            "rmse": self.rmse,
            "horizons": self.horizons,
            "closed_loop": self.closed_loop,
            "where": self.where,
            "fitted_first": self.fitted_first,
            "warnings": self.warnings,
            "force_error": self.force_error,
            "bursts": self.bursts,
            "per_log": self.per_log,
            "remainder": self.remainder,
            "residuals": self.residual_tests.channels if self.residual_tests else None,
            "against": self.against,
        }

    def headline(self) -> str:
        """The error, over which horizon, and what noise alone would leave."""
        error = f"error {self.error:.3g} σ over {self.horizon_s:g} s at a noise floor of {self.noise_floor:.3g} σ"
        others = "".join(f"; {other.label}: {other.error:.3g} σ" for other in self.against)
        return f"Comparison: {error}{', of the model as fitted first' if self.fitted_first else ''}{others}"

    @property
    def models(self) -> tuple[ModelErrors, ...]:
        """The errors of this model, and of those that it is compared with."""
        own = ModelErrors(OWN_LABEL, self.error, self.fit_percent, self.rmse, self.horizons, self.fitted_first)
        return (own, *self.against)

    def table(self) -> ResultTable:
        """A row per channel: share that is predicted [%], and root mean square error in the channel's unit.

        Where other models are compared, a row per model and channel, the model's label first.
        """
        columns = {"channel": str, "fit_percent": float, "rmse": float}
        rows = [(m.label, name, m.fit_percent.get(name), rmse) for m in self.models for name, rmse in m.rmse.items()]
        if not self.against:
            return ResultTable(columns, [row[1:] for row in rows])
        return ResultTable({"model": str, **columns}, rows)


class ComparedModel(NamedTuple):
    """A model with values, and the segments of each log that it is compared with."""

    problem: EstimationProblem
    log_segments: tuple[Segments, ...]
    log_values: list[dict[str, float]]  # of each log
    fitted_first: bool  # the model had no values and was fitted to the log

    @property
    def own_problem(self) -> EstimationProblem:
        """The problem with the compared segments as its estimation data."""
        return replace(self.problem, data=self.problem.data.with_estimation(self.log_segments))


@with_one_blas_thread
def compare(
    model: Model,
    logs: LogsLike,
    holdout: LogsLike = (),
    *,
    against: Model | Sequence[Model] | Mapping[str, Model] = (),
    progress: Callable[[str], None] = lambda text: None,
) -> Comparison:
    """Compare the model with every sample of the logs, or with the hold-out logs where some are given.

    ``logs`` and ``holdout`` are one or several, each a path, a Log, a DataFrame or a dict of arrays (N,), as of
    ``load_log``. Parameters that each log has for itself are estimated on that log, on a hold-out log on its first
    third, which is then not compared. A model with neither identified nor nominal values is fitted to the logs first.
    ``against`` are other models of the plant, one, several, or by label: each predicts the same segments of the same
    logs, read and measured by the σ of ``model``. Raises Failure where the logs or a model cannot be used.
    """
    others = labelled_models(model, against)
    begun, validation = _segments_to_compare(model, logs, holdout, DEFAULT_HORIZON_S)
    compared = _with_values(begun, validation, progress)
    problem, log_segments, log_values, fitted_first = compared
    progress("predicting segments")
    error, residuals = predict_segments(compared)
    progress("predicting further ahead")
    horizons = horizon_errors(compared)
    force_error, bursts = force_errors(compared)
    progress("estimating the missing force")
    missing: tuple[MissingForce, ...] = ()
    where: tuple[ForceConcentration, ...] = ()
    if error > MAX_NOISE_LEVEL_ERROR_RATIO * problem.floor:
        fitted = fit_at_values(compared)
        missing = missing_forces(compared.own_problem, fitted)
        where = where_it_shows(compared.own_problem, missing, fitted)
    else:
        bursts = []  # within the noise, those of the equations are what differentiation makes of steps of the command
    judged = tuple(_errors_of(label, other, begun, validation, progress) for label, other in others.items())
    left, tests, untold = chance_and_tests(compared.own_problem, log_values, progress)
    left = left and replace(left, unpredicted=unpredicted_share(log_segments, residuals))
    return Comparison(
        error=error,
        noise_floor=problem.floor,
        horizon_s=problem.horizon,
        fit_percent=fit_percent(compared.own_problem, residuals),
        rmse=rmse_of(log_segments, residuals),
        horizons=horizons,
        closed_loop=replayed_together(
            replay_closed_loop(problem, s, v) for s, v in zip(log_segments, log_values, strict=True)
        ),
        where=where,
        fitted_first=fitted_first,
        warnings=(
            *problem.warnings,
            *overstated_noise(problem, error, log_segments, residuals),
            *untold,
            *remainder_warnings(left, problem.plant),
        ),
        remainder=left,
        residual_tests=tests,
        missing=missing,
        problem=problem,
        per_log=per_log_table(model, log_segments, log_values),
        force_error=force_error,
        bursts=bursts,
        against=judged,
    )


def model_to_compare(
    model: Model, logs: LogsLike, holdout: LogsLike, progress: Progress, horizon: float = DEFAULT_HORIZON_S
) -> ComparedModel:
    """The model with its values, fitted to the logs where it has none, and with each log's own parameters."""
    return _with_values(*_segments_to_compare(model, logs, holdout, horizon), progress)


def _segments_to_compare(
    model: Model, logs: LogsLike, holdout: LogsLike, horizon: float
) -> tuple[EstimationProblem, Sequence[ValidationData]]:
    """The problem with all samples of the logs, and the segments of the hold-out logs."""
    problem = prepare(model, logs, horizon=horizon, use_all=True, leads=False)
    held_out = as_list(holdout)
    return problem, prepare(model, logs, held_out, horizon=horizon, leads=False).data.validation if held_out else ()


def _with_values(problem: EstimationProblem, validation: Sequence[ValidationData], progress: Progress) -> ComparedModel:
    """The problem's model with its values, fitted where it has none, on its segments or those of the hold-out logs."""
    values = known_values(problem.model)
    fitted_first = not all(n in values for n in problem.base)
    if fitted_first:
        progress("the model has no values yet: fitting it first")
        problem, start = best_start(problem)
        values = fit_model(problem, start, free_names(problem, problem.model.effects)).of_log(0)
    step = stable_step(problem.module, values, problem.logs[0])
    problem = replace(problem, max_step=step)
    return ComparedModel(problem, *values_per_log(problem, validation, values), fitted_first)


def chance_and_tests(
    problem: EstimationProblem, log_values: LogValues, progress: Progress
) -> tuple[Remainder | None, ResidualTests | None, tuple[str, ...]]:
    """What a model leaves to chance at its values in each log, the tests of its residuals, and why one is lacking."""
    progress("measuring what is left to chance")
    likeliest, unfound = found_or_warning(NO_REMAINDER_WORDS, lambda: likeliest_point(problem, log_values, ()))
    if likeliest is None:
        return None, None, unfound
    progress("testing the residuals")
    tests, untested = found_or_warning(NO_TESTS_WORDS, lambda: residual_tests_beside(problem, log_values, *likeliest))
    return remainder_at_point(problem, *likeliest), tests, untested


def _errors_of(
    label: str, model: Model, problem: EstimationProblem, validation: Sequence[ValidationData], progress: Progress
) -> ModelErrors:
    """Errors of another model on the segments of a problem."""
    progress(f"predicting with {label}")
    compared = _with_values(replace(problem, model=model).with_candidates(), validation, progress)
    error, residuals = predict_segments(compared)
    return ModelErrors(
        label, error, fit_percent(compared.own_problem, residuals), rmse_of(compared.log_segments, residuals),
        horizon_errors(compared), compared.fitted_first,
    )  # fmt: skip


def predict_segments(compared: ComparedModel) -> tuple[float, list[np.ndarray]]:
    """Error [σ] over the segments of all logs, and the residuals (N, channels) [σ] of each."""
    problem, residuals, squares, count = compared.problem, [], 0.0, 0
    for segments, values in zip(compared.log_segments, compared.log_values, strict=True):
        _, residual = prediction_error(problem.simulator, segments, values)
        residuals.append(residual)
        squares += sum_of_squares(residual)
        count += segments.values - problem.module.NX * len(segments.bounds)
    return float(np.sqrt(squares / max(count, 1))), residuals


def horizon_errors(compared: ComparedModel) -> tuple[HorizonError, ...]:
    """Errors of predictions over growing horizons, as far as the shortest log reaches."""
    problem, log_segments, log_values, _ = compared
    shortest = min((s.log for s in log_segments), key=lambda log: log.duration)
    return errors_over(problem, log_segments, log_values, horizons_of(shortest))


def force_errors(compared: ComparedModel) -> tuple[dict[str, float | None], list[dict[str, Any]]]:
    """By log the share of the input that the equations leave [%], and where in time that is far more than usual."""
    shares: dict[str, float | None] = {}
    found: dict[str, list] = {}
    for segments, values in zip(compared.log_segments, compared.log_values, strict=True):
        name = segments.log.name
        shares[name], found[name] = force_error_and_bursts(compared.problem.module, segments.log, values)
    rows = [
        {"log": name, "from": b.low, "to": b.high, "row": b.row, "peak": b.peak, "at_reversal": b.at_reversal}
        for name, bursts in found.items()
        for b in bursts
    ]
    return shares, rows


def values_per_log(
    problem: EstimationProblem, validation: Sequence[ValidationData], values: dict[str, float]
) -> tuple[tuple[Segments, ...], list[dict[str, float]]]:
    """The segments that are compared, and the values of each log: of the hold-out logs where there are some."""
    names = free_names(problem, problem.model.effects)
    if not validation:
        return problem.data.estimation, [calibrated_values(problem, s, values, names) for s in problem.data.estimation]
    log_segments = tuple(v.part for v in validation)
    return log_segments, [calibrated_values(problem, v.calibration or v.part, values, names) for v in validation]


def per_log_table(model: Model, log_segments: Sequence[Segments], log_values: Sequence[dict]) -> list[dict]:
    """Parameters that each log has for itself, as estimated on it."""
    names = per_log_names([n for e in model.effects for n in derive.effects.find(e).full_names])
    pairs = zip(log_segments, log_values, strict=True)
    return [{"log": s.log.name, **{n: v[n] for n in names}} for s, v in pairs] if names else []


def fit_at_values(compared: ComparedModel) -> Fit:
    """The model at its values as a fit without free parameters, the initial states of its segments fitted."""
    problem, states = compared.problem, []
    for segments, values in zip(compared.log_segments, compared.log_values, strict=True):
        parameters = kernel_parameters(problem.module, values, segments.log)
        first = initial_states(problem.module, segments)
        states.append(fit_states(problem.simulator, segments, first, parameters)[0])
    return Fit.at(compared.log_values[0], compared.log_values, states)


def rmse_of(log_segments: Sequence[Segments], residuals: Sequence[np.ndarray]) -> dict[str, float]:
    """Root mean square prediction error per channel, in its unit."""
    found = {}
    for c, channel in enumerate(log_segments[0].log.channels):
        errors = [(r[:, c] * s.sigma[c]) ** 2 for s, r in zip(log_segments, residuals, strict=True)]
        found[channel] = float(np.sqrt(np.nanmean(np.concatenate(errors))))
    return found
