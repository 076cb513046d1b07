"""Findings on clocks: sensors that are late against each other or against the input."""

from __future__ import annotations

import numpy as np

from wheelpend.inspection.findings import Cures, Finding
from wheelpend.inspection.kinematics import residual_of
from wheelpend.inspection.signals import INPUT, NEAREST, Shift, Signals, scan

SHORT_DELAY = 0.006  # s; a delay that physics may have and the diagnosis finds (actuator_delay, imu_lag)


def imu_shift(signals: Signals) -> Shift:
    """By how much pitch and gyro come after the encoder, from the sum of both rows, where the voltage cancels."""
    rows = signals.rows
    wheel, ones = signals.smooth("theta_w", 2)[rows], np.ones(len(rows))
    sine, bend = np.sin(signals.smooth("theta_p")), signals.smooth("dtheta_p", 1)
    return scan(lambda k: residual_of(np.column_stack((wheel, bend[rows + k], ones)), sine[rows + k]))


def move_imu(signals: Signals, samples: float) -> Signals:
    """The signals with pitch and gyro moved to earlier times."""
    places = np.arange(len(signals.voltage), dtype=float)
    moved = {c: np.interp(places + samples, places, signals.channels[c]) for c in ("theta_p", "dtheta_p")}
    return signals._replace(channels={**signals.channels, **moved})


def clock_findings(late_imu: float, voltage: Shift | None, dt: float, cures: Cures) -> list[Finding]:
    """Say which of input, encoder, pitch and gyro has a clock of its own.

    ``late_imu`` [samples] is against the encoder, with the gyro at the pitch's time; ``voltage`` is against both.
    """
    late_voltage = voltage.samples if voltage and voltage.is_clear(1.3) else 0.0
    gyro, found = cures.late_gyro, []
    if late_imu and abs(late_voltage - late_imu) < NEAREST:
        return [*lone_finding("dtheta_p", gyro, dt), late_finding("theta_w", -0.5 * (late_imu + late_voltage), dt)]
    if gyro and abs(late_imu + gyro) < NEAREST:  # the gyro had the encoder's clock, so it is the pitch
        found += lone_finding("theta_p", -gyro, dt)
    else:
        found += lone_finding("dtheta_p", gyro, dt)
        if late_imu and not 0 < late_imu * dt <= SHORT_DELAY:
            found.append(late_finding("theta_p and dtheta_p", late_imu, dt))
    if late_voltage and not 0 < -late_voltage * dt <= SHORT_DELAY:
        found.append(late_finding(INPUT, late_voltage, dt))
    return found


def lone_finding(name: str, samples: float, dt: float) -> list[Finding]:
    """Say that one of pitch and gyro is late or early against the other, if it is."""
    if not samples:
        return []
    other = {"theta_p": "dtheta_p", "dtheta_p": "theta_p"}[name]
    amount = f"{1e3 * abs(samples) * dt:.3g} ms ({abs(samples):.1f} samples)"
    sentence = f"{name} is logged {amount} {'after' if samples > 0 else 'before'} {other}."
    cure = f"Shift {name} in time, or take both from the same clock and filter."
    return [Finding("time_shift", name, sentence, cure, samples * dt)]


def late_finding(name: str, samples: float, dt: float) -> Finding:
    """Say that a channel is late (samples > 0) or early against the others."""
    amount = f"{1e3 * abs(samples) * dt:.3g} ms ({abs(samples):.1f} samples)"
    if name == INPUT and samples < 0:
        why = "a delay in the actuator (effect actuator_delay) or a clock offset"
        sentence = f"The input acts {amount} later than logged: {why}."
    elif name == INPUT:
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
    return Finding("time_shift", name, sentence, cure, (-1 if name == INPUT else 1) * samples * dt)
