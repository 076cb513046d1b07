"""What theta_w is: against the vertical or the body, and in which unit.

The drive damps body and wheel alike: what brakes the one drives the other. A reading of theta_w is right where both
dampings come out equal and the equations explain the voltage.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from derive.plants.wheel_pendulum import INPUT
from wheelpend.inspection.findings import Finding, LogCorrections
from wheelpend.inspection.signals import DEGREES_PER_RADIAN, JACKKNIFE_BLOCKS, Signals, TimeShift, scan_time_shifts
from wheelpend.inspection.voltage import MAX_UNEXPLAINED_SHARE, VoltageRegression, voltage_regression, voltage_residual

MAX_DAMPING_RATIO_DEVIATION = 0.6  # of X7/X6 from 1, beyond which other readings of theta_w are evaluated
MAX_OUTSIDE_DAMPING = 0.1  # of X6: what damps the body beside the drive, air for instance, is less
MAX_UNIT_ITERATIONS, UNIT_TOLERANCE = 12, 0.02  # of the search for the unit that makes both dampings equal
UNIT_NAMES = {"deg": DEGREES_PER_RADIAN, "rev": 1 / (2 * math.pi)}  # units in a rad, by their name in [columns]
MIN_TURN_COUNTS = 100  # of an encoder, gear included, in a turn of the wheel
MIN_UNIT_FACTOR = 3.0  # between units that are told apart: a dead zone bends the damping by up to 2.4
MAX_UNIT_MISFIT = 2.0  # times the declared reading's misfit: on a slow log both are noise
MAX_UNIT_NAME_DEVIATION = 0.15  # of the unit found from one with a name: the search is about so exact


class EncoderHypothesis(NamedTuple):
    """A reading of theta_w, and the fit of the equations to the voltage under it."""

    relative: bool  # measured against the body
    unit: float  # units in a rad
    shift: TimeShift  # of the voltage
    ratio: float  # X7/X6, the drive's damping on the body over that on the wheel: near 1 on a machine


def evaluate_encoder(signals: Signals, relative: bool, unit: float) -> EncoderHypothesis:
    """Fit the equations under a reading of theta_w: its reference, and the number of its units in a rad."""
    wheel = signals.channels["theta_w"] / unit
    scaled = signals._replace(channels={**signals.channels, "theta_w": wheel})
    system = voltage_regression(scaled, relative)
    shift = scan_time_shifts(voltage_residual(system, scaled))
    return EncoderHypothesis(relative, unit, shift, body_to_wheel_damping_ratio(system, scaled, round(shift.samples)))


def body_to_wheel_damping_ratio(system: VoltageRegression, signals: Signals, shift: int) -> float:
    """Estimate X7/X6 by plain least squares."""
    target = np.repeat(signals.smooth(INPUT)[signals.rows + shift], 2)
    x = np.linalg.lstsq(system.matrix, target, rcond=None)[0]
    return float(x[6] / x[5]) if x[5] else math.inf


def is_better(other: EncoderHypothesis, declared: EncoderHypothesis) -> bool:
    """True of another reading that gives a plausible machine and a clearly better fit in all blocks but one."""
    wins = int(np.sum(other.shift.blocks < declared.shift.blocks))
    sane = abs(other.ratio - 1) < 0.5 * MAX_DAMPING_RATIO_DEVIATION and other.shift.share < MAX_UNEXPLAINED_SHARE
    return sane and declared.shift.share > 1.5 * other.shift.share and wins >= JACKKNIFE_BLOCKS - 1


def find_encoder_reading(signals: Signals, declared: EncoderHypothesis) -> EncoderHypothesis:
    """The reading of theta_w that fits best: as declared, against the other of body and vertical, in another unit.

    An encoder in s units per rad, read as if against the body, brakes the body by 1 + s times as much as the wheel.
    Only where that is more than a machine has is it a unit; and in every unit s the search for it must end.
    """
    if abs(declared.ratio - 1) <= MAX_DAMPING_RATIO_DEVIATION:
        return declared
    other = evaluate_encoder(signals, not declared.relative, 1.0)
    against_body = declared if declared.relative else other
    in_degrees = evaluate_encoder(signals, True, DEGREES_PER_RADIAN)
    rivals = [o for o in (other, in_degrees) if is_better(o, declared)]
    small = abs(in_degrees.ratio - 1) < 0.5 * MAX_OUTSIDE_DAMPING
    if (
        small
        and in_degrees in rivals
        and wheel_moves_most(signals, DEGREES_PER_RADIAN)
        and stands_clear(in_degrees, other)
    ):
        return in_degrees
    if against_body.ratio - 1 > MAX_OUTSIDE_DAMPING and (scaled := find_unit(signals, against_body.ratio - 1)):
        far = not 1 / MIN_UNIT_FACTOR < scaled.unit < MIN_UNIT_FACTOR
        if far and scaled.shift.share < MAX_UNIT_MISFIT * declared.shift.share:
            return scaled
    return other if other in rivals else declared


def is_too_coarse(reading: EncoderHypothesis) -> bool:
    """True of counts fewer to a turn of a wheel than encoders have: one read against the body misleads the search."""
    return 1.0 < reading.unit < MIN_TURN_COUNTS / (2 * math.pi)


def stands_clear(one: EncoderHypothesis, other: EncoderHypothesis) -> bool:
    """True of a reading that leaves clearly less of the voltage than another in nearly all blocks."""
    wins = int(np.sum(one.shift.blocks < other.shift.blocks))
    return 5 * one.shift.share < other.shift.share and wins >= JACKKNIFE_BLOCKS - 1


def wheel_moves_most(signals: Signals, unit: float) -> bool:
    """True where the wheel, in that unit, turns faster than the body: else adding the body's angle says all."""
    wheel, body = np.std(signals.smooth("theta_w", 1)[signals.rows]), np.std(signals.smooth("dtheta_p")[signals.rows])
    return bool(wheel / unit > body)


