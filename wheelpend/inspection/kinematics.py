"""Faults that show without a model: wrapped angles, swapped channels, degrees, flipped or shifted rates."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import permutations

import numpy as np

from wheelpend.inspection.findings import Finding, LogCorrections
from wheelpend.inspection.signals import (
    DEGREES_PER_RADIAN,
    INPUT_COLUMN,
    JACKKNIFE_BLOCKS,
    MAX_SHIFT_SAMPLES,
    MAX_SWAPPED_MISFIT_SHARE,
    SMOOTHING_FACTORS,
    Signals,
    TimeShift,
    channel_values,
    scan_time_shifts,
    uniform_signals,
    with_channel,
)
from wheelpend.logs.log import WHEEL_PENDULUM_CHANNELS, Log

MAX_RATE_NOISE_SHARE = 2e-4  # unexplained share up to which noise, fed back by the controller, cannot look like a shift
MIN_RATE_CORRELATION = 0.8  # correlation of gyro and derivative of the pitch from which they are compared


def find_wrapped_angles(log: Log, corrections: LogCorrections) -> tuple[list[Finding], Log]:
    """Find angles that jump by a whole turn; the log that is returned has them continuous."""
    found = []
    for name in ("theta_w", "theta_p"):
        values = channel_values(log, name)
        known = np.flatnonzero(np.isfinite(values))
        steps = np.diff(values[known])
        for turn, unit in ((2 * math.pi, "2π"), (360.0, "360°")):
            jumps = np.abs(np.abs(steps) - turn) < 0.25 * turn
            largest_step = float(np.max(np.abs(steps[~jumps]), initial=0.0))
            if not jumps.any() or largest_step > 0.25 * turn or np.ptp(values[known]) > 1.05 * turn:
                continue
            sentence = f"{name} jumps by about {unit} in {int(jumps.sum())} places: it is wrapped into one turn."
            cure = f"Unwrap it before it is used (numpy.unwrap with period {turn:.6g})."
            found.append(Finding("wrapped_angle", name, sentence, cure, turn))
            continuous = values.copy()
            continuous[known] = np.unwrap(values[known], period=turn)
            log = with_channel(log, name, continuous)
            break
    return found, log


def find_swapped_columns(log: Log, corrections: LogCorrections) -> tuple[list[Finding], Log]:
    """Find columns under each other's names: another pair than pitch and gyro is an angle and its rate."""
    signals = uniform_signals(log, upright=False)
    if signals is None:
        return [], log
    for factor in SMOOTHING_FACTORS:
        coarser = signals._replace(smoothing_factor=factor)
        if factor > 1 and len(coarser.rows) < 4 * JACKKNIFE_BLOCKS:
            break
        misfit = {
            p: rate_misfit(coarser, *p)
            for p in permutations((INPUT_COLUMN, *WHEEL_PENDULUM_CHANNELS), 2)
            if p[1] != INPUT_COLUMN
        }
        best = min(misfit, key=lambda p: misfit[p])
        if misfit[best] < MAX_RATE_NOISE_SHARE:
            break
    if misfit[best] > MAX_SWAPPED_MISFIT_SHARE or 5 * misfit[best] > misfit["theta_p", "dtheta_p"]:
        return [], log
    source = interchanged_columns(*best)
    corrections.source.update(source)
    values = {INPUT_COLUMN: log.voltage, **{c: channel_values(log, c) for c in WHEEL_PENDULUM_CHANNELS}}
    names = " and ".join(sorted(source))
    sentence = f"{best[1]} is the derivative of {best[0]}, so the columns {names} seem to be interchanged."
    finding = Finding("swapped_channels", names, sentence, "Map them in [columns].", None)
    measured = np.column_stack([values[source[c]] if c in source else channel_values(log, c) for c in log.channels])
    return [finding], replace(log, voltage=values[source.get(INPUT_COLUMN, INPUT_COLUMN)], measured=measured)


def interchanged_columns(angle: str, rate: str) -> dict[str, str]:
    """The column of each quantity that is not in its own, where ``angle`` and ``rate`` are pitch and gyro."""
    source = {"theta_p": angle, "dtheta_p": rate}
    free = [c for c in source if c not in (angle, rate)]
    source |= {c: free.pop() for c in (INPUT_COLUMN, "theta_w") if c in (angle, rate)}
    return {c: s for c, s in source.items() if c != s}


def rate_misfit(signals: Signals, angle: str, rate: str, lenient: bool = False) -> float:
    """Share of a signal's power that an angle's derivative leaves; 1 where sign or size exclude that it is its rate.

    Pitch and gyro under their own names may have either sign and a factor of 1.5, ``lenient`` any: it is judged later.
    """
    rows, leader, follower = signals.rows, signals.smooth(angle, 1)[signals.rows], signals.smooth(rate)
    own = (angle, rate) == ("theta_p", "dtheta_p")
    misfits = [1.0]
    for k in range(-MAX_SHIFT_SAMPLES, MAX_SHIFT_SAMPLES + 1, 3):
        c = np.cov(leader, follower[rows + k])
        if c[0, 0] <= 0 or c[1, 1] <= 0:
            continue
        size = math.sqrt(c[1, 1] / c[0, 0])
        if lenient or (is_rate(size, 1.5 if own else 1.25) and (own or c[0, 1] > 0)):
            misfits.append(float(1 - c[0, 1] ** 2 / (c[0, 0] * c[1, 1])))
    return min(misfits)


def is_rate(size: float, slack: float) -> bool:
    """True where a signal of this size over an angle's derivative may be its rate, in rad or in degrees."""
    return any(1 / slack < size / scale < slack for scale in (1.0, DEGREES_PER_RADIAN, 1 / DEGREES_PER_RADIAN))


