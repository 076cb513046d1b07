"""What a file's columns are, without a model: time, inputs, positions, their rates, references, constants."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from itertools import permutations
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from wheelpend.errors import Failure
from wheelpend.inspection.kinematics import RatePair, rate_misfit
from wheelpend.inspection.signals import MAX_SWAPPED_MISFIT_SHARE, Signals, uniform_signals
from wheelpend.logs.checks import check_time
from wheelpend.logs.columns import INPUT_ALIASES, TIME_ALIASES, UNIT_CONVERSIONS, ColumnMap, guess_unit
from wheelpend.logs.log import Log
from wheelpend.logs.noise import find_quantum
from wheelpend.logs.read import find_time_column, open_file
from wheelpend.logs.tables import check_length, scalars_of
from wheelpend.logs.white_noise import difference_noise
from wheelpend.numerics import gaussian_smoothed

REFERENCE_NAMES = ("ref", "goal", "desired", "target", "setpoint")
RATE_NAMES = ("vel", "rate", "gyro", "omega", "dtheta", "speed", "dpos")
TORQUE_NAMES = ("tau", "trq", "torque")
INPUT_UNITS = {"N m": TORQUE_NAMES, "A": ("current", "amp"), "N": ("force",), "V": ("v_in", "volt", "vir")}
MAX_FOLLOWING_SHARE = 0.05  # of a position's variance, by which another one that it follows differs at most
MIN_NAMED_RATE_SHARE = 0.3  # unexplained, up to which a column that is called a rate is that of a position
COMPUTED_SHARE = 0.4  # of a rate's errors that a filter of its angle gives, from which on it was computed
MIN_ENCODER_COUNTS = 100  # of a turn
COMPUTED = "no sensor of its own."
SCATTER_LAG_SAMPLES, MAX_RAW_GROWTH = 4, 1.9  # growth of a raw signal's scatter over so many samples
MAX_REMARK_SAMPLES = 20_000  # looked at for that
MIN_PLACES = 10  # different readings of a place
MAX_PLACE_STEP_SHARE = 0.3  # of its range, by which a place moves from sample to sample at most
ERROR_SMOOTHING_SAMPLES = 3.0  # standard deviation of the Gaussian beyond which a signal is error
MAX_FILTER_SAMPLES = 15  # samples before and after, from which such a filter takes them


class FileColumn(NamedTuple):
    """A column of a file: what it is taken for, and why."""

    name: str
    role: str  # time, input, position, rate, reference, constant, further
    of: str  # the position of a rate or a reference
    minimum: float
    maximum: float
    step: float  # 0 where it has none
    remark: str  # a sentence, or nothing

    def to_json(self) -> dict[str, Any]:
        """The column under the keys of JSON."""
        return self._asdict()


class Survey(NamedTuple):
    """The columns of a file, its clock, and its signals on a uniform grid."""

    file: str
    columns: tuple[FileColumn, ...]
    clock: ColumnMap
    signals: Signals | None
    values: dict[str, np.ndarray]
    scalars: dict[str, float]

    def of_role(self, role: str) -> list[str]:
        """Names of the columns of a role, in the file's order."""
        return [c.name for c in self.columns if c.role == role]

    def is_computed(self, name: str) -> bool:
        """True of a rate that is no sensor of its own."""
        return self.column(name).remark.endswith(COMPUTED)

    def column(self, name: str) -> FileColumn:
        """A column by its name."""
        return next(c for c in self.columns if c.name == name)


