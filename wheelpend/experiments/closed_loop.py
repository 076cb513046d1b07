"""An experiment played in advance: the model under its controller along a reference, with noisy sensors.

Noise belongs to it: at the paper's gains it shakes the voltage by more than a volt, which costs room below a limit and
keeps dry friction from sticking.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from types import ModuleType
from typing import NamedTuple

import numpy as np
from scipy.linalg import solve_continuous_are

from wheelpend.errors import Failure
from wheelpend.estimation.parameters import vector
from wheelpend.experiments.excitation import Excitation
from wheelpend.logs.log import Log
from wheelpend.logs.noise import Noise, rounding_only

SHRINKS = 8  # times that a trajectory is made smaller to fit the limits
MARGIN = 0.98  # of a limit that is aimed at
STIFF = 5.0  # how much faster than the fall a controller of our own is to be
FASTEST = 0.2  # rad per sample that such a controller may be fast


class Limits(NamedTuple):
    """What the robot may do."""

    pitch: float  # rad
    voltage: float  # V


class Played(NamedTuple):
    """An experiment as it would go."""

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
        """How far the wheels turn from one end of the track to the other [rad]."""
        return float(np.ptp(self.states[:, 0]))

    def within(self, limits: Limits) -> bool:
        """Whether the robot keeps the limits."""
        return self.peak_pitch <= limits.pitch and self.peak_voltage <= limits.voltage


@dataclass(frozen=True)
class Loop:
    """The robot that is to be recorded, under its controller."""

    module: ModuleType
    values: Mapping[str, float]
    gains: np.ndarray  # (3,) of the PID on the pitch
    t: np.ndarray  # (N,) s
    noise: np.ndarray  # (N, NY)
    quantum: np.ndarray  # (NY,)
    max_step: float  # s

    @classmethod
    def of(cls, module: ModuleType, values: Mapping[str, float], gains: np.ndarray, t: np.ndarray, sensors: Noise,
           max_step: float) -> Loop:  # fmt: skip
        """A loop whose sensors scatter as those of a log do; the draw is always the same."""
        white = np.sqrt(np.maximum(sensors.sigma**2 - np.array([rounding_only(q) for q in sensors.quantum]) ** 2, 0.0))
        noise = np.random.default_rng(0).normal(size=(len(t), module.NY)) * white
        return cls(module, values, gains, t, noise, sensors.quantum, max_step)

    def with_values(self, values: Mapping[str, float]) -> Loop:
        """The same loop of another machine."""
        return replace(self, values=values)

    def play(self, excitation: Excitation, factor: float = 1.0) -> Played | None:
        """Follow a trajectory; None where the robot falls."""
        module, channels = self.module, tuple(self.module.OUTPUTS)
        angle, rate = excitation.trajectory(self.t, factor)
        still = Log(excitation.name, self.t, angle, np.zeros_like(self.noise), channels)
        parameters = vector(module, self.values, still)
        states, measured, voltage = module.closed_loop(
            self.t, angle, rate, self.gains, np.zeros(module.NX), parameters, self.noise, self.quantum, self.max_step
        )  # fmt: skip
        if not (np.isfinite(states).all() and np.isfinite(voltage).all() and np.abs(states[:, 1]).max() < np.pi / 2):
            return None
        log = Log(excitation.name, self.t, voltage, measured, channels, angle)
        return Played(excitation, log, states, vector(module, self.values, log), factor, rate)

    def play_within(self, excitation: Excitation, limits: Limits) -> Played | None:
        """Follow a trajectory, made smaller until the limits are kept; None where that does not help."""
        factor = 1.0
        for _ in range(SHRINKS):
            played = self.play(excitation, factor)
            if played is not None and played.within(limits):
                return played
            if played is None:
                factor *= 0.5
                continue
            over = min(limits.pitch / played.peak_pitch, limits.voltage / played.peak_voltage)
            factor *= min(MARGIN * over, 0.98)
        return None


def balancing_gains(module: ModuleType, values: Mapping[str, float], dt: float) -> np.ndarray:
    """Gains (3,) of a PID that keeps the model upright: linear-quadratic, on the pitch about the vertical.

    The wheel's slow influence on the pitch is taken as a disturbance, which the integral removes. The loop is made
    ``STIFF`` times as fast as the fall, or as fast as samples ``dt`` [s] apart allow. Effects are left out.
    """
    fall, damping, effect = _pitch_row(module, values)
    speed = min(STIFF * np.sqrt(abs(fall)), FASTEST / dt)
    weight = max(speed**4 - fall**2, 0.1 * fall**2) / effect**2  # closed loop of a double integrator: speed⁴ = a² + b²q
    matrix = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.0, fall, damping]])
    column = np.array([[0.0], [0.0], [effect]])
    cost = np.diag([weight * speed**2 / 16, weight, weight / speed**2])
    solution = solve_continuous_are(matrix, column, cost, np.eye(1))
    integral, angle, rate = (column.T @ solution)[0]
    return np.array([angle, integral, rate])


def _pitch_row(module: ModuleType, values: Mapping[str, float]) -> tuple[float, float, float]:
    """Derivatives of the pitch's acceleration about the vertical in pitch, its rate, and the voltage."""
    plain = {n: v for n, v in values.items() if "." not in n}
    nowhere = Log("", np.arange(2.0), np.zeros(2), np.zeros((2, module.NY)), tuple(module.OUTPUTS))
    parameters = vector(module, plain, nowhere)

    def pitch(state: np.ndarray, voltage: float) -> float:
        return float(module.acceleration(0.0, state, voltage, parameters)[1])

    small, size = 1e-4, module.NX
    angle, rate = np.eye(size)[1] * small, np.eye(size)[module.NQ + 1] * small
    slopes = [(pitch(s, v) - pitch(-s, -v)) / (2 * small)
              for s, v in ((angle, 0.0), (rate, 0.0), (np.zeros(size), small))]  # fmt: skip
    if not (np.isfinite(slopes).all() and slopes[2] != 0.0):
        raise Failure("The model must be one that a voltage can balance, but with these values the pitch does not "
                      "answer to it. Check the values in [parameters].")  # fmt: skip
    return slopes[0], slopes[1], slopes[2]
