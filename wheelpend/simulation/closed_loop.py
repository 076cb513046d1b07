"""The closed loop: a machine under its PID controller along a reference, read by sensors with noise and steps.

It is played nowhere else, but for a controller of a user's own (``own_controller``). What differs between its users is
the reference, the machine and what a fall means to them.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from wheelpend.estimation.shooting import DEFAULT_MAX_STEP_S
from wheelpend.kernels.kernel_module import KernelModule
from wheelpend.logs.log import Log
from wheelpend.model.record import Model

RANGE_LIMIT_RAD = np.pi / 2  # rad, of the output that a plant's range is about


class ClosedLoopRun(NamedTuple):
    """A closed loop as it was played."""

    states: np.ndarray  # (N, NX)
    measured: np.ndarray  # (N, NY) readings, with noise and in steps
    input: np.ndarray  # (N,) V, the controller's; (N, inputs) of several
    first_out_of_range: int | None  # first sample outside the plant's range; None where the machine stays within

    @property
    def stays_in_range(self) -> bool:
        """The machine stays within its plant's range: the robot does not fall."""
        return self.first_out_of_range is None


@dataclass(frozen=True)
class ClosedLoop:
    """Kernels of a machine, the gains of its PID controller, and the longest step of the integrator."""

    module: KernelModule
    gains: np.ndarray  # (3,) on error, integral and rate error [V/rad, V/(rad s), V s/rad]
    max_step: float = DEFAULT_MAX_STEP_S  # s

    @classmethod
    def of(cls, model: Model, module: KernelModule, max_step: float = DEFAULT_MAX_STEP_S) -> ClosedLoop:
        """The loop with the model's own controller; of a model without one the input stays zero."""
        gains = model.controller.gains if model.controller else (0.0, 0.0, 0.0)
        return cls(module, np.array(gains, dtype=float), max_step)

    def play(
        self,
        t: np.ndarray,
        reference: np.ndarray,
        reference_rate: np.ndarray,
        initial_state: np.ndarray,
        parameters: np.ndarray,
        noise: np.ndarray | None = None,
        quantum: np.ndarray | None = None,
    ) -> ClosedLoopRun:
        """Follow a reference (N,) [rad] and its rate [rad/s] at the times t (N,) [s], from a state (NX,).

        noise (N, NY) is added to the readings, channels with a quantum (NY,) above zero are rounded to it; the sensors
        are ideal unless given.
        """
        noise = np.zeros((len(t), self.module.NY)) if noise is None else noise
        quantum = np.zeros(self.module.NY) if quantum is None else quantum
        states, measured, voltage = self.module.closed_loop(
            t, reference, reference_rate, self.gains, initial_state, parameters, noise, quantum, self.max_step
        )
        return ClosedLoopRun(states, measured, voltage, first_sample_out_of_range(self.module, states))

    def replay(
        self,
        log: Log,
        initial_state: np.ndarray,
        parameters: np.ndarray,
        noise: np.ndarray | None = None,
        quantum: np.ndarray | None = None,
    ) -> ClosedLoopRun:
        """Follow the reference of a log, which must have one at every sample."""
        assert log.reference is not None
        rate = np.gradient(log.reference, log.t)
        return self.play(log.t, log.reference, rate, initial_state, parameters, noise, quantum)


def first_sample_out_of_range(module: KernelModule, states: np.ndarray) -> int | None:
    """First sample at which a simulation (N, NX) has left the plant's range; None where it stays within."""
    inside = np.isfinite(states).all(axis=1)
    if module.RANGE_OUTPUT >= 0:
        inside &= np.abs(states @ module.OUTPUT_MATRIX[module.RANGE_OUTPUT]) <= RANGE_LIMIT_RAD
    return None if inside.all() else int(np.argmin(inside))
