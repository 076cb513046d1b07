"""The paper's machine under its controller: model, kernels, closed loop and logs that the rows share."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import NamedTuple

import numpy as np

from wheelpend.kernels.kernel_module import KernelModule
from wheelpend.kernels.load import model_module
from wheelpend.logs.log import Log
from wheelpend.model.model_kernels import library_module_of
from wheelpend.model.record import Model
from wheelpend.simulation.hidden import machine_values
from wheelpend.simulation.references import reference
from wheelpend.simulation.simulate import SAMPLE_INTERVAL_S, simulate

COMMAND_NAME = "aggressive"
EXPERIMENT_DURATION_S = 20.0  # s


class Loop(NamedTuple):
    """Arguments of a closed loop without noise."""

    t: np.ndarray  # (N,) [s]
    reference: np.ndarray  # (N,) [rad]
    rate: np.ndarray  # (N,) [rad/s]
    gains: np.ndarray  # (3,)
    state: np.ndarray  # (NX,)
    parameters: np.ndarray  # (NP,)


@dataclass
class Setting:
    """The machine of [simulation], with its kernels."""

    peers: Path  # environment with other packages

    @cached_property
    def model(self) -> Model:
        """The paper's model as a workspace starts with it."""
        return Model.default()

    @cached_property
    def lean(self) -> KernelModule:
        """Kernels of the model, the text of generated/wheel_pendulum.py."""
        return model_module(self.model.plant, self.model.assumptions, ())

    @cached_property
    def library(self) -> KernelModule:
        """Kernels with every effect."""
        return library_module_of(self.model)

    @cached_property
    def parameters(self) -> np.ndarray:
        """X1...X7 of the machine, (7,)."""
        values = machine_values(self.model, {})
        return np.array([values[name] for name in self.lean.PARAMETERS])

    def loop(self, duration: float = EXPERIMENT_DURATION_S) -> Loop:
        """The aggressive command from rest."""
        t = np.arange(round(duration / SAMPLE_INTERVAL_S) + 1) * SAMPLE_INTERVAL_S
        angle, rate = reference(COMMAND_NAME, t)
        assert self.model.controller is not None
        gains = np.array(self.model.controller.gains, dtype=float)
        return Loop(t, angle, rate, gains, np.zeros(self.lean.NX), self.parameters)

    def log(self, duration: float = EXPERIMENT_DURATION_S, **hide: float) -> Log:
        """A simulated log with sensor noise; effects are hidden as effect=value."""
        return simulate(self.model, command=COMMAND_NAME, duration=duration, hide=hide)
