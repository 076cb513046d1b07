"""Logs from MuJoCo, a rigid-body engine that shares no code with this project.

``scene`` has the robot as its parts, ``laws`` what surrounds them; nothing here knows the equations of motion. Times in
s, angles in rad, voltages in V.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import numpy as np

from wheelpend.benchmarks.hidden_effects.laws import (
    FORCE_LAW_PARAMETERS,
    SAMPLE_INTERVAL_S,
    SENSOR_NOISE_SIGMA,
    SENSOR_PARAMETERS,
    VOLTAGE_PARAMETERS,
    Drive,
    ForceLaws,
    Sensors,
)
from wheelpend.benchmarks.hidden_effects.scene import (
    MAX_ENGINE_STEP_S,
    SCENE_PARAMETERS,
    WHEEL_RADIUS_M,
    scene,
    step_of,
)
from wheelpend.errors import Failure, OutOfRange
from wheelpend.logs.log import Log
from wheelpend.simulation.references import reference

PID_GAINS = (-168.0, -800.0, -8.8)  # of the PID on the pitch, V/rad, V/(rad s), V s/rad
SUPPORTED_PARAMETERS = (*SCENE_PARAMETERS, *FORCE_LAW_PARAMETERS, *VOLTAGE_PARAMETERS, *SENSOR_PARAMETERS)


class Run(NamedTuple):
    """A measured log and the true motion at its samples."""

    log: Log
    angles: np.ndarray  # (samples, joints) x [m], pitch and drive [rad], then rotor and liquid where the scene has them
    rates: np.ndarray  # (samples, joints) likewise per second
    voltage: np.ndarray  # (samples,) at the motor, mean over the engine's step before the sample [V]


class Robot:
    """The robot in MuJoCo with its hidden effects, to be moved on from sample to sample.

    Raises Failure for effects that the engine does not offer and without MuJoCo.
    """

    def __init__(self, hide: Mapping[str, float], engage: float, samples: int) -> None:
        if unknown := [name for name in hide if name not in SUPPORTED_PARAMETERS]:
            offered = ", ".join(SUPPORTED_PARAMETERS)
            raise Failure(f"The engine offers {offered}; {', '.join(unknown)} is not among them.")
        self.mujoco = _engine()
        self.hide, self.step = hide, step_of(hide)
        self.model = self.mujoco.MjModel.from_xml_string(scene(hide, engage))
        self.data = self.mujoco.MjData(self.model)
        self.steps_per_sample = round(SAMPLE_INTERVAL_S / self.step)  # steps of the engine per sample
        self.laws, self.drive = ForceLaws(hide, self.step), Drive(hide, self.step)
        self.sensors = Sensors(hide, self.step, samples * self.steps_per_sample)
        self.slope = hide.get("slope.angle", 0.0)
        self.data.qpos[:3] = WHEEL_RADIUS_M * self.slope, self.slope, 0.0  # upright, the wheel at zero against the body
        self.see()

    def see(self) -> None:
        """Let the sensors see the motion."""
        self.sensors.see(self.data.qpos[1] - self.slope, self.data.qvel[1], self.data.qvel[1] + self.data.qvel[2])

    def measured(self, noise: np.ndarray) -> np.ndarray:
        """Readings (theta_w, theta_p, dtheta_p) with the noise of the last two."""
        return self.sensors.read(self.data.qpos[1] - self.slope + self.data.qpos[2], noise)

    def move(self, t: float, commands: np.ndarray) -> None:
        """Move on by a sample from ``t``; ``commands`` are all until now, and the last acts if nothing delays it."""
        for number in range(self.steps_per_sample):
            now = t + number * self.step
            self.load(now)
            self.data.ctrl[0] = self.drive.act(now, commands)
            self.data.qfrc_applied[:3] = self.applied(now)
            if "stribeck_drive.static" in self.hide:
                self.model.dof_frictionloss[2] = self.laws.dry(self.data.qvel[2])
            self.mujoco.mj_step(self.model, self.data)
            self.see()

    def applied(self, t: float) -> np.ndarray:
        """Generalised forces (x, pitch, drive) over the next step that are no part of the scene [N, N m, N m]."""
        return self.laws.generalised_forces(t, self.data)

    def load(self, t: float) -> None:
        """Put the payload on when its time comes: a mass at the body's centre of mass, which already moves along."""
        due = self.hide.get("payload_step.time", np.inf)
        if due - self.step / 2 <= t < due + self.step / 2:
            body = self.model.body("body").id
            self.model.body_mass[body] *= 1 + self.hide["payload_step.ratio"]
            self.mujoco.mj_setConst(self.model, self.mujoco.MjData(self.model))


