"""The models of an error ladder with the values that they have there, for judges outside of the diagnosis."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from derive.parameter_name import full_name
from wheelpend.benchmarks.markdown import markdown_table
from wheelpend.diagnosis.explain import Ladder
from wheelpend.estimation.continuation import fit_model
from wheelpend.estimation.fit import Fit
from wheelpend.estimation.free_parameters import free_names, values_of_model_effects
from wheelpend.estimation.problem import EstimationProblem, extended_effects
from wheelpend.kernels.kernel_module import KernelModule
from wheelpend.kernels.load import model_module
from wheelpend.model.record import Model

START_LABEL = "model file, refitted"


class FittedModel(NamedTuple):
    """A model with values, fitted to the training part of the logs of an explanation."""

    label: str  # the effect that it has more than the one before
    model: Model
    values: dict[str, float]  # by name [unit of the parameter]; of those of each log alone the mean over the logs

    @property
    def module(self) -> KernelModule:
        """Kernels of the model, with no effects but its own."""
        return model_module(self.model.plant, self.model.assumptions, self.model.effects)


def fitted_models(found: Ladder) -> list[FittedModel]:
    """The model of every rung of a ladder, from the refitted one on.

    The ladder keeps the fits of its first and last rung; those between are fitted again from the values of its steps.
    """
    problem, start = found.first.problem, dict(found.first.fit.values)
    rungs = [_fitted_model(START_LABEL, problem, found.first.fit)]
    for number, step in enumerate(found.steps, 1):
        problem = problem.with_effects(extended_effects(problem.model, step.effect))
        own = {full_name(step.effect, n): v for n, v in step.coefficients.items()}
        start = values_of_model_effects(problem, {**start, **step.parameters, **own})
        is_last = number == len(found.steps)
        fitted = found.fit if is_last else fit_model(problem, start, free_names(problem, problem.model.effects))
        rungs.append(_fitted_model(f"+ `{step.effect}`", problem, fitted))
    return rungs


def _fitted_model(label: str, problem: EstimationProblem, fitted: Fit) -> FittedModel:
    """The model of a problem with the values of a fit."""
    alone = {n: float(np.mean([own[n] for own in fitted.per_log])) for n in (fitted.per_log or ({},))[0]}
    values = values_of_model_effects(problem, {**fitted.values, **alone})
    return FittedModel(label, problem.model, values)


def value_table(fitted: FittedModel, found: Ladder) -> str:
    """Table of a model's values with the standard errors and units of the ladder's last rung."""
    rows = [
        (f"`{name}`", f"{fitted.values[name]:.4g}", f"{estimate.sigma:.2g}", estimate.unit or "–")
        for name, estimate in found.parameters.items()
        if name in fitted.values
    ]
    return markdown_table(("parameter", "value", "standard error", "unit"), rows)


def added_effects_text(found: Ladder) -> str:
    """The effects that were added, in their order, or that there were none."""
    return ", then ".join(f"`{s.effect}`" for s in found.steps) or "no effect"
