"""Findings on the clocks of input and sensors."""

from __future__ import annotations

from wheelpend.inspection.findings import Finding

MAX_PHYSICAL_DELAY_S = 0.006  # s; a delay that physics may have and the diagnosis finds (actuator_delay, imu_lag)


def rate_shift_findings(name: str, other: str, samples: float, dt: float) -> list[Finding]:
    """The finding that one of an angle and its rate is late (samples > 0) or early; none at 0 samples."""
    if not samples:
        return []
    amount = shift_text(samples, dt)
    sentence = f"{name} is logged {amount} {'after' if samples > 0 else 'before'} {other}."
    cure = f"Shift {name} in time, or take both from the same clock and filter."
    return [Finding("time_shift", name, sentence, cure, samples * dt)]


def input_shift_finding(name: str, samples: float, dt: float) -> Finding:
    """The finding that the input acts later than logged (samples < 0), or is logged after it acts."""
    amount = shift_text(samples, dt)
    if samples < 0:
        sentence = (f"The input acts {amount} later than logged: a delay in the actuator (effect actuator_delay) or a "
                    "clock offset.")  # fmt: skip
    else:
        sentence = (
            f"The input is logged {amount} after it acts: no machine does that, so it is a fault of clocks or logging."
        )
    effect = "actuator_delay" if samples < 0 else ""
    return Finding("time_shift", name, sentence, shift_cure(name, effect), -samples * dt, effect=effect)


def sensor_shift_finding(name: str, samples: float, dt: float, lag: str = "") -> Finding:
    """The finding that a sensor is late (samples > 0) or early; ``lag`` is an effect that may be the reason."""
    amount = shift_text(samples, dt)
    if samples > 0:
        effect = f" (effect {lag})" if lag else ""
        sentence = (
            f"{name} is logged {amount} after the other signals: a delay in the sensor{effect} or a clock offset."
        )
    else:
        sentence = f"{name} is logged {amount} before the other signals: a fault of clocks or logging."
    effect = lag if samples > 0 else ""
    return Finding("time_shift", name, sentence, shift_cure(name, effect), samples * dt, effect=effect)


def shift_text(samples: float, dt: float) -> str:
    """A time shift in ms and samples."""
    return f"{1e3 * abs(samples) * dt:.3g} ms ({abs(samples):.1f} samples)"


def shift_cure(name: str, effect: str) -> str:
    """What to do about a time shift, which may be an effect."""
    cure = f"Shift {name} in time where the clock is at fault; add the effect where the delay is real."
    return cure if effect else f"Shift {name} in time, or log everything by one clock."
