"""The model linearised at rest: the state space that a controller or an observer is designed from."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

import derive
from derive.effects import Deformation, Force, InputMap, SensorMap
from wheelpend.errors import Failure, did_you_mean
from wheelpend.estimation.free_parameters import known_values
from wheelpend.kernels.kernel_module import KernelModule
from wheelpend.kernels.load import model_module
from wheelpend.logs.log import stack_inputs
from wheelpend.model.record import Model
from wheelpend.notebook import NotebookResult, ResultTable

DIFFERENCE_STEP = 1e-3  # rad, rad/s, m, m/s or the input's unit: with four points the slope's error is some 1e-12 of it
MAX_NEWTON_STEPS = 30
MAX_REST_ACCELERATION = 1e-9  # rad/s² or m/s², at which a machine counts as at rest


@dataclass(frozen=True, repr=False)
class LinearModel(NotebookResult):
    """dx/dt = A x + B u, y = C x + D u, where x, u and y are counted from those at rest."""

    A: np.ndarray  # (states, states), in units of the states per s
    B: np.ndarray  # (states, inputs), in units of the states per s and the input's
    C: np.ndarray  # (outputs, states)
    D: np.ndarray  # (outputs, inputs)
    states: tuple[str, ...]  # names: coordinates [rad or m], then their rates
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]  # channels of a log
    rest_state: np.ndarray  # (states,) at which it is linearised
    rest_input: np.ndarray  # (inputs,) that keeps it there
    left_out: tuple[str, ...] = ()  # effects of the model that have no slope at rest, or add states

    def headline(self) -> str:
        """What was linearised, and what was not."""
        without = f", without {', '.join(self.left_out)}" if self.left_out else ""
        return f"Linear model at rest from {', '.join(self.inputs) or 'nothing'} to {', '.join(self.outputs)}{without}"

    def table(self) -> ResultTable:
        """The rows of [A B]: the rate of each state by states and inputs."""
        columns = {"rate of": str, **dict.fromkeys((*self.states, *self.inputs), float)}
        rows = zip(self.states, np.hstack([self.A, self.B]).tolist(), strict=True)
        return ResultTable(columns, [(name, *row) for name, row in rows])

    def to_control(self) -> Any:
        """The same as a StateSpace of python-control; raises Failure where that is not installed."""
        try:
            import control
        except ImportError:
            raise Failure("to_control needs python-control, which is not installed. Install it with: "
                          "pip install control") from None  # fmt: skip
        names = {"states": list(self.states), "inputs": list(self.inputs), "outputs": list(self.outputs)}
        return control.ss(self.A, self.B, self.C, self.D, **names)


def linearize(model: Model, near: Mapping[str, float] | None = None) -> LinearModel:
    """Linearise a model at the rest that is nearest to its coordinates at zero, or ``near`` others [rad or m].

    Upright is zero for a machine that is held upright; ``near={"theta": math.pi}`` is a pendulum's other rest. The
    values are the identified ones, else the nominal ones. Effects that have no slope at rest (dry friction, play,
    hysteresis, events) and those that add states or delays are left out, and named in ``left_out``. Raises Failure
    where a value is missing, an angle is none of the model's, no rest is found, or a command does not act there.
    """
    kept = tuple(e for e in model.effects if _is_smooth(e))
    module = model_module(model.plant, model.assumptions, kept)
    values = known_values(model)
    if missing := [n for n in module.PARAMETERS[: module.OWN_PARAMETERS] if n not in values]:
        raise Failure(f"{', '.join(missing)} must have a value to linearise: identify the model first, or give it in "
                      "[parameters].")  # fmt: skip
    parameters = np.array([values.get(n, a) for n, a in zip(module.PARAMETERS, module.ABSENT, strict=True)])
    rest = _rest(module, parameters, _start(module, near or {}))
    slopes = _slopes(lambda x: _acceleration(module, parameters, x), rest)
    half, size = module.NQ, module.NX
    top = np.hstack([np.zeros((half, half)), np.eye(half)])
    a, b = np.vstack([top, slopes[:, :size]]), np.vstack([np.zeros((half, len(module.INPUTS))), slopes[:, size:]])
    if idle := [n for n, column in zip(module.INPUTS, b.T, strict=True) if not column.any()]:
        raise Failure(f"A command must act at rest to linearise, but {', '.join(idle)} does not: it is in a dead zone. "
                      "Linearise the model without that effect: model.with_effects([...]).")  # fmt: skip
    c = _slopes(lambda x: _readings(module, parameters, x), rest[:size])
    left_out = tuple(e for e in model.effects if e not in kept)
    d = np.zeros((module.NY, len(module.INPUTS)))
    return LinearModel(a, b, c, d, module.STATES, module.INPUTS, module.OUTPUTS, rest[:size], rest[size:], left_out)


def _is_smooth(effect: str) -> bool:
    """True of an effect that has a slope at rest, adds no states and lasts."""
    row = derive.effects.find(effect)
    return isinstance(row.enters, Force | Deformation | InputMap | SensorMap) and not row.event


def _start(module: KernelModule, near: Mapping[str, float]) -> np.ndarray:
    """State and input (NX + inputs,) near which a rest is sought."""
    start, coordinates = np.zeros(module.NX + len(module.INPUTS)), module.STATES[: module.NQ]
    for name, value in near.items():
        if name not in coordinates:
            raise Failure(f"A rest must be near coordinates of the model ({', '.join(coordinates)}), not '{name}'."
                          f"{did_you_mean(name, coordinates)}")  # fmt: skip
        start[coordinates.index(name)] = value
    return start


def _rest(module: KernelModule, parameters: np.ndarray, start: np.ndarray) -> np.ndarray:
    """State and input (NX + inputs,) at which nothing accelerates, by least changes of coordinates and input."""
    point, free = start.copy(), np.r_[: module.NQ, module.NX : len(start)]
    for _ in range(MAX_NEWTON_STEPS):
        acceleration = _acceleration(module, parameters, point)
        if not np.isfinite(acceleration).all():
            break
        if np.abs(acceleration).max() < MAX_REST_ACCELERATION:
            return point
        slopes = _slopes(lambda x: _acceleration(module, parameters, x), point)[:, free]
        if not np.isfinite(slopes).all():
            break
        point[free] -= np.linalg.lstsq(slopes, acceleration, rcond=None)[0]
    raise Failure("A model must have a rest to be linearised at, but none was found from "
                  f"{', '.join(f'{n} = {v:g}' for n, v in zip(module.STATES[: module.NQ], start, strict=False))}. "
                  "Say near which coordinates it rests: near={...}.")  # fmt: skip


def _acceleration(module: KernelModule, parameters: np.ndarray, point: np.ndarray) -> np.ndarray:
    """Accelerations (NQ,) at a state and input (NX + inputs,)."""
    inputs = stack_inputs([np.array([u]) for u in point[module.NX :]], 1)[0]
    return module.acceleration(0.0, np.ascontiguousarray(point[: module.NX]), inputs, parameters)


def _readings(module: KernelModule, parameters: np.ndarray, state: np.ndarray) -> np.ndarray:
    """Readings (NY,) in a state (NX,)."""
    output = np.zeros(module.NY)
    module.read_sensors(0.0, state, parameters, output)
    return output


def _slopes(function: Callable[[np.ndarray], np.ndarray], point: np.ndarray) -> np.ndarray:
    """Derivatives (values, n) of a function at a point (n,), by central differences of four points each."""
    columns = []
    for step in np.eye(len(point)) * DIFFERENCE_STEP:
        near = function(point + step) - function(point - step)
        far = function(point + 2.0 * step) - function(point - 2.0 * step)
        columns.append((8.0 * near - far) / (12.0 * DIFFERENCE_STEP))
    return np.column_stack(columns)
