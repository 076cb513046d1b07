"""Force laws that MuJoCo has no element for, the chain from commanded to acting voltage, and the sensors.

Forces are evaluated once per step of the engine. Times in s, angles in rad, rates in rad/s; laws give volt-equivalents,
which times ALPHA are N m.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from wheelpend.benchmarks.hidden_effects.scene import ALPHA, WHEEL_RADIUS_M, creep_stiffness

SAMPLE_INTERVAL_S = 1e-3  # s, of the log
SENSOR_NOISE_SIGMA, ENCODER_COUNTS = np.radians(0.5), 60000  # rad and rad/s; encoder counts per revolution
FORCE_LAW_PARAMETERS = (
    "quadratic_drive.coefficient", "viscous_asymmetry.coefficient", "coulomb_asymmetry.torque", "cogging.sine",
    "cogging.cosine", "cogging.periods", "stribeck_drive.static", "stribeck_drive.sliding", "stribeck_drive.speed",
    "presliding_drive.torque", "presliding_drive.stiffness", "air_drag.coefficient", "wheel_runout.sine",
    "wheel_runout.cosine", "wheel_slip.stiffness", "wheel_slip.limit", "external_push.start", "external_push.end",
    "external_push.torque", "payload_step.time", "payload_step.ratio", "coasting_driver.rate",
)  # fmt: skip
VOLTAGE_PARAMETERS = (
    "actuator_delay.delay", "voltage_saturation.limit", "voltage_dead_zone.threshold", "voltage_sag.rate",
    "voltage_asymmetry.ratio", "voltage_offset.offset", "winding_inductance.time_constant",
)  # fmt: skip
SENSOR_PARAMETERS = (
    "imu_bias.bias", "gyro_bias.bias", "gyro_scale.scale", "pitch_scale.scale", "imu_lag.delay",
    "encoder_scale.scale", "encoder_eccentricity.sine", "encoder_eccentricity.cosine", "accelerometer_tilt.gain",
    "accelerometer_tilt.time_constant",
)  # fmt: skip


class ForceLaws:
    """Forces on the coordinates x, pitch and drive; keeps the deflection of presliding friction."""

    def __init__(self, hide: Mapping[str, float], step: float) -> None:
        self.hide, self.step = hide, step
        self.bristle = 0.0  # rad, Dahl's z
        self.stiffness = creep_stiffness(hide)  # V s/rad, of traction; 0 where the wheels cannot slip

    def of(self, name: str, absent: float = 0.0) -> float:
        """Value of a hidden parameter; ``absent`` where its effect is not hidden."""
        return self.hide.get(name, absent)

    def generalised_forces(self, t: float, data: Any) -> np.ndarray:
        """Generalised forces (x, pitch, drive) over the next step [N, N m, N m]."""
        slip, wheel = data.qvel[2], data.qvel[1] + data.qvel[2]
        angle = data.qpos[1] + data.qpos[2] - self.of("slope.angle")
        drive = self.gearbox(data.qpos[2], slip) - self.presliding(slip)
        drive -= self.of("coasting_driver.rate") * abs(data.ctrl[0]) * slip  # back-EMF, as long as the driver is on
        ground = -self.of("air_drag.coefficient") * wheel * abs(wheel)
        ground += self.of("wheel_runout.sine") * np.sin(angle) + self.of("wheel_runout.cosine") * np.cos(angle)
        traction = self.traction(wheel - data.qvel[0] / WHEEL_RADIUS_M)
        ground -= traction
        return ALPHA * np.array([(traction + self.push(t)) / WHEEL_RADIUS_M, ground, drive + ground])

    def gearbox(self, angle: float, slip: float) -> float:
        """Drag, one-sided friction and ripple between wheels and body [V]."""
        force = -self.of("quadratic_drive.coefficient") * slip * abs(slip)
        force -= self.of("viscous_asymmetry.coefficient") * abs(slip) + self.of("coulomb_asymmetry.torque")
        turn = self.of("cogging.periods") * angle
        return force + self.of("cogging.sine") * np.sin(turn) + self.of("cogging.cosine") * np.cos(turn)

    def presliding(self, slip: float) -> float:
        """Dahl's friction k z [V], whose deflection is taken on exactly over a step at this slip speed."""
        limit, stiffness = self.of("presliding_drive.torque"), self.of("presliding_drive.stiffness", np.inf)
        if limit <= 0.0 or not np.isfinite(stiffness):
            return 0.0
        end = np.sign(slip) * limit / stiffness  # where the deflection is going
        fade = np.exp(-abs(slip) * stiffness / limit * self.step)
        before, self.bristle = self.bristle, end + (self.bristle - end) * fade
        return stiffness * (before + self.bristle) / 2

    def dry(self, slip: float) -> float:
        """Limit of the dry friction between wheels and body at a slip speed [N m]; MuJoCo finds whether it holds."""
        static, sliding = self.of("stribeck_drive.static"), self.of("stribeck_drive.sliding")
        falling = (static - sliding) * np.exp(-((slip / self.of("stribeck_drive.speed", 1.0)) ** 2))
        return ALPHA * (self.of("coulomb_drive.torque") + sliding + falling)

    def traction(self, creep: float) -> float:
        """Traction F tanh(k creep / F) [V] at a creep speed θ̇w − v/R."""
        if self.stiffness == 0.0:
            return 0.0
        limit = self.of("wheel_slip.limit", np.inf)
        return limit * np.tanh(self.stiffness * creep / limit) if np.isfinite(limit) else self.stiffness * creep

    def push(self, t: float) -> float:
        """External push at the axle [V], from its start to its end."""
        pushed = self.of("external_push.start", np.inf) <= t + 1e-9 < self.of("external_push.end", np.inf)
        return self.of("external_push.torque") if pushed else 0.0


