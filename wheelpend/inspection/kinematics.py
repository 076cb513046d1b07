"""Faults that show without a model: wrapped angles, swapped channels, degrees, flipped or shifted rates."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from itertools import permutations
from typing import NamedTuple

import numpy as np

from wheelpend.inspection.findings import Finding, LogCorrections
from wheelpend.inspection.signals import (
    DEGREES_PER_RADIAN,
    JACKKNIFE_BLOCKS,
    MAX_SWAPPED_MISFIT_SHARE,
    MIN_SIGN_SAMPLES,
    SMOOTHING_FACTORS,
    Signals,
    TimeShift,
    channel_values,
    scan_time_shifts,
    uniform_signals,
    with_channel,
)
from wheelpend.logs.log import Log
from wheelpend.logs.units import UNIT_CONVERSIONS
from wheelpend.logs.unwrap import TURNS, count_wraps, unwrapped

MAX_RATE_NOISE_SHARE = 2e-4  # unexplained share up to which noise, fed back by the controller, cannot look like a shift
GYRO_COUNTS_PER_DEG_S = (131.0, 65.5, 32.8, 16.4)  # of 16 bits for ±250, ±500, ±1000 and ±2000 deg/s (MPU-6050)
GYRO_TOLERANCE = 0.05  # by which they may be off: an angle's scale is not exact; 1000 is another unit
SHAFT_UNITS = (("rev", "rpm"), ("rad", "rpm"), ("deg", "rpm"), ("rev", "rad/s"), ("rev", "deg/s"))  # beside rad or deg
RATIO_TOLERANCE = 0.015  # by which a rate in such units is off: rpm of turns and deg/s of rad differ by 0.047
SWAY_RAD, MIN_SWAYS = 0.7, 3  # 40° on either side, and so often there and back: nothing balances so
MIN_RATE_CORRELATION = 0.8  # correlation of a rate and the derivative of its angle from which they are compared
ANGLE_SCALES = (1.0, DEGREES_PER_RADIAN, 1 / DEGREES_PER_RADIAN)  # of a rate against its angle: units of either
MIN_SUMMED_SAMPLES = 30  # of a rate, from which on its sum is compared with a place


class RatePair(NamedTuple):
    """Channels of an angle, or a position, and of its rate."""

    angle: str
    rate: str


def find_wrapped_angles(log: Log, names: Sequence[str], corrections: LogCorrections) -> tuple[list[Finding], Log]:
    """Find angles that jump by a whole turn; the log that is returned has them continuous."""
    found = []
    for name in names:
        values = channel_values(log, name)
        known = np.flatnonzero(np.isfinite(values))
        for turn, unit in zip(TURNS, ("2π", "360°"), strict=True):
            jumps = count_wraps(values[known] * (2 * math.pi / turn), np.full(max(known.size - 1, 0), True))
            if not jumps:
                continue
            sentence = f"{name} jumps by about {unit} in {jumps} places: it is wrapped into one turn."
            cure = f"Unwrap it before it is used (numpy.unwrap with period {turn:.6g})."
            found.append(Finding("wrapped_angle", name, sentence, cure, turn))
            log = with_channel(log, name, unwrapped(values, turn))
            break
    return found, log


def find_swapped_columns(log: Log, pair: RatePair, corrections: LogCorrections) -> tuple[list[Finding], Log]:
    """Find columns under each other's names: another pair than the one that should be is an angle and its rate."""
    signals, own = uniform_signals(log, corrections.table.input, in_range=False), corrections.table.input
    if signals is None:
        return [], log
    others = {(a, r) for r, a in corrections.table.rates.items()} - {tuple(pair)}  # they are each other's rightly
    for factor in SMOOTHING_FACTORS:
        coarser = signals._replace(smoothing_factor=factor)
        if factor > 1 and len(coarser.rows) < 4 * JACKKNIFE_BLOCKS:
            break
        misfit = {
            p: rate_misfit(coarser, RatePair(*p), own=p == pair)
            for p in permutations((own, *log.channels), 2)
            if p[1] != own and p not in others
        }
        best = min(misfit, key=lambda p: misfit[p])
        if misfit[best] < MAX_RATE_NOISE_SHARE:
            break
    if best == pair or misfit[best] > MAX_SWAPPED_MISFIT_SHARE or 5 * misfit[best] > misfit[pair]:
        return [], log
    source = interchanged_columns(RatePair(*best), pair, (own, *log.channels))
    corrections.source.update(source)
    values = {own: log.voltage, **{c: channel_values(log, c) for c in log.channels}}
    names = " and ".join(sorted(source))
    sentence = f"{best[1]} is the derivative of {best[0]}, so the columns {names} seem to be interchanged."
    finding = Finding("swapped_channels", names, sentence, "Map them in [columns].", None)
    measured = np.column_stack([values[source[c]] if c in source else channel_values(log, c) for c in log.channels])
    return [finding], replace(log, voltage=values[source.get(own, own)], measured=measured)


