"""The paper's robot on rough ground, in MuJoCo: a rigid-body engine that shares no code with this project."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from wheelpend.benchmarks.hidden_effects.engine import Robot, play, sample_count
from wheelpend.benchmarks.hidden_effects.scene import ALPHA, MAX_ENGINE_STEP_S
from wheelpend.benchmarks.random_force.forces import FORCE_KINDS, ForceKind
from wheelpend.logs.log import Log

FORCE_SHARE = 0.05  # of the drive's rms voltage: a random force's rms
PLACE_WEIGHTS = {"wheel": (1.0, 0.0), "drive": (-1.0, 1.0)}  # on the rows of wheel and body, of a force at a place
LOG_DURATION_S, LOG_COMMAND = 20.0, "aggressive"  # s; of every log
DRIVE_VOLTAGE_RMS_V, WHEEL_SPEED_RMS_RAD_S = 6.045, 6.942  # V, rad/s; of a log without a force, measured


class PlayedForce(NamedTuple):
    """A log with the force that was played in it."""

    log: Log
    force: np.ndarray  # (samples,) V, at its place


class RoughGround(Robot):
    """The robot with a random force at a place."""

    def __init__(self, hide: Mapping[str, float], samples: int, kind: ForceKind, place: str, random_seed: int) -> None:
        super().__init__(hide, 2 * MAX_ENGINE_STEP_S, samples)
        random = np.random.default_rng(random_seed)
        self.path = FORCE_SHARE * DRIVE_VOLTAGE_RMS_V * kind.draw(random, samples * self.steps_per_sample, self.step)
        self.kind, self.played = kind, np.zeros(samples * self.steps_per_sample)
        wheel, body = PLACE_WEIGHTS[place]
        self.per_volt = ALPHA * np.array([0.0, wheel + body, wheel])  # on x, pitch and drive, where θw = pitch + drive

    def applied(self, t: float) -> np.ndarray:
        """Generalised forces with the random one."""
        number = round(t / self.step)
        size = self.path[number]
        if self.kind.with_speed:
            size *= abs(self.data.qvel[1] + self.data.qvel[2]) / WHEEL_SPEED_RMS_RAD_S
        self.played[number] = size
        return super().applied(t) + self.per_volt * size


def rough_log(
    kind: str, place: str, seed: int, hide: Mapping[str, float] | None = None, duration: float = LOG_DURATION_S
) -> PlayedForce:
    """A log with a random force of 5 % of the drive, and effects hidden as {"effect.parameter": value}.

    Raises OutOfRange where the robot falls.
    """
    robot = RoughGround(hide or {}, sample_count(duration), FORCE_KINDS[kind], place, 1_000_000 + seed)
    run = play(robot, LOG_COMMAND, duration, seed)
    steps = robot.steps_per_sample
    return PlayedForce(run.log, robot.played.reshape(-1, steps).mean(axis=1))


__all__ = ["PlayedForce", "RoughGround", "rough_log"]
