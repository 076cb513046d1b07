"""Findings on columns in the numbers of a controller instead of physical units: duty of a PWM, counts."""

from __future__ import annotations

import math

import numpy as np

from wheelpend.inspection.column_names import DUTY_NAMES, stated_base
from wheelpend.inspection.findings import Finding, LogCorrections
from wheelpend.inspection.signals import channel_values, is_whole, share_in_common
from wheelpend.logs.columns import ColumnMap, ColumnTable
from wheelpend.logs.log import Log
from wheelpend.numerics import first_order_lag

PWM_LIMITS = (100, 127, 255, 400, 500, 1000, 1023, 2047, 4095, 8191, 10000, 32767)  # full scale of common timers
MIN_REACHED_SHARE = 0.9  # of a full scale that a command reaches where nothing clips it before
MIN_PWM_PEAK = 30.0  # whole numbers up to which an input may as well be volts
MIN_ACCELERATION_SHARE, ACCELERATION_S = 0.3, 0.05  # of an acceleration's variance over s, that a signed command tells
ACTING_SHARE = 0.1  # of its largest value, from which on an input acts
MIN_WAY_BACK_SHARE = 0.1  # of a place's way, against an input that acts one way only: a brake takes less
LEVEL_LAGS = (0, 1, 2, 4, 8, 16, 32)  # samples in which a speed follows its command
MIN_LAGS_IN_LOG = 20  # of the slowest of them
MIN_LEVEL_SHARE = 0.8  # of a signal's variance that its level explains by the input alone, of a speed
MAX_FOLLOWED_SHARE = 0.25  # of a set point's range, by which what follows it differs in level and range
MIN_CLIPPED_SAMPLES = 3  # readings at just 1 or 100, from which on that is a limit
MIN_COUNTS_NAMED = 20.0  # range of an encoder's readings in whole numbers, beyond which they are no rad nor m
DUTY_LIMITS = (1.0, 100.0)  # of a duty as a share and in percent


def find_duty(log: Log, corrections: LogCorrections) -> list[Finding]:
    """The findings on inputs that are a duty instead of a voltage."""
    table = corrections.table
    found = []
    for name, values in zip(table.inputs, log.inputs, strict=False):
        mapped = corrections.known.get(name, ColumnMap(name))
        if table.units.get(name) == "V" and reads_as_it_is(mapped) and not states_volts(mapped.column):
            found += duty_findings(name, mapped.column, values)
    return found


def reads_as_it_is(mapped: ColumnMap) -> bool:
    """True of a column of which nobody said in which unit it is."""
    return mapped.scale == 1.0 and not mapped.unit and not mapped.times


def in_counts(name: str, values: np.ndarray, mapped: ColumnMap, table: ColumnTable) -> bool:
    """True of a position (N,) in whole numbers, read as it is, that go far beyond what they would be in rad or m."""
    if not reads_as_it_is(mapped) or table.units.get(name) not in ("rad", "m") or name == table.range_channel:
        return False
    known = values[np.isfinite(values)]
    return is_whole(known) and float(np.ptp(known)) > MIN_COUNTS_NAMED


def find_counts(log: Log, corrections: LogCorrections) -> list[Finding]:
    """The findings on positions in an encoder's counts of which nothing tells how many are a turn, or a metre."""
    found = []
    for name in log.channels:
        values, mapped = channel_values(log, name), corrections.known.get(name, ColumnMap(name))
        if in_counts(name, values, mapped, corrections.table):
            own = corrections.table.units[name]
            reach = float(np.nanmax(np.abs(values)))
            words = "2π over the counts per turn" if own == "rad" else "metres per count"
            sentence = f"{name} looks like counts: whole numbers up to {reach:g}, no {own}."
            cure = f"Map it in [columns] with scale = {words}, the gear included; this log cannot tell how many."
            found.append(Finding("counts", name, sentence, cure, None))
    return found


def find_rectified(log: Log, table: ColumnTable) -> list[Finding]:
    """The finding on an input that is never negative though a place moves both ways while it acts.

    Gravity turns a pendulum back by itself, so only machines are judged whose first coordinate it does not pull.
    """
    places = [c for c in log.channels if table.units.get(c) in ("rad", "m") and c != table.range_channel]
    hangs = table.pulled and not table.range_channel
    if len(table.inputs) != 1 or not places or hangs or np.nanmin(log.voltage) < 0.0:
        return []
    place, known = channel_values(log, places[0]), np.isfinite(channel_values(log, places[0]))
    acts = (log.voltage[known] > ACTING_SHARE * np.nanmax(log.voltage))[:-1]
    steps = np.diff(place[known])[acts]
    there, back = float(steps[steps > 0].sum()), float(-steps[steps < 0].sum())
    if not min(there, back) > MIN_WAY_BACK_SHARE * (there + back):
        return []
    name, share = table.inputs[0], 100 * min(there, back) / (there + back)
    both = known & np.isfinite(log.voltage)
    level = level_share(log.voltage[both], place[both])
    if level > MIN_LEVEL_SHARE:
        sentence = (f"{places[0]} settles at a level that {name} sets ({100 * level:.3g} % of its variance), as a "
                    "speed does and no place.")  # fmt: skip
        speed_unit = {"rad": "rad/s", "m": "m/s"}[table.units[places[0]]]
        cure = f'If it is one, say so in [columns] with unit = "{speed_unit}": it is then summed over the time.'
        return [Finding("speed", places[0], sentence, cure, None)]
    if acceleration_share(log.t[both], log.voltage[both], place[both]) > MIN_ACCELERATION_SHARE:
        return []  # its zero is elsewhere: a size pushes now one way, now the other
    sentence = (f"{name} is never negative, but {places[0]} moves both ways while it acts ({share:.2g} % of the way "
                "against the rest): the log has the command's size without its direction.")  # fmt: skip
    cure = ("Log the direction pin too, and give the command its sign by it; no motor can be found before. What pushes "
            "one way only, against a weight or a spring, has none. "
            f"If {places[0]} is a speed, say so by its unit.")  # fmt: skip
    return [Finding("rectified", name, sentence, cure, None)]


