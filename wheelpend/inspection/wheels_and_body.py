"""Faults of the wiring of a body on wheels: of input, encoder and IMU, most of which only the equations of motion show.

The wheel-driven pendulum names this check in its plant file.
"""

from __future__ import annotations

import math
from functools import partial

import numpy as np

from derive.plants.wheel_pendulum import INPUT
from wheelpend.inspection.clocks import (
    MAX_PHYSICAL_DELAY_S,
    input_shift_finding,
    rate_shift_findings,
    sensor_shift_finding,
)
from wheelpend.inspection.encoder import encoder_findings, evaluate_encoder, find_encoder_reading, is_too_coarse
from wheelpend.inspection.findings import Finding, LogCorrections
from wheelpend.inspection.fused_pitch import fused_pitch_findings
from wheelpend.inspection.kinematics import (
    RatePair,
    find_range_in_degrees,
    find_rate_faults,
    find_swapped_columns,
    find_wrapped_angles,
    least_squares_residual,
    rate_matches_angle,
)
from wheelpend.inspection.signals import (
    JACKKNIFE_BLOCKS,
    MIN_SHIFT_SAMPLES,
    Signals,
    TimeShift,
    channel_values,
    is_whole,
    scan_time_shifts,
    uniform_signals,
)
from wheelpend.inspection.voltage import MAX_UNEXPLAINED_SHARE, unexplained_voltage_share
from wheelpend.logs.log import Log

IMU = RatePair("theta_p", "dtheta_p")


def find_faults(log: Log, relative: bool, corrections: LogCorrections) -> list[Finding]:
    """Faults of wiring, units, signs and clocks; each is cured in a copy before the next is looked for."""
    findings = []
    for check in (
        partial(find_wrapped_angles, names=("theta_w", "theta_p"), corrections=corrections),
        partial(find_swapped_columns, pair=IMU, corrections=corrections),
        partial(find_range_in_degrees, corrections=corrections),
    ):
        found, log = check(log)
        findings += found
    signals = uniform_signals(log, INPUT, in_range=True)
    fused, cured = fused_findings(signals, relative) if signals and rate_goes_along(signals, IMU) else ([], signals)
    if fused:  # its slope is not the gyro's, and tells no unit of it
        signals = cured
    else:
        found, log = find_rate_faults(log, pair=IMU, corrections=corrections)
        findings += found
        signals = uniform_signals(log, INPUT, in_range=True)
    if signals is None or not rate_matches_angle(signals, IMU):
        return findings + rate_shift_findings("dtheta_p", "theta_p", corrections.rate_delay_samples, log.dt)
    conflict = corrections.sign.get("dtheta_p", 1) < 0  # the log's copy has a gyro that agrees with the pitch
    found, signals = find_flipped_signs(signals, conflict, corrections)
    findings += found
    whole = is_whole(channel_values(log, "theta_w"))
    if not fused:
        fused, signals = fused_findings(signals, relative)
    return findings + fused + find_clocks_and_encoder(signals, relative, whole, corrections)


def rate_goes_along(signals: Signals, pair: RatePair) -> bool:
    """True of a rate that mostly has the sign of its angle's derivative."""
    slope, rate = signals.smooth(pair.angle, 1)[signals.rows], signals.smooth(pair.rate)[signals.rows]
    return bool(slope @ rate > 0.0)


def fused_findings(signals: Signals, relative: bool) -> tuple[list[Finding], Signals]:
    """The finding on a pitch that an accelerometer draws along, and the signals without that error."""
    wheel = signals.channels["theta_w"] + (signals.channels["theta_p"] if relative else 0.0)
    return fused_pitch_findings(signals, IMU, wheel)


def find_flipped_signs(signals: Signals, conflict: bool, corrections: LogCorrections) -> tuple[list[Finding], Signals]:
    """Find wrong signs of input, encoder and IMU: the smallest set of flips, as all together change nothing.

    ``conflict`` says that gyro and pitch disagreed and that the gyro was turned round.
    """
    imu = pitch_sign_against_wheel(signals) < 0
    turned = with_signs_flipped(signals, {"theta_p", "dtheta_p"} if imu else set())
    as_is, other = (
        min(unexplained_voltage_share(with_signs_flipped(turned, f), r) for r in (False, True))
        for f in (set(), {INPUT})
    )
    voltage = other < MAX_UNEXPLAINED_SHARE and as_is > 2 * other
    if min(as_is, other) > MAX_UNEXPLAINED_SHARE:
        imu = voltage = False
    flips = {"theta_w"} if imu and voltage else {"theta_p", "dtheta_p"} if imu else {INPUT} if voltage else set()
    signals = with_signs_flipped(signals, flips)
    flips ^= {"dtheta_p"} if conflict else set()
    corrections.sign.clear()
    corrections.sign.update(dict.fromkeys(sorted(flips), -1))
    return [flip_finding(n, conflict and n in ("theta_p", "dtheta_p")) for n in sorted(flips)], signals


