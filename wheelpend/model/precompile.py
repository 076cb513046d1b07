"""Compile ahead of time what the commands use."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from types import ModuleType

import numpy as np

import derive
from wheelpend.kernels import load as kernels
from wheelpend.logs.log import stack_inputs
from wheelpend.model import model_kernels
from wheelpend.model.record import Model


def compile_all(model: Model, progress: Callable[[str], None]) -> list[str]:
    """Compile the library's kernels, also those with something free inside the machine, and the model's own.

    Returns those of which something was compiled in this process.
    """
    return compile_modules(module_loaders(model), progress)


def module_loaders(model: Model) -> dict[str, Callable[[], ModuleType]]:
    """What loads each module that the tool uses of a model, by what holds it."""
    freeing = sorted({e.frees: e.name for e in derive.effects.possible_on(model.plant_signature) if e.frees}.items())
    return {
        "library": partial(model_kernels.library_module_of, model),
        "plain plant": partial(kernels.model_module, model.plant, model.assumptions, ()),
        "model": partial(kernels.model_module, model.plant, model.assumptions, model.effects),
        **{
            f"library with {name}": partial(model_kernels.library_module_of, model, [effect])
            for name, effect in freeing
        },
    }


def compile_modules(modules: Mapping[str, Callable[[], ModuleType]], progress: Callable[[str], None]) -> list[str]:
    """Compile modules by name; returns those of which something was compiled in this process."""
    new = []
    for number, (name, load) in enumerate(modules.items(), 1):
        progress(f"compiling the kernels of the {name}, once per machine ({number} of {len(modules)})")
        module = load()
        call_every_kernel(module)
        if module.__name__ in kernels.first_use_notice().compiled:
            new.append(name)
    return new


def call_every_kernel(module: ModuleType) -> None:
    """Call every public kernel once with the types that the tool uses."""
    t, command = np.arange(6) * 1e-3, np.zeros(6)
    voltage = stack_inputs([command] * len(module.INPUTS), 6)
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
    weight, bounds, first = np.ones(module.NY), np.array([[0, 6]]), states[:1]
    module.shoot(
        t, voltage, zeros, weight, bounds, first, parameters, columns,
        np.array([[0, 9]]), 0.01, np.zeros((1, size, size)), zeros.copy(),
    )  # fmt: skip
    if module.NV > module.NX:  # something carries on from segment to segment
        module.settle(t, voltage, zeros, weight, bounds, first.copy(), parameters, 0.01, 1, False)
    if module.LAG >= 0:
        module.acting_voltage(t, voltage, parameters)
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
