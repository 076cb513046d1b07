"""Delays between input, encoder, pitch and gyro, and the findings on them."""

from __future__ import annotations

import numpy as np

from wheelpend.inspection.findings import Finding, LogCorrections
from wheelpend.inspection.kinematics import least_squares_residual
from wheelpend.inspection.signals import INPUT_COLUMN, MIN_SHIFT_SAMPLES, Signals, TimeShift, scan_time_shifts

MAX_PHYSICAL_DELAY_S = 0.006  # s; a delay that physics may have and the diagnosis finds (actuator_delay, imu_lag)


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
    gyro, found = corrections.gyro_delay_samples, []
    if late_imu and abs(late_voltage - late_imu) < MIN_SHIFT_SAMPLES:
        return [
            *gyro_or_pitch_shift_findings("dtheta_p", gyro, dt),
            time_shift_finding("theta_w", -0.5 * (late_imu + late_voltage), dt),
        ]
    if gyro and abs(late_imu + gyro) < MIN_SHIFT_SAMPLES:  # the gyro had the encoder's clock, so it is the pitch
        found += gyro_or_pitch_shift_findings("theta_p", -gyro, dt)
    else:
        found += gyro_or_pitch_shift_findings("dtheta_p", gyro, dt)
        if late_imu and not 0 < late_imu * dt <= MAX_PHYSICAL_DELAY_S:
            found.append(time_shift_finding("theta_p and dtheta_p", late_imu, dt))
    if late_voltage and not 0 < -late_voltage * dt <= MAX_PHYSICAL_DELAY_S:
        found.append(time_shift_finding(INPUT_COLUMN, late_voltage, dt))
    return found


def gyro_or_pitch_shift_findings(name: str, samples: float, dt: float) -> list[Finding]:
    """The finding that one of pitch and gyro is late (samples > 0) or early against the other; none at 0 samples."""
    if not samples:
        return []
    other = {"theta_p": "dtheta_p", "dtheta_p": "theta_p"}[name]
    amount = f"{1e3 * abs(samples) * dt:.3g} ms ({abs(samples):.1f} samples)"
    sentence = f"{name} is logged {amount} {'after' if samples > 0 else 'before'} {other}."
    cure = f"Shift {name} in time, or take both from the same clock and filter."
    return [Finding("time_shift", name, sentence, cure, samples * dt)]


def time_shift_finding(name: str, samples: float, dt: float) -> Finding:
    """The finding that a channel is late (samples > 0) or early against the others."""
    amount = f"{1e3 * abs(samples) * dt:.3g} ms ({abs(samples):.1f} samples)"
    if name == INPUT_COLUMN and samples < 0:
        why = "a delay in the actuator (effect actuator_delay) or a clock offset"
        sentence = f"The input acts {amount} later than logged: {why}."
    elif name == INPUT_COLUMN:
        sentence = (
            f"The input is logged {amount} after it acts: no machine does that, so it is a fault of clocks or logging."
        )
    elif samples > 0:
        lag = " (effect imu_lag)" if name != "theta_w" else ""
        sentence = f"{name} is logged {amount} after the other signals: a delay in the sensor{lag} or a clock offset."
    else:
        sentence = f"{name} is logged {amount} before the other signals: a fault of clocks or logging."
    cure = f"Shift {name} in time where the clock is at fault; add the effect where the delay is real."
    cure = cure if "effect" in sentence else f"Shift {name} in time, or log everything by one clock."
    return Finding("time_shift", name, sentence, cure, (-1 if name == INPUT_COLUMN else 1) * samples * dt)
