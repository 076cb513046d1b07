"""The closed loop under a controller of the user's own: a Python function that is called once per sample."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from wheelpend.errors import Failure
from wheelpend.kernels.kernel_module import KernelModule
from wheelpend.simulation.closed_loop import ClosedLoopRun, first_sample_out_of_range

MAX_SHOWN_CHARACTERS = 60  # of what a controller returned, in a message
OwnController = Callable[[float, dict[str, float]], Any]  # t [s], reading by channel → volts, one number per input


class SampledMachine:
    """A machine whose commands are held from each sample to the next; it is simulated from one to the next."""

    def __init__(self, module: KernelModule, parameters: np.ndarray, t: np.ndarray, max_step: float) -> None:
        delay = float(parameters[module.DELAY]) if module.DELAY >= 0 else 0.0
        sensor_delay = float(parameters[module.SENSOR_DELAY]) if module.SENSOR_DELAY >= 0 else 0.0
        self.module, self.t, self.max_step = module, t, max_step
        self.begun = t + delay  # (N,) s, when each command begins to act
        self.seen = t - sensor_delay  # (N,) s, when what a delayed sensor reads at each sample was so
        self.parameters = parameters.copy()  # (NP,) without the input's delay, which stands in ``begun``
        if module.DELAY >= 0:
            self.parameters[module.DELAY] = 0.0

    def read(self, k: int, state: np.ndarray, seen: np.ndarray) -> np.ndarray:
        """Readings (NY,) at a sample without noise, of its state (NV,) and of that which delayed sensors see."""
        output, late = np.zeros(self.module.NY), np.zeros(self.module.NY)
        self.module.read_sensors(self.t[k], state, self.parameters, output)
        if self.seen[k] == self.t[k]:
            return output
        self.module.read_sensors(self.seen[k], seen, self.parameters, late)
        return np.where(self.module.DELAYED, late, output)

    def advance(self, k: int, state: np.ndarray, commands: np.ndarray, seen: np.ndarray) -> np.ndarray:
        """State (NV,) at sample k + 1, from that at k and the commands (N,) or (N, inputs) up to k.

        What delayed sensors will see of this interval is written into ``seen`` (N, NV).
        """
        now, goal = self.t[k], self.t[k + 1]
        switches = self.begun[slice(*np.searchsorted(self.begun, [now, goal]))]
        first, last = np.searchsorted(self.seen, [now, goal], side="right")
        moments = np.unique(np.concatenate([[now], switches, self.seen[first:last], [goal]]))
        acting = np.clip(np.searchsorted(self.begun, moments, side="right") - 1, 0, k)
        path = self.module.simulate(moments, commands[acting], state, self.parameters, self.max_step)
        seen[first:last] = path[np.searchsorted(moments, self.seen[first:last])]
        return path[-1]


def play_own_controller(
    machine: SampledMachine, controller: OwnController, start: np.ndarray, noise: np.ndarray, quantum: np.ndarray
) -> ClosedLoopRun:
    """Play a controller of the user's own from a state (NX,), until the machine leaves its range or the times end.

    noise (N, NY) is added to the readings, channels with a quantum (NY,) above zero are rounded to it. Raises Failure
    where the controller fails or returns anything but finite numbers, and where the input lags: what a lag remembers
    cannot be carried from sample to sample.
    """
    module, t = machine.module, machine.t
    if module.LAG >= 0 and machine.parameters[module.LAG] > 0.0:
        raise Failure(
            "A controller of your own cannot drive an input that lags, but "
            f"{module.PARAMETERS[module.LAG]} is not zero. Leave that effect out, or put the lag into the controller."
        )
    several, stepped = len(module.INPUTS) > 1, quantum > 0.0
    step = np.where(stepped, quantum, 1.0)
    commands = np.zeros((len(t), len(module.INPUTS)) if several else len(t))
    states, measured, seen = (np.zeros((len(t), size)) for size in (module.NX, module.NY, module.NV))
    state = np.zeros(module.NV)
    state[: module.NX] = start
    seen[machine.seen <= t[0]] = state
    for k, now in enumerate(t):
        states[k] = state[: module.NX]
        if first_sample_out_of_range(module, states[k : k + 1]) is not None:
            return ClosedLoopRun(states, measured, commands, k)
        reading = machine.read(k, state, seen[k]) + noise[k]
        measured[k] = np.where(stepped, np.round(reading / step) * step, reading)
        told = dict(zip(module.OUTPUTS, measured[k].tolist(), strict=True))
        commands[k] = _command(controller, float(now), told, module)
        if k + 1 < len(t):
            state = machine.advance(k, state, commands, seen)
    return ClosedLoopRun(states, measured, commands, None)


def _command(
    controller: OwnController, now: float, measured: dict[str, float], module: KernelModule
) -> float | np.ndarray:
    """What the controller returns at a time [s], as a number, or (inputs,) of several; raises Failure for others."""
    try:
        returned = controller(now, measured)
    except Exception as error:
        raise Failure(f"The controller must return an input at every sample, but at t = {now:g} s it raised "
                      f"{type(error).__name__}: {error}") from error  # fmt: skip
    count = max(len(module.INPUTS), 1)
    try:
        values = np.asarray(returned)
        numbers = values.astype(float).ravel() if values.dtype.kind in "iuf" else np.zeros(0)
    except (TypeError, ValueError):
        numbers = np.zeros(0)
    if len(numbers) != count or not np.isfinite(numbers).all():
        needs = "a finite number" if count == 1 else f"{count} finite numbers"
        raise Failure(f"The controller must return {needs} at every sample, but at t = {now:g} s it returned "
                      f"{_shown(returned)}.")  # fmt: skip
    return float(numbers[0]) if count == 1 else numbers


def _shown(returned: Any) -> str:
    """A returned value in a sentence, cut where it is long."""
    text = repr(returned)
    return text if len(text) <= MAX_SHOWN_CHARACTERS else f"{text[:MAX_SHOWN_CHARACTERS]}..."