def interchanged_columns(found: RatePair, pair: RatePair, columns: Sequence[str]) -> dict[str, str]:
    """The column of each quantity that is not in its own, where the columns ``found`` hold an angle and its rate."""
    source = {pair.angle: found.angle, pair.rate: found.rate}
    free = [c for c in source if c not in found]
    source |= {c: free.pop() for c in columns if c in found and c not in pair}
    return {c: s for c, s in source.items() if c != s}


def rate_misfit(signals: Signals, pair: RatePair, *, own: bool = True, lenient: bool = False) -> float:
    """Share of a signal's power that an angle's derivative leaves; 1 where sign or size exclude that it is its rate.

    Those under their ``own`` names may have either sign and a factor of 1.5, ``lenient`` any: it is judged later.
    """
    rows, leader, follower = signals.rows, signals.smooth(pair.angle, 1)[signals.rows], signals.smooth(pair.rate)
    misfits = [1.0]
    for k in range(-signals.max_shift, signals.max_shift + 1, 3):
        c = np.cov(leader, follower[rows + k])
        if c[0, 0] <= 0 or c[1, 1] <= 0:
            continue
        size = math.sqrt(c[1, 1] / c[0, 0])
        if lenient or (is_rate(size, 1.5 if own else 1.25) and (own or c[0, 1] > 0)):
            misfits.append(float(1 - c[0, 1] ** 2 / (c[0, 0] * c[1, 1])))
    return min(misfits)


def sum_misfit(place: np.ndarray, rate: np.ndarray, t: np.ndarray, scales: Sequence[float] = ANGLE_SCALES) -> float:
    """Share of a place's variance about a line (N,) that a rate, summed over the times, leaves; 1 of other sizes.

    That is within a quarter of one of these scales of it: the same unit, degrees, or of degrees. Without any every size
    may be, of either sign.
    """
    known = np.isfinite(place) & np.isfinite(rate)
    if known.sum() < MIN_SUMMED_SAMPLES:
        return 1.0
    summed = np.concatenate(([0.0], np.cumsum(0.5 * (rate[known][1:] + rate[known][:-1]) * np.diff(t[known]))))
    c = np.cov([y - np.polyval(np.polyfit(t[known], y, 1), t[known]) for y in (summed, place[known])])
    if c[0, 0] <= 0.0 or c[1, 1] <= 0.0 or (scales and not is_rate(c[0, 0] / (c[0, 1] or np.inf), 1.25, scales)):
        return 1.0
    return float(1.0 - c[0, 1] ** 2 / (c[0, 0] * c[1, 1]))


def is_rate(size: float, slack: float, scales: Sequence[float] = ANGLE_SCALES) -> bool:
    """True where a signal of this size over an angle's derivative may be its rate, in rad or in degrees."""
    return any(1 / slack < size / scale < slack for scale in scales)


