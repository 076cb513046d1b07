"""The question of a design, posed: two effects to distinguish, or the parameters that are known worst."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

import derive
from wheelpend.diagnosis.score_test import linear_names
from wheelpend.errors import Failure, did_you_mean
from wheelpend.estimation.free_parameters import free_names
from wheelpend.estimation.parameters import kernel_parameters
from wheelpend.estimation.problem import why_not_testable
from wheelpend.estimation.states import fit_states, initial_states
from wheelpend.experiments.design_start import DesignStart, start_from_diagnosis, start_from_fit, start_without_logs
from wheelpend.experiments.question import (
    Question,
    experiment_loop,
    information_at,
    profiled_values_of,
    rival_parameters,
    sample_times,
)
from wheelpend.experiments.reversals import changes_sign
from wheelpend.kernels.kernel_module import KernelModule
from wheelpend.logs.log import Log
from wheelpend.model import model_kernels, workspace
from wheelpend.model.record import Model
from wheelpend.simulation.simulate import SAMPLE_INTERVAL_S


class DesignProblem(NamedTuple):
    """A question, and the assumptions behind it, in sentences."""

    question: Question
    sentences: tuple[str, ...]


def pose_problem(
    model: Model,
    logs: Sequence[str | Path | Log],
    between: Sequence[str],
    duration: float,
    sample: float | None,
    progress: Callable[[str], None],
) -> DesignProblem:
    """Pose the question of a design; raises Failure where it has no answer."""
    first, others = order_rivals(model, between) if between else ("", ())
    rivals: tuple[str, ...] = others
    if logs and not first:
        start, first, rivals = start_from_diagnosis(model, logs, progress)
    elif logs:
        start = start_from_fit(model, logs, first, progress)
    else:
        start = start_without_logs(model, first)
    if sample is None:
        sample = start.problem.logs[0].dt if start.problem.logs else SAMPLE_INTERVAL_S
    found = _problem_of(start, first, rivals, sample_times(duration, sample))
    step = float(found.question.loop.t[1])
    return found._replace(question=replace(found.question, density=step / sample))


def logs_of_last_change(model: Model) -> tuple[Path, ...]:
    """Logs of the last change in the workspace's history that are still there; none where it names none."""
    for entry in reversed(workspace.history(model.workspace)):
        named = entry.get("logs", []) if isinstance(entry, dict) else []
        found = [next((p for p in (model.workspace / n, Path(n)) if p.is_file()), None) for n in map(str, named)]
        if found and all(found):
            return tuple(p for p in found if p)
    return ()


def order_rivals(model: Model, between: Sequence[str]) -> tuple[str, tuple[str, ...]]:
    """The effect of the simulated machine, one of the model's where there is one, and its rival.

    Raises Failure for effects that cannot be judged, or that no command can distinguish.
    """
    known = [e.name for e in derive.effects.all_with(model.own)]
    if len(between) != 2 or between[0] == between[1]:
        raise Failure(f"--between takes two different effects, such as slope,com_offset; it got {','.join(between)}.")
    module = model_kernels.library_module_of(model)
    for name in between:
        if name not in known:
            raise Failure(f"No effect named '{name}'. `wheelpend effects` lists them.{did_you_mean(name, known)}")
        if why := why_not_testable(derive.effects.find(name), model, module):
            raise Failure(f"--between takes effects that data can tell, but {name} {why}.")
    first, other = sorted(between, key=lambda name: name not in model.effects)
    _check_separable(model, module, first, other)
    return first, (other,)


def _check_separable(model: Model, module: KernelModule, first: str, other: str) -> None:
    """Raise Failure where the equations say that no command distinguishes two effects."""
    if other in module.TWINS.get(first, ()):
        reversals = model.plant_signature.reversals
        helps = [t.instruction for t in reversals if changes_sign(t, first) != changes_sign(t, other)]
        cure = f"{helps[0]} and record any command again." if helps else "Measure one of them by other means."
        raise Failure(f"No command separates {first} from {other}: they change every log in the same way. {cure}")
    if first in module.CONTAINS.get(other, {}):
        raise Failure(f"{other} contains {first}, so it explains all that {first} does. Ask what it adds: "
                      f"--between {other},{first}, with {first} not in the model.")  # fmt: skip


def _problem_of(start: DesignStart, first: str, others: tuple[str, ...], t: np.ndarray) -> DesignProblem:
    """The question of distinguishing effects, or of the parameters, with the information of the logs at hand."""
    problem = start.problem
    kept = [e for e in start.present if e not in (first, *others)]
    base = tuple(free_names(problem, kept))
    absent = {n: 0.0 for o in others for n in linear_names(derive.effects.find(o))}  # the machine lacks it
    profiled = profiled_values_of(problem.plant, others, start.values[-1])
    log_values = tuple({**own, **absent, **profiled} for own in start.values)
    names = (*base, *rival_parameters(first, others))
    pieces = []
    for segments, values in zip(problem.data.estimation, log_values, strict=False):
        parameters = kernel_parameters(problem.module, values, segments.log)
        states = initial_states(problem.module, segments)
        states, _ = fit_states(problem.simulator, segments, states, parameters)
        pieces.append(information_at(problem, segments, states, values, names))
    loop = experiment_loop(problem, log_values[-1], t)
    return DesignProblem(Question(problem, loop, base, first, others, log_values, tuple(pieces)), start.sentences)