def survey_file(path: Path) -> Survey:
    """What each column of a file is; raises Failure where it has no time that grows."""
    file, path = open_file(path), Path(path)
    values = numeric_columns(file.read, file.names)
    likely = next((n for n in values if n == "t" or contains(n, TIME_ALIASES)), "")
    clock = find_time_column(file, likely, list(values))
    if clock is None:
        raise Failure(f"{path.name}: one column must be the time, growing from row to row; none of {', '.join(values)} "
                      "does. Sort the rows, or add the times.")  # fmt: skip
    raw = values.pop(clock.column)
    check_length(path.name, len(raw))
    check_time(path.name, raw)
    t = (raw - raw[0]) * UNIT_CONVERSIONS[clock.unit][1]
    moving = {n: v for n, v in values.items() if np.isfinite(v).any() and np.nanmin(v) < np.nanmax(v)}
    log = Log(path.name, t, np.zeros(len(t)), np.column_stack(list(moving.values())), tuple(moving), rates={})
    signals = uniform_signals(log, "", in_range=False)
    roles = roles_of(moving, signals)
    columns = [column_of(clock.column, "time", "", raw, "")]
    for name, v in values.items():
        role, of = roles.get(name, ("constant", ""))
        remark = rate_remark(moving[of], v, t) if role == "rate" else ""
        remark = step_remark(find_quantum(v)) if role == "position" else remark
        columns.append(column_of(name, role, of, v, remark))
    return Survey(path.name, tuple(columns), clock, signals, {**moving, "t": t}, scalars_of(path))


def numeric_columns(read: Callable[[list[str]], dict[str, np.ndarray]], names: Sequence[str]) -> dict[str, np.ndarray]:
    """The columns of a file that hold numbers."""
    found = {}
    for name in names:
        try:
            found[name] = read([name])[name]
        except Failure:
            continue  # text, which no quantity is
    return found


def column_of(name: str, role: str, of: str, values: np.ndarray, remark: str) -> FileColumn:
    """A column with its range and step."""
    known = values[np.isfinite(values)]
    low, high = (float(known.min()), float(known.max())) if known.size else (np.nan, np.nan)
    return FileColumn(name, role, of, low, high, find_quantum(values) if role != "time" else 0.0, remark)


def contains(name: str, words: Sequence[str]) -> bool:
    """True of a name that is one of the words, or has one of more than two letters in it."""
    low = name.lower()
    return any(re.sub(r"\d+$", "", low) == w or (len(w) > 2 and w in low) for w in words)


def roles_of(values: dict[str, np.ndarray], signals: Signals | None) -> dict[str, tuple[str, str]]:
    """Role of each column that changes, and of rates and references the position: by names, then by what they do."""
    roles: dict[str, tuple[str, str]] = {}
    for name in values:
        if contains(name, (*INPUT_ALIASES, *TORQUE_NAMES, "v_in")) and not contains(name, REFERENCE_NAMES):
            roles[name] = ("input", "")
    free = [n for n in values if n not in roles]
    roles |= rates_among(free, signals)
    free = [n for n in free if n not in roles]
    roles |= references_among(free, values)
    roles |= {n: ("position" if is_place(values[n]) else "further", "") for n in free if n not in roles}
    if not any(r == "input" for r, _ in roles.values()):
        return roles | {n: ("input", "") for n in roles if contains(n, ("cmd", "motor", "effort"))}
    return roles


def rates_among(names: list[str], signals: Signals | None) -> dict[str, tuple[str, str]]:
    """Columns that are derivatives of others, with these."""
    if signals is None:
        return {}
    misfit = {(a, b): rate_misfit(signals, RatePair(a, b), own=False) for a, b in permutations(names, 2)}
    misfit |= {(a, b): rate_misfit(signals, RatePair(a, b), lenient=True) for a, b in misfit
               if contains(b, RATE_NAMES) and not contains(a, RATE_NAMES) and misfit[a, b] == 1.0}  # fmt: skip
    found: dict[str, tuple[str, str]] = {}
    for a, b in sorted(misfit, key=lambda p: misfit[p]):
        limit = MIN_NAMED_RATE_SHARE if contains(b, RATE_NAMES) else MAX_SWAPPED_MISFIT_SHARE
        if misfit[a, b] < limit and a not in found and b not in found and not contains(a, REFERENCE_NAMES):
            found[b] = ("rate", a)
    return found


