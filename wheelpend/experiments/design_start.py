"""Model, values and sensors from which a design starts: a diagnosis or a fit of logs, or the model as it stands."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

import derive
from derive.parameter_name import full_name
from wheelpend.diagnosis.evidence import CandidateFit
from wheelpend.diagnosis.refit import refit_with
from wheelpend.diagnosis.score_test import size_names
from wheelpend.diagnosis.stepwise import diagnose
from wheelpend.errors import Failure
from wheelpend.estimation.continuation import fit_model
from wheelpend.estimation.criteria import DEFAULT_HORIZON_S
from wheelpend.estimation.data import prepare
from wheelpend.estimation.fit import Fit
from wheelpend.estimation.free_parameters import effect_parameter, free_names, known_values
from wheelpend.estimation.problem import EstimationProblem, extended_effects
from wheelpend.estimation.segments import DataSplit
from wheelpend.estimation.starts import best_start
from wheelpend.estimation.step_size import stable_step
from wheelpend.experiments.advice import with_advice
from wheelpend.logs.log import Log
from wheelpend.logs.noise import Noise, rounding_sigma
from wheelpend.model import model_kernels
from wheelpend.model.record import Model
from wheelpend.simulation.hidden import base_parameter_names
from wheelpend.simulation.simulate import noise_levels

MIN_SIZE_IN_STANDARD_ERRORS = 2.0  # standard errors above which a fitted size is used, else a typical one
MAX_STEP_S = 0.01  # s of integration, where no log says how fast the machine is


class DesignStart(NamedTuple):
    """An estimation problem and its parameter values, from logs or without any."""

    problem: EstimationProblem
    values: tuple[dict[str, float], ...]  # of each log at hand, or one without any
    present: tuple[str, ...]  # effects of the simulated machine
    sentences: tuple[str, ...]


def start_from_diagnosis(
    model: Model, logs: Sequence[str | Path | Log], progress: Callable[[str], None]
) -> tuple[DesignStart, str, tuple[str, ...]]:
    """The start, the effect and its rivals that a diagnosis leaves: none where the parameters are the question.

    Of an ambiguous diagnosis the equivalents are the rivals; a missing effect is added to the model.
    """
    found = with_advice(diagnose(model, logs, progress=progress))
    best = found.named[0] if found.named and found.verdict in ("ambiguous", "effect_missing") else None
    problem = prepare(model, logs, use_all=True, leads=False)
    problem = replace(problem, max_step=found.problem.max_step)
    if best is None:
        said = ("The logs leave something unexplained, so these figures are those of a model that is not true yet.",)
        present = model.effects
        start = _start_of_fit(problem, found.fit, present, said if found.verdict == "unexplained" else ())
        return start, "", ()
    present = tuple(extended_effects(model, best.effect))
    rivals = separable_rivals(problem, best)
    said = (f"The logs show {best.effect}, which the model does not have yet; it is in the rehearsals.",)
    start = _start_of_fit(problem, best.fit, present, said, profiled_values={
        full_name(t.effect, p): v for t in found.named for p, v in t.coefficients.items() if t.effect in rivals
    })  # fmt: skip
    if best.equivalent_to and not rivals:
        hopeless = (f"No command separates {best.effect} from {' and '.join(best.equivalent_to)}. "
                    f"{found.experiment or ''}").strip()  # fmt: skip
        return start._replace(sentences=(*start.sentences, hopeless)), "", ()
    return start, best.effect if rivals else "", rivals


def separable_rivals(problem: EstimationProblem, best: CandidateFit) -> tuple[str, ...]:
    """Equivalents that a command might distinguish from an effect."""
    module = problem.module
    return tuple(
        e for e in best.equivalent_to
        if e not in module.TWINS.get(best.effect, ()) and best.effect not in module.CONTAINS.get(e, {})
    )  # fmt: skip


def start_from_fit(
    model: Model, logs: Sequence[str | Path | Log], first: str, progress: Callable[[str], None]
) -> DesignStart:
    """Fit the model with the first effect to the logs."""
    problem = prepare(model, logs, use_all=True, leads=False)
    progress("finding a start")
    problem, start = best_start(problem)
    progress("fitting the model as it is")
    fitted = fit_model(problem, start, free_names(problem, model.effects))
    if first in model.effects:
        return _start_of_fit(problem, fitted, model.effects, ())
    progress(f"fitting {first}")
    larger = refit_with(problem, start, fitted, first)[1]
    return _start_of_fit(problem, larger, tuple(extended_effects(model, first)), ())


def _start_of_fit(
    problem: EstimationProblem,
    fitted: Fit,
    present: Sequence[str],
    assumptions: Sequence[str],
    profiled_values: Mapping[str, float] | None = None,
) -> DesignStart:
    """A start with a fit's values, sizes that are lost in the noise replaced by typical ones."""
    values = tuple({**fitted.of_log(k), **(profiled_values or {})} for k in range(len(problem.data.estimation)))
    sentences = list(assumptions)
    for effect in present:
        sizes = size_names(derive.effects.find(effect))
        if any(
            abs(values[-1][n] - _absent_value(problem, n)) > MIN_SIZE_IN_STANDARD_ERRORS * fitted.sigma(n)
            for n in sizes
        ):
            continue
        typical = {n: p.typical for n in sizes if (p := effect_parameter(n, problem.plant))}
        values = tuple({**v, **typical} for v in values)
        sentences.append(f"{effect} does not show in the logs; a typical size is assumed.")
    return DesignStart(problem, values, tuple(present), tuple(sentences))


def _absent_value(problem: EstimationProblem, name: str) -> float:
    parameter = effect_parameter(name, problem.plant)
    return parameter.absent if parameter else 0.0


def start_without_logs(model: Model, first: str) -> DesignStart:
    """The model as it stands, its sensors as stated; effects without a value get a typical one."""
    values, module = known_values(model), model_kernels.library_module_of(model)
    if absent := [n for n in base_parameter_names(model) if n not in values]:
        raise Failure(f"{', '.join(absent)} must have a value to rehearse a command: give a LOG to fit, or identify "
                      "the model first.")  # fmt: skip
    present = tuple(model.effects) if not first or first in model.effects else tuple(extended_effects(model, first))
    sentences = ["No log is given, so the command has to tell everything alone."]
    for effect in present:
        row = derive.effects.in_plant_units(derive.effects.find(effect), model.plant_signature)
        unset = [p for p in row.parameters if full_name(effect, p.name) not in values]
        values |= {full_name(effect, p.name): p.typical for p in unset}
        if unset:
            sentences.append(f"{effect} is assumed to have a typical size.")
    empty = Log("", np.arange(2.0), np.zeros(2), np.zeros((2, module.NY)), tuple(module.OUTPUTS))
    step = min(stable_step(module, values, empty), MAX_STEP_S)
    noise = (specified_noise(model, module.OUTPUTS),)
    problem = EstimationProblem(model, module, DataSplit((), ()), noise, DEFAULT_HORIZON_S, step, ())
    return DesignStart(problem, (values,), present, tuple(sentences))


def specified_noise(model: Model, channels: Sequence[str]) -> Noise:
    """Noise of the sensors as the model states it, else the plant's; of an encoder the rounding to its counts."""
    known = map(model.plant_signature.channel, channels)
    quantum = np.array([model.sensors.step_of(c) or c.sensor.step for c in known])
    levels = np.maximum(noise_levels(model, channels), [rounding_sigma(q) for q in quantum])
    return Noise(levels, quantum, 1.0)
