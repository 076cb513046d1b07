"""Short times in which something outside the machine moves it: a hand that holds it, a blow, a stop, a dead sensor.

A random force that is as large in one second of a log as in another describes none of these. It grows until it covers
them, and hides behind itself whatever law the rest of the log would show. So where a model leaves such a force, and the
smoother finds most of it in a few short spans, a search is made on the logs without these. It counts if it explains
what is left by a law, or leaves far less to chance. What a command that jumps makes at once is no such span: so a delay
would look, or an amplifier at its limit. Nor is one in which a command does most of what it does in the log.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from wheelpend.diagnosis.likelihood.filtered_model import FilteredModel
from wheelpend.diagnosis.missing_force.estimate import MissingForce
from wheelpend.diagnosis.missing_force.smoothed_force import forces_by_filter
from wheelpend.diagnosis.verdict import Diagnosis
from wheelpend.estimation.criteria import MAX_EXPLAINED_ERROR_RATIO
from wheelpend.estimation.data import prepare
from wheelpend.estimation.fit import Fit
from wheelpend.estimation.problem import EstimationProblem
from wheelpend.logs.checks import moves
from wheelpend.logs.log import REST_SHARE, Log
from wheelpend.logs.runs import runs_of

MAX_SPANS, MAX_SPAN_SHARE = 3, 0.15  # of a log that are left out, and their share of its time: more is no exception
PEAK_SHARE = 0.3  # of the largest missing force, above which a span holds it
MIN_PEAK_RATIO = 8.0  # of that largest to the rms elsewhere: a model gone astray makes six
EDGE_RATIO = 2.0  # of the missing force at the edges of a span to the rms elsewhere
MARGIN_HORIZON_SHARE = 0.2  # of the horizon, left out before and after: the smoother blurs what begins at once
MIN_CALMED_SHARE = 0.02  # of the drive: a random force below hides little
STEP_SHARE = 0.5  # of a command's range, by which it jumps at a step; of all its changes, that are the drive
MIN_SURPRISE_RATIO = 3.0  # of a held-out error to the noise, where the fit leaves nothing to chance: a late blow
CALM_RATIO = 3.0  # of what is left to chance with all of the log to what is left without the spans


class Span(NamedTuple):
    """A short time of a log in which the missing force is far larger than elsewhere."""

    begin: float  # s
    end: float  # s
    ratio: float  # of its largest force to the rms of the missing force elsewhere; 0 where nothing is commanded
    onset: float = 0.0  # s, at which that force begins


def without_outside_forces(model: FilteredModel, error_ratio: float = 0.0) -> EstimationProblem | None:
    """A model's problem on logs without the spans in which something else moves the machine.

    None where little is left to chance and held-out data, whose error is ``error_ratio`` times the noise, hold little
    more; or no few spans hold what is left, or all that moves. Raises Failure where they leave too little of a log, and
    what a filter along the logs does where it cannot follow the model.
    """
    problem = model.problem
    if model.remainder().share < MIN_CALMED_SHARE and error_ratio < MIN_SURPRISE_RATIO:
        return None
    whole = prepare(problem.model, problem.logs, horizon=problem.horizon, use_all=True, without=problem.without)
    forces = forces_by_filter(replace(whole, max_step=problem.max_step), Fit.at({}, model.log_values))
    pairs = zip(forces, problem.logs, strict=False)  # none where no filter could follow the model
    spans = [_spans_of_log(log, force, problem.horizon) for force, log in pairs]
    if not any(spans) or not any(_moves_without(*pair) for pair in zip(problem.logs, spans, strict=True)):
        return None
    logs = [log_without(log, own) for log, own in zip(problem.logs, spans, strict=True)]
    held_out = [v.part.log for v in problem.data.validation if v.estimation_log is None]
    return prepare(problem.model, logs, held_out, horizon=problem.horizon, without=problem.without)


def is_far_calmer(found: Diagnosis, before: Diagnosis) -> bool:
    """True where the last diagnosis of a search leaves far less to chance than that of one with all of the logs.

    A model that reaches sensor noise over the horizon leaves nothing. Or where it reaches that noise on held-out data,
    far below the other: a blow there leaves nothing to chance in what was fitted.
    """
    shares = [one.remainder.share if one.remainder else 0.0 for one in (found, before)]
    reaches_noise = found.error <= MAX_EXPLAINED_ERROR_RATIO * found.noise_floor
    return shares[0] * CALM_RATIO < shares[1] or (reaches_noise and found.error * CALM_RATIO < before.error)


def _spans_of_log(log: Log, missing: MissingForce, horizon: float) -> list[Span]:
    """The spans of a log that no command makes, and its ends at which it moves without one."""
    found = spans_of(missing, (float(log.t[0]), float(log.t[-1])), horizon)
    margin = MARGIN_HORIZON_SHARE * horizon
    from_outside = [s for s in found if not (begins_at_a_step(log, s.onset, margin) or drives_within(log, s))]
    spans = joined([*from_outside, *idle_ends(log, horizon)])
    return spans if sum(s.end - s.begin for s in spans) <= MAX_SPAN_SHARE * log.duration else []


def joined(spans: Sequence[Span]) -> list[Span]:
    """Spans in the order of time, those that overlap as one."""
    found: list[Span] = []
    for span in sorted(spans):
        if found and span.begin <= found[-1].end:
            last = found.pop()
            span = last._replace(end=max(last.end, span.end), ratio=max(last.ratio, span.ratio))
        found.append(span)
    return found


def idle_ends(log: Log, horizon: float) -> list[Span]:
    """The begin and the end of a log in which it moves for the horizon [s] or longer, and nothing is commanded.

    A machine that is held until it is switched on, or caught and switched off, looks so, and a motor without current
    does not brake. One that comes to rest within the horizon behind the last command was driven by it.
    """
    commanded = np.isnan(log.inputs) | (log.inputs != 0.0)  # what is not known may be anything
    active = np.flatnonzero(commanded.any(axis=0))
    if not len(active):
        return []
    found = []
    for first, last in ((0, int(active[0])), (int(active[-1]) + 1, len(log))):
        if last - first < 2 or log.t[last - 1] - log.t[first] < horizon:
            continue
        coasted = int(np.searchsorted(log.t, log.t[first] + horizon)) if first else 0
        if _moves(log, coasted, last):
            found.append(Span(float(log.t[first]), float(log.t[last - 1]), 0.0))
    return found


def _moves_without(log: Log, spans: Sequence[Span]) -> bool:
    """True where a log moves before, between or behind its spans: what rests there tells no law."""
    left = log_without(log, spans)
    return any(_moves(left, stretch.begin, stretch.end) for stretch in left.stretches)


def _moves(log: Log, first: int, last: int) -> bool:
    """True where a channel leaves its noise, and does not rest, from one sample to before another."""
    for channel in log.measured.T:
        known, part = (values[np.isfinite(values)] for values in (channel, channel[first:last]))
        if part.size and moves(part, log.dt) and np.ptp(part) > REST_SHARE * np.ptp(known):
            return True
    return False


def begins_at_a_step(log: Log, onset: float, margin: float) -> bool:
    """True of a force that begins [s] within a margin [s] of where a command jumps by half of its range or more."""
    if onset < log.t[log.lead]:  # between rest and the step that follows nothing is read
        return True
    near = np.abs(log.t[1:] - onset) <= margin
    for command in log.known_voltage.reshape(len(log), -1).T:
        jumps, width = np.abs(np.diff(command)), np.ptp(command)
        if width > 0.0 and np.any(jumps[near] >= STEP_SHARE * width):
            return True
    return False


def drives_within(log: Log, span: Span) -> bool:
    """True of a span in which a command does half or more of all that it does in a log: what acts there is the drive.

    Without such a time hardly anything is left that shows a law.
    """
    changes = np.abs(np.diff(log.known_voltage.reshape(len(log), -1), axis=0))
    within = changes[(log.t[1:] >= span.begin) & (log.t[1:] <= span.end)].sum(axis=0)
    return bool(np.any((within > 0.0) & (within >= STEP_SHARE * changes.sum(axis=0))))


def spans_of(missing: MissingForce, ends: tuple[float, float], horizon: float) -> list[Span]:
    """The few short spans of a log that hold most of what is missing, with a margin; none where it is spread.

    What would be left between one and one of the log's ``ends`` [s], and is shorter than the horizon [s], belongs to
    it. Of the rows that one counts whose force is the most uneven.
    """
    found = (_spans_of_row(missing.t, np.abs(force), ends, horizon) for force in missing.force.T)
    return max(found, key=_unevenness, default=[])


def _unevenness(spans: Sequence[Span]) -> float:
    return max((s.ratio for s in spans), default=0.0)


def _spans_of_row(t: np.ndarray, size: np.ndarray, ends: tuple[float, float], horizon: float) -> list[Span]:
    """The spans of one row, with the sizes (N,) of its missing force at times t (N,) [s]."""
    margin = MARGIN_HORIZON_SHARE * horizon
    peaks = _ranges(size > PEAK_SHARE * size.max(), t, margin) if size.any() else []
    if not 0 < len(peaks) <= MAX_SPANS:
        return []
    outside = np.ones(len(t), dtype=bool)
    for first, last in peaks:
        outside[first : last + 1] = False
    usual = float(np.sqrt(np.mean(size[outside] ** 2))) if outside.any() else np.inf
    if not 0.0 < usual <= size.max() / MIN_PEAK_RATIO:
        return []
    spans = []
    for first, last in (_widened(size > EDGE_RATIO * usual, *peak) for peak in peaks):
        begin, end, ratio = t[first] - margin, t[last] + margin, size[first : last + 1].max() / usual
        begin = begin if begin - ends[0] > horizon else ends[0]
        end = end if ends[1] - end > horizon else ends[1]
        if ratio >= MIN_PEAK_RATIO:
            spans.append(Span(float(begin), float(end), float(ratio), float(t[first])))
    return spans if sum(s.end - s.begin for s in joined(spans)) <= MAX_SPAN_SHARE * (ends[1] - ends[0]) else []


def _ranges(chosen: np.ndarray, t: np.ndarray, near: float) -> list[tuple[int, int]]:
    """First and last places of the runs of chosen samples (N,); runs are one where they are nearer than twice that."""
    places = np.flatnonzero(chosen)
    parted = np.flatnonzero(np.diff(t[places]) > 2.0 * near)
    begins, ends = places[np.r_[0, parted + 1]], places[np.r_[parted, len(places) - 1]]
    return list(zip(begins.tolist(), ends.tolist(), strict=True))


def _widened(chosen: np.ndarray, first: int, last: int) -> tuple[int, int]:
    """A range of samples with the chosen ones (N,) that adjoin it."""
    mask = chosen.copy()
    mask[first : last + 1] = True
    return next((int(a), int(b) - 1) for a, b in runs_of(mask) if a <= first < b)


def log_without(log: Log, spans: Sequence[Span]) -> Log:
    """A log in whose spans nothing is known of the input, so that no segment has a part in them, and a warning."""
    if not spans:
        return log
    voltage = np.array(log.voltage, dtype=float)
    for span in spans:
        voltage[(log.t >= span.begin) & (log.t <= span.end)] = np.nan
    return replace(log, voltage=voltage, warnings=(*log.warnings, *map(_sentence, spans)))


def _sentence(span: Span) -> str:
    times = f"Between {span.begin:.2f} and {span.end:.2f} s"
    said = (
        f"{times} something outside the model moves it, {span.ratio:.0f} times as hard as what else is missing: a hand "
        "that holds it, a blow, a stop, a sensor that fails?"
        if span.ratio
        else f"{times}, at an end of the log, it moves and nothing is commanded: a hand that holds it, or a motor "
        "that is off?"
    )
    return f"{said} This time is left out of the search; cut it off the log for other commands too."
