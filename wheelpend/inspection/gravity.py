"""Where an angle hangs, by what gravity does to it, without a model."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from wheelpend.inspection.signals import Signals

MIN_GRAVITY_GAIN = 1.3  # times less of an acceleration left by gravity, from which on it pulls the position back
MAX_ROUNDING_SHARE = 1e-6  # of an input, rms, below which what is left of it is that of its digits
MIN_SWING_RAD = 0.5  # below which a spring would do as well
RESTING_SHARE, MIN_RESTING_READINGS, MIN_RESTING_PART = 0.05, 5, 0.1  # of a swing: what is at rest; of a log, as long
MIN_BACKLASH_SHARE = 0.1  # of its range, by which an angle goes back where it turns
MIN_PASSED_TURNS = 2.0  # one way, from which on what gravity does repeats
MIN_SWINGS = 4  # half periods of a free swing before it rests
MIN_POLE_SWING_RAD = 0.2  # of a pole, the cart's acceleration known
MAX_POLE_ZERO_RAD = 0.5  # of what a pole reads as it hangs, to be measured from there
MAX_ZERO_DEVIATION_RAD = 0.1  # of a zero from hanging or upright, within which it counts as that
MAX_LEVEL_DEVIATION_RAD = 0.03  # the same from level, which a zero may be near by chance


def turning_points(angle: np.ndarray) -> np.ndarray:
    """Readings (k,) at which an angle (N,) turns back, by at least MIN_BACKLASH_SHARE of its range each time."""
    values = angle[np.isfinite(angle)]
    band = MIN_BACKLASH_SHARE * float(np.ptp(values)) if values.size else 0.0
    found: list[float] = []
    extreme, way = float(values[0]) if values.size else 0.0, 0
    for value in values.tolist():
        if way * (value - extreme) >= 0 and way:
            extreme = value
        elif abs(value - extreme) > band:
            found += [extreme] if way else []
            extreme, way = value, 1 if value > extreme else -1
    return np.array(found)


def is_passed_once(angle: np.ndarray, unit: float = 1.0) -> bool:
    """True of an angle (N,) that goes one way through less than two turns, where gravity is alike to a slow change.

    ``unit`` is the number of its units in a rad.
    """
    known = angle[np.isfinite(angle)]
    return float(np.ptp(known)) < MIN_PASSED_TURNS * 2 * math.pi * unit and not turning_points(known).size


def gravity_zero(signals: Signals | None, place: str, inputs: Sequence[str], unit: float = 1.0) -> float | None:
    """Reading of an angle [rad] at which it hangs, by what gravity does to it; None where no gravity shows.

    The acceleration is fitted by input, viscous and dry friction and a constant, and then by the sine and cosine of the
    angle beside them. ``unit`` is the number of the column's units in a rad.
    """
    if signals is None or not len(signals.rows) or is_passed_once(signals.channels[place], unit):
        return None
    angle = signals.channels[place][signals.rows] / unit  # smoothed, a coarse log's swing would be small
    left = [gravity_fit(signals, place, inputs, unit, pulled) for pulled in (False, True)]
    if np.ptp(angle) < MIN_SWING_RAD or left[0][0] < MIN_GRAVITY_GAIN * left[1][0]:
        return None
    sine, cosine = left[1][1][-2:]
    return _on_the_side_of(float(math.atan2(cosine, -sine)), float(angle[0]))


def spring_zero(signals: Signals | None, place: str, inputs: Sequence[str], unit: float = 1.0) -> float | None:
    """Reading about which an angle swings [rad] as on a spring, however little; None where nothing pulls it back."""
    if signals is None or not len(signals.rows):
        return None
    left, _ = gravity_fit(signals, place, inputs, unit, pulled=False)
    angle, speed, bend = (signals.smooth(place, k)[signals.rows] / unit for k in range(3))
    matrix = np.column_stack([*friction_columns(speed), angle, np.ones(len(angle))])
    sprung, coefficients = residual_power(matrix, bend)
    pull, constant = coefficients[-2:]
    turns_back = len(turning_points(signals.channels[place])) >= MIN_SWINGS
    return float(-constant / pull) if turns_back and pull < 0.0 and left > MIN_GRAVITY_GAIN * sprung else None


def resting_zero(angle: np.ndarray) -> float | None:
    """Reading at which an angle (N,) that nothing drives comes to rest [rad], having swung about it; None of any other.

    Where few readings fall in a swing no acceleration is had from them, but a swing that dies out ends where it hangs,
    as near as dry friction lets it.
    """
    known = angle[np.isfinite(angle)]
    swing = float(np.ptp(known)) if known.size else 0.0
    if swing < MIN_SWING_RAD:
        return None
    away = np.flatnonzero(np.abs(known - np.median(known[-MIN_RESTING_READINGS:])) > RESTING_SHARE * swing)
    resting = known[away[-1] + 1 :] if len(away) else known
    if len(away) == 0 or len(resting) < max(MIN_RESTING_READINGS, MIN_RESTING_PART * len(known)):
        return None
    zero = float(np.median(resting))
    sides = np.sign(known[away] - zero)
    swings = np.count_nonzero(np.diff(sides))
    return zero if swings >= MIN_SWINGS else None


class ChainZero(NamedTuple):
    """Where the first of two links hangs, and how the angle of the second is measured."""

    zero: float  # reading [rad]
    is_relative: bool  # the second angle is against the first link
    left: float  # power of the first link's acceleration that is not explained


def chain_zero(
    signals: Signals | None, links: Sequence[str], inputs: Sequence[str], unit: float = 1.0
) -> ChainZero | None:
    """Where the first of two links hangs, by what gravity does to it beside the second; None where no gravity shows.

    As `gravity_zero`, with the reaction of the second link: its acceleration along the first, and its centripetal one.
    """
    if signals is None or not len(signals.rows) or not all(n in signals.channels for n in links):
        return None
    found = [z for z in (_chain_zero(signals, links, inputs, unit, relative) for relative in (True, False)) if z]
    return min(found, key=lambda z: z.left, default=None)


def _chain_zero(
    signals: Signals, links: Sequence[str], inputs: Sequence[str], unit: float, relative: bool
) -> ChainZero | None:
    rows = signals.rows
    (angle, speed, bend), second = ([signals.smooth(n, k)[rows] / unit for k in range(3)] for n in links)
    turned, spin, twist = (b + a if relative else b for a, b in zip((angle, speed, bend), second, strict=True))
    reaction = twist * np.cos(angle - turned) + spin**2 * np.sin(angle - turned)
    moved = [reaction, spin - speed, *friction_columns(speed)]
    moved += [signals.smooth(i)[rows] for i in inputs if i in signals.channels]
    without, _ = residual_power(np.column_stack([*moved, np.ones(len(rows))]), bend)
    left, coefficients = residual_power(np.column_stack([*moved, np.sin(angle), np.cos(angle)]), bend)
    if np.ptp(signals.channels[links[0]][rows]) / unit < MIN_SWING_RAD or without < MIN_GRAVITY_GAIN * left:
        return None
    zero = float(math.atan2(coefficients[-1], -coefficients[-2]))
    return ChainZero(_on_the_side_of(zero, float(angle[0])), relative, left)


def _on_the_side_of(zero: float, begin: float) -> float:
    """A zero [rad]; one near ±π, which are alike, on the side on which the log begins [rad]."""
    upright = math.pi - abs(zero) < MAX_ZERO_DEVIATION_RAD
    return math.copysign(zero, math.remainder(begin, 4 * math.pi)) if upright else zero


def hangs_at_zero(stretches: Sequence[Signals], cart: str, pole: str, unit: float = 1.0) -> bool:
    """True of a pole on a cart whose angle is measured from hanging: gravity pulls it to where it reads 0.

    The angle's acceleration is fitted by its speed and by that of the cart, whichever way the pole points, and then by
    gravity beside them, over all stretches that have both.
    """
    both = [s for s in stretches if cart in s.channels and pole in s.channels]
    if not both:
        return False
    angle, speed, bend = (np.concatenate([s.smooth(pole, k)[s.rows] for s in both]) / unit for k in range(3))
    push = np.concatenate([s.smooth(cart, 2)[s.rows] for s in both])
    gravity = np.column_stack([np.sin(angle), np.cos(angle)])
    moved = np.column_stack([speed, push[:, None] * gravity])
    without, _ = residual_power(np.column_stack([moved, np.ones(len(angle))]), bend)
    pulled, coefficients = residual_power(np.column_stack([moved, gravity]), bend)
    if np.ptp(angle) < MIN_POLE_SWING_RAD or without < MIN_GRAVITY_GAIN * pulled:
        return False
    sine, cosine = coefficients[-2:]
    return abs(math.atan2(cosine, -sine)) < MAX_POLE_ZERO_RAD


def gravity_misfit(signals: Signals, place: str, inputs: Sequence[str], unit: float) -> float:
    """Share of an angle's acceleration that input, friction and gravity leave, in a unit, over what they do without it.

    1 where gravity explains nothing.
    """
    without, pulled = (gravity_fit(signals, place, inputs, unit, by)[0] for by in (False, True))
    return pulled / (without + 1e-300)


def gravity_fit(
    signals: Signals, place: str, inputs: Sequence[str], unit: float, pulled: bool
) -> tuple[float, np.ndarray]:
    """Power of an angle's acceleration left by input, friction and a constant or, ``pulled``, gravity; coefficients."""
    rows = signals.rows
    angle, speed, bend = (signals.smooth(place, k)[rows] / unit for k in range(3))
    columns = friction_columns(speed)
    columns += [signals.smooth(i)[rows] for i in inputs if i in signals.channels]  # a rare command is not among them
    columns += [np.sin(angle), np.cos(angle)] if pulled else [np.ones(len(rows))]
    return residual_power(np.column_stack(columns), bend)


