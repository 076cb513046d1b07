"""Logs from MuJoCo, a rigid-body engine that shares no code with this project.

The robot as its parts: a body on a slide and a hinge, the wheels as its child, the rotors' inertia as armature of the
joint between them, rolling as a stiff equality. Nothing here knows the equations of motion. Times in s, angles in rad,
voltages in V; torques are volt-equivalents times alpha.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from wheelpend.commands import reference
from wheelpend.failures import Failure
from wheelpend.logs import Log

ALPHA, RADIUS, GRAVITY = 165.42, 0.2413, 9.81  # N m/V, m, m/s²
WHEELS, BODY, HEIGHT = 9.2, 110.0, 0.716  # kg, kg, m from the axle to the centre of mass
WHEEL_INERTIA, BODY_INERTIA, ROTORS = 0.1339, 87.89, 0.0178 * ALPHA  # kg m²; of one wheel, the body, both rotors
DAMPING = 0.7256 * ALPHA  # N m s/rad between wheels and body: back-EMF and gearbox
GAINS = (-168.0, -800.0, -8.8)
SAMPLE, STEP = 1e-3, 1e-4  # s: of the log, of the engine
NOISE, COUNTS = np.radians(0.5), 60000  # rad and rad/s; encoder counts per revolution
TRUTH = {
    "X1": ((WHEELS + BODY) * RADIUS**2 + 2 * WHEEL_INERTIA) / ALPHA,
    "X2": ROTORS / ALPHA,
    "X3": BODY * HEIGHT * RADIUS / ALPHA,
    "X4": (BODY * HEIGHT**2 + BODY_INERTIA) / ALPHA,
    "X5": BODY * GRAVITY * HEIGHT / ALPHA,
    "X6": DAMPING / ALPHA,
    "X7": DAMPING / ALPHA,
}

SCENE = """
<mujoco>
 <option timestep="{step}" gravity="{downhill} 0 {down}" integrator="RK4" tolerance="1e-12" iterations="200">
  <flag contact="disable"/>
 </option>
 <worldbody>
  <body name="body" pos="0 0 {radius}">
   <joint name="x" type="slide" axis="1 0 0"/>
   <joint name="pitch" type="hinge" axis="0 1 0" damping="{body_damping}"/>
   <inertial pos="{ahead} 0 {above}" mass="{body}" diaginertia="{inertia} {inertia} {inertia}"/>
   <body name="wheels">
    <joint name="drive" type="hinge" axis="0 1 0" armature="{rotors}" damping="{damping}"
           frictionloss="{drive_friction}" solreffriction="{engage} 1"/>
    <inertial pos="0 0 0" mass="{wheels}" diaginertia="{wheel_inertia} {wheel_inertia} {wheel_inertia}"/>
   </body>
  </body>
 </worldbody>
 <tendon>
  <fixed name="roll">
   <joint joint="x" coef="1"/><joint joint="pitch" coef="-{radius}"/><joint joint="drive" coef="-{radius}"/>
  </fixed>
  <fixed name="wheel" damping="{ground_viscous}" stiffness="{tether}" springlength="0"
         frictionloss="{ground_friction}" solreffriction="{engage} 1">
   <joint joint="pitch" coef="1"/><joint joint="drive" coef="1"/>
  </fixed>
 </tendon>
 <equality>
  <tendon tendon1="roll" polycoef="0 0 0 0 0" solref="{stiff} 1" solimp="0.9999 0.9999 0.001"/>
 </equality>
 <actuator><motor joint="drive" gear="{alpha}"/></actuator>