def find_range_in_degrees(log: Log, corrections: LogCorrections) -> tuple[list[Finding], Log]:
    """Find an angle beyond ±π/2 again and again that must be within, so in degrees; the log returned has it in rad.

    Or one that sways to and fro farther than any machine that balances comes back from.
    """
    name = log.range_channel
    if name not in log.channels:  # the machine may be at any angle
        return [], log
    values = channel_values(log, name)
    returns = times_back(np.abs(values), 1.6, 0.8)
    sways = min(times_back(side * values, SWAY_RAD, 0.0) for side in (1.0, -1.0))
    if returns < 2 and sways < MIN_SWAYS:  # one return may be a machine that somebody picked up
        return [], log
    returns = max(returns, sways)
    corrections.unit[name] = "deg"
    sentence = f"{name} goes to {np.nanmax(np.abs(values)):.3g} and comes back {returns} times: it looks like degrees."
    finding = Finding("wrong_unit", name, sentence, 'Map it in [columns] with unit = "deg".', DEGREES_PER_RADIAN)
    return [finding], with_channel(log, name, values / DEGREES_PER_RADIAN)


def times_back(values: np.ndarray, far: float, near: float) -> int:
    """How often a signal (N,) comes back from above ``far`` to below ``near``."""
    state = np.where(values > far, 1, np.where(values < near, -1, 0))
    state = state[state != 0]  # far, near; what lies between belongs to what came before
    return int(np.sum(np.diff(state) < 0))


def find_rate_faults(log: Log, pair: RatePair, corrections: LogCorrections) -> tuple[list[Finding], Log]:
    """Compare a rate with the derivative of its angle in sign, scale and clock; the log returned has them agree."""
    signals = uniform_signals(log, corrections.table.input, in_range=False, least=MIN_SIGN_SAMPLES)
    if signals is None or not rate_matches_angle(signals, pair):
        return [], log
    signals, late = smooth_until_consistent(signals, pair)
    rows, slope, rate = signals.rows, signals.smooth(pair.angle, 1), signals.smooth(pair.rate)
    cross = np.cov(slope[rows], rate[rows + round(late.samples)])
    slopes = cross[0, 1] / cross[0, 0], cross[1, 1] / cross[0, 1]  # noise in the one or in the other: between them
    found, log = find_rate_scale(log, pair, slopes, corrections)
    if slopes[0] < 0:  # which of the two it is, the equations tell
        corrections.sign[pair.rate] = -1
        log = with_channel(log, pair.rate, -channel_values(log, pair.rate))
    if signals.is_long and late.share < MAX_RATE_NOISE_SHARE and late.is_significant(1.1):
        corrections.rate_delay_samples = late.samples
        log = with_channel_advanced(log, pair.rate, late.samples * signals.dt)
    return found, log


def rate_matches_angle(signals: Signals, pair: RatePair) -> bool:
    """True where a rate correlates with the derivative of its angle, without which the equations say nothing."""
    return rate_misfit(signals, pair, lenient=True) <= 1 - MIN_RATE_CORRELATION**2


def smooth_until_consistent(signals: Signals, pair: RatePair) -> tuple[Signals, TimeShift]:
    """Smooth until rate and derivative of the angle agree up to MAX_RATE_NOISE_SHARE; returns the rate's delay too.

    Noise in the angle moves the machine through the controller, a moment later: with too little smoothing that looks
    like a shift.
    """
    for factor in SMOOTHING_FACTORS:
        smoothed = signals._replace(smoothing_factor=factor)
        if len(smoothed.rows) < 4 * JACKKNIFE_BLOCKS:
            break
        signals, late = smoothed, rate_time_shift(smoothed, pair)
        if late.share < MAX_RATE_NOISE_SHARE:
            break
    return signals, late


def rate_time_shift(signals: Signals, pair: RatePair) -> TimeShift:
    """Delay of a rate against the derivative of its angle."""
    rows, slope, rate = signals.rows, signals.smooth(pair.angle, 1), signals.smooth(pair.rate)
    ones = np.ones(len(rows))

    def residual(k: int) -> tuple[np.ndarray, float]:
        return least_squares_residual(np.column_stack((rate[rows + k], ones)), slope[rows])

    return scan_time_shifts(residual, signals.max_shift)


