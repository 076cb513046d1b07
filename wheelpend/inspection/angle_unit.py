"""In which unit an angle is whose name states none, by what gravity does to it."""

from __future__ import annotations

import math

import numpy as np

from wheelpend.inspection.gravity import (
    MIN_GRAVITY_GAIN,
    carried_weight_misfit,
    gravity_misfit,
    is_passed_once,
    turning_points,
)
from wheelpend.inspection.signals import DEGREES_PER_RADIAN, Signals

A_TURN_DEG = 360.0
MIN_TURNING_POINTS = 3
MAX_CARRIED_SHARE = 0.3  # of an input that gravity leaves of what it carries: else it is something else
SMALL_UNIT = 1e6  # of which so many would be a rad: every swing is small in it
MIN_UNIT_GAIN = 2.0  # times less of an acceleration that gravity leaves in degrees than in rad


def longest_swing(angle: np.ndarray) -> float:
    """How far an angle (N,) goes, at most, from where it turned back; 0 of one that never did."""
    points = turning_points(angle)
    if not points.size:
        return 0.0
    behind = angle[np.flatnonzero(angle == points[-1])[-1] :]
    return float(max(np.abs(np.diff(points)).max(initial=0.0), np.nanmax(np.abs(behind - points[-1]))))


def swings_beyond_a_turn(angle: np.ndarray) -> bool:
    """True of an angle (N,) [rad] that swings to and fro over more than a turn: nothing that hangs does so.

    It would have to go over the top at the one end, and gravity turns it back at neither.
    """
    points = turning_points(angle)
    return points.size >= MIN_TURNING_POINTS and float(np.abs(np.diff(points)).min()) > 2 * math.pi


def is_small_swing(angle: np.ndarray, signals: Signals | None, place: str, inputs: list[str]) -> bool:
    """True of what swings freely over a wide range (N,) as a small angle does: a length, or counts, and no angle.

    Gravity pulls an angle back by its sine, and a way by itself: over tens of degrees that is another acceleration.
    And in degrees too nothing that hangs swings over more than a turn from where it turned back.
    """
    if inputs or np.nanmax(angle) - np.nanmin(angle) < 2 * math.pi:
        return False
    if longest_swing(angle) > A_TURN_DEG:
        return True
    if signals is None:
        return False
    units = (1.0, DEGREES_PER_RADIAN, SMALL_UNIT)
    in_rad, in_degrees, small = (gravity_misfit(signals, place, inputs, unit) for unit in units)
    return small * MIN_GRAVITY_GAIN < min(in_rad, in_degrees)


def is_in_degrees(angle: np.ndarray, signals: Signals | None, place: str, inputs: list[str]) -> str:
    """Why an angle (N,) that states no unit is in degrees; nothing of one that may be in rad."""
    known = angle[np.isfinite(angle)]
    free = not inputs
    if free and swings_beyond_a_turn(known) and float(np.ptp(turning_points(known))) < A_TURN_DEG:
        points = turning_points(known)
        return (f"it swings from {points.min():.3g} to {points.max():.3g} and back: in rad it would turn over, in "
                "degrees it would not")  # fmt: skip
    if signals is None or np.ptp(known) < 2 * math.pi or is_passed_once(known, DEGREES_PER_RADIAN):
        return ""
    in_rad, in_degrees = (gravity_misfit(signals, place, inputs, unit) for unit in (1.0, DEGREES_PER_RADIAN))
    if in_degrees * MIN_UNIT_GAIN < in_rad:
        return f"gravity then leaves {in_rad / in_degrees:.3g} times less of its acceleration unexplained than in rad"
    for pushing in (i for i in inputs if i in signals.channels):
        in_rad, in_degrees = (carried_weight_misfit(signals, place, pushing, u) for u in (1.0, DEGREES_PER_RADIAN))
        if in_degrees < MAX_CARRIED_SHARE and in_degrees * MIN_UNIT_GAIN < in_rad:
            return f"gravity then leaves {in_rad / in_degrees:.3g} times less of {pushing} unexplained than in rad"
    return ""
