"""The models of an error ladder with the values that they have there, and what a page says of every ladder."""

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
from wheelpend.reports.numbers import share_text
from wheelpend.reports.text.remainder import remainder_sentences

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


def ladder_texts(found: Ladder) -> dict[str, str]:
    """What a page says of every ladder: its steps, errors, last values and what remains, as Markdown."""
    rows = [(f"`{n}`", f"{e.value:.4g}", f"{e.sigma:.2g}", e.unit) for n, e in found.parameters.items()]
    return {
        "steps": steps_table(found),
        "course": course_text(found),
        "values": markdown_table(("parameter", "value", "standard error", "unit"), rows),
        "verdict": found.verdict,
        "horizon": f"{found.horizon_s:g}",
        "remains": "\n".join(f"- {line}" for line in remainder_sentences(found.remainder, found.model)),
    }


def steps_table(found: Ladder) -> str:
    """Effect, errors and random force before and after every step of an explanation, in Markdown."""
    header = ("step", "added", "probability", "error before [σ]", "error after [σ]",
              "random force before [% of the drive]", "after")  # fmt: skip
    rows = [
        (str(k), f"`{s.effect}`", _share_text(s.probability), f"{s.error_before:.4g}", f"{s.error_after:.4g}",
         _share_text(s.force_before), _share_text(s.force_after))
        for k, s in enumerate(found.steps, 1)
    ]  # fmt: skip
    return markdown_table(header, rows) if rows else "No effect was added."


def _share_text(share: float | None) -> str:
    return "" if share is None else share_text(share)


def course_text(found: Ladder) -> str:
    """How far the held-out error came down, in sentences."""
    ends = f"noise, with a floor of {found.noise_floor:.2g}."
    begin = f"The held-out error over {found.horizon_s:g} s"
    if not found.steps:
        return f"{begin} is {found.base_error:.4g} times the sensor {ends}"
    added = ", then ".join(f"`{step.effect}`" for step in found.steps)
    return f"Added: {added}. {begin} goes from {found.base_error:.4g} to {found.error:.4g} times the sensor {ends}"


def goal_text(value: float, limit: float) -> str:
    """Whether a value is within a limit, in words that a sentence can end with."""
    return "it is reached" if value <= limit else "it is not reached"