def references_among(names: list[str], values: dict[str, np.ndarray]) -> dict[str, tuple[str, str]]:
    """Columns that a position follows: called so, or nearly the position a moment before."""
    found: dict[str, tuple[str, str]] = {}
    for a, b in permutations(names, 2):
        apart = values[a] - values[b]
        speed = np.gradient(values[b])
        known = np.isfinite(apart) & np.isfinite(speed)
        close = np.mean(apart[known] ** 2) < MAX_FOLLOWING_SHARE * np.nanvar(values[a])
        follows = contains(b, REFERENCE_NAMES) or float(np.sum(apart[known] * speed[known])) < 0
        if close and follows and a not in found and b not in found:
            found[b] = ("reference", a)
    return found | {n: ("reference", "") for n in names if contains(n, REFERENCE_NAMES) and n not in found}


def is_place(values: np.ndarray) -> bool:
    """True of a signal (N,) that moves on from where it was, as a place does; wrapped angles are made continuous."""
    steps = np.abs(np.diff(values[np.isfinite(values)]))
    whole = np.ptp(values[np.isfinite(values)])
    jumps = steps > MAX_PLACE_STEP_SHARE * whole
    if len(np.unique(values)) < MIN_PLACES:
        return False
    turns = np.abs(steps[jumps] - 2 * np.pi) < 0.5 * np.pi
    return bool(turns.all())


def rate_remark(angle: np.ndarray, rate: np.ndarray, t: np.ndarray) -> str:
    """What is known of where a rate comes from: how much of its errors are those of its angle, and whose they are."""
    good = np.flatnonzero(np.isfinite(angle) & np.isfinite(rate))[:MAX_REMARK_SAMPLES]
    if good.size < 20 * MAX_FILTER_SAMPLES:
        return ""
    slope = np.diff(angle[good]) / np.diff(t[good])
    errors, own = (v - gaussian_smoothed(v, ERROR_SMOOTHING_SAMPLES) for v in (slope, rate[good][1:]))
    lagged = np.lib.stride_tricks.sliding_window_view(errors, 2 * MAX_FILTER_SAMPLES + 1)
    target = own[MAX_FILTER_SAMPLES:-MAX_FILTER_SAMPLES]
    rest = target - lagged @ np.linalg.lstsq(lagged, target, rcond=None)[0]
    shared = 1 - float(rest @ rest) / (float(target @ target) or 1.0)
    raw_angle = bool(find_quantum(angle)) or not is_filtered(angle)
    if shared > COMPUTED_SHARE and raw_angle:
        return f"A filter of the angle gives {100 * shared:.0f} % of its errors: computed from it, {COMPUTED}"
    if shared > COMPUTED_SHARE:
        return (f"{100 * shared:.0f} % of its errors are the angle's too: one of the two was made from the other, as a "
                "fused angle is from a gyro, and is no raw sensor.")  # fmt: skip
    if is_filtered(rate) and raw_angle:
        return f"It is too smooth for a raw sensor, while its angle is not: filtered or computed, {COMPUTED}"
    return f"A filter of the angle gives {100 * shared:.0f} % of its errors: a sensor of its own."


def is_filtered(values: np.ndarray) -> bool:
    """True of a signal whose scatter grows with the lag as no white noise does: what was raw in it is gone."""
    near = difference_noise(values)
    far = float(np.median([difference_noise(values[k::SCATTER_LAG_SAMPLES]) for k in range(SCATTER_LAG_SAMPLES)]))
    return far > MAX_RAW_GROWTH * near


def step_remark(step: float) -> str:
    """That a step is one of an encoder with a power of two of counts in a turn; nothing of others."""
    counts = 2 * np.pi / step if step else 0.0
    bits = round(float(np.log2(counts))) if counts >= MIN_ENCODER_COUNTS else 0
    return f"Its step is that of {2**bits} counts a turn." if bits and abs(counts / 2**bits - 1) < 0.002 else ""


def input_unit(names: Sequence[str]) -> str:
    """Unit of inputs by their names: V where nothing tells."""
    for unit, words in INPUT_UNITS.items():
        if any(contains(n, words) for n in names):
            return unit
    return next((u for n in names if (u := guess_unit("V", n))), "V")
