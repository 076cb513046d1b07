"""Ahead-of-time compilation of the kernels that the commands use."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial

import numpy as np

import derive
from wheelpend.kernels.kernel_module import KernelModule
from wheelpend.kernels.load import first_use_notice, model_module
from wheelpend.logs.log import stack_inputs
from wheelpend.model.model_kernels import library_module_of
from wheelpend.model.record import Model

SAMPLES = 6
MAX_STEP_S = 0.01  # s
TIME_CONSTANTS_S = (0.1, 0.13)  # s


def compile_all(model: Model, progress: Callable[[str], None]) -> list[str]:
    """Compile the model's own kernels and the library's, also those with an internal coordinate released.

    Returns the modules, by what they hold, of which something was compiled in this process.
    """
    return compile_modules(module_loaders(model), progress)


def module_loaders(model: Model) -> dict[str, Callable[[], KernelModule]]:
    """Loaders of the modules that the tool uses of a model, by what they hold."""
    releasing = sorted(
        {e.releases: e.name for e in derive.effects.applicable_to(model.plant_signature) if e.releases}.items()
    )
    return {
        "library": partial(library_module_of, model),
        "plain plant": partial(model_module, model.plant, model.assumptions, ()),
        "model": partial(model_module, model.plant, model.assumptions, model.effects),
        **{f"library with {name}": partial(library_module_of, model, [effect]) for name, effect in releasing},
    }


def compile_modules(modules: Mapping[str, Callable[[], KernelModule]], progress: Callable[[str], None]) -> list[str]:
    """Compile modules by name; returns those of which something was compiled in this process."""
    compiled = []
    for number, (name, load) in enumerate(modules.items(), 1):
        progress(f"compiling the kernels of the {name}, once per machine ({number} of {len(modules)})")
        module = load()
        call_every_kernel(module)
        if module.__name__ in first_use_notice().compiled:
            compiled.append(name)
    return compiled


@dataclass(frozen=True)
class KernelArguments:
    """Arguments of a module's kernels, of the types with which the tool calls them: a log of six samples."""

    t: np.ndarray  # (N,) s
    command: np.ndarray  # (N,)
    voltage: np.ndarray  # (N,), (N, inputs) of several [V]
    states: np.ndarray  # (N, NX)
    measured: np.ndarray  # (N, NY); serves as noise, too
    parameters: np.ndarray  # (NP,)
    columns: np.ndarray  # (1,) indices of parameters with sensitivities


def call_every_kernel(module: KernelModule) -> None:
    """Call every public kernel of a generated module once, which compiles it."""
    command = np.zeros(SAMPLES)
    arguments = KernelArguments(
        t=np.arange(SAMPLES) * 1e-3,
        command=command,
        voltage=stack_inputs([command] * len(module.INPUTS), SAMPLES),
        states=np.zeros((SAMPLES, module.NX)),
        measured=np.zeros((SAMPLES, module.NY)),
        parameters=np.ones(len(module.PARAMETERS)),
        columns=np.arange(1),
    )
    call_simulation_kernels(module, arguments)
    call_regression_kernels(module, arguments)
    call_estimation_kernels(module, arguments)


def call_simulation_kernels(module: KernelModule, a: KernelArguments) -> None:
    """Call the kernels that simulate, in open and closed loop, and that linearise a simulation."""
    start, gains, quantum = a.states[0], np.zeros(3), np.zeros(module.NY)
    module.acceleration(0.0, start, a.voltage[0], a.parameters)
    module.simulate(a.t, a.voltage, start, a.parameters, MAX_STEP_S)
    module.closed_loop(a.t, a.command, a.command, gains, start, a.parameters, a.measured, quantum, MAX_STEP_S)
    module.sensitivities(a.t, a.voltage, start, a.parameters, a.columns, MAX_STEP_S)
    if module.LAG >= 0:
        module.acting_voltage(a.t, a.voltage, a.parameters)


def call_regression_kernels(module: KernelModule, a: KernelArguments) -> None:
    """Call the kernels of inverse dynamics, of its filtered and its energy form, and of recursive least squares."""
    start, (tau1, tau2), count = a.states[0], TIME_CONSTANTS_S, len(module.LINEAR)
    module.regressor(0.0, start, np.zeros(module.NQ), a.voltage[0], a.parameters)
    module.regressor_parts(0.0, start, a.voltage[0], a.parameters)
    module.filter_regressor(a.t, a.states, a.voltage, a.parameters, tau1, tau2, True, start)
    module.energy_parts(0.0, start, a.voltage[0], a.parameters)
    estimate, covariance, instruments = np.zeros(count), np.eye(count), np.zeros((1, count))
    module.recursive_identification(
        a.t, a.states, a.voltage, a.parameters, tau1, tau2, True, start, 0, 1.0, estimate, covariance, instruments
    )


def call_estimation_kernels(module: KernelModule, a: KernelArguments) -> None:
    """Call the kernels of multiple shooting, with a segment from the first sample to the last."""
    weight, bounds, first, size = np.ones(module.NY), np.array([[0, SAMPLES]]), a.states[:1], module.NX + 2
    module.shoot(
        a.t, a.voltage, a.measured, weight, bounds, first, a.parameters, a.columns,
        np.array([[0, 9]]), MAX_STEP_S, np.zeros((1, size, size)), a.measured.copy(),
    )  # fmt: skip
    if module.NV > module.NX:  # something carries on from segment to segment
        module.fit_initial_states(
            a.t, a.voltage, a.measured, weight, bounds, first.copy(), a.parameters, MAX_STEP_S, 1, False
        )
