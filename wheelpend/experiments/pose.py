"""What the last log left open: two effects to tell apart, or the parameters that are known worst."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

import derive
from wheelpend.diagnosis.evidence import CandidateFit
from wheelpend.errors import Failure, did_you_mean
from wheelpend.estimation.continuation import fit_model
from wheelpend.estimation.criteria import DEFAULT_HORIZON_S
from wheelpend.estimation.data import prepare
from wheelpend.estimation.fit import Fit
from wheelpend.estimation.free_parameters import effect_parameter, free_names, known_values
from wheelpend.estimation.parameters import kernel_parameters
from wheelpend.estimation.problem import EstimationProblem, extended_effects, why_not_testable
from wheelpend.estimation.starts import best_start  # fmt: skip
from wheelpend.estimation.states import fit_states, initial_states
from wheelpend.estimation.step_size import stable_step
from wheelpend.experiments.advice import with_advice
from wheelpend.experiments.information import information_of_segments
from wheelpend.experiments.question import Question, closed_loop_of, profiled_values_of, rival_parameters, sample_times
from wheelpend.logs.log import Log
from wheelpend.logs.noise import Noise, rounding_sigma
from wheelpend.model import model_kernels, workspace
from wheelpend.model.record import Model
from wheelpend.simulation.hidden import base_parameter_names
from wheelpend.simulation.simulate import SAMPLE_INTERVAL_S, noise_levels

DEFAULT_ENCODER_COUNTS = 4096  # per revolution, of an encoder of which nothing is known
MIN_SIZE_IN_STANDARD_ERRORS = 2.0  # standard errors above which a fitted size is used, else a typical one


class DesignProblem(NamedTuple):
    """A question, and what was assumed to pose it, in sentences."""

    question: Question
    sentences: tuple[str, ...]


class DesignStart(NamedTuple):
    """A model, its study and values, from logs or without any."""

    problem: EstimationProblem
    values: tuple[dict[str, float], ...]  # of each log at hand, or one without any
    present: tuple[str, ...]  # effects that the rehearsed machine has
    sentences: tuple[str, ...]


def pose_problem(
    model: Model,
    logs: Sequence[str | Path | Log],
    between: Sequence[str],
    duration: float,
    sample: float | None,
    progress: Callable[[str], None],
) -> DesignProblem:
    """Pose the question of a design; raises Failure where it has no answer."""  # fmt: skip
    first, others = order_rivals(model, between) if between else ("", ())
    rivals: tuple[str, ...] = others
    if logs and not first:
        begun, first, rivals = _start_from_diagnosis(model, logs, progress)
    elif logs:
        begun = _start_from_fit(model, logs, first, progress)
    else:
        begun = _start_without_logs(model, first)
    if sample is None:
        sample = begun.problem.training[0].log.dt if begun.problem.training else SAMPLE_INTERVAL_S
    found = _problem_of(begun, first, rivals, sample_times(duration, sample))
    step = float(found.question.loop.t[1])
    return found._replace(question=replace(found.question, density=step / sample))


def logs_of_last_change(model: Model) -> tuple[Path, ...]:
    """Logs of the last change in the workspace's history that are still there; none where it names none."""
    for entry in reversed(workspace.history(model.workspace)):
        named = entry.get("logs", []) if isinstance(entry, dict) else []
        found = [next((p for p in (Path(n), model.workspace / n) if p.is_file()), None) for n in map(str, named)]
        if found and all(found):
            return tuple(p for p in found if p)
    return ()


# ---- which effects


