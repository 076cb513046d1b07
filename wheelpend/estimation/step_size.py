"""The integration step that resolves a model's fastest motion."""

from __future__ import annotations

from collections.abc import Mapping
from types import ModuleType

import numpy as np

import derive
from derive.effects import InternalForce
from wheelpend.estimation.parameters import kernel_parameters
from wheelpend.logs.log import Log, stack_inputs


def stable_step(module: ModuleType, values: Mapping[str, float], log: Log) -> float:
    """A step that the integrator resolves the model's fastest motion with [s]; of effects what moves inside counts."""
    inside = {e.name for e in derive.effects.EFFECT_LIBRARY.values() if isinstance(e.enters, InternalForce)}
    kept = {n: v for n, v in values.items() if "." not in n or n.partition(".")[0] in inside}
    parameters, rates = kernel_parameters(module, kept, log), np.array(module.RATES)
    angles = np.array([module.VARIABLES.index(module.VARIABLES[r].removeprefix("d")) for r in rates])
    order = np.concatenate([angles, rates])
    still, size = np.zeros(module.NV), len(rates)
    still[rates] = 1e-6
    nothing = stack_inputs([np.zeros(1)] * len(module.INPUTS), 1)[0]
    base = module.acceleration(0.0, still, nothing, parameters)
    matrix = np.zeros((2 * size, 2 * size))
    matrix[:size, size:] = np.eye(size)
    for k, place in enumerate(order):
        moved = still.copy()
        moved[place] += 1e-3
        matrix[size:, k] = (module.acceleration(0.0, moved, nothing, parameters) - base) / 1e-3
    fastest = float(np.max(np.abs(np.linalg.eigvals(matrix)))) if np.all(np.isfinite(matrix)) else 100.0
    return float(np.clip(0.25 / max(fastest, 1e-9), 1e-4, 0.01))
