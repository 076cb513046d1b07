"""A machine that moves as nothing free does though no drive is logged: a motor without a command in the log, a hand.

What is at rest everywhere at once stays at rest, unless it stands where it falls from; and nothing free sets out from
rest to turn on at a constant speed.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from wheelpend.logs.finding import Finding
from wheelpend.logs.log import EXCERPT_SAMPLES
from wheelpend.logs.noise import find_quantum
from wheelpend.logs.rest import standstill_band, standstill_times
from wheelpend.logs.runs import runs_of
from wheelpend.logs.white_noise import difference_noise

MAX_BAND_SHARE = 0.02  # of the way that a place goes, up to which its noise and steps show where it stands still
MIN_WAY_SHARE = 0.2  # of it, that it goes before it stands still and behind that
MIN_STILL_RATIO = 1.5  # of standing still to going half of the next way: half is what a swing spends where it turns
SPEED_PARTS, STEADY_PARTS = 10, 4  # into which a log is parted, and the last of them, whose speeds are alike
MAX_STEADY_SPREAD = 0.08  # of their mean, that these differ from it: on its way down a swing reaches 0.096
MAX_FIRST_SPEED = 0.5  # of it, of the first part of what sets out from rest
MIN_PART_SAMPLES = 5
DRIVE_CURE = (
    "If a motor moves it, log what that is told (a voltage, a duty, a current, a torque) and map it as the input. If "
    "it was a hand, cut the log there and keep the parts in which the {machine} is free."
)


def unlogged_drive(t: np.ndarray, places: Mapping[str, np.ndarray], machine: str) -> list[Finding]:
    """The finding that something moves a machine without inputs, whose places (N,) are read at times t (N,) [s]."""
    if not places:
        return []
    every = max(1, len(t) // EXCERPT_SAMPLES)
    seen = np.array([values[::every] for values in places.values()])
    known = np.isfinite(seen).all(axis=0)
    t, seen = t[::every][known], seen[:, known]
    if len(t) < SPEED_PARTS * MIN_PART_SAMPLES or not np.ptp(seen, axis=1).all():
        return []
    cure = DRIVE_CURE.format(machine=machine)
    if at := _rest_between(t, seen):
        first, last = at
        sentence = (f"Nothing that drives the {machine} is logged, but it stands still from t = {t[first]:.4g} s to "
                    f"{t[last]:.4g} s and then moves again: something moves it.")  # fmt: skip
        return [Finding("unlogged_drive", "", sentence, cure, float(t[last]))]
    turning = next((name for name, values in zip(places, seen, strict=True) if _gathers_speed(t, values)), "")
    if not turning:
        return []
    sentence = (f"Nothing that drives the {machine} is logged, but {turning} sets out slowly and goes on one way at a "
                "steady speed: something drives it.")  # fmt: skip
    return [Finding("unlogged_drive", turning, sentence, cure, None)]


def _rest_between(t: np.ndarray, places: np.ndarray) -> tuple[int, int] | None:
    """First and last samples of the longest rest of all places (places, N) between two motions; None without any."""
    still = np.ones(len(t), dtype=bool)
    for values in places:
        band = _band(values)
        if not band <= MAX_BAND_SHARE * np.ptp(values):
            return None
        own = np.zeros(len(t), dtype=bool)
        for begin, end in standstill_times(t, values, band):
            own |= (t >= begin) & (t <= end)
        still &= own
    rests = [(int(a), int(b) - 1) for a, b in runs_of(still)]
    between = [r for r in rests if any(_is_left(t, values, *r) for values in places)]
    return max(between, key=lambda r: float(t[r[1]] - t[r[0]]), default=None)


def _band(values: np.ndarray) -> float:
    """The band within which a place (N,) stays that stands still."""
    noise, quantum = difference_noise(values), find_quantum(values)
    return float(standstill_band(np.array([noise]), np.array([quantum]))[0])


def _is_left(t: np.ndarray, values: np.ndarray, first: int, last: int) -> bool:
    """True where a place (N,) comes from far to a rest between two samples, and leaves it as nothing free does."""
    gone = np.abs(values - values[last])
    came, way = gone[: first + 1].max(), gone[last:].max()
    if min(came, way) < MIN_WAY_SHARE * np.ptp(values):
        return False
    half = last + int(np.argmax(gone[last:] > 0.5 * way))
    return bool(t[last] - t[first] > MIN_STILL_RATIO * (t[half] - t[last]))


def _gathers_speed(t: np.ndarray, values: np.ndarray) -> bool:
    """True of a place (N,) that goes one way all along, slowly at first and steadily in the end."""
    parts = zip(np.array_split(values, SPEED_PARTS), np.array_split(t, SPEED_PARTS), strict=True)
    speeds = np.array([(own[-1] - own[0]) / (at[-1] - at[0]) for own, at in parts])
    steady = float(np.mean(speeds[-STEADY_PARTS:]))
    way = np.sign(steady) * values
    back = float(np.max(np.maximum.accumulate(way) - way))
    alike = np.abs(speeds[-STEADY_PARTS:] - steady) <= MAX_STEADY_SPREAD * abs(steady)
    return bool(back <= _band(values) and alike.all() and speeds[0] * np.sign(steady) < MAX_FIRST_SPEED * abs(steady))
