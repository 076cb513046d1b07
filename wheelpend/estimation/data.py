"""Logs made ready for estimation: read, their noise estimated, cut into estimation and validation segments."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

import derive
from wheelpend.errors import Failure, did_you_mean
from wheelpend.estimation.criteria import DEFAULT_HORIZON_S
from wheelpend.estimation.free_parameters import event_time_names, known_values
from wheelpend.estimation.problem import EstimationProblem, why_not_testable
from wheelpend.estimation.segments import Segments, ValidationData, contiguous_ranges
from wheelpend.kernels import load as kernels
from wheelpend.logs.log import Log, segment_bounds
from wheelpend.logs.noise import Noise, sensor_noise
from wheelpend.logs.read import load_log
from wheelpend.model import model_kernels
from wheelpend.model.record import Model

EVENT_MARGIN_HORIZON_SHARE = (
    0.05  # of the horizon, within which something that happens beside a segment may have happened in it
)
COUPLED_SEGMENTS_PER_RUN = 10  # short segments in a row where something carries on from one to the next


def read_logs(paths: Sequence[str | Path | Log], model: Model) -> tuple[Log, ...]:
    """Load logs as the model's [columns] say; a Log is taken as it is."""
    return tuple(p if isinstance(p, Log) else load_log(p, model.columns, model.table) for p in paths)


def noise_of(log: Log, model: Model) -> Noise:
    """Sensor noise as [sensors] states it, or from the log."""
    stated = {c: model.sensors.noise_of(c) for c in log.channels}
    return sensor_noise(log.excerpt(), stated, {c: model.sensors.step_of(c) for c in log.channels})


def prepare(
    model: Model,
    logs: Sequence[str | Path | Log],
    holdout: Sequence[str | Path | Log] = (),
    *,
    horizon: float = DEFAULT_HORIZON_S,
    use_all: bool = False,
    without: Sequence[str] = (),
    lean: bool = False,
) -> EstimationProblem:
    """Cut logs into training and held-out segments.

    Without hold-out logs the last third of each log is held out; with ``use_all`` nothing is. Effects named in
    ``without`` are not tried. ``lean`` takes the model's own kernels, which know no other effects and are several times
    faster. Raises Failure where a log stands on both sides or yields no segments.
    """
    known = [e.name for e in derive.effects.all_with(model.own)]
    for name in without:
        if name not in known:
            raise Failure(f"No effect named '{name}' can be left out.{did_you_mean(name, known)}")
    _require_distinct_logs(logs, holdout)
    module = (
        kernels.model_module(model.plant, model.assumptions, model.effects)
        if lean
        else model_kernels.library_module_of(model)
    )
    loaded, held_logs = read_logs(logs, model), read_logs(holdout, model)
    _require_testable_effects(model)
    noise = tuple(noise_of(log, model) for log in (*loaded, *held_logs))
    training, held = [], []
    for number, (log, own) in enumerate(zip(loaded, noise, strict=False)):
        split = len(log) if use_all or held_logs else len(log) * 2 // 3
        training.append(_segments_of_log(log, own, horizon, 0, split))
        if split < len(log):
            held.append(ValidationData(_segments_of_log(log, own, horizon, split, len(log)), number, None))
    for log, own in zip(held_logs, noise[len(loaded) :], strict=True):
        third = len(log) // 3
        rest = _segments_of_log(log, own, horizon, third, len(log))
        held.append(ValidationData(rest, None, _segments_of_log(log, own, horizon, 0, third)))
    warnings = tuple(f"{log.name}: {w}" for log in (*loaded, *held_logs) for w in log.warnings)
    step = 0.002  # s, until a start tells how fast the machine is
    found = EstimationProblem(
        model, module, tuple(training), tuple(held), noise, horizon, step, warnings, without=tuple(without)
    )
    if any(derive.effects.find(e).event for e in model.effects):
        values = known_values(model)
        found = with_interleaved_validation(
            found, [values[n] for e in model.effects for n in event_time_names(e) if n in values]
        )
    return replace(found, carries=any(derive.effects.find(e).carries for e in model.effects))


def _require_distinct_logs(logs: Sequence, holdout: Sequence) -> None:
    both = {str(Path(p).resolve()) for p in logs if not isinstance(p, Log)} & {
        str(Path(p).resolve()) for p in holdout if not isinstance(p, Log)
    }
    if both:
        raise Failure(f"A log must not be on both sides, but {', '.join(sorted(both))} is given to fit and to hold "
                      "out. Leave it out of one.")  # fmt: skip


def _require_testable_effects(model: Model) -> None:
    for name in model.effects:
        if why := why_not_testable(derive.effects.find(name), model, model_kernels.library_module_of(model)):
            raise Failure(f"Every effect of the model must be one that data can tell, but {name} {why}. "
                          "Remove it from effects.")  # fmt: skip


def _segments_of_log(log: Log, noise: Noise, horizon: float, start: int, stop: int) -> Segments:
    bounds = segment_bounds(log, horizon, start, stop)
    if not len(bounds):
        raise Failure(f"{log.name} must hold at least one uninterrupted stretch of 5 samples in which the robot "
                      f"stands, but none was found between {log.t[start]:.2f} s and {log.t[stop - 1]:.2f} s. "
                      "Check `wheelpend inspect`.")  # fmt: skip
    return Segments(log, noise.sigma, np.ascontiguousarray(bounds, dtype=np.int64))


def shortened_segments(problem: EstimationProblem, horizon: float, max_segments: int = 120) -> tuple[Segments, ...]:
    """Training parts cut into shorter segments, thinned evenly to about ``most``: they only prepare."""
    found = []
    for part in problem.training:
        bounds = np.concatenate([segment_bounds(part.log, horizon, a, b) for a, b in contiguous_ranges(part.bounds)])
        thin, run = max(1, len(bounds) // max_segments), COUPLED_SEGMENTS_PER_RUN if problem.carries else 1
        kept = np.arange(len(bounds)) // run % thin == 0
        found.append(replace(part, bounds=np.ascontiguousarray(bounds[kept])))
    return tuple(found)


def with_interleaved_validation(problem: EstimationProblem, moments: Sequence[float] = ()) -> EstimationProblem:
    """The study with every second segment of its training logs held out, over their whole length.

    Segments that hold one of the moments [s], or nearly so, are not: nothing else says when something happened.
    """
    training, held = [], []
    for number, part in enumerate(problem.training):
        bounds, t, near = (
            segment_bounds(part.log, problem.horizon),
            part.log.t,
            EVENT_MARGIN_HORIZON_SHARE * problem.horizon,
        )
        kept = np.arange(len(bounds)) % 2 == 0
        for moment in moments:
            kept |= (t[bounds[:, 0]] - near <= moment) & (moment <= t[bounds[:, 1] - 1] + near)
        training.append(replace(part, bounds=np.ascontiguousarray(bounds[kept])))
        if not kept.all():
            held.append(ValidationData(replace(part, bounds=np.ascontiguousarray(bounds[~kept])), number, None))
    return replace(problem, training=tuple(training), validation=tuple(held))