def flip_finding(name: str, kinematic: bool) -> Finding:
    """The finding that a channel counts the other way."""
    why = (
        "it is opposite to the other of pitch and gyro"
        if kinematic
        else "the equations fit only with its sign turned round"
    )
    sentence = f"{name} counts the other way: {why}."
    return Finding("flipped_sign", name, sentence, f"Map {name} in [columns] with sign = -1.", None)


def with_signs_flipped(signals: Signals, names: set[str]) -> Signals:
    """The signals with some of them turned round."""
    channels = {c: -v if c in names else v for c, v in signals.channels.items()}
    return signals._replace(voltage=-signals.voltage if INPUT in names else signals.voltage, channels=channels)


def pitch_sign_against_wheel(signals: Signals) -> int:
    """Sign with which the wheel's acceleration follows the pitch, 1 on a machine that balances; 0 where unclear.

    From the sum of both rows, where the voltage cancels: sin θp is a positive multiple of the wheel's acceleration plus
    one of the body's, whatever the drive does.
    """
    rows = signals.rows
    columns = signals.smooth("theta_w", 2)[rows], signals.smooth("dtheta_p", 1)[rows], np.ones(len(rows))
    table = np.column_stack((*columns, np.sin(signals.smooth("theta_p")[rows])))
    parts = np.array_split(table, JACKKNIFE_BLOCKS)
    slopes = []
    for left_out in range(-1, JACKKNIFE_BLOCKS):
        stack = np.concatenate([p for k, p in enumerate(parts) if k != left_out])
        slopes.append(float(np.linalg.lstsq(stack[:, :-1], stack[:, -1], rcond=None)[0][0]))
    sigma = math.sqrt((JACKKNIFE_BLOCKS - 1) * float(np.var(slopes[1:])))
    return 0 if abs(slopes[0]) < 5 * sigma else int(np.sign(slopes[0]))


def find_clocks_and_encoder(
    signals: Signals, relative: bool, whole: bool, corrections: LogCorrections
) -> list[Finding]:
    """Find delays between input, encoder and IMU, and a wrong reference or unit of the encoder.

    ``whole`` says that the encoder's readings have no fractions.
    """
    imu = imu_time_shift(signals)
    moved = imu.is_significant(1.3)
    aligned = with_imu_advanced(signals, imu.samples) if moved else signals
    declared = evaluate_encoder(aligned, relative, 1.0)
    best = find_encoder_reading(aligned, declared)
    best = declared if whole and is_too_coarse(best) else best
    found = encoder_findings(best, declared, whole, corrections)
    explained = best.shift.share < MAX_UNEXPLAINED_SHARE
    return found + clock_findings(
        imu.samples if moved else 0.0, best.shift if explained else None, signals.dt, corrections
    )


def imu_time_shift(signals: Signals) -> TimeShift:
    """Delay of pitch and gyro against the encoder, from the sum of both rows, where the voltage cancels."""
    rows = signals.rows
    wheel, ones = signals.smooth("theta_w", 2)[rows], np.ones(len(rows))
    sine, body_acceleration = np.sin(signals.smooth("theta_p")), signals.smooth("dtheta_p", 1)
    return scan_time_shifts(
        lambda k: least_squares_residual(np.column_stack((wheel, body_acceleration[rows + k], ones)), sine[rows + k])
    )


def with_imu_advanced(signals: Signals, samples: float) -> Signals:
    """The signals with pitch and gyro moved to earlier times."""
    indices = np.arange(len(signals.voltage), dtype=float)
    advanced = {c: np.interp(indices + samples, indices, signals.channels[c]) for c in ("theta_p", "dtheta_p")}
    return signals._replace(channels={**signals.channels, **advanced})


def clock_findings(late_imu: float, voltage: TimeShift | None, dt: float, corrections: LogCorrections) -> list[Finding]:
    """Findings on the clocks of input, encoder, pitch and gyro.

    ``late_imu`` [samples] is against the encoder, with the gyro at the pitch's time; ``voltage`` is against both.
    """
    late_voltage = voltage.samples if voltage and voltage.is_significant(1.3) else 0.0
    gyro, found = corrections.rate_delay_samples, []
    if late_imu and abs(late_voltage - late_imu) < MIN_SHIFT_SAMPLES:
        return [
            *rate_shift_findings("dtheta_p", "theta_p", gyro, dt),
            sensor_shift_finding("theta_w", -0.5 * (late_imu + late_voltage), dt),
        ]
    if gyro and abs(late_imu + gyro) < MIN_SHIFT_SAMPLES:  # the gyro had the encoder's clock, so it is the pitch
        found += rate_shift_findings("theta_p", "dtheta_p", -gyro, dt)
    else:
        found += rate_shift_findings("dtheta_p", "theta_p", gyro, dt)
        if late_imu and not 0 < late_imu * dt <= MAX_PHYSICAL_DELAY_S:
            found.append(sensor_shift_finding("theta_p and dtheta_p", late_imu, dt, "imu_lag"))
    if late_voltage and not 0 < -late_voltage * dt <= MAX_PHYSICAL_DELAY_S:
        found.append(input_shift_finding(INPUT, late_voltage, dt))
    return found