def order_rivals(model: Model, between: Sequence[str]) -> tuple[str, tuple[str, ...]]:
    """The effect that the rehearsed machine has, one of the model's where there is one, and its rival.

    Raises Failure for effects that cannot be judged, or that no command can tell apart.
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
    _check_separable(module, first, other)
    return first, (other,)


def _check_separable(module, first: str, other: str) -> None:
    if other in module.TWINS.get(first, ()):
        from wheelpend.experiments.reversals import PART_REVERSALS, changes_sign

        helps = [t.instruction for t in PART_REVERSALS if changes_sign(t, first) != changes_sign(t, other)]
        cure = f"{helps[0]} and record any command again." if helps else "Measure one of them by other means."
        raise Failure(f"No command separates {first} from {other}: they change every log in the same way. {cure}")
    if first in module.CONTAINS.get(other, {}):
        raise Failure(f"{other} contains {first}, so it explains all that {first} does. Ask what it adds: "
                      f"--between {other},{first}, with {first} not in the model.")  # fmt: skip


# ---- from logs


def _start_from_diagnosis(
    model: Model, logs: Sequence[str | Path | Log], progress: Callable[[str], None]
) -> tuple[DesignStart, str, tuple[str, ...]]:
    """Diagnose the logs: what is ambiguous is the question; else the parameters, with what is missing added."""
    from wheelpend.diagnosis.stepwise import diagnose

    found = with_advice(diagnose(model, logs, progress=progress))
    best = found.named[0] if found.named and found.verdict in ("ambiguous", "effect_missing") else None
    problem = prepare(model, logs, use_all=True)
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
        f"{t.effect}.{p}": v for t in found.named for p, v in t.coefficients.items() if t.effect in rivals
    })  # fmt: skip
    if best.equivalent_to and not rivals:
        hopeless = (f"No command separates {best.effect} from {' and '.join(best.equivalent_to)}. "
                    f"{found.experiment or ''}").strip()  # fmt: skip
        return start._replace(sentences=(*start.sentences, hopeless)), "", ()
    return start, best.effect if rivals else "", rivals


def separable_rivals(problem: EstimationProblem, best: CandidateFit) -> tuple[str, ...]:
    """Those of its equivalents that a command might tell from an effect."""
    module = problem.module
    return tuple(
        e for e in best.equivalent_to
        if e not in module.TWINS.get(best.effect, ()) and best.effect not in module.CONTAINS.get(e, {})
    )  # fmt: skip


def _start_from_fit(
    model: Model, logs: Sequence[str | Path | Log], first: str, progress: Callable[[str], None]
) -> DesignStart:
    """Fit the model with the first effect to the logs."""
    from wheelpend.diagnosis.refit import refit_with

    problem = prepare(model, logs, use_all=True)
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
    """Values of every log, the sizes that are lost in the noise replaced by typical ones."""
    values = tuple({**fitted.of_log(k), **(profiled_values or {})} for k in range(len(problem.training)))
    sentences = list(assumptions)
    for effect in present:
        sizes = [f"{effect}.{p.name}" for p in derive.effects.find(effect).sizes]
        if any(abs(values[-1][n] - _absent_value(n)) > MIN_SIZE_IN_STANDARD_ERRORS * fitted.sigma(n) for n in sizes):
            continue
        typical = {n: p.typical for n in sizes if (p := effect_parameter(n))}
        values = tuple({**v, **typical} for v in values)
        sentences.append(f"{effect} does not show in the logs; a typical size is assumed.")
    return DesignStart(problem, values, tuple(present), tuple(sentences))


def _absent_value(name: str) -> float:
    parameter = effect_parameter(name)
    return parameter.absent if parameter else 0.0


# ---- without logs


def _start_without_logs(model: Model, first: str) -> DesignStart:
    """The model as it stands, its sensors as stated; effects without a value get a typical one."""
    values, module = known_values(model), model_kernels.library_module_of(model)
    if absent := [n for n in base_parameter_names(model) if n not in values]:
        raise Failure(f"{', '.join(absent)} must have a value to rehearse a command: give a LOG to fit, or identify "
                      "the model first.")  # fmt: skip
    present = tuple(model.effects) if not first or first in model.effects else tuple(extended_effects(model, first))
    sentences = ["No log is given, so the command has to tell everything alone."]
    for effect in present:
        unset = [p for p in derive.effects.find(effect).parameters if f"{effect}.{p.name}" not in values]
        values |= {f"{effect}.{p.name}": p.typical for p in unset}
        if unset:
            sentences.append(f"{effect} is assumed to have a typical size.")
    nowhere = Log("", np.arange(2.0), np.zeros(2), np.zeros((2, module.NY)), tuple(module.OUTPUTS))
    step = min(stable_step(module, values, nowhere), 0.01)
    problem = EstimationProblem(
        model, module, (), (), (specified_noise(model, module.OUTPUTS),), DEFAULT_HORIZON_S, step, ()
    )
    return DesignStart(problem, (values,), present, tuple(sentences))


def specified_noise(model: Model, channels: Sequence[str]) -> Noise:
    """Noise of the sensors as the model states it, else the paper's; of an encoder the rounding to its counts."""
    unknown = {"theta_w": 2 * np.pi / DEFAULT_ENCODER_COUNTS}
    quantum = np.array([model.sensors.step_of(c) or unknown.get(c, 0.0) for c in channels])
    levels = np.maximum(noise_levels(model, channels), [rounding_sigma(q) for q in quantum])
    return Noise(levels, quantum, 1.0)


# ---- the question


def _problem_of(begun: DesignStart, first: str, others: tuple[str, ...], t: np.ndarray) -> DesignProblem:
    problem = begun.problem
    kept = [e for e in begun.present if e not in (first, *others)]
    base = tuple(free_names(problem, kept))
    rival = {f"{o}.{p.name}": 0.0 for o in others for p in derive.effects.find(o).linear}  # the machine lacks it
    shapes = profiled_values_of(others, begun.values[-1])
    sizes = tuple({**own, **rival, **shapes} for own in begun.values)
    names = (*base, *rival_parameters(first, others))
    pieces = []
    for part, own in zip(problem.training, sizes, strict=False):
        parameters = kernel_parameters(problem.module, own, part.log)
        states = initial_states(problem.module, part)
        states, _ = fit_states(problem.module, part, states, parameters, problem.max_step)
        pieces.append(information_of_segments(problem.module, part, states, parameters, names, problem.max_step))
    loop = closed_loop_of(problem, sizes[-1], t)
    return DesignProblem(Question(problem, loop, base, first, others, sizes, tuple(pieces)), begun.sentences)
