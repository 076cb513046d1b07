"""Starting values: nominal ones, or least squares behind filters of several time constants, the best of them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from wheelpend.errors import Failure
from wheelpend.estimation import least_squares
from wheelpend.estimation.continuation import fit_parts, kernels_for
from wheelpend.estimation.criteria import EXPLAINED
from wheelpend.estimation.data import shortened
from wheelpend.estimation.fit import Fit
from wheelpend.estimation.free_parameters import known_values
from wheelpend.estimation.parameters import vector
from wheelpend.estimation.prediction import part_error
from wheelpend.estimation.problem import Study
from wheelpend.estimation.segments import Part
from wheelpend.estimation.states import fit_states, initial_states
from wheelpend.estimation.step_size import stable_step
from wheelpend.kernels import load as kernels

ENOUGH = 200_000  # samples of a log that give a start
START_TIMES = (0.03, 0.14, 0.6, 2.5)  # filter time constants tried for a start without nominal values [s]


def starts(study: Study) -> list[dict[str, float]]:
    """Possible starts for the base parameters: the model's values, and filtered regressions of the first log.

    The parameters are sums of positive physical constants, so a regression that makes one negative is repeated with
    non-negative least squares.
    """
    complete = _known_start(study)
    known, found = complete or _known(study), [complete] if complete else []
    plain = kernels.lean(study.model.plant, study.model.assumptions, ())
    log = study.training[0].log
    log = log.part(0, min(len(log), ENOUGH))
    for time in START_TIMES:
        if 4 * log.dt < time < log.duration / 4:
            tau = (time, 1.3 * time)
            found.append({**known, **least_squares.positive(plain, log, vector(plain, known, log), tau)})
    if not found:
        raise Failure(f"{log.name} must last at least {4 * START_TIMES[0]} s to start without nominal values; "
                      f"it lasts {log.duration:.3f} s. Give nominal values in [parameters].")  # fmt: skip
    return found


def _known(study: Study) -> dict[str, float]:
    """What the model says of its parameters, and what a log says of those that cannot start as absent."""
    from wheelpend.estimation.profiled_starts import first_settings  # imported late: it needs a study

    settings = first_settings(study) if study.model.effects else {}
    return {**settings, **known_values(study.model)}


def _known_start(study: Study) -> dict[str, float] | None:
    """The same where it says all; else None."""
    known = _known(study)
    return known if all(n in known for n in study.base) else None


def best_start(study: Study) -> tuple[Study, dict[str, float]]:
    """The start from which short segments are fitted best, and the study with a step that suits it."""
    parts = shortened(study, study.horizon / 5, most=40)
    known = _known_start(study)
    if known is not None:
        values, fitted = _few_rounds(study, parts, known)
        if fitted.error < EXPLAINED * study.floor:  # in the noise: there is none better
            return replace(study, max_step=_step_at(study, values), origins=(known,)), values
    found = starts(study)
    ranked = sorted(found, key=lambda v: _start_cost(study, parts[0], v))[:3]
    best, lowest = None, np.inf
    for start in ranked:
        values, fitted = _few_rounds(study, parts, start)
        if fitted.cost < lowest:
            best, lowest = values, fitted.cost
        if fitted.error < EXPLAINED * study.floor:
            break
    if best is None:
        raise Failure(f"{study.training[0].log.name}: no start was found from which the model can be simulated. "
                      "Check `wheelpend inspect`, or give nominal values in [parameters].")  # fmt: skip
    return replace(study, max_step=_step_at(study, best), origins=(found[0], *found[:0:-1][:2])), best


def _few_rounds(study: Study, parts: Sequence[Part], start: Mapping[str, float]) -> tuple[dict[str, float], Fit]:
    """Values after a few rounds from a start, and their fit, with a step that suits the start."""
    suited = replace(study, max_step=_step_at(study, start))
    fitted = fit_parts(suited, parts, start, study.base, rounds=8)
    return {**start, **fitted.values}, fitted


def _step_at(study: Study, values: Mapping[str, float]) -> float:
    """A step that resolves the machine's fastest motion at some values [s]."""
    return stable_step(study.module, values, study.training[0].log)


def _start_cost(study: Study, part: Part, values: Mapping[str, float]) -> float:
    module = kernels_for(study, (), values)
    parameters = vector(module, values, part.log)
    shot = fit_states(module, part, initial_states(module, part), parameters, rounds=3, keep=False)[1]
    return part_error(part, shot)
