"""Logs made ready for estimation: read, their noise estimated, cut into estimation and validation segments."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import product

import numpy as np

import derive
from derive.effects import INPUT_MEMORY_S
from derive.plant_signature import PlantWords
from wheelpend.errors import Failure, TooShort, did_you_mean
from wheelpend.estimation.criteria import DEFAULT_HORIZON_S
from wheelpend.estimation.free_parameters import event_time_names, known_values
from wheelpend.estimation.held_out_motion import held_out_input_warnings, held_out_motion_warnings
from wheelpend.estimation.problem import EstimationProblem, carries_over, why_not_testable
from wheelpend.estimation.segments import DataSplit, Segments, ValidationData, contiguous_ranges
from wheelpend.kernels.load import model_module
from wheelpend.logs.checks import check_interval, check_motion, check_sensors_act
from wheelpend.logs.log import MAX_WARM_UP_SHARE, REST_SHARE, Log, segment_bounds, shortest_segment
from wheelpend.logs.noise import Noise, sensor_noise
from wheelpend.logs.outliers import outliers_of, without_outliers
from wheelpend.logs.read import load_log
from wheelpend.logs.rest import led_by_rest, rest_begin, rest_end
from wheelpend.logs.same_record import shared_rows
from wheelpend.logs.sources import LogsLike, as_list, names_of, resolved_paths
from wheelpend.model.model_kernels import library_module_of
from wheelpend.model.record import Model

EVENT_MARGIN_HORIZON_SHARE = 0.05  # of the horizon: an event so near to a segment may have happened in it
COUPLED_SEGMENTS_PER_RUN = 10  # short segments taken in a row where the model couples each to the one before
MIN_MOVING_HORIZONS = 3.0  # of motion, for two to be fitted to and one to be held out
MAX_STILL_SHARE = 0.5  # of a log's last third: where the machine stands still for more of it, more is held out
LEFT_OUT_REST = "what is behind that tells no law from another, and is left out"
INITIAL_MAX_STEP_S = 0.002  # s, until a start gives the machine's fastest motion


def read_logs(given: LogsLike, model: Model) -> tuple[Log, ...]:
    """Logs, loaded with the columns and units of the model's [columns], without outliers; a Log needs no loading.

    Raises Failure for one in which nothing moves, or a sensor says nothing.
    """
    sources = as_list(given)
    named = zip(sources, names_of(sources), strict=True)
    logs = tuple(load_log(source, model.columns, model.table, name=name) for source, name in named)
    stated = model.columns["t"].unit if "t" in model.columns else ""
    for source, log in zip(sources, logs, strict=True):
        check_interval(log, "" if isinstance(source, Log) else stated)
        check_motion(log, model.table)
        check_sensors_act(log, model.table)
    return tuple(without_outliers(log, outliers_of(log, model.table)) for log in logs)


def noise_of(log: Log, model: Model) -> Noise:
    """Sensor noise of a log: as [sensors] states it, else estimated from the log."""
    channels = [model.plant_signature.channel(c) for c in log.channels]
    stated = {c.name: model.sensors.noise_of(c) for c in channels}
    return sensor_noise(log.excerpt(), stated, {c.name: model.sensors.step_of(c) for c in channels})


def prepare(
    model: Model,
    logs: LogsLike,
    holdout: LogsLike = (),
    *,
    horizon: float = DEFAULT_HORIZON_S,
    use_all: bool = False,
    without: Sequence[str] = (),
    lean: bool = False,
    leads: bool = True,
) -> EstimationProblem:
    """Cut logs into estimation and validation segments.

    Without validation logs the last third of each log is held out; with ``use_all`` nothing is. Effects named in
    ``without`` are no candidates. ``lean`` takes the model's own kernels, which contain no other effects and are
    several times faster, and judges logs from where these effects alone have forgotten what came before. A log that
    begins with a step from rest ``leads`` with a time of rest, where an effect may remember it. Raises Failure without
    a log, where a log, or part of its record, stands on both sides, or a log yields no segments.
    """
    if not as_list(logs):
        raise Failure("There must be a log to learn from, but the list of logs is empty. Give one or several.")
    _require_known_effects(model, without)
    _require_distinct_logs(logs, holdout)
    memory = memory_of(model.effects) if lean else INPUT_MEMORY_S
    loaded, validation_logs = (
        tuple(replace(moving_part(log, model, horizon), memory_s=memory) for log in read_logs(given, model))
        for given in (logs, holdout)
    )
    loaded, validation_logs = (
        tuple(led_by_rest(log, model.table) if leads and memory > 0.0 else log.as_read() for log in given)
        for given in (loaded, validation_logs)
    )
    _require_distinct_records(loaded, validation_logs)
    module = model_module(model.plant, model.assumptions, model.effects) if lean else library_module_of(model)
    _require_testable_effects(model)
    noise = tuple(noise_of(log, model) for log in (*loaded, *validation_logs))
    words = model.plant_signature.words
    keep_all = use_all or bool(validation_logs)
    begins = [
        len(log) if keep_all else held_out_begin(log, noise[k], horizon, drives=bool(model.table.inputs))
        for k, log in enumerate(loaded)
    ]
    split = _split_logs(loaded, noise, horizon, words, begins)
    held_out = zip(validation_logs, noise[len(loaded) :], strict=True)
    given = [_validation_data_of_log(log, own, horizon, words) for log, own in held_out]
    split = replace(split, validation=(*split.validation, *given))
    read = zip((*loaded, *validation_logs), noise, strict=True)
    warnings = tuple(w for log, own in read for w in (*_warnings_of(log), *(f"{log.name}: {r}" for r in own.remarks)))
    problem = EstimationProblem(
        model, module, split, noise, horizon, INITIAL_MAX_STEP_S, warnings, without=tuple(without)
    )  # fmt: skip
    if any(derive.effects.find(e).event for e in model.effects) and not use_all:
        problem = with_interleaved_validation(problem, _known_event_times(model))
        aside = [f"{log.name} is not judged: what happens once is in the logs that are fitted, of which every second "
                 "segment is held out." for log in validation_logs]  # fmt: skip
        problem = replace(problem, warnings=(*problem.warnings, *aside))
    else:
        said = [*_stillness_warnings(loaded, begins, words), *_motion_warnings(split, model)]
        problem = replace(problem, warnings=(*problem.warnings, *said))
    return replace(problem, carries=carries_over(module, model.effects))


def moving_part(log: Log, model: Model, horizon: float) -> Log:
    """A log of what nothing drives, until a horizon [s] after it has come to rest; any other log as it is.

    That it stops belongs to how it moves. That it goes on standing says no more, and would outvote what moves, as long
    as it may last: a third of it would be held out, and half of all that is judged be at rest. A swing that noise does
    not hide is none.
    """
    if model.table.inputs or log.has_said(LEFT_OUT_REST):
        return log
    sigma = noise_of(log, model).sigma
    begin, rest = rest_end(log, sigma), rest_begin(log, sigma, share=0.0)
    if rest >= len(log) or log.t[rest] - log.t[min(begin, rest)] < MIN_MOVING_HORIZONS * horizon:
        return log
    end = int(np.searchsorted(log.t, log.t[rest] + horizon))
    if not np.isfinite(log.measured[end:]).any(axis=0).all():
        return log  # it ends there, or what was not read may move
    said = (f"nothing drives the {model.plant_signature.words.machine}, which comes to rest before t = "
            f"{log.t[end]:.3g} s: {LEFT_OUT_REST}.")  # fmt: skip
    return replace(log.part(0, end), warnings=(*log.warnings, said))


def memory_of(effects: Sequence[str]) -> float:
    """Time [s] for which a model with these effects remembers its input, or needs to find a state that it carries."""
    rows = map(derive.effects.find, effects)
    return max((INPUT_MEMORY_S if row.carries else row.input_memory for row in rows), default=0.0)


def _warnings_of(log: Log) -> list[str]:
    """Warnings about a log, which its estimates inherit."""
    found = [f"{log.name}: {w}" for w in log.warnings]
    driven = bool(np.any(log.inputs[np.isfinite(log.inputs)]))
    if driven and log.warm_up_s < log.memory_s and log.dt < log.memory_s:  # else one sample outlasts the memory
        found.append(f"{log.name}: what was commanded before a log begins, or in a gap, is unknown, and an actuator "
                     f"may remember it for {log.memory_s:g} s. The log is too short to leave out more than "
                     f"{log.warm_up_s:.2g} s after each: believe no delay or lag that lasts longer, and record "
                     f"{3.0 * log.memory_s / MAX_WARM_UP_SHARE:g} s without a gap.")  # fmt: skip
    return found


def _require_known_effects(model: Model, names: Sequence[str]) -> None:
    known = [e.name for e in derive.effects.all_with(model.own)]
    for name in names:
        if name not in known:
            raise Failure(f"No effect named '{name}' can be left out.{did_you_mean(name, known)}")


def _require_distinct_logs(logs: LogsLike, holdout: LogsLike) -> None:
    fitted, held_out = (set(resolved_paths(given)) for given in (logs, holdout))
    both = fitted & held_out
    if both:
        raise Failure(f"A log must not be on both sides, but {', '.join(sorted(both))} is given to fit and to hold "
                      "out. Leave it out of one.")  # fmt: skip


def _require_distinct_records(logs: Sequence[Log], holdout: Sequence[Log]) -> None:
    """Raise Failure where a log to hold out has samples of one to fit, whatever its name, format and times are."""
    for log, held_out in product(logs, holdout):
        if shared := shared_rows(log, held_out):
            whole = shared.length == len(log) == len(held_out)
            alike = "all their samples" if whole else f"{shared.length} samples in a row"
            rows = "" if whole else f" (from row {shared.first} and row {shared.other_first} on)"
            raise Failure(f"A record must not be on both sides, but {log.name} to fit and {held_out.name} to hold out "
                          f"have {alike} in common{rows}. Leave one out, or cut it.")  # fmt: skip


def _require_testable_effects(model: Model) -> None:
    for name in model.effects:
        if why := why_not_testable(derive.effects.find(name), model, library_module_of(model)):
            raise Failure(f"Every effect of the model must be one that data can tell, but {name} {why}. "
                          "Remove it from effects.")  # fmt: skip


def _known_event_times(model: Model) -> list[float]:
    """Times [s] at which the events in the model begin and end, as far as it gives them."""
    values = known_values(model)
    return [values[n] for e in model.effects for n in event_time_names(e) if n in values]


def _split_logs(
    logs: Sequence[Log], noise: Sequence[Noise], horizon: float, words: PlantWords, begins: Sequence[int]
) -> DataSplit:
    """Estimation segments of logs, and validation segments from the sample of each on with which these begin."""
    estimation, validation = [], []
    for number, (log, own, split) in enumerate(zip(logs, noise, begins, strict=False)):
        estimation.append(_segments_of_log(log, own, horizon, 0, split, words))
        if split < len(log):
            validation.append(ValidationData(_segments_of_log(log, own, horizon, split, len(log), words), number, None))
    return DataSplit(tuple(estimation), tuple(validation))


def held_out_begin(log: Log, noise: Noise, horizon: float, *, drives: bool = True) -> int:
    """The first sample that is held out: two thirds of a log, or of what moves where it stands still for the rest.

    A machine at rest follows hardly any law, and tells none from another. What moves for less than three times the
    horizon [s] is not divided where the log ends with a rest. Of a machine that nothing ``drives`` a rest at its log's
    end has been cut, and any that is left counts. Raises Failure where nothing moves before what is held out, nor for
    long enough behind that.
    """
    first, third, rest = log.first_read, _last_third(log), rest_begin(log, noise.sigma, REST_SHARE if drives else 0.0)
    stands_still = len(log) - rest > (MAX_STILL_SHARE * (len(log) - third) if drives else 0)
    moves = log.t[min(rest, len(log) - 1)] - log.t[first] >= MIN_MOVING_HORIZONS * horizon
    split = min(first + (rest - first) * 2 // 3, third) if stands_still and moves else third
    moving = max(rest_end(log, noise.sigma), first)
    if moving - first <= MAX_STILL_SHARE * (split - first) or moving >= rest:
        return split
    end = rest if stands_still else len(log)
    later = moving + (end - moving) * 2 // 3
    if end - later >= shortest_segment(log, horizon):
        return later
    if rest_end(log, np.zeros(len(log.channels))) >= split:  # whatever the noise is: all motion is held out
        raise Failure(f"{log.name} must show how the machine moves for longer: it stands still until t = "
                      f"{log.t[moving]:.3g} s and moves for {log.t[end - 1] - log.t[moving]:.2g} s, of which a third "
                      f"is held out, and over {horizon:g} s, or a fifth of that, it is judged. Record more of the "
                      "motion, or hold out another log (--holdout).")  # fmt: skip
    return split


def _last_third(log: Log) -> int:
    """The first sample of the last third of what was read while a log is usable, before which it may be held."""
    return log.first_read + (len(log) - log.first_read) * 2 // 3


def _stillness_warnings(logs: Sequence[Log], begins: Sequence[int], words: PlantWords) -> list[str]:
    """A warning on each log of which more or less than the last third is held out, by the sample that begins it."""
    said = []
    for log, begin in zip(logs, begins, strict=True):
        third = _last_third(log)
        part = "last third" if begin < third else "first two thirds"
        where = "while it moves" if begin < third else "with two thirds of what moves before it"
        if begin not in (third, len(log)):
            said.append(
                f"{log.name}: the {words.machine} stands still for most of the {part}, which tells no law from "
                f"another: what is held out begins at t = {log.t[begin]:.3g} s, {where}."
            )
    return said


def _motion_warnings(split: DataSplit, model: Model) -> list[str]:
    """Warnings on each log of which a part is held out that hardly judges what is fitted to the rest."""
    return [
        warning
        for v in split.validation
        if v.estimation_log is not None
        for warning in (
            *held_out_motion_warnings(split.estimation[v.estimation_log], v.part, model.table),
            *held_out_input_warnings(split.estimation, v.part, model.table),
        )
    ]


def _validation_data_of_log(log: Log, noise: Noise, horizon: float, words: PlantWords) -> ValidationData:
    """A validation log's segments, with the first third of what was read, to calibrate its per-log parameters."""
    begin = log.first_read
    split = begin + (len(log) - begin) // 3
    judged = _segments_of_log(log, noise, horizon, split, len(log), words)
    return ValidationData(judged, None, _segments_of_log(log, noise, horizon, 0, split, words))