def find_unit(signals: Signals, start: float) -> EncoderHypothesis | None:
    """The reading against the vertical, in as many units in a rad as damp the body like the wheel; None without one.

    Sought in the reading against the body in a unit ten times as large: the wheel is then the body and a little, and
    noise does not bend the ratio.
    """
    unit = start
    for _ in range(MAX_UNIT_ITERATIONS):
        before, unit = unit, 10 * unit * (evaluate_encoder(signals, True, 10 * unit).ratio - 1)
        if not 0 < unit < math.inf:
            return None
        if abs(unit / before - 1) < UNIT_TOLERANCE:
            found = evaluate_encoder(signals, False, unit)
            return found if 0.5 < found.ratio < 2 and found.shift.share < MAX_UNEXPLAINED_SHARE else None
    return None


def encoder_findings(
    best: EncoderHypothesis, declared: EncoderHypothesis, whole: bool, corrections: LogCorrections
) -> list[Finding]:
    """The findings where another reading of theta_w than declared fits better; ``whole`` if it has no fractions."""
    gain = f"the equations then leave {declared.shift.share / best.shift.share:.3g} times less of the input unexplained"
    found = []
    if best.unit != declared.unit:
        found.append(unit_finding(best, whole, gain, corrections))
    if best.relative != declared.relative and (best.unit == declared.unit or best.relative):
        corrections.encoder, against = ("relative", "the body") if best.relative else ("absolute", "the vertical")
        sentence = f"theta_w is measured against {against}: {gain}."
        cure = f'Set encoder = "{corrections.encoder}" in [sensors].'
        if 0.02 < best.ratio - 1 < 2 * MAX_OUTSIDE_DAMPING and best.unit == 1.0:
            cure += " If it is the way along the ground in m, map it instead with scale = 1 over the wheel's radius."
        found.append(Finding(f"{corrections.encoder}_encoder", "theta_w", sentence, cure, None))
    return found


def unit_finding(best: EncoderHypothesis, whole: bool, gain: str, corrections: LogCorrections) -> Finding:
    """The finding that theta_w is in another unit; one with a name where there is one, else a scale is proposed."""
    unit = best.unit
    name = next((n for n, u in UNIT_NAMES.items() if abs(unit / u - 1) < MAX_UNIT_NAME_DEVIATION), "")
    if name:
        corrections.unit["theta_w"] = name
        words = {"deg": "degrees", "rev": "revolutions"}[name] + (", or another unit as small" if best.relative else "")
        cure = f'Map theta_w in [columns] with unit = "{name}".'
        return Finding("wrong_unit", "theta_w", f"theta_w looks like {words}: {gain}.", cure, UNIT_NAMES[name])
    corrections.scale["theta_w"] = float(f"{1 / unit:.4g}")
    if whole:
        turn = 2 * math.pi * unit
        sentence = f"theta_w looks like counts, about {turn:.4g} to a turn of the wheel: {gain}."
        cure = "Map it in [columns] with scale = 2π over the exact counts per turn; the proposal has the estimate."
        return Finding("counts", "theta_w", sentence, cure, unit)
    sentence = (
        f"theta_w is about {unit:.3g} times the wheel's angle in rad, as if counted at the motor, before a gear of "
        f"{unit:.3g} (in rad) or {2 * math.pi * unit:.3g} (in turns), or along the ground: {gain}."
    )
    cure = "Map it in [columns] with scale = 1 over the exact ratio; the proposal has the estimate."
    return Finding("wrong_unit", "theta_w", sentence, cure, unit)
