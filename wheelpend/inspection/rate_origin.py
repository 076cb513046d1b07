"""Where a rate comes from: a sensor of its own, or computed from its angle."""

from __future__ import annotations

import math

import numpy as np

from wheelpend.inspection.signals import is_whole
from wheelpend.logs.noise import find_quantum, rounding_sigma
from wheelpend.logs.white_noise import difference_noise, white_differences
from wheelpend.numerics import gaussian_smoothed

COMPUTED_SHARE = 0.9  # of a rate's scatter that a filter of its angle gives, from which on it was computed
ROUNDING_SHARE = 0.4  # the same where the angle scatters by little more than its rounding: no motion is shared then
MAX_ROUNDING_GROWTH = 3.0  # of the scatter of an angle's slope over what rounding makes of it, for that
MAX_SHARED_NOISE = 0.05  # of a rate's white noise, that a filter of its angle gives where the noise is the sensor's
MOTIONLESS_ORDER = 4  # of differences in which no motion is left
MIN_OWN_ROUNDINGS = 2.0  # of the error of rounding, from which on such noise is no rounding
MIN_ENCODER_COUNTS = 100  # of a turn
COMPUTED, COUNTS_ENDING = "no sensor of its own.", "counts a turn."  # ends of remarks
SAME_READINGS = "no raw sensor."  # likewise, of a rate or the angle that was made from it
SCATTER_LAG_SAMPLES, MAX_RAW_GROWTH = 4, 1.9  # growth of a raw signal's scatter over so many samples
MAX_REMARK_SAMPLES = 20_000  # looked at for that
ERROR_SMOOTHING_SAMPLES = 3.0  # standard deviation of the Gaussian beyond which a signal is error
MIN_FILTER_SAMPLES, MAX_FILTER_SAMPLES = 5, 15  # samples before and after, from which such a filter takes them
MIN_SAMPLES_PER_TAP = 20  # of a log, for each of these


def rate_remark(angle: np.ndarray, rate: np.ndarray, t: np.ndarray) -> str:
    """What is known of where a rate comes from: how much of its scatter is that of its angle, and whose it is.

    Fast motion is in both, so that a part of the scatter proves nothing: what was computed has nearly all of it, or
    the angle's rounding in it, and no white noise of its own.
    """
    good = np.flatnonzero(np.isfinite(angle) & np.isfinite(rate))[:MAX_REMARK_SAMPLES]
    taps = min(MAX_FILTER_SAMPLES, good.size // MIN_SAMPLES_PER_TAP)
    if taps < MIN_FILTER_SAMPLES:
        return ""
    slope = np.diff(angle[good]) / np.diff(t[good])
    errors, own = (v - gaussian_smoothed(v, ERROR_SMOOTHING_SAMPLES) for v in (slope, rate[good][1:]))
    shared = 1.0 - unfiltered_share(errors, own, taps)
    gives = f"A filter of the place gives {100 * shared:.0f} % of its scatter from sample to sample"
    if has_own_noise(slope, rate[good], taps):
        return f"{gives}, motion included, and nothing of its white noise: a sensor of its own."
    quantum = find_quantum(angle) or float(is_whole(angle))
    rounding = quantum / math.sqrt(6) / float(np.median(np.diff(t[good])))  # of the slope between two readings
    smooth = taps == MAX_FILTER_SAMPLES and float(np.std(errors)) < MAX_ROUNDING_GROWTH * rounding  # in a long log
    by_rounding = shared > ROUNDING_SHARE and smooth
    raw_angle = bool(quantum) or not is_filtered(angle)
    if by_rounding or (shared > COMPUTED_SHARE and raw_angle):
        return f"{gives}: computed from it, {COMPUTED}"
    if shared > COMPUTED_SHARE:
        return (f"{100 * shared:.0f} % of its scatter from sample to sample is the angle's too: one of the two was "
                f"made from the other, as a fused angle is from a gyro, and is {SAME_READINGS}")  # fmt: skip
    if is_filtered(rate) and raw_angle:
        return f"It is too smooth for a raw sensor, while its angle is not: filtered or computed, {COMPUTED}"
    return f"{gives} and not the rest: a sensor of its own."


def has_own_noise(slope: np.ndarray, rate: np.ndarray, taps: int) -> bool:
    """True of a rate (N,) whose white noise no filter of an angle's slope (N - 1,) with so many taps gives.

    High differences are free of motion. Rounding is no noise of a sensor.
    """
    errors, own = (white_differences(v, MOTIONLESS_ORDER) for v in (slope, rate[1:]))
    count = len(own) - 2 * taps
    by_chance = count / max(count - 2 * taps - 1, 1)
    shared = 1.0 - by_chance * unfiltered_share(errors, own, taps)
    rounding = rounding_sigma(find_quantum(rate))
    raw = float(np.std(own[taps:-taps])) > MIN_OWN_ROUNDINGS * rounding and not is_filtered(rate)
    return raw and shared < MAX_SHARED_NOISE


def unfiltered_share(source: np.ndarray, values: np.ndarray, taps: int) -> float:
    """Share of the squares of values (N,) that no filter of a source (N,) with so many taps before and after gives."""
    lagged, target = np.lib.stride_tricks.sliding_window_view(source, 2 * taps + 1), values[taps:-taps]
    rest = target - lagged @ np.linalg.lstsq(lagged, target, rcond=None)[0]
    return float(rest @ rest) / (float(target @ target) or 1.0)


def is_filtered(values: np.ndarray) -> bool:
    """True of a signal whose scatter grows with the lag as no white noise does: what was raw in it is gone."""
    near = difference_noise(values)
    far = float(np.median([difference_noise(values[k::SCATTER_LAG_SAMPLES]) for k in range(SCATTER_LAG_SAMPLES)]))
    return far > MAX_RAW_GROWTH * near


def step_remark(step: float) -> str:
    """That a step is one of an encoder with a power of two of counts in a turn; nothing of others."""
    counts = 2 * np.pi / step if step else 0.0
    bits = round(float(np.log2(counts))) if counts >= MIN_ENCODER_COUNTS else 0
    return f"Its step is that of {2**bits} {COUNTS_ENDING}" if bits and abs(counts / 2**bits - 1) < 0.002 else ""