def find_rate_scale(
    log: Log, pair: RatePair, slopes: tuple[float, float], corrections: LogCorrections
) -> tuple[list[Finding], Log]:
    """Find a scale factor between a rate and the derivative of its angle; the log that is returned has them agree.

    ``slopes`` are of rate on derivative and the inverse of derivative on rate, between which the factor lies.
    """
    low, high = sorted(abs(s) for s in slopes)
    if low < 1.15 and high > 1 / 1.15:
        return [], log
    factor = math.sqrt(low * high)
    own = corrections.table.units.get(pair.angle, "rad")
    sentence = f"{pair.rate} is {factor:.3g} times the derivative of {pair.angle}"
    name = next(
        (
            c
            for c, f in ((pair.rate, DEGREES_PER_RADIAN), (pair.angle, 1 / DEGREES_PER_RADIAN))
            if own == "rad" and 0.85 < factor / f < 1.18
        ),
        "",
    )
    both = units_by_ratio(factor) if own == "rad" and pair.angle != corrections.table.range_channel else None
    if both:
        units = dict(zip((pair.angle, pair.rate), both, strict=True))
        name, size = pair.rate, factor
        entries = " and ".join(f'{n} with unit = "{u}"' for n, u in units.items())
        cure = f"Map {entries} in [columns], unless a gear is between them or one is in counts."
        sentence += f": they look like {both[0]} and {both[1]}."
    elif name:
        unit = "deg/s" if name == pair.rate else "deg"
        corrections.unit[name] = unit
        size, cure = DEGREES_PER_RADIAN, f'Map {name} in [columns] with unit = "{unit}".'
        sentence += f": {name} looks like {unit}."
    elif own == "rad" and (counts := gyro_counts(factor)):
        scale_of_count = float(f"{1.0 / (counts * DEGREES_PER_RADIAN):.5g}")
        corrections.scale[pair.rate] = scale_of_count
        name, size = pair.rate, factor
        cure = f"Map {name} in [columns] with scale = {scale_of_count:g}."
        sentence += f": {name} looks like the counts of a gyro, {counts:g} of them a degree per second."
    else:
        name, size, cure = pair.rate, factor, "Find out the unit of each, and of the times, and convert the column."
        sentence += f"; they cannot both be in {own} and {own}/s."
    correct, scale = (name, DEGREES_PER_RADIAN) if name == pair.angle else (pair.rate, factor)
    return [Finding("wrong_unit", name, sentence, cure, size)], with_channel(
        log, correct, channel_values(log, correct) / scale
    )


def units_by_ratio(factor: float) -> tuple[str, str] | None:
    """Units of an angle and its rate by how many times its derivative the rate is; None where that is not sharp.

    Degrees beside rad are not among them: a gyro's scale may be off by more than what tells rpm of turns from them.
    """
    return next((units for units in SHAFT_UNITS if abs(factor / ratio_of(*units) - 1.0) < RATIO_TOLERANCE), None)


def ratio_of(angle: str, rate: str) -> float:
    """How many times an angle's derivative a rate is that is read in another unit."""
    return UNIT_CONVERSIONS[angle][1] / UNIT_CONVERSIONS[rate][1]


def gyro_counts(factor: float) -> float:
    """Counts per deg/s that an IMU's gyro is known to have, by what it reads over a rate in rad/s; 0 of any other."""
    near = (c for c in GYRO_COUNTS_PER_DEG_S if abs(factor / (c * DEGREES_PER_RADIAN) - 1.0) < GYRO_TOLERANCE)
    return next(near, 0.0)


def with_channel_advanced(log: Log, name: str, seconds: float) -> Log:
    """The log with one channel moved to earlier times."""
    values = channel_values(log, name)
    known = np.isfinite(values)
    return with_channel(log, name, np.interp(log.t + seconds, log.t[known], values[known]))


def least_squares_residual(matrix: np.ndarray, target: np.ndarray) -> tuple[np.ndarray, float]:
    """Residual (N,) of least squares on a target (N,), and the target's power about its mean."""
    solution = np.linalg.lstsq(matrix, target, rcond=None)[0]
    return target - matrix @ solution, float(np.sum((target - target.mean()) ** 2))
