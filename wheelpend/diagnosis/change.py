"""Adding an effect to a model, or removing one: both models refitted and judged on validation data."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

import derive
from derive.effects import InternalPlay
from derive.parameter_name import short_name
from wheelpend.diagnosis.criteria import MIN_RELATIVE_ERROR_DECREASE
from wheelpend.diagnosis.evidence import estimates_per_log
from wheelpend.diagnosis.explain import STEP_COLUMNS, Step, fitted_model, step_rows
from wheelpend.diagnosis.likelihood.search import likely_fits
from wheelpend.diagnosis.physical import is_physical
from wheelpend.diagnosis.refit import Progress, refit_with
from wheelpend.estimation.continuation import fit_model
from wheelpend.estimation.criteria import MAX_EXPLAINED_ERROR_RATIO
from wheelpend.estimation.data import prepare
from wheelpend.estimation.estimate import Estimate
from wheelpend.estimation.fit import Fit
from wheelpend.estimation.free_parameters import free_names
from wheelpend.estimation.parameter_table import parameter_table, standard_error
from wheelpend.estimation.problem import EstimationProblem, extended_effects, require_testable, with_stable_step
from wheelpend.estimation.validation import unpredicted_share, validation_residuals
from wheelpend.estimation.workable_horizon import over_workable_horizon
from wheelpend.identification.remainder import Remainder
from wheelpend.identification.remainder_at import found_or_warning, refitted_remainder, remainder_or_warning
from wheelpend.identification.remainder_warnings import remainder_warnings, undetermined_warnings
from wheelpend.logs.sources import LogsLike
from wheelpend.model.record import Model
from wheelpend.notebook import NotebookResult, ResultTable
from wheelpend.parallel import with_one_blas_thread


@dataclass(frozen=True, repr=False)
class Change(NotebookResult):
    """A model with an effect added or removed, and the fits of both."""

    step: Step
    model: Model = field(repr=False)
    problem: EstimationProblem = field(repr=False)
    before: Fit = field(repr=False)
    after: Fit = field(repr=False)
    remainder: Remainder | None = None  # what the model leaves to chance after it
    warnings: tuple[str, ...] = ()

    def to_json(self) -> dict[str, Any]:
        """The step, and the model's parameters after it, under the keys of JSON."""
        step, model = self.step, self.model
        return {
            "effect": step.effect,
            "coefficients": step.coefficients,
            "sigma": step.sigma,
            "unit": step.unit,
            "error_before": step.error_before,
            "error_after": step.error_after,
            "per_log": step.per_log,
            "blocks_agree": step.blocks_agree,
            "effects": model.effects,
            "noise_floor": self.problem.floor,
            "horizon_s": self.problem.horizon,
            "parameters": model.estimates(),
            "remainder": self.remainder,
            "warnings": self.warnings,
        }

    def headline(self) -> str:
        """The effect, and the errors without and with the change."""
        step = self.step
        return f"Change: {step.effect}, error {step.error_before:.3g} -> {step.error_after:.3g} σ"

    def table(self) -> ResultTable:
        """A row per parameter of the effect; sizes in the row's unit, errors in σ."""
        return ResultTable(STEP_COLUMNS, step_rows(1, self.step))


@with_one_blas_thread
def add(
    model: Model,
    effect: str,
    logs: LogsLike,
    holdout: LogsLike = (),
    *,
    remove: bool = False,
    progress: Callable[[str], None] = lambda text: None,
) -> Change:
    """Refit a model with one more effect (or, with ``remove``, one less) and judge both on validation data.

    ``logs`` and ``holdout`` are one or several, each a path, a Log, a DataFrame or a dict of arrays (N,), as of
    ``load_log``. Returns the new model; writes nothing. Raises Failure where no data can tell an effect that is
    to be added, and where the logs or the model cannot be used.
    """
    if not remove:
        require_testable(derive.effects.find(effect), model)
    return over_workable_horizon(
        lambda horizon: prepare(model, logs, holdout, horizon=horizon),
        lambda problem, start: _changed(problem, start, effect, remove, progress),
        progress,
    )


def _changed(
    problem: EstimationProblem, start: dict[str, float], effect: str, remove: bool, progress: Callable[[str], None]
) -> Change:
    """The change of a problem's model by an effect, from a start of its parameters."""
    model = problem.model
    if remove:  # the values of the model hold what leaves it
        problem, start = _without_values(problem, start, effect)
    old = model.effects
    new = tuple(e for e in old if e != effect) if remove else tuple(extended_effects(model, effect))
    fits = _fit_both(problem, new if remove else old, start, effect, progress)
    before, after = (fits.larger, fits.smaller) if remove else (fits.smaller, fits.larger)
    pairs = ((old, before), (new, after))
    judged = [validation_residuals(with_stable_step(fits.problem.with_effects(e), start), f) for e, f in pairs]
    changed = fits.problem.with_effects(new)
    step = _step_of(problem, effect, fits.larger, [e for e, _ in judged], {n: after.values[n] for n in problem.base})
    progress("measuring what is left to chance")
    left, warnings = remainder_or_warning(
        refitted_remainder, changed, [after.of_log(k) for k in range(len(changed.logs))]
    )
    left = left and replace(left, unpredicted=unpredicted_share(problem.data.held_out, judged[-1][1]))
    undetermined = undetermined_warnings(changed.module, changed.plant, parameter_table(changed, after), left=left)
    astray = () if remove else _added_in_vain(problem, step)
    said = (*problem.warnings, *astray, *undetermined, *warnings, *remainder_warnings(left, problem.plant))
    return Change(step, fitted_model(changed, after, left), changed, before, after, left, said)