def acceleration_share(t: np.ndarray, command: np.ndarray, place: np.ndarray) -> float:
    """Share of the variance of a place's acceleration (N,) that a command (N,) tells in proportion, both smoothed."""
    width = max(3, round(ACCELERATION_S / max(float(np.median(np.diff(t))), 1e-300))) if len(t) > 1 else 3
    if len(t) < 8 * width:
        return 0.0
    speed = (place[2 * width :] - place[: -2 * width]) / (2 * width)
    acceleration = (speed[2 * width :] - speed[: -2 * width]) / (2 * width)
    means = np.convolve(command, np.ones(2 * width) / (2 * width), "same")[2 * width : -2 * width]
    return float(share_in_common(means, acceleration))


def level_share(command: np.ndarray, values: np.ndarray) -> float:
    """Share of a signal's variance (N,) that a level explains which a command (N,) sets, followed at some lag.

    A motor's speed follows its voltage so, and a place does not. 0 of a signal of too few samples, and of one that the
    way which is gone at such levels explains better: over a short log a place may look like a slow speed.
    """
    lags = [lag for lag in LEVEL_LAGS if max(lag, 1) * MIN_LAGS_IN_LOG <= len(command)]
    decays = [math.exp(-1.0 / lag) if lag else 0.0 for lag in lags]
    levels = [first_order_lag(command, a) for a in decays]
    share = max((share_in_common(level, values) for level in levels), default=0.0)
    return share if share > max((way_share(level, values) for level in levels), default=0.0) else 0.0


def is_followed(goal: np.ndarray, values: np.ndarray) -> bool:
    """True of a signal (N,) that has the level and the range of another one, which is then what it is to come to."""
    reach = float(np.ptp(goal))
    off = abs(float(np.median(values - goal)))
    return reach > 0.0 and max(off, abs(float(np.ptp(values)) - reach)) < MAX_FOLLOWED_SHARE * reach


def way_share(speed: np.ndarray, values: np.ndarray) -> float:
    """Share of a signal's variance (N,) that a way explains which is gone at a speed (N,) but for a constant one."""
    way = np.column_stack([np.ones(len(speed)), np.arange(len(speed)), np.cumsum(speed - speed.mean())])
    left = values - way @ np.linalg.lstsq(way, values, rcond=None)[0]
    return 1.0 - float(np.var(left) / np.var(values)) if np.ptp(values) else 0.0


def states_volts(column: str) -> bool:
    """True of a column whose name says that it is in volts."""
    return stated_base(column) == "V" or "volt" in column.lower()


def duty_findings(name: str, column: str, values: np.ndarray) -> list[Finding]:
    """The finding that an input is a duty, with its full scale; none of one that may as well be volts.

    That it is clipped at a round number is the weakest evidence: a supply may be limited there too.
    """
    known = values[np.isfinite(values)]
    limit = full_scale(column, known)
    clipped = 0.0 if limit else clipping_limit(known)
    if not (limit or clipped):
        return []
    limit, looks = limit or clipped, "looks like" if limit else "may be"
    peak, scale = float(np.nanmax(np.abs(values))), f"{limit:g}"
    kind = "a duty" if limit == 1.0 else "a duty in % or PWM counts" if limit == 100 else "PWM counts"
    whole = " in whole numbers" if is_whole(values) else ""
    reaches = f"it reaches {peak:g}{whole}." if not clipped else f"it is clipped at just {peak:g}."
    sentence = f"{name} {looks} {kind} of ±{scale} and not {'like ' if not clipped else ''}volts: {reaches}"
    cure = f"Map it in [columns] with scale = the supply's volts / {scale}; which supply, the log cannot tell."
    if not clipped and limit > 1.0 and peak < MIN_REACHED_SHARE * limit:
        cure += " Nor can it whether that is the full scale, or a driver clips the command below it."
    if clipped:
        cure = f'If it is volts, say so in [columns] with unit = "V". If not: {cure[0].lower()}{cure[1:]}'
    return [Finding("duty", name, sentence, cure, limit)]


def full_scale(column: str, values: np.ndarray) -> float:
    """Full scale of an input (N,) that is a duty by its whole numbers or its name; 0 of any other."""
    if not values.size:
        return 0.0
    peak = float(np.abs(values).max())
    if is_whole(values) and peak > MIN_PWM_PEAK:
        return float(next((limit for limit in PWM_LIMITS if peak <= limit), 0))
    named = any(word in column.lower() for word in DUTY_NAMES)
    return next((d for d in (*DUTY_LIMITS, *PWM_LIMITS) if peak <= d), 0.0) if named else 0.0


def clipping_limit(values: np.ndarray) -> float:
    """Limit of a duty at which an input (N,) is clipped; 0 of one that is not, or that only switches between values."""
    sizes = np.abs(values)
    peak = float(sizes.max(initial=0.0))
    clipped, between = int(np.sum(sizes == peak)), int(np.sum((sizes < peak) & (sizes > 0.0)))
    return peak if peak in DUTY_LIMITS and clipped >= MIN_CLIPPED_SAMPLES and between > clipped else 0.0
