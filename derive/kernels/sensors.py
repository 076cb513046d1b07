"""Readings of the sensors and of the controller, and their derivatives."""

from __future__ import annotations

from typing import NamedTuple

import sympy as sp

from derive.algebra import jacobian, symbols_in
from derive.functions import symbol
from derive.kernels.arguments import index_of, nonzero, scalar_sources, sources
from derive.printing import Kernel, Target, kernel
from derive.records import Model


class Sensors(NamedTuple):
    """The outputs, by their indices."""

    outputs: tuple[str, ...]
    delayed: tuple[bool, ...]  # True for each that the sensor delay acts on
    delay: int  # index of that delay among the parameters, or -1
    controlled: tuple[int, int]  # outputs that the controller sees: value, rate; -1 for what no sensor reads
    output_matrix: tuple[
        tuple[float, ...], ...
    ]  # what each output reads of the states while no effect touches the sensors
    range_output: int  # index of the output that must stay within ±π/2, or -1
    unmeasured: tuple[int, ...]  # indices of the rates that no sensor reads
    variables: int  # that readings depend on: the states, and where a sensor's filter is one, those added before it too


def sensors_of(model: Model) -> Sensors:
    """Outputs, output matrix, and the indices that the controller reads."""
    plant = model.plant
    outputs = tuple(c.name for c in plant.channels)
    return Sensors(
        outputs=outputs,
        delayed=tuple(name in model.delayed_channels for name in outputs),
        delay=index_of(model.parameters, model.sensor_delay),
        controlled=(index_of(outputs, plant.controlled[0]), index_of(outputs, plant.controlled[1])),
        output_matrix=ideal_output_matrix(model),
        range_output=index_of(outputs, plant.range_channel),
        unmeasured=unmeasured_rates(model),
        variables=len(read_variables(model)),
    )


def sensor_kernels(model: Model) -> dict[str, Kernel]:
    """Readings, as an array and as scalars, and their derivatives."""
    return {
        "controlled": controlled_kernel(model),
        "outputs": outputs_kernel(model),
        "readings": readings_kernel(model),
        "output_jacobian": output_jacobian_kernel(model),
    }


def ideal_output_matrix(model: Model) -> tuple[tuple[float, ...], ...]:
    """Output matrix (NY, NX) while no effect acts on the sensors; raises ValueError where it is not constant."""
    readings = sp.Matrix([c.reading for c in model.plant.channels])
    weights = jacobian(readings, model.states)
    at_rest = readings.subs(dict.fromkeys(model.states, 0))
    if weights.free_symbols or any(at_rest):
        raise ValueError(f"{model.plant.name}: every sensor must read a sum of coordinates or of rates, not {readings}")
    return tuple(tuple(float(w) for w in row) for row in weights.tolist())


def unmeasured_rates(model: Model) -> tuple[int, ...]:
    """Indices, among the states, of the rates that no sensor of the plant reads."""
    count = len(model.plant.coordinates)
    read = {c.reading for c in model.plant.channels}
    return tuple(count + n for n, c in enumerate(model.plant.coordinates) if c.dq not in read)


def read_variables(model: Model) -> tuple[sp.Symbol, ...]:
    """The states, and the added ones up to the last that a reading depends on."""
    used = set().union(*map(symbols_in, model.readings))
    last = max((k + 1 for k, s in enumerate(model.added_states) if s in used), default=0)
    return (*model.states, *model.added_states[:last])


def controlled_kernel(model: Model) -> Kernel:
    """Readings of the controller, in the states; no rate where it reads none."""
    outputs = [c.name for c in model.plant.channels]
    seen = zip(("angle", "rate"), model.plant.controlled, strict=True)
    return kernel([Target(n, model.readings[outputs.index(c)]) for n, c in seen if c], scalar_sources(model))


def outputs_kernel(model: Model) -> Kernel:
    """Readings as entries of output (NY,)."""
    return kernel([Target(f"output[{n}]", r) for n, r in enumerate(model.readings)], sources(model))


def readings_kernel(model: Model) -> Kernel:
    """Readings as scalars reading_0, reading_1, ..."""
    return kernel([Target(f"reading_{n}", r) for n, r in enumerate(model.readings)], scalar_sources(model))


def output_jacobian_kernel(model: Model) -> Kernel:
    """Derivatives of the readings; zero entries are left out."""
    readings = sp.Matrix(model.readings)
    by_state = jacobian(readings, read_variables(model))
    by_parameter = jacobian(readings, [symbol(p.name) for p in model.fitted])
    return kernel(nonzero("by_state", by_state) + nonzero("by_parameter", by_parameter), sources(model))
