"""An experiment simulated in advance: the model under its controller along a reference, with noisy sensors.

Noise belongs to it: at high gains it shakes the input by much, which takes up part of a limit and keeps dry friction
from sticking.
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
from wheelpend.logs.noise import Noise
from wheelpend.simulation.closed_loop import ClosedLoop

MAX_SHRINK_STEPS = 8  # times that a trajectory is made smaller to fit the limits
LIMIT_MARGIN = 0.98  # of a limit that is aimed at
LOOP_TO_FALL_SPEED_RATIO = 5.0  # speed of the closed loop over that of the fall, with a controller of our own
MAX_LOOP_SPEED_RAD_PER_SAMPLE = 0.2  # rad per sample, of such a controller
DIFFERENCE_STEP = 1e-4  # rad, rad/s, unit of the input, of the differences that linearise what is controlled


class Limits(NamedTuple):
    """Bounds within which a machine is operated."""

    pitch: float  # rad, of the angle that must stay in range
    voltage: float  # of the input, in its unit

    def to_json(self) -> dict[str, Any]:
        """The limits under the keys of JSON."""
        return {"pitch": self.pitch, "voltage": self.voltage}


class SimulatedExperiment(NamedTuple):
    """A simulated experiment of a machine that is held upright; its first plant gave pitch and voltage their names."""

    excitation: Excitation
    log: Log
    states: np.ndarray  # (N, NX)
    parameters: np.ndarray  # (NP,)
    factor: float  # by which the excitation was made smaller
    rate: np.ndarray  # (N,) rad/s, of the reference
    tilt: np.ndarray  # (N,) rad, the angle that must stay in range

    @property
    def peak_pitch(self) -> float:
        """Largest true angle from upright [rad]."""
        return float(np.abs(self.tilt).max())

    @property
    def peak_voltage(self) -> float:
        """Largest input [its unit], the controller's answer to the noise included."""
        return float(np.abs(self.log.voltage).max())

    @property
    def travel(self) -> float:
        """Range of the first coordinate [its unit]."""
        return float(np.ptp(self.states[:, 0]))

    def is_within(self, limits: Limits) -> bool:
        """Both peaks within the limits."""
        return self.peak_pitch <= limits.pitch and self.peak_voltage <= limits.voltage


@dataclass(frozen=True)
class ExperimentLoop:
    """The machine that is to be recorded, under its controller, and its sensors."""

    closed_loop: ClosedLoop
    values: Mapping[str, float]
    t: np.ndarray  # (N,) s
    noise: np.ndarray  # (N, NY)
    quantum: np.ndarray  # (NY,)

    @classmethod
    def of(cls, closed_loop: ClosedLoop, values: Mapping[str, float], t: np.ndarray, sensors: Noise) -> ExperimentLoop:
        """A loop whose sensors scatter as those of a log do; the draw is always the same."""
        draw = np.random.default_rng(0).normal(size=(len(t), closed_loop.module.NY))
        return cls(closed_loop, values, t, draw * sensors.sigma_before_rounding, sensors.quantum)

    @property
    def gains(self) -> np.ndarray:
        """Gains (3,) of the PID on the pitch."""
        return self.closed_loop.gains

    def with_values(self, values: Mapping[str, float]) -> ExperimentLoop:
        """The same loop of another machine."""
        return replace(self, values=values)

    def play(self, excitation: Excitation, factor: float = 1.0) -> SimulatedExperiment | None:
        """Follow a trajectory; None where the machine leaves its range."""
        module = self.closed_loop.module
        angle, rate = excitation.trajectory(self.t, factor)
        empty = Log(excitation.name, self.t, angle, np.zeros_like(self.noise), tuple(module.OUTPUTS))
        parameters = kernel_parameters(module, self.values, empty)
        rest = np.zeros(module.NX)
        run = self.closed_loop.play(self.t, angle, rate, rest, parameters, self.noise, self.quantum)
        if not (run.stays_in_range and np.isfinite(run.input).all()):
            return None
        in_range = module.OUTPUTS[module.RANGE_OUTPUT]
        log = replace(empty, voltage=run.input, measured=run.measured, reference=angle, range_channel=in_range)
        parameters = kernel_parameters(module, self.values, log)
        tilt = run.states @ module.OUTPUT_MATRIX[module.RANGE_OUTPUT]
        return SimulatedExperiment(excitation, log, run.states, parameters, factor, rate, tilt)

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
    """Gains (3,) of a PID that keeps the model upright: linear-quadratic, on what is controlled, about the vertical.

    The slow influence of other coordinates on it is taken as a disturbance, which the integral removes. The loop is
    made ``LOOP_TO_FALL_SPEED_RATIO`` times as fast as the fall, or as fast as samples ``dt`` [s] apart allow.
    Effects are left out.
    """
    fall, damping, effect = _linearised_tilt(module, values)
    speed = min(LOOP_TO_FALL_SPEED_RATIO * np.sqrt(abs(fall)), MAX_LOOP_SPEED_RAD_PER_SAMPLE / dt)
    weight = max(speed**4 - fall**2, 0.1 * fall**2) / effect**2  # closed loop of a double integrator: speed⁴ = a² + b²q
    matrix = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.0, fall, damping]])
    column = np.array([[0.0], [0.0], [effect]])
    cost = np.diag([weight * speed**2 / 16, weight, weight / speed**2])
    solution = solve_continuous_are(matrix, column, cost, np.eye(1))
    integral, angle, rate = (column.T @ solution)[0]
    return np.array([angle, integral, rate])


def _linearised_tilt(module: KernelModule, values: Mapping[str, float]) -> tuple[float, float, float]:
    """Derivatives of the acceleration of what is controlled, about the vertical: in itself, its rate, and the input."""
    empty = Log("", np.arange(2.0), np.zeros(2), np.zeros((2, module.NY)), tuple(module.OUTPUTS))
    parameters = kernel_parameters(module, plant_values(module, values), empty)

    small, weights = DIFFERENCE_STEP, module.OUTPUT_MATRIX[module.CONTROLLED[0], : module.NQ]
    still, along = np.zeros(module.NQ), weights / (weights @ weights) * small  # motion of the coordinates

    def tilt(state: np.ndarray, voltage: float) -> float:
        return float(weights @ module.acceleration(0.0, state, voltage, parameters)[: module.NQ])

    directions = ((along, still, 0.0), (still, along, 0.0), (still, still, small))
    slopes = [(tilt(s, v) - tilt(-s, -v)) / (2 * small)
              for s, v in ((np.concatenate((q, dq)), v) for q, dq, v in directions)]  # fmt: skip
    if not (np.isfinite(slopes).all() and slopes[2] != 0.0):
        raise Failure(f"The model must be one that {module.INPUT} can balance, but with these values "
                      f"{module.OUTPUTS[module.CONTROLLED[0]]} does not answer to it. Check the values in [parameters]."
                      )  # fmt: skip
    return slopes[0], slopes[1], slopes[2]
