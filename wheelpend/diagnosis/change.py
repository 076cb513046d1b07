"""Adding an effect to a model, or removing one: both models refitted and judged on validation data."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import derive
from wheelpend.diagnosis.evidence import estimates_per_log
from wheelpend.diagnosis.explain import Step, fitted_model
from wheelpend.diagnosis.refit import refit_with
from wheelpend.estimation.continuation import fit_model
from wheelpend.estimation.data import prepare
from wheelpend.estimation.fit import Fit
from wheelpend.estimation.free_parameters import free_names
from wheelpend.estimation.parameter_table import standard_error
from wheelpend.estimation.problem import EstimationProblem, extended_effects, require_testable, with_stable_step
from wheelpend.estimation.starts import best_start
from wheelpend.estimation.validation import validation_residuals
from wheelpend.logs.log import Log
from wheelpend.model.record import Model


@dataclass(frozen=True)
class Change:
    """What adding or removing an effect did to a model."""

    step: Step
    model: Model = field(repr=False)
    problem: EstimationProblem = field(repr=False)
    before: Fit = field(repr=False)
    after: Fit = field(repr=False)


def add(
    model: Model,
    effect: str,
    logs: Sequence[str | Path | Log],
    holdout: Sequence[str | Path | Log] = (),
    *,
    remove: bool = False,
    progress: Callable[[str], None] = lambda text: None,
) -> Change:
    """Refit a model with one more effect (or, with ``remove``, one less) and judge both on held-out data.

    Returns the new model; writes nothing.
    """
    if not remove:
        require_testable(derive.effects.find(effect), model)
    problem = prepare(model, logs, holdout)
    progress("finding a start")
    problem, start = best_start(problem)
    old = model.effects
    new = tuple(e for e in old if e != effect) if remove else tuple(extended_effects(model, effect))
    fewer = new if remove else old
    progress("fitting without the effect")
    lesser = problem.with_effects(fewer)
    small = fit_model(lesser, start, free_names(lesser, fewer))
    progress(f"fitting with {effect}")
    judged, large = refit_with(lesser, start, small, effect)
    if judged is not lesser:
        lesser, small = judged, fit_model(judged, small.values, free_names(judged, fewer), start_per_log=small.per_log)
    before, after = (large, small) if remove else (small, large)
    errors = [
        validation_residuals(with_stable_step(lesser.with_effects(e), start), f)[0]
        for e, f in ((old, before), (new, after))
    ]
    names = {n.partition(".")[2]: n for n in free_names(problem, [effect]) if n not in problem.base}
    changed = lesser.with_effects(new)
    step = Step(
        effect,
        {p: large.of_log(0)[n] for p, n in names.items()},
        {p: standard_error(problem, large, n) for p, n in names.items()},
        {p: _unit(problem, effect, p) for p in names},
        None, (), errors[0], errors[1], {n: after.values[n] for n in problem.base},
        estimates_per_log(problem, large, derive.effects.find(effect)),
    )  # fmt: skip
    return Change(step, fitted_model(changed, after), changed, before, after)


def _unit(problem: EstimationProblem, effect: str, parameter: str) -> str:
    return next(p.unit for p in problem.effect(effect).parameters if p.name == parameter)
