"""The paper's closed-loop experiment (section 4); what the paper leaves open about it is an argument."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from wheelpend.errors import Failure
from wheelpend.estimation.parameters import kernel_parameters
from wheelpend.kernels.kernel_module import KernelModule
from wheelpend.kernels.load import model_module
from wheelpend.logs.log import Log
from wheelpend.model.record import Model
from wheelpend.simulation.hidden import machine_values
from wheelpend.simulation.references import reference
from wheelpend.simulation.simulate import SAMPLE_INTERVAL_S, sensor_errors

COMMAND_NAMES = ("simple", "aggressive")
EXPERIMENT_DURATION_S = 20.0  # s


@dataclass(frozen=True)
class Setup:
    """One closed-loop experiment."""

    command: str = "aggressive"
    duration: float = EXPERIMENT_DURATION_S  # s
    rate_error: bool = True  # the D-term acts on reference rate − measured rate; False: on −measured rate alone
    tilt: float = 0.0  # rad, true pitch at the beginning


class Run(NamedTuple):
    """The record of one experiment."""

    states: np.ndarray  # (N, 4) true θw, θp [rad], θ̇w, θ̇p [rad/s]
    log: Log  # sensor readings and controller output

    @property
    def is_upright(self) -> bool:
        """True if the states stay finite and the pitch within 90°."""
        return bool(np.isfinite(self.states).all() and np.abs(self.states[:, 1]).max() < np.pi / 2)


class Robot(NamedTuple):
    """The machine with its true parameters, and the lean kernels of its model."""

    model: Model
    module: KernelModule
    values: dict[str, float]  # true parameters and known constants

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the identified parameters, X1, X2, ..."""
        return tuple(self.module.LINEAR)

    @property
    def truth(self) -> np.ndarray:
        """Their true values."""
        return np.array([self.values[n] for n in self.names])

    def percent_error(self, estimate: np.ndarray) -> tuple[float, ...]:
        """Signed error of an estimate in percent of the truth."""
        return tuple(map(float, 100.0 * (estimate / self.truth - 1.0)))

    def scaled(self, factor: float) -> dict[str, float]:
        """Every parameter's true value times a factor, beside the known constants."""
        return {**self.values, **{n: factor * self.values[n] for n in self.names}}


@lru_cache(maxsize=4)
def load_robot(text: str) -> Robot:
    """The robot of a model.toml's text, loaded once in each process; raises Failure without values or controller."""
    model = Model.parse(text)
    if model.controller is None:
        raise Failure("The model must have a [controller] with kind and gains to play the paper's closed loop, but has "
                      "none. Add the paper's, -168, -800 and -8.8.")  # fmt: skip
    return Robot(model, model_module(model.plant, model.assumptions, ()), machine_values(model, {}))


def play(robot: Robot, setup: Setup, seed: int | None = None, values: Mapping[str, float] | None = None) -> Run:
    """Run the closed loop from rest, with the sensors' noise of a seed or with ideal sensors.

    ``values`` are parameters to run it with in place of the true ones.
    """
    module, t = robot.module, np.arange(round(setup.duration / SAMPLE_INTERVAL_S) + 1) * SAMPLE_INTERVAL_S
    angle, rate = reference(setup.command, t)
    log = Log(setup.command, t, np.zeros_like(t), np.zeros((t.size, module.NY)), tuple(module.OUTPUTS), angle)
    start = np.zeros(module.NX)
    start[1] = setup.tilt
    noise, quantum = sensor_errors(robot.model, module.OUTPUTS, t.size, seed)
    assert robot.model.controller is not None
    states, measured, voltage = module.closed_loop(
        t, angle, rate * setup.rate_error, np.array(robot.model.controller.gains, dtype=float), start,
        kernel_parameters(module, {**robot.values, **(values or {})}, log), noise, quantum, SAMPLE_INTERVAL_S,
    )  # fmt: skip
    return Run(states, Log(setup.command, t, voltage, measured, log.channels, angle))


def unstable_pole(robot: Robot) -> float:
    """Largest real part of the eigenvalues of the upright robot without its controller [1/s]."""
    module, small = robot.module, 1e-5
    parameters = kernel_parameters(module, robot.values, Log("", np.zeros(1), np.zeros(1), np.zeros((1, 3)), ()))
    matrix = np.zeros((4, 4))
    matrix[:2, 2:] = np.eye(2)
    for k in range(4):
        matrix[2:, k] = module.acceleration(0.0, small * np.eye(4)[k], 0.0, parameters) / small
    return float(np.linalg.eigvals(matrix).real.max())
