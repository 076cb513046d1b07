"""The integration step that resolves a model's fastest motion."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from wheelpend.estimation.parameters import kernel_parameters, plant_values
from wheelpend.estimation.state_reconstruction import measured_states
from wheelpend.kernels.kernel_module import KernelModule
from wheelpend.logs.log import Log, stack_inputs

STEP_PER_TIME_CONSTANT = 0.25  # of the fastest motion
MAX_STEP_PER_TIME_CONSTANT = 0.5  # the same, from which on a step is shortened: the method is stable up to 2.8
STEP_LIMITS_S = (1e-4, 0.01)  # s, least and largest step
UNKNOWN_RATE = 100.0  # 1/s, taken as fastest where the accelerations are not finite
FAST_QUANTILE = 0.9  # of a rate's size along a log
REST_RATE = 1e-6  # rad/s, so near rest that smoothed dry friction is at its steepest
DIFFERENCE_STEP = 1e-3  # rad or rad/s


def stable_step(module: KernelModule, values: Mapping[str, float], log: Log) -> float:
    """Step [s] of the integrator, a quarter of the inverse of the fastest rate; of effects only inner forces count."""
    return step_within(shortest_time_constant(module, values, log))


def step_within(time_constant: float) -> float:
    """Step [s] of the integrator that resolves a motion of such a time constant [s], within the limits of steps."""
    return float(np.clip(STEP_PER_TIME_CONSTANT * time_constant, *STEP_LIMITS_S))


def shortest_time_constant(module: KernelModule, values: Mapping[str, float], log: Log) -> float:
    """The inverse [s] of the fastest rate of a model near rest; of effects only inner forces count."""
    internal = {n: values[n] for n in module.INTERNAL if n in values}
    matrix = linearised_motion(module, kernel_parameters(module, plant_values(module, values) | internal, log))
    fastest = float(np.max(np.abs(np.linalg.eigvals(matrix)))) if np.all(np.isfinite(matrix)) else UNKNOWN_RATE
    return 1.0 / max(fastest, 1e-9)


def resolving_step(module: KernelModule, parameters: np.ndarray, state: np.ndarray, longest: float) -> float:
    """The longest step [s] up to one that is given in which motion near a state (NV,) is resolved.

    A fit may make an inertia so small, or a friction so large, that a step that was short enough at its start is not:
    what it then finds is where the integrator becomes unstable. Far from rest dry friction adds no rate of its own.
    """
    matrix = linearised_motion(module, parameters, state)
    if not np.all(np.isfinite(matrix)):
        return longest
    return min(longest, MAX_STEP_PER_TIME_CONSTANT / max(float(np.max(np.abs(np.linalg.eigvals(matrix)))), 1e-9))


def fastest_state(module: KernelModule, log: Log) -> np.ndarray:
    """State (NV,) of a log where it moves fastest, as far as sensors tell, every rate as fast as it mostly is at least.

    One that is next to nothing there would have dry friction at its steepest.
    """
    states, found = np.nan_to_num(measured_states(module, log)), np.zeros(module.NV)
    rates = np.abs(states[:, module.NQ : module.NX])
    usual = np.quantile(rates, FAST_QUANTILE, axis=0)
    found[: module.NX] = states[int(np.argmax((rates / np.where(usual > 0.0, usual, 1.0)).sum(axis=1)))]
    found[module.NQ : module.NX] = np.maximum(np.abs(found[module.NQ : module.NX]), np.where(usual > 0.0, usual, 1.0))
    return found


def linearised_motion(module: KernelModule, parameters: np.ndarray, state: np.ndarray | None = None) -> np.ndarray:
    """State matrix (2 n, 2 n) [1/s] of angles and rates without input, by forward differences near rest or a state."""
    rates = np.array(module.RATES)
    angles = np.where(rates < module.NX, rates - module.NQ, rates - 1)  # an added rate stands behind its coordinate
    order = np.concatenate([angles, rates])
    rest, size = np.zeros(module.NV) if state is None else state, len(rates)
    rest[rates] += REST_RATE if state is None else 0.0
    no_input = stack_inputs([np.zeros(1)] * len(module.INPUTS), 1)[0]
    base = module.acceleration(0.0, rest, no_input, parameters)
    matrix = np.zeros((2 * size, 2 * size))
    matrix[:size, size:] = np.eye(size)
    for k, place in enumerate(order):
        moved = rest.copy()
        moved[place] += DIFFERENCE_STEP
        matrix[size:, k] = (module.acceleration(0.0, moved, no_input, parameters) - base) / DIFFERENCE_STEP
    return matrix