def engine_log(hide: Mapping[str, float], **how: Any) -> Log:
    """The log of ``engine_run``, which takes the same arguments."""
    return engine_run(hide, **how).log


def engine_run(
    hide: Mapping[str, float],
    *,
    command: str = "aggressive",
    duration: float = 20.0,
    seed: int = 0,
    engage: float = 2 * MAX_ENGINE_STEP_S,
    noise: float = 1.0,
) -> Run:
    """Run the robot under its PID controller in MuJoCo and measure it; ``hide`` is {"effect.parameter": value}.

    ``noise`` is that of pitch and gyro, in multiples of the paper's. Raises Failure for effects that the engine does
    not offer and without MuJoCo, and OutOfRange when the robot falls.
    """
    return play(Robot(hide, engage, sample_count(duration)), command, duration, seed, noise)


def sample_count(duration: float) -> int:
    """Number of samples of a log that lasts so long [s]."""
    return round(duration / SAMPLE_INTERVAL_S) + 1


def play(
    robot: Robot,
    command: str,
    duration: float,
    seed: int,
    noise: float = 1.0,
    through: Callable[[np.ndarray, float], float] = lambda measured, wanted: wanted,
) -> Run:
    """Run a robot, which has not moved yet, under its PID controller; raises OutOfRange when it falls.

    What the controller wants goes ``through`` a function of the readings and it, whose answer is applied [V].
    """
    t = np.arange(sample_count(duration)) * SAMPLE_INTERVAL_S
    angle, rate = commanded_pitch(command, t)
    scatter = np.random.default_rng(seed).normal(size=(len(t), 2)) * SENSOR_NOISE_SIGMA * noise
    measured, voltage, acting = np.zeros((len(t), 3)), np.zeros(len(t)), np.zeros(len(t))
    angles, rates, integral = np.zeros((len(t), robot.model.nq)), np.zeros((len(t), robot.model.nv)), 0.0
    for k in range(len(t)):
        measured[k] = robot.measured(scatter[k])
        angles[k], rates[k], acting[k] = robot.data.qpos, robot.data.qvel, robot.data.ctrl[0]
        if not abs(angles[k, 1] - robot.slope) < np.pi / 2:
            raise OutOfRange(f"The robot must stay up, but it falls at {t[k]:.2f} s. Hide something smaller.")
        error = angle[k] - measured[k, 1]
        integral += error * SAMPLE_INTERVAL_S if k else 0.0
        wanted = PID_GAINS[0] * error + PID_GAINS[1] * integral + PID_GAINS[2] * (rate[k] - measured[k, 2])
        voltage[k] = through(measured[k], wanted)
        robot.move(t[k], voltage[: k + 1])
    log = Log(f"engine {command}", t, voltage, measured, ("theta_w", "theta_p", "dtheta_p"), angle)
    return Run(log, angles, rates, acting)


def commanded_pitch(command: str, t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Commanded pitch [rad] and its rate [rad/s]: those of the project, and "slow", which makes dry friction stick."""
    if command != "slow":
        return reference(command, t)
    angle = np.radians(0.5) * np.sin(0.5 * t)
    return angle, np.gradient(angle, t)


def _engine() -> Any:
    try:
        import mujoco
    except ImportError:
        raise Failure("The engine needs MuJoCo, which is not installed. Install wheelpend[benchmark].") from None
    return mujoco


__all__ = ["SUPPORTED_PARAMETERS", "Robot", "Run", "engine_log", "engine_run", "play", "sample_count"]
