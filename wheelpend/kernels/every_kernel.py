"""A call of every kernel of a generated module, with arguments of the types with which the tool calls them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from wheelpend.kernels.kernel_module import KernelModule

SAMPLES = 6
MAX_STEP_S = 0.01  # s
TIME_CONSTANTS_S = (0.1, 0.13)  # s


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
        voltage=command if len(module.INPUTS) < 2 else np.zeros((SAMPLES, len(module.INPUTS))),
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
    if module.MISSING_FORCES and not module.INTERNAL:  # no filter runs with a released coordinate
        call_filter(module, a)


def call_filter(module: KernelModule, a: KernelArguments) -> None:
    """Call the kernel of the filter, with a random force on the first row."""
    size, steps = module.NV + (module.LAG >= 0) + 1, 2 * SAMPLES + 1
    forces = np.array([module.PARAMETERS.index(n) for n in module.MISSING_FORCES], dtype=np.int64)
    module.filter_error(
        a.t, a.voltage, a.measured, np.ones(module.NY), np.array([[0, SAMPLES]]), a.states[:1], np.ones(size - 1),
        a.parameters, a.columns, forces, np.eye(module.NQ)[:, :1].copy(), np.zeros((module.NY, 1)),
        np.array([[1.0, 0.1, 0.0]]), MAX_STEP_S, 1, np.zeros((1, 2, 2)), np.zeros(1), np.zeros((SAMPLES, module.NY, 2)),
        np.zeros((steps, 2, size)), np.zeros((steps, 2, size, size)), np.zeros((steps, size, size)),
        np.zeros(steps, dtype=np.int64),
    )  # fmt: skip
