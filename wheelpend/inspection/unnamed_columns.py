"""Columns whose names say nothing: which one commands the machine, and which is the battery beside its duty."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from wheelpend.inspection.column_names import (
    COUNT_NAMES,
    RATE_NAMES,
    REFERENCE_NAMES,
    SENSOR_NAMES,
    SUPPLY_NAMES,
    contains,
    has_word,
    stated_base,
)
from wheelpend.inspection.raw_units import MIN_PWM_PEAK, full_scale, states_volts
from wheelpend.inspection.signals import is_whole
from wheelpend.logs.units import stated_unit
from wheelpend.logs.white_noise import difference_noise

SENSED_NAMES = (*SENSOR_NAMES, *RATE_NAMES, *COUNT_NAMES, *REFERENCE_NAMES, "acc", "gyr", "imu", "mag", "adc", "dist")
MAX_EASY_LIMIT = 1023  # full scale up to which a command need not reach it to be told: larger ones fit any counts
MIN_LIMIT_SHARE = 0.5  # of such a full scale, that a command reaches
MIN_COMMAND_ROUGHNESS = 0.5  # counts of white scatter, which an encoder's rounding (0.29) does not make
MIN_ROUGH_SHARE = 0.02  # of its range, that a command scatters from sample to sample
MIN_PREDICTION_GAIN = 0.1  # of what a sensor's past leaves of its next step, that a command explains
CHANCE_OF_TRIALS = 21.0  # χ² of three coefficients that the best of a hundred columns and strides passes in 1 %
MIN_HELD_ROWS, MIN_FIRST_SHARE = 5, 0.1  # rows; of its range, that a command goes before anything moves
MAX_LEVELS = 8  # of a command that jumps between a few values, as no position does
MIN_GAIN_ROWS = 60  # steps of a sensor from which that is judged
STEP_STRIDES = (1, 3, 10)  # samples in such a step
MIN_BATTERY_V, MAX_BATTERY_V = 3.0, 60.0
MAX_BATTERY_RANGE = 0.4  # of its median, by which a battery's volts vary, with what a motor draws


def unnamed_command(names: Sequence[str], values: Mapping[str, np.ndarray], sensors: Sequence[str]) -> str:
    """The column among those named that can only be a command in PWM counts, or nothing.

    It is in whole numbers within a timer's full scale, no smooth count of an encoder's, and tells how the ``sensors``
    move next better than their own past does.
    """
    able = [n for n in names if may_be_command(n, values[n])]
    gains = {n: max((prediction_gain(values[n], values[o]) for o in sensors if o != n), default=0.0) for n in able}
    best = max(gains, key=lambda n: gains[n], default="")
    return best if best and gains[best] > MIN_PREDICTION_GAIN else ""


def may_be_command(name: str, values: np.ndarray) -> bool:
    """True of a column (N,) in whole numbers that may be PWM counts by its range and its scatter, and its name."""
    known = values[np.isfinite(values)]
    if stated_unit(name) or has_word(name, SENSED_NAMES) or contains(name, SUPPLY_NAMES) or not is_whole(known):
        return False
    peak = float(np.abs(known).max())
    limit = full_scale("", known) if peak > MIN_PWM_PEAK else 0.0
    if peak == limit:
        return True
    near = 0.0 < limit <= MAX_EASY_LIMIT and peak > MIN_LIMIT_SHARE * limit
    return near and difference_noise(known) > max(MIN_COMMAND_ROUGHNESS, MIN_ROUGH_SHARE * float(np.ptp(known)))


def nameless_command(names: Sequence[str], values: Mapping[str, np.ndarray], sensors: Sequence[str]) -> str:
    """The column among those named, of a file without a header, that commands the ``sensors``; nothing where none does.

    It tells better how another one moves next than that one tells of it, and goes between few levels or sets out while
    the other stands still: what swings together moves together.
    """
    for name in names:
        own, levels = values[name], len(np.unique(values[name][np.isfinite(values[name])]))
        for other in (values[n] for n in sensors if n != name):
            gain = prediction_gain(own, other)
            leads = levels <= MAX_LEVELS or sets_out_first(own, other)
            if gain > MIN_PREDICTION_GAIN and leads and prediction_gain(other, own) < gain:
                return name
    return ""


def sets_out_first(command: np.ndarray, sensor: np.ndarray) -> bool:
    """True of a column (N,) that changes while another, as the log begins, still holds one value."""
    held = int(np.argmax(sensor != sensor[0])) if np.any(sensor != sensor[0]) else 0
    return held >= MIN_HELD_ROWS and np.ptp(command[:held]) > MIN_FIRST_SHARE * np.ptp(command)


def prediction_gain(command: np.ndarray, sensor: np.ndarray) -> float:
    """Share of what a sensor's past (N,) leaves of its next step that a command (N,) before it explains, at best."""
    known = np.isfinite(command) & np.isfinite(sensor)
    return max(gain_in_steps(command[known], sensor[known], stride) for stride in STEP_STRIDES)


def gain_in_steps(command: np.ndarray, sensor: np.ndarray, stride: int) -> float:
    """That share for steps of so many samples: by the command that acts as a step begins, and its mean before."""
    count = (len(sensor) - 1) // stride
    if count < MIN_GAIN_ROWS:
        return 0.0
    begins = np.arange(count) * stride
    steps = np.diff(sensor[: count * stride + 1 : stride])
    before = command[: count * stride].reshape(count, stride).mean(axis=1)
    past = np.column_stack((np.ones(count - 3), sensor[begins[3:]], steps[2:-1], steps[1:-2], steps[:-3]))
    told = np.column_stack((past, command[begins[3:]], before[2:-1], before[1:-2]))
    target = steps[3:]
    rest, less = (float(np.sum((target - m @ np.linalg.lstsq(m, target, rcond=None)[0]) ** 2)) for m in (past, told))
    return 1.0 - less / rest - CHANCE_OF_TRIALS / count if rest > 0.0 else 0.0


def is_battery(name: str, values: np.ndarray) -> bool:
    """True of a column (N,) in SI units that is a battery's volts by its numbers, and no sensor by its name."""
    called = contains(name, SUPPLY_NAMES) or states_volts(name)
    if stated_base(name) not in ("", "V") or (has_word(name, SENSED_NAMES) and not called):
        return False
    known = values[np.isfinite(values)]
    middle = float(np.median(known)) if known.size else 0.0
    within = MIN_BATTERY_V <= middle <= MAX_BATTERY_V and float(np.ptp(known)) < MAX_BATTERY_RANGE * middle
    return within and float(known.min()) > 0.0 and not is_whole(known)
