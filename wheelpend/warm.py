"""Compile ahead of time what the commands use."""

from __future__ import annotations

from collections.abc import Callable
from types import ModuleType

import numpy as np

import derive
from wheelpend import kernels
from wheelpend.logs import side_by_side
from wheelpend.model import Model


def compile_all(model: Model, progress: Callable[[str], None]) -> None:
    """Compile the library's kernels, also those with something free inside the machine, and the model's own."""
    plant = model.built
    freeing = sorted({e.frees: e.name for e in derive.effects.possible_on(plant) if e.frees}.items())
    modules = [
        ("library", kernels.library_of(model)),
        ("plain", kernels.lean(model.plant, model.assumptions, ())),
        ("model", kernels.lean(model.plant, model.assumptions, model.effects)),
        *((f"library with {name}", kernels.library_of(model, [effect])) for name, effect in freeing),
    ]
    for number, (name, module) in enumerate(modules, 1):
        progress(f"compiling the kernels of the {name}, once per machine ({number} of {len(modules)})")
        exercise(module)


def exercise(module: ModuleType) -> None:
    """Call every public kernel once with the types that the tool uses."""
    t, command = np.arange(6) * 1e-3, np.zeros(6)
    voltage = side_by_side([command] * len(module.INPUTS), 6)
    parameters = np.ones(len(module.PARAMETERS))
    states = np.zeros((6, module.NX))
    zeros, columns = np.zeros((6, module.NY)), np.arange(1)
    module.acceleration(0.0, states[0], voltage[0], parameters)
    module.simulate(t, voltage, states[0], parameters, 0.01)
    module.closed_loop(t, command, command, np.zeros(3), states[0], parameters, zeros, np.zeros(module.NY), 0.01)
    module.sensitivities(t, voltage, states[0], parameters, columns, 0.01)
    module.regressor(0.0, states[0], np.zeros(module.NQ), voltage[0], parameters)
    module.regressor_parts(0.0, states[0], voltage[0], parameters)
    module.filter_regressor(t, states, voltage, parameters, 0.1, 0.13, True, states[0])
    module.energy_parts(0.0, states[0], voltage[0], parameters)
    size = module.NX + 2
    module.shoot(
        t, voltage, zeros, np.ones(module.NY), np.array([[0, 6]]), states[:1], parameters, columns,
        np.array([[0, 9]]), 0.01, np.zeros((1, size, size)), zeros.copy(),
    )  # fmt: skip
    count = len(module.LINEAR)
    module.recursive_identification(
        t,
        states,
        voltage,
        parameters,
        0.1,
        0.13,
        True,
        states[0],
        0,
        1.0,
        np.zeros(count),
        np.eye(count),
        np.zeros((1, count)),
    )