def _segments_of_log(log: Log, noise: Noise, horizon: float, start: int, stop: int, words: PlantWords) -> Segments:
    bounds = segment_bounds(log, horizon, start, stop)
    if not len(bounds):
        raise TooShort(f"{log.name} must hold at least one uninterrupted stretch of {shortest_segment(log, horizon)} "
                      f"samples, a fifth of the horizon of {horizon:g} s, in which the {words.machine} {words.stands}, "
                      f"but none was found between {log.t[start]:.2f} s and {log.t[stop - 1]:.2f} s. "
                      "Check `wheelpend inspect`.")  # fmt: skip
    return Segments(log, noise.sigma, np.ascontiguousarray(bounds, dtype=np.int64))


def shortened_segments(problem: EstimationProblem, horizon: float, max_segments: int = 120) -> tuple[Segments, ...]:
    """Estimation segments cut into shorter ones of a horizon [s], thinned evenly to about ``max_segments`` a log."""
    found = []
    for segments in problem.data.estimation:
        ranges = contiguous_ranges(segments.bounds)
        bounds = np.concatenate([segment_bounds(segments.log, horizon, a, b) for a, b in ranges])
        thin, run = max(1, len(bounds) // max_segments), COUPLED_SEGMENTS_PER_RUN if problem.carries else 1
        selected = np.arange(len(bounds)) // run % thin == 0
        found.append(replace(segments, bounds=np.ascontiguousarray(bounds[selected])))
    return tuple(found)


def with_interleaved_validation(problem: EstimationProblem, event_times: Sequence[float] = ()) -> EstimationProblem:
    """The problem with every second segment of its estimation logs held out, over their whole length.

    Segments at or near an event time [s] are not held out: nothing else determines when the event happened.
    """
    estimation, validation = [], []
    margin = EVENT_MARGIN_HORIZON_SHARE * problem.horizon
    for number, segments in enumerate(problem.data.estimation):
        bounds, t = segment_bounds(segments.log, problem.horizon), segments.log.t
        fitted = np.arange(len(bounds)) % 2 == 0
        for time in event_times:
            fitted |= (t[bounds[:, 0]] - margin <= time) & (time <= t[bounds[:, 1] - 1] + margin)
        estimation.append(replace(segments, bounds=np.ascontiguousarray(bounds[fitted])))
        if not fitted.all():
            others = replace(segments, bounds=np.ascontiguousarray(bounds[~fitted]))
            validation.append(ValidationData(others, number, None))
    return replace(problem, data=DataSplit(tuple(estimation), tuple(validation)))