def find_pitch_in_degrees(log: Log, corrections: LogCorrections) -> tuple[list[Finding], Log]:
    """Find a pitch beyond ±π/2 again and again, which is in degrees; the log that is returned has it in rad."""
    pitch = channel_values(log, "theta_p")
    state = np.where(np.abs(pitch) > 1.6, 1, np.where(np.abs(pitch) < 0.8, -1, 0))
    state = state[state != 0]  # far, near; what lies between belongs to what came before
    returns = int(np.sum(np.diff(state) < 0))
    if returns < 2:  # one return may be a robot that somebody picked up
        return [], log
    corrections.unit["theta_p"] = "deg"
    sentence = f"theta_p goes to {np.nanmax(np.abs(pitch)):.3g} and comes back {returns} times: it looks like degrees."
    finding = Finding("wrong_unit", "theta_p", sentence, 'Map it in [columns] with unit = "deg".', DEGREES_PER_RADIAN)
    return [finding], with_channel(log, "theta_p", pitch / DEGREES_PER_RADIAN)


def find_gyro_faults(log: Log, corrections: LogCorrections) -> tuple[list[Finding], Log]:
    """Compare the gyro with the derivative of the pitch in sign, scale and clock; the log returned has them agree."""
    signals = uniform_signals(log, upright=False)
    if signals is None or not gyro_matches_pitch(signals):
        return [], log
    signals, late = smooth_until_consistent(signals)
    rows, rate, gyro = signals.rows, signals.smooth("theta_p", 1), signals.smooth("dtheta_p")
    cross = np.cov(rate[rows], gyro[rows + round(late.samples)])
    slopes = cross[0, 1] / cross[0, 0], cross[1, 1] / cross[0, 1]  # noise in the one or in the other: between them
    found, log = find_gyro_scale(log, slopes, corrections)
    if slopes[0] < 0:  # which of the two it is, the equations tell
        corrections.sign["dtheta_p"] = -1
        log = with_channel(log, "dtheta_p", -channel_values(log, "dtheta_p"))
    if late.share < MAX_RATE_NOISE_SHARE and late.is_significant(1.1):
        corrections.gyro_delay_samples = late.samples
        log = with_channel_advanced(log, "dtheta_p", late.samples * signals.dt)
    return found, log


def gyro_matches_pitch(signals: Signals) -> bool:
    """True where the gyro correlates with the derivative of the pitch, without which the equations say nothing."""
    return rate_misfit(signals, "theta_p", "dtheta_p", lenient=True) <= 1 - MIN_RATE_CORRELATION**2


def smooth_until_consistent(signals: Signals) -> tuple[Signals, TimeShift]:
    """Smooth until gyro and derivative of the pitch agree up to MAX_RATE_NOISE_SHARE; returns the gyro's delay too.

    Noise in the pitch moves the robot through the controller, a moment later: with too little smoothing that looks like
    a shift.
    """
    for factor in SMOOTHING_FACTORS:
        smoothed = signals._replace(smoothing_factor=factor)
        if len(smoothed.rows) < 4 * JACKKNIFE_BLOCKS:
            break
        signals, late = smoothed, gyro_time_shift(smoothed)
        if late.share < MAX_RATE_NOISE_SHARE:
            break
    return signals, late


def gyro_time_shift(signals: Signals) -> TimeShift:
    """Delay of the gyro against the derivative of the pitch."""
    rows, rate, gyro = signals.rows, signals.smooth("theta_p", 1), signals.smooth("dtheta_p")
    ones = np.ones(len(rows))
    return scan_time_shifts(lambda k: least_squares_residual(np.column_stack((gyro[rows + k], ones)), rate[rows]))


def find_gyro_scale(log: Log, slopes: tuple[float, float], corrections: LogCorrections) -> tuple[list[Finding], Log]:
    """Find a scale factor between gyro and derivative of the pitch; the log that is returned has them agree.

    ``slopes`` are of gyro on derivative and the inverse of derivative on gyro, between which the factor lies.
    """
    low, high = sorted(abs(s) for s in slopes)
    if low < 1.15 and high > 1 / 1.15:
        return [], log
    factor = math.sqrt(low * high)
    sentence = f"dtheta_p is {factor:.3g} times the derivative of theta_p"
    name = next(
        (
            c
            for c, f in (("dtheta_p", DEGREES_PER_RADIAN), ("theta_p", 1 / DEGREES_PER_RADIAN))
            if 0.85 < factor / f < 1.18
        ),
        "",
    )
    if name:
        unit = "deg/s" if name == "dtheta_p" else "deg"
        corrections.unit[name] = unit
        size, cure = DEGREES_PER_RADIAN, f'Map {name} in [columns] with unit = "{unit}".'
        sentence += f": {name} looks like {unit}."
    else:
        name, size, cure = "dtheta_p", factor, "Find out the unit of each and convert the column."
        sentence += "; they cannot both be in rad and rad/s."
    correct, scale = (name, DEGREES_PER_RADIAN) if name == "theta_p" else ("dtheta_p", factor)
    return [Finding("wrong_unit", name, sentence, cure, size)], with_channel(
        log, correct, channel_values(log, correct) / scale
    )


def with_channel_advanced(log: Log, name: str, seconds: float) -> Log:
    """The log with one channel moved to earlier times."""
    values = channel_values(log, name)
    known = np.isfinite(values)
    return with_channel(log, name, np.interp(log.t + seconds, log.t[known], values[known]))


def least_squares_residual(matrix: np.ndarray, target: np.ndarray) -> tuple[np.ndarray, float]:
    """Residual (N,) of least squares on a target (N,), and the target's power about its mean."""
    solution = np.linalg.lstsq(matrix, target, rcond=None)[0]
    return target - matrix @ solution, float(np.sum((target - target.mean()) ** 2))