def carried_weight_misfit(signals: Signals, place: str, input: str, unit: float) -> float:
    """Share of an input that inertia, friction and gravity leave, in a unit, over what they leave without gravity.

    Where an angle hardly accelerates, an arm that is moved slowly, what carries its weight tells of gravity. All of it
    where hardly more than rounding is left without: of a constant input, say.
    """
    rows = signals.rows
    angle, speed, bend = (signals.smooth(place, k)[rows] / unit for k in range(3))
    moved = [bend, *friction_columns(speed), np.ones(len(rows))]
    pull = [np.sin(angle), np.cos(angle)]
    pushed = signals.smooth(input)[rows]
    without, pulled = (residual_power(np.column_stack(columns), pushed)[0] for columns in (moved, [*moved, *pull]))
    rounding = MAX_ROUNDING_SHARE**2 * float(np.sum(pushed**2))
    return pulled / without if without > rounding else 1.0


def friction_columns(speed: np.ndarray) -> list[np.ndarray]:
    """What viscous and dry friction are in proportion to, at a speed (N,)."""
    return [speed, np.tanh(speed / (0.05 * np.std(speed) + 1e-300))]


def residual_power(matrix: np.ndarray, target: np.ndarray) -> tuple[float, np.ndarray]:
    """Power that least squares leave, and the coefficients."""
    solution = np.linalg.lstsq(matrix, target, rcond=None)[0]
    return float(np.sum((target - matrix @ solution) ** 2)), solution


def zero_offset(zero: float) -> float:
    """What is added to an angle so that it hangs at 0: nothing, π or π/2 turned back, or the zero found [rad]."""
    conventions = (
        (0.0, MAX_ZERO_DEVIATION_RAD),
        (math.pi, MAX_ZERO_DEVIATION_RAD),
        (math.pi / 2, MAX_LEVEL_DEVIATION_RAD),
    )
    near = next((angle for angle, most in conventions if abs(abs(zero) - angle) < most), abs(zero))
    return -math.copysign(near, zero) if near else 0.0