</mujoco>
"""

MECHANICAL = {  # effect.parameter: what it is in the scene, per volt-equivalent or as it stands
    "coulomb_drive.torque": ("drive_friction", ALPHA),
    "rolling_resistance.torque": ("ground_friction", ALPHA),
    "ground_viscous.coefficient": ("ground_viscous", ALPHA),
    "tether_spring.stiffness": ("tether", ALPHA),
    "body_damping.coefficient": ("body_damping", ALPHA),
}
SUPPORTED = (
    *MECHANICAL, "slope.angle", "com_offset.angle", "quadratic_drive.coefficient", "air_drag.coefficient",
    "cogging.sine", "cogging.cosine", "cogging.periods", "actuator_delay.delay", "voltage_dead_zone.threshold",
    "voltage_asymmetry.ratio", "voltage_sag.rate", "voltage_offset.offset", "winding_inductance.time_constant",
    "voltage_saturation.limit", "viscous_asymmetry.coefficient", "coulomb_asymmetry.torque",
    "wheel_runout.sine", "wheel_runout.cosine", "imu_bias.bias", "gyro_bias.bias", "gyro_scale.scale",
    "pitch_scale.scale", "encoder_scale.scale", "encoder_eccentricity.sine", "encoder_eccentricity.cosine",
)  # fmt: skip


def scene(hide: Mapping[str, float], engage: float) -> str:
    """The robot with its hidden effects, as MuJoCo reads it; friction engages within about ``engage`` seconds."""
    slope, offset = hide.get("slope.angle", 0.0), hide.get("com_offset.angle", 0.0)
    place = {where: hide.get(name, 0.0) * factor for name, (where, factor) in MECHANICAL.items()}
    return SCENE.format(
        step=STEP, stiff=2 * STEP, downhill=-GRAVITY * np.sin(slope), down=-GRAVITY * np.cos(slope), radius=RADIUS,
        ahead=HEIGHT * np.sin(offset), above=HEIGHT * np.cos(offset), body=BODY, inertia=BODY_INERTIA, rotors=ROTORS,
        damping=DAMPING, wheels=WHEELS, wheel_inertia=2 * WHEEL_INERTIA, alpha=ALPHA, engage=engage, **place,
    )  # fmt: skip


def engine_log(
    hide: Mapping[str, float],
    *,
    command: str = "aggressive",
    duration: float = 20.0,
    seed: int = 0,
    engage: float = 2 * STEP,
) -> Log:
    """Run the robot under its PID controller in MuJoCo and measure it; ``hide`` is {"effect.parameter": value}.

    Raises Failure for effects that the engine does not offer, without MuJoCo, and when the robot falls.
    """
    unknown = [name for name in hide if name not in SUPPORTED]
    if unknown:
        raise Failure(f"The engine offers {', '.join(SUPPORTED)}; {', '.join(unknown)} is not among them.")
    mujoco = _engine()
    model = mujoco.MjModel.from_xml_string(scene(hide, engage))
    data = mujoco.MjData(model)
    t = np.arange(round(duration / SAMPLE) + 1) * SAMPLE
    angle, rate = reference(command, t)
    normal = np.random.default_rng(seed).normal(size=(len(t), 2)) * NOISE
    slope = hide.get("slope.angle", 0.0)
    data.qpos[:] = RADIUS * slope, slope, 0.0  # upright against the vertical, the wheel at zero against the body
    measured, voltage, integral = np.zeros((len(t), 3)), np.zeros(len(t)), 0.0
    acting, drive = 0.0, Drive(hide)
    for k in range(len(t)):
        measured[k] = read(data, hide, normal[k], slope)
        if not abs(measured[k, 1]) < np.pi / 2:
            raise Failure(f"The robot must stay up, but it falls at {t[k]:.2f} s. Hide something smaller.")
        error = angle[k] - measured[k, 1]
        integral += error * SAMPLE if k else 0.0
        voltage[k] = GAINS[0] * error + GAINS[1] * integral + GAINS[2] * (rate[k] - measured[k, 2])
        for step in range(round(SAMPLE / STEP)):
            acting = drive.act(t[k] + step * STEP, voltage[: k + 1], acting)
            data.ctrl[0] = acting
            data.qfrc_applied[:] = applied(data, hide)
            mujoco.mj_step(model, data)
    return Log(f"engine {command}", t, voltage, measured, ("theta_w", "theta_p", "dtheta_p"), angle)


def _engine() -> Any:
    try:
        import mujoco
    except ImportError:
        raise Failure("The engine needs MuJoCo, which is not installed. Install wheelpend[benchmark].") from None
    return mujoco


def read(data: Any, hide: Mapping[str, float], normal: np.ndarray, slope: float) -> np.ndarray:
    """What the sensors report: encoder (absolute, quantised), pitch from the vertical, gyro."""
    pitch, rate = data.qpos[1] - slope, data.qvel[1]
    wheel = pitch + data.qpos[2]
    quantum = 2 * np.pi / COUNTS
    turned = (1 + hide.get("encoder_scale.scale", 0.0)) * wheel
    turned += hide.get("encoder_eccentricity.sine", 0.0) * np.sin(wheel)
    turned += hide.get("encoder_eccentricity.cosine", 0.0) * np.cos(wheel)
    return np.array([
        np.round(turned / quantum) * quantum,
        (1 + hide.get("pitch_scale.scale", 0.0)) * pitch + hide.get("imu_bias.bias", 0.0) + normal[0],
        (1 + hide.get("gyro_scale.scale", 0.0)) * rate + hide.get("gyro_bias.bias", 0.0) + normal[1],
    ])  # fmt: skip


def applied(data: Any, hide: Mapping[str, float]) -> np.ndarray:
    """Generalised forces (x, pitch, drive) of effects that are laws of the motion and no part of the scene [N, N m]."""
    slip, wheel = data.qvel[2], data.qvel[1] + data.qvel[2]
    turn = hide.get("cogging.periods", 0.0) * data.qpos[2]
    drive = -hide.get("quadratic_drive.coefficient", 0.0) * slip * abs(slip)
    drive += hide.get("cogging.sine", 0.0) * np.sin(turn) + hide.get("cogging.cosine", 0.0) * np.cos(turn)
    drive -= hide.get("viscous_asymmetry.coefficient", 0.0) * abs(slip) + hide.get("coulomb_asymmetry.torque", 0.0)
    ground = -hide.get("air_drag.coefficient", 0.0) * wheel * abs(wheel)  # on the wheel's angle, pitch + drive
    angle = data.qpos[1] + data.qpos[2]
    ground += hide.get("wheel_runout.sine", 0.0) * np.sin(angle) + hide.get("wheel_runout.cosine", 0.0) * np.cos(angle)
    return ALPHA * np.array([0.0, ground, drive + ground])


class Drive:
    """The way from the commanded voltage to the motor's."""

    def __init__(self, hide: Mapping[str, float]) -> None:
        self.hide = hide

    def act(self, t: float, commands: np.ndarray, acting: float) -> float:
        """Voltage at the motor over the next step of the engine [V]."""
        past = t - self.hide.get("actuator_delay.delay", 0.0)
        commanded = float(commands[min(max(int(past / SAMPLE + 1e-6), 0), len(commands) - 1)])
        commanded = float(
            np.clip(commanded, *(np.array([-1.0, 1.0]) * self.hide.get("voltage_saturation.limit", np.inf)))
        )
        size = max(abs(commanded) - self.hide.get("voltage_dead_zone.threshold", 0.0), 0.0)
        driven = np.sign(commanded) * size * (1 - self.hide.get("voltage_sag.rate", 0.0) * t)
        driven *= 1 + self.hide.get("voltage_asymmetry.ratio", 0.0) * np.sign(driven)
        driven += self.hide.get("voltage_offset.offset", 0.0)
        lag = self.hide.get("winding_inductance.time_constant", 0.0)
        if lag <= 0 or t == 0.0:
            return float(driven)
        return float(driven + (acting - driven) * np.exp(-STEP / lag))  # its mean over the step lags by half of it
