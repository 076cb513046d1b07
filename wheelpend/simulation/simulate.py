"""Closed-loop measurement files, with hidden effects on request."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from derive.parameter_name import effect_of
from derive.plant_signature import ChannelSpec
from wheelpend.errors import Failure, OutOfRange
from wheelpend.estimation.parameters import kernel_parameters
from wheelpend.estimation.step_size import stable_step
from wheelpend.kernels.kernel_module import KernelModule
from wheelpend.logs.log import Log
from wheelpend.model.model_kernels import library_module_of
from wheelpend.model.record import Model
from wheelpend.simulation.closed_loop import ClosedLoop
from wheelpend.simulation.hidden import machine_values, with_full_parameter_names
from wheelpend.simulation.own_controller import OwnController, SampledMachine, play_own_controller
from wheelpend.simulation.references import command_duration, reference

DEFAULT_NOISE_SIGMA = {"rad": 1e-3, "rad/s": 1e-2, "m": 1e-5, "m/s": 1e-3}  # by unit, of sensors without a description
SAMPLE_INTERVAL_S = 0.001  # s (paper, section 4)
MAX_DURATION_S = 86_400.0  # s; at the usual interval a day's log takes 7 GB


def simulate(
    model: Model,
    *,
    command: str = "aggressive",
    duration: float | None = None,
    hide: Mapping[str, float] | None = None,
    seed: int = 0,
    noise: bool = True,
    sample: float = SAMPLE_INTERVAL_S,
    controller: OwnController | None = None,
) -> Log:
    """Simulate the model's machine under its PID controller and measure it with its sensors.

    The machine is that of [simulation] where the model has one, else the model as identified, its effects included;
    ``command`` is a built-in one or a file, which lasts as long as it is unless ``duration`` [s] is shorter.
    ``hide`` adds effects as {"effect.parameter": value}, or {"effect": value} where it has one parameter. RK4 with
    steps of at most ``sample`` seconds, stick-slip and delays resolved inside a step. ``controller(t, measured)`` is a
    controller of your own in place of the model's: it is called once per sample with the time [s] and a dict of the
    readings by channel, and returns the input [V] that is held until the next; no ``command`` is followed then. Raises
    Failure without parameter values or controller, for a hidden effect that is none, for a controller that raises or
    returns no finite number, and when the machine leaves its range.
    """
    hidden = with_full_parameter_names(hide or {})
    t = np.arange(round(_checked_duration(model, command, duration, sample) / sample) + 1) * sample
    followed = None if controller is not None else reference(command, t, model.table)
    machine = machine_values(model, hidden)
    module = _simulation_module(model, machine, own_controller=controller is not None)
    begin = np.array([(model.simulation or {}).get(name, 0.0) for name in module.STATES])
    outputs, channels = begin[None, : module.NQ] @ module.OUTPUT_MATRIX[:, : module.NQ].T, tuple(module.OUTPUTS)
    empty = Log("", t, t, outputs, channels)
    parameters = kernel_parameters(module, machine, empty)
    step = min(sample, 2.0 * stable_step(module, machine, empty)) if module.NV > module.NX else sample
    errors, quantum = sensor_errors(model, module.OUTPUTS, len(t), seed if noise else None)
    commanded = None
    if controller is not None:
        run = play_own_controller(SampledMachine(module, parameters, t, step), controller, begin, errors, quantum)
    elif followed is not None:
        angle, rate = followed
        run = ClosedLoop.of(model, module, step).play(t, angle, rate, begin, parameters, errors, quantum)
        commanded = angle if model.table.reference else None
    if (lost := run.first_out_of_range) is not None:
        words = model.plant_signature.words
        cure = "another controller" if controller else "other gains"
        raise OutOfRange(
            f"The {words.machine} must {words.stay}, but it {words.leaves} at {t[lost]:.2f} s. Use smaller hidden "
            f"effects or {cure}."
        )
    table, name = model.table, "simulated with a controller" if controller else f"simulated {command}"
    return Log(
        name, t, run.input, run.measured, channels, commanded,
        range_channel=table.range_channel, rates=table.rates,
    )  # fmt: skip


def _simulation_module(model: Model, machine: Mapping[str, float], own_controller: bool) -> KernelModule:
    """Kernels with all effects of a machine; raises Failure where it cannot be simulated in a closed loop."""
    module = library_module_of(model, sorted(set(map(effect_of, machine)) - {""}))
    unknown = sorted(n for n in machine if effect_of(n) and n not in module.PARAMETERS)
    if unknown:
        raise Failure(f"{', '.join(unknown)} cannot be simulated under the model's assumptions.")
    if own_controller and not module.INPUTS:
        raise Failure("A controller needs an input, but nothing drives this machine. Leave the controller out.")
    if own_controller:
        return module
    if module.INPUTS and module.CONTROLLED[0] < 0:
        raise Failure(f"{model.plant} must say what is controlled to simulate a closed loop: controlled in its file.")
    if model.controller is None and model.table.input:
        raise Failure("A [controller] with kind and gains must be in the model to simulate a closed loop.")
    return module


def _checked_duration(model: Model, command: str, duration: float | None, sample: float) -> float:
    """Duration of a simulation [s], the command's where none is given; raises Failure unless a sample to a day."""
    duration = command_duration(command, model.table) if duration is None else duration
    if not sample <= duration <= MAX_DURATION_S:
        raise Failure(f"The duration must be a positive time in s, a day ({MAX_DURATION_S:g}) at most and one sample "
                      f"({sample:g}) at least, not {duration}.")  # fmt: skip
    return duration


def sensor_errors(
    model: Model, outputs: Sequence[str], samples: int, seed: int | None
) -> tuple[np.ndarray, np.ndarray]:
    """Noise (samples, channels) and quantisation (channels,) of the sensors; none without a seed."""
    if seed is None:
        return np.zeros((samples, len(outputs))), np.zeros(len(outputs))
    channels = map(model.plant_signature.channel, outputs)
    quantum = np.array([model.sensors.step_of(c) or 0.0 for c in channels])
    return np.random.default_rng(seed).normal(size=(samples, len(outputs))) * noise_levels(model, outputs), quantum


def noise_levels(model: Model, outputs: Sequence[str]) -> np.ndarray:
    """Standard deviation (channels,) of each channel's noise: [simulation], else [sensors], else the plant's."""
    given, sensors = model.simulation or {}, model.sensors
    levels = [
        given.get(c.sensor.noise_key) or sensors.noise_of(c) or c.sensor.noise or default_noise(model, c)
        for c in map(model.plant_signature.channel, outputs)
    ]
    return np.array(levels, dtype=float)


def default_noise(model: Model, channel: ChannelSpec) -> float:
    """Standard deviation of a channel without a description: 0 where it is quantised, else a small one for its unit."""
    return 0.0 if model.sensors.step_of(channel) else DEFAULT_NOISE_SIGMA.get(channel.unit, 0.0)
