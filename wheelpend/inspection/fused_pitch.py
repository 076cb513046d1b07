"""A pitch that was fused from a gyro and an accelerometer, which takes the machine's own acceleration for tilt.

What a complementary filter of the time constant T reports is off by -k (v - y), dy/dt = (v - y) / T, where v is the
speed of the wheels and k = R/(g T) with an accelerometer at the axle: the integral of the gyro shows it.
"""

from __future__ import annotations

import numpy as np

from derive.plants.wheel_pendulum import KNOWN_CONSTANTS
from wheelpend.inspection.findings import Finding
from wheelpend.inspection.kinematics import RatePair
from wheelpend.inspection.signals import Signals
from wheelpend.logs.white_noise import difference_noise
from wheelpend.numerics import first_order_lag

TIME_CONSTANTS_S = np.geomspace(0.2, 8.0, 16)  # of the filters tried
MIN_EXPLAINED_SHARE = 0.6  # of what the pitch is off the integral of the gyro, by drift and start apart, in each half
MIN_ERROR_SIGMAS = 2.0  # of the pitch's scatter from sample to sample, rms
LEVER_RANGE_M = (0.003, 1.0)  # k g T: an accelerometer's height above the ground, as far as it counts
MAX_GAIN_RATIO = 1.5  # of the gain of one half of a log to that of the other
TILT_EFFECT = "accelerometer_tilt"


def fused_pitch_findings(signals: Signals, pair: RatePair, wheel: np.ndarray) -> tuple[list[Finding], Signals]:
    """The finding on a pitch that follows the speed gained by the wheel, whose angle (N,) is against the ground.

    And the signals without that error, in which other faults are looked for.
    """
    from scipy.integrate import cumulative_trapezoid  # imported late: it is slow, and few logs come here

    pitch, rate = signals.channels[pair.angle], signals.channels[pair.rate]
    off = pitch - cumulative_trapezoid(rate, dx=signals.dt, initial=0.0)
    angles = signals._replace(channels={"wheel": wheel})
    speed = angles.smooth("wheel", 1)
    tried = [(*_fit(off, speed, signals.dt, T), T) for T in TIME_CONSTANTS_S]
    share, gain, error, T = max(tried, key=lambda found: found[0])
    halves = [_fit(off[part], speed[part], signals.dt, T) for part in _halves(len(off))]
    gains = sorted(h[1] for h in halves)
    is_large = error > MIN_ERROR_SIGMAS * difference_noise(pitch)
    is_seen = is_large and min(share, *(h[0] for h in halves)) > MIN_EXPLAINED_SHARE
    is_alike = gains[0] > 0.0 and gains[1] < MAX_GAIN_RATIO * gains[0]
    if not (is_seen and is_alike and LEVER_RANGE_M[0] < gain * KNOWN_CONSTANTS["g"] * T < LEVER_RANGE_M[1]):
        return [], signals
    sentence = (
        f"{pair.angle} is off the integral of {pair.rate} by {1e3 * error:.2g} mrad rms, as the speed goes that the "
        f"wheels gain within about {T:.2g} s: it is fused with an accelerometer, which takes the robot's acceleration "
        "for tilt."
    )
    cure = (
        f"Nothing in [columns] cures it: the effect {TILT_EFFECT} has it in the model, and `explain` tries it. Or log "
        "an angle that the accelerometer hardly corrects."
    )
    cured = {**signals.channels, pair.angle: pitch + gain * _gained(speed, signals.dt, T)}
    finding = Finding("fused_pitch", pair.angle, sentence, cure, float(error), effect=TILT_EFFECT)
    return [finding], signals._replace(channels=cured)


def _gained(speed: np.ndarray, dt: float, T: float) -> np.ndarray:
    """The speed (N,) that was gained within about T [s]: without what a first-order filter follows."""
    return speed - first_order_lag(speed, float(np.exp(-dt / T)))


def _halves(samples: int) -> tuple[slice, slice]:
    return slice(None, samples // 2), slice(samples // 2, None)


def _fit(off: np.ndarray, speed: np.ndarray, dt: float, T: float) -> tuple[float, float, float]:
    """Share of an error (N,) that the speed (N,) gained within T [s] explains, its gain [s], and what it makes, rms.

    Beside a constant, a drift, and what is left of how the filter began, which may be anything.
    """
    t, gained = dt * np.arange(len(off)), _gained(speed, dt, T)
    others = np.column_stack([np.ones(len(t)), t, np.exp(-t / T)])
    basis, _ = np.linalg.qr(others)
    left, moved = (v - basis @ (basis.T @ v) for v in (off, gained))
    along = float(moved @ left) / max(float(moved @ moved), 1e-300)
    share = 1.0 - float(np.sum((left - along * moved) ** 2)) / max(float(left @ left), 1e-300)
    return share, -along, abs(along) * float(np.sqrt(np.mean(moved**2)))