class Drive:
    """From the commanded voltage to the motor's; keeps the voltage behind the windings from step to step."""

    def __init__(self, hide: Mapping[str, float], step: float) -> None:
        self.hide, self.step = hide, step
        self.acting: float | None = None  # V

    def act(self, t: float, commands: np.ndarray) -> float:
        """Mean voltage at the motor over the next step of the engine [V]."""
        driven = self.driven(t, commands)
        lag = self.hide.get("winding_inductance.time_constant", 0.0)
        if lag <= 0.0:
            return driven
        before = 0.0 if self.acting is None else self.acting  # the robot rests before its first command
        fade = np.exp(-self.step / lag)
        self.acting = driven + (before - driven) * fade
        return float(driven + (before - driven) * (1 - fade) * lag / self.step)

    def driven(self, t: float, commands: np.ndarray) -> float:
        """Driver output [V]: the mean over a step inside which a delayed command may change, from 0 V at first."""
        begin = t - self.hide.get("actuator_delay.delay", 0.0)
        first = int(np.floor(begin / SAMPLE_INTERVAL_S + 1e-6))
        last = int(np.floor((begin + self.step) / SAMPLE_INTERVAL_S - 1e-6))
        before, after = (self.driver(t, commands[k] if k >= 0 else 0.0) for k in (first, last))
        if first == last:
            return before
        share = (last * SAMPLE_INTERVAL_S - begin) / self.step
        return share * before + (1 - share) * after

    def driver(self, t: float, command: float) -> float:
        """Driver output [V] for a command: saturation, dead zone, sag, asymmetry and offset in turn."""
        limit = self.hide.get("voltage_saturation.limit", np.inf)
        clipped = min(max(float(command), -limit), limit)
        size = max(abs(clipped) - self.hide.get("voltage_dead_zone.threshold", 0.0), 0.0)
        driven = np.sign(clipped) * size * (1 - self.hide.get("voltage_sag.rate", 0.0) * t)
        driven *= 1 + self.hide.get("voltage_asymmetry.ratio", 0.0) * np.sign(driven)
        return float(driven + self.hide.get("voltage_offset.offset", 0.0))


class Sensors:
    """Encoder (absolute, quantised), pitch from the vertical and gyro, which may report late."""

    def __init__(self, hide: Mapping[str, float], step: float, steps: int) -> None:
        self.hide, self.step = hide, step
        self.path = np.zeros((steps + 1, 2))  # pitch and its rate at every step of the engine so far
        self.now = 0
        self.tilt, self.speed = 0.0, 0.0  # rad, error of the fused pitch; rad/s, of the wheels

    def see(self, pitch: float, rate: float, speed: float) -> None:
        """Note the body's motion at a step of the engine, and what the wheels' acceleration does to a fused pitch."""
        self.path[self.now] = pitch, rate
        fade = np.exp(-self.step / self.hide.get("accelerometer_tilt.time_constant", 1.0))
        self.tilt = fade * self.tilt - np.sqrt(fade) * self.hide.get("accelerometer_tilt.gain", 0.0) * (
            speed - self.speed
        )
        self.speed = speed
        self.now += 1

    def late(self) -> np.ndarray:
        """Pitch and rate as they were ``imu_lag.delay`` ago; before the log they were as at its start."""
        back = max(self.now - 1 - self.hide.get("imu_lag.delay", 0.0) / self.step, 0.0)
        whole = min(int(back), self.now - 1)
        after = min(whole + 1, self.now - 1)
        return self.path[whole] + (back - whole) * (self.path[after] - self.path[whole])

    def read(self, wheel: float, noise: np.ndarray) -> np.ndarray:
        """Readings (3,) of wheel angle, pitch and pitch rate; ``noise`` (2,) is that of the last two."""
        quantum = 2 * np.pi / ENCODER_COUNTS
        turned = (1 + self.hide.get("encoder_scale.scale", 0.0)) * wheel
        turned += self.hide.get("encoder_eccentricity.sine", 0.0) * np.sin(wheel)
        turned += self.hide.get("encoder_eccentricity.cosine", 0.0) * np.cos(wheel)
        pitch, rate = self.late()
        return np.array([
            np.round(turned / quantum) * quantum,
            (1 + self.hide.get("pitch_scale.scale", 0.0)) * pitch
            + self.hide.get("imu_bias.bias", 0.0) + self.tilt + noise[0],
            (1 + self.hide.get("gyro_scale.scale", 0.0)) * rate + self.hide.get("gyro_bias.bias", 0.0) + noise[1],
        ])  # fmt: skip