def _added_in_vain(problem: EstimationProblem, step: Step) -> list[str]:
    """Warnings of an effect with a size that nothing has, and of one with which the model predicts less well."""
    found, row = list[str](), problem.effect(step.effect)
    sizes = [(step.coefficients, step.sigma), *((e.coefficients, e.sigma) for e in step.per_log)]
    if not all(is_physical(row, values, sigma) for values, sigma in sizes):
        sized = ", ".join(f"{p} = {step.coefficients[p]:.3g}" for p in step.coefficients)
        found.append(f"{step.effect} came out with a size that nothing has ({sized}): something else is missing, and "
                     "takes its shape. `wheelpend diagnose LOG` looks for it.")  # fmt: skip
    if step.error_after > (1.0 + MIN_RELATIVE_ERROR_DECREASE) * step.error_before:
        errors = f"{step.error_before:.4g} σ before and {step.error_after:.4g} σ after"
        found.append(f"With {step.effect} the model predicts held-out data less well, {errors}: "
                     f"`wheelpend remove {step.effect} LOG` takes it out.")  # fmt: skip
    return found


def _without_values(
    problem: EstimationProblem, start: dict[str, float], effect: str
) -> tuple[EstimationProblem, dict[str, float]]:
    """The problem and its start with an effect absent, from which a model without it is fitted."""
    known = dict(zip(problem.module.PARAMETERS, problem.module.ABSENT, strict=True))
    absent = {name: known[name] for name in problem.effect(effect).full_names if name in known}
    others = tuple({**values, **absent} for values in problem.fallback_starts)
    return replace(problem, fallback_starts=others), {**start, **absent}


class NestedFits(NamedTuple):
    """Fits of a model without and with an effect, on the same segments."""

    problem: EstimationProblem  # that judges both, of the model without the effect
    smaller: Fit
    larger: Fit


def _fit_both(
    problem: EstimationProblem, present: Sequence[str], start: dict[str, float], effect: str, progress: Progress
) -> NestedFits:
    """Fit a model with some effects present, and with one more; both anew where an event needs other segments."""
    progress("fitting without the effect")
    without = problem.with_effects(present)
    smaller = fit_model(without, start, free_names(without, present))
    progress(f"fitting with {effect}")
    judging, larger = refit_with(without, start, smaller, effect)
    if judging is not without:
        free = free_names(judging, present)
        smaller = fit_model(judging, smaller.values, free, start_per_log=smaller.per_log)
    elif _is_judged_by_likelihood(without, larger, effect):
        likely, warnings = found_or_warning(
            "It could not be refitted with random forces", lambda: likely_fits(without, start, effect, progress)
        )
        for warning in warnings:
            progress(warning)
        if likely:
            return NestedFits(without, *likely)
    return NestedFits(judging, smaller, larger)


def _is_judged_by_likelihood(problem: EstimationProblem, larger: Fit, effect: str) -> bool:
    """True where sensor noise is out of reach, of the fit and of held-out data, so that a search fits with random
    forces; and a filter can follow.
    """
    if isinstance(derive.effects.find(effect).enters, InternalPlay):
        return False
    noise = MAX_EXPLAINED_ERROR_RATIO * problem.floor
    if larger.error <= noise:
        return False
    judging = with_stable_step(problem.with_effects(extended_effects(problem.model, effect)), larger.values)
    held_out_error, _ = validation_residuals(judging, larger)
    return not held_out_error <= noise


def _step_of(
    problem: EstimationProblem, effect: str, larger: Fit, errors: Sequence[float], parameters: dict[str, float]
) -> Step:
    """A ladder's step from the fit with an effect, the validation errors before and after, and base parameters."""
    names = {short_name(n): n for n in free_names(problem, [effect]) if n not in problem.base}
    units = {p.name: p.unit for p in problem.effect(effect).parameters}
    return Step(
        effect=effect,
        estimates={
            p: Estimate(larger.of_log(0)[n], standard_error(problem, larger, n), units[p]) for p, n in names.items()
        },
        p_value=None,
        equivalent_to=(),
        error_before=errors[0],
        error_after=errors[1],
        parameters=parameters,
        per_log=estimates_per_log(problem, larger, derive.effects.find(effect)),
    )
