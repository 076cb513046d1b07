"""An experiment simulated in advance: the model under its controller along a reference, with noisy sensors.

Noise belongs to it: at the paper's gains it shakes the voltage by more than a volt, which takes up part of a limit and
keeps dry friction from sticking.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from scipy.linalg import solve_continuous_are

from wheelpend.errors import Failure
from wheelpend.estimation.parameters import kernel_parameters, plant_values
from wheelpend.experiments.excitation import Excitation
from wheelpend.kernels.kernel_module import KernelModule
from wheelpend.logs.log import Log
from wheelpend.logs.noise import Noise, rounding_sigma

MAX_SHRINK_STEPS = 8  # times that a trajectory is made smaller to fit the limits
LIMIT_MARGIN = 0.98  # of a limit that is aimed at
LOOP_TO_FALL_SPEED_RATIO = 5.0  # speed of the closed loop over that of the fall, with a controller of our own
MAX_LOOP_SPEED_RAD_PER_SAMPLE = 0.2  # rad per sample, of such a controller
PITCH_STEP = 1e-4  # rad, rad/s, V of the differences that linearise the pitch


class Limits(NamedTuple):
    """Bounds within which the robot is operated."""

    pitch: float  # rad
    voltage: float  # V

    def to_json(self) -> dict[str, Any]:
        """The limits under the keys of JSON."""
        return {"pitch": self.pitch, "voltage": self.voltage}


class SimulatedExperiment(NamedTuple):
    """A simulated experiment."""

    excitation: Excitation
    log: Log
    states: np.ndarray  # (N, NX)
    parameters: np.ndarray  # (NP,)
    factor: float  # by which the excitation was made smaller
    rate: np.ndarray  # (N,) rad/s, of the reference

    @property
    def peak_pitch(self) -> float:
        """Largest true pitch [rad]."""
        return float(np.abs(self.states[:, 1]).max())

    @property
    def peak_voltage(self) -> float:
        """Largest voltage [V], the controller's answer to the noise included."""
        return float(np.abs(self.log.voltage).max())

    @property
    def travel(self) -> float:
        """Range of the wheel angle [rad]."""
        return float(np.ptp(self.states[:, 0]))

    def is_within(self, limits: Limits) -> bool:
        """Both peaks within the limits."""
        return self.peak_pitch <= limits.pitch and self.peak_voltage <= limits.voltage


@dataclass(frozen=True)
class ClosedLoop:
    """The robot that is to be recorded, under its controller."""

    module: KernelModule
    values: Mapping[str, float]
    gains: np.ndarray  # (3,) of the PID on the pitch
    t: np.ndarray  # (N,) s
    noise: np.ndarray  # (N, NY)
    quantum: np.ndarray  # (NY,)
    max_step: float  # s

    @classmethod
    def of(cls, module: KernelModule, values: Mapping[str, float], gains: np.ndarray, t: np.ndarray, sensors: Noise,
           max_step: float) -> ClosedLoop:  # fmt: skip
        """A loop whose sensors scatter as those of a log do; the draw is always the same."""
        white = np.sqrt(np.maximum(sensors.sigma**2 - np.array([rounding_sigma(q) for q in sensors.quantum]) ** 2, 0.0))
        noise = np.random.default_rng(0).normal(size=(len(t), module.NY)) * white
        return cls(module, values, gains, t, noise, sensors.quantum, max_step)

    def with_values(self, values: Mapping[str, float]) -> ClosedLoop:
        """The same loop of another machine."""
        return replace(self, values=values)

    def play(self, excitation: Excitation, factor: float = 1.0) -> SimulatedExperiment | None:
        """Follow a trajectory; None where the robot falls."""
        module, channels = self.module, tuple(self.module.OUTPUTS)
        angle, rate = excitation.trajectory(self.t, factor)
        empty = Log(excitation.name, self.t, angle, np.zeros_like(self.noise), channels)
        parameters = kernel_parameters(module, self.values, empty)
        states, measured, voltage = module.closed_loop(
            self.t, angle, rate, self.gains, np.zeros(module.NX), parameters, self.noise, self.quantum, self.max_step
        )  # fmt: skip
        if not (np.isfinite(states).all() and np.isfinite(voltage).all() and np.abs(states[:, 1]).max() < np.pi / 2):
            return None
        log = Log(excitation.name, self.t, voltage, measured, channels, angle)
        return SimulatedExperiment(excitation, log, states, kernel_parameters(module, self.values, log), factor, rate)

    def play_within(self, excitation: Excitation, limits: Limits) -> SimulatedExperiment | None:
        """Follow a trajectory, made smaller until the limits are kept; None where that does not help."""
        factor = 1.0
        for _ in range(MAX_SHRINK_STEPS):
            played = self.play(excitation, factor)
            if played is not None and played.is_within(limits):
                return played
            if played is None:
                factor *= 0.5
                continue
            over = min(limits.pitch / played.peak_pitch, limits.voltage / played.peak_voltage)
            factor *= min(LIMIT_MARGIN * over, 0.98)
        return None


def balancing_gains(module: KernelModule, values: Mapping[str, float], dt: float) -> np.ndarray:
    """Gains (3,) of a PID that keeps the model upright: linear-quadratic, on the pitch about the vertical.

    The wheel's slow influence on the pitch is taken as a disturbance, which the integral removes. The loop is made
    ``LOOP_TO_FALL_SPEED_RATIO`` times as fast as the fall, or as fast as samples ``dt`` [s] apart allow. Effects are
    left out.
    """
    fall, damping, effect = _linearised_pitch(module, values)
    speed = min(LOOP_TO_FALL_SPEED_RATIO * np.sqrt(abs(fall)), MAX_LOOP_SPEED_RAD_PER_SAMPLE / dt)
    weight = max(speed**4 - fall**2, 0.1 * fall**2) / effect**2  # closed loop of a double integrator: speed⁴ = a² + b²q
    matrix = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.0, fall, damping]])
    column = np.array([[0.0], [0.0], [effect]])
    cost = np.diag([weight * speed**2 / 16, weight, weight / speed**2])
    solution = solve_continuous_are(matrix, column, cost, np.eye(1))
    integral, angle, rate = (column.T @ solution)[0]
    return np.array([angle, integral, rate])


def _linearised_pitch(module: KernelModule, values: Mapping[str, float]) -> tuple[float, float, float]:
    """Derivatives of the pitch's acceleration about the vertical in pitch, its rate, and the voltage."""
    empty = Log("", np.arange(2.0), np.zeros(2), np.zeros((2, module.NY)), tuple(module.OUTPUTS))
    parameters = kernel_parameters(module, plant_values(module, values), empty)

    def pitch(state: np.ndarray, voltage: float) -> float:
        return float(module.acceleration(0.0, state, voltage, parameters)[1])

    small, size = PITCH_STEP, module.NX
    angle, rate = np.eye(size)[1] * small, np.eye(size)[module.NQ + 1] * small
    slopes = [(pitch(s, v) - pitch(-s, -v)) / (2 * small)
              for s, v in ((angle, 0.0), (rate, 0.0), (np.zeros(size), small))]  # fmt: skip
    if not (np.isfinite(slopes).all() and slopes[2] != 0.0):
        raise Failure("The model must be one that a voltage can balance, but with these values the pitch does not "
                      "answer to it. Check the values in [parameters].")  # fmt: skip
    return slopes[0], slopes[1], slopes[2]
