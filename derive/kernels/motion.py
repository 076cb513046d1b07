"""Free motion, its derivatives, and the actuator."""

from __future__ import annotations

from typing import NamedTuple

import sympy as sp

from derive.algebra import adjugate_of, derivative, jacobian, substitute
from derive.effect_laws import slip_row
from derive.functions import symbol
from derive.kernels.arguments import (
    index_of,
    input_argument,
    nonzero,
    scalar_sources,
    trig_arguments_of,
    trig_sources,
    variables_of,
    with_trig_arguments,
)
from derive.printing import Kernel, Target, kernel, local_name
from derive.records import Model
from derive.regressor import dry_forces


class Layout(NamedTuple):
    """Order of the time-varying quantities in arrays and arguments."""

    without_events: bool  # True where a step has neither events nor hysteresis: many machines take it side by side
    trig_arguments: tuple[str, ...]  # names of the angles whose sines and cosines the equations of motion take
    rows: tuple[str, ...]  # equations of motion, one for each coordinate
    state_names: tuple[str, ...]  # coordinates and rates
    variable_names: tuple[str, ...]  # the same, then added states
    states: tuple[str, ...]  # the former, and all that follow, as variables of the code
    variables: tuple[str, ...]
    derivatives: tuple[str, ...]  # time derivative of each variable but the hysteresis forces
    rates: tuple[int, ...]  # index of the rate of each moving coordinate among the variables
    accelerations: tuple[str, ...]
    ports: dict[str, tuple[float, ...]]  # each port's coordinate as weights on the coordinates


class Actuator(NamedTuple):
    """The input and how it reaches the machine."""

    input: str  # argument of the kernels: the input, or a row of several
    inputs: tuple[str, ...]  # columns; none where nothing drives the machine
    delay: int  # index of the input delay among the parameters, or -1
    lag: int  # index of the time constant of the input's lag, or -1


def layout_of(model: Model) -> Layout:
    """The order of everything that varies in time."""
    plant, variables = model.plant, variables_of(model)
    return Layout(
        without_events=is_without_events(model),
        trig_arguments=tuple(trig_arguments_of(model).values()),
        rows=tuple(c.row for c in plant.coordinates),
        state_names=tuple(s.name for s in model.states),
        variable_names=variables,
        states=tuple(local_name(s.name) for s in model.states),
        variables=tuple(map(local_name, variables)),
        derivatives=derivative_names(model),
        rates=tuple(variables.index(c.dq.name) for c in plant.moving),
        accelerations=tuple(local_name(c.ddq.name) for c in plant.moving),
        ports={p.name: slip_row(plant, p.name)[: len(plant.coordinates)] for p in plant.ports},
    )


def actuator_of(model: Model) -> Actuator:
    """The input, with its delay and its lag where there are any."""
    return Actuator(
        input=input_argument(model),
        inputs=tuple(u.name for u in model.plant.inputs) if model.plant.driven else (),
        delay=index_of(model.parameters, model.delay),
        lag=index_of(model.parameters, model.lag),
    )


def motion_kernels(model: Model) -> dict[str, Kernel]:
    """Accelerations, the input map, and their derivatives."""
    return {
        "angles": angles_kernel(model),
        "free_motion": free_motion_kernel(model),
        "residual_jacobian": residual_jacobian_kernel(model),
        "drive": kernel([Target("driven", model.drive)], scalar_sources(model)),
        "drive_jacobian": drive_jacobian_kernel(model),
        "first_row": first_row_kernel(model),
    }


def is_without_events(model: Model) -> bool:
    """True where a step has no events, hysteresis and delays, one input and a controller that reads angle and rate."""
    plant, delays = model.plant, model.lag or model.delay or model.sensor_delay
    events = model.surfaces or model.hystereses or model.event_times or len(plant.moving) > len(plant.coordinates)
    return not (events or delays) and plant.driven and len(plant.inputs) == 1 and all(plant.controlled)


def derivative_names(model: Model) -> tuple[str, ...]:
    """Names of the variables' time derivatives, those of hysteresis forces left out."""
    slope = {c.q.name: c.dq.name for c in model.plant.moving} | {c.dq.name: c.ddq.name for c in model.plant.moving}
    return tuple(local_name(slope[name]) for name in variables_of(model) if name in slope)


def angles_kernel(model: Model) -> Kernel:
    """Arguments of the sines and cosines in the equations of motion."""
    return kernel([Target(f"angle_{name}", a) for a, name in trig_arguments_of(model).items()], scalar_sources(model))


def free_motion_kernel(model: Model) -> Kernel:
    """Accelerations without dry friction, and the inverse mass matrix, in closed form.

    The forces are multiplied by the adjugate while the determinant is being divided by, which comes last: one stage of
    a step waits for the other, and so for the longest chain of operations, not for their number.
    """
    accelerations = [c.ddq for c in model.plant.moving]
    mass = jacobian(model.residual, accelerations)
    adjugate, determinant = adjugate_of(mass)
    at_rest = [substitute(row, dict.fromkeys(accelerations, sp.Integer(0))) for row in model.residual]
    size = len(accelerations)
    forces = [sp.Add(*(adjugate[i, k] * at_rest[k] for k in range(size))) for i in range(size)]
    targets = [Target(local_name(a.name), -force / determinant) for a, force in zip(accelerations, forces, strict=True)]
    targets += [Target(f"mobility_{i}_{j}", adjugate[i, j] / determinant) for i in range(size) for j in range(size)]
    return kernel(with_trig_arguments(model, targets), trig_sources(model))


def residual_jacobian_kernel(model: Model) -> Kernel:
    """Derivatives of the residual, dry friction included, with the accelerations held.

    Those in the states are all there, and where the input lags it is a state, the last. Of those in the parameters the
    zero ones are left out.
    """
    dry = dry_forces(model.surfaces, len(model.residual))
    slipping = [row + force for row, force in zip(model.residual, dry, strict=True)]
    by_state = jacobian(slipping, [*model.states, *model.added_states, *([model.plant.input] if model.lag else [])])
    by_parameter = jacobian(slipping, [symbol(p.name) for p in model.fitted])
    rows, columns = by_state.shape
    targets = [Target(f"by_{i}_{j}", by_state[i, j]) for i in range(rows) for j in range(columns)]
    targets += nonzero("by_parameter", by_parameter, "stage")
    return kernel(with_trig_arguments(model, targets), trig_sources(model))


def first_row_kernel(model: Model) -> Kernel:
    """What of the first row is no inertia and no dry friction: the force that would hold the machine as it moves."""
    accelerations = dict.fromkeys((c.ddq for c in model.plant.moving), sp.Integer(0))
    return kernel([Target("held", substitute(model.residual[0], accelerations))], scalar_sources(model))


def drive_jacobian_kernel(model: Model) -> Kernel:
    """Derivatives of the driven input in the parameters; zero entries are left out."""
    slopes = [(n, derivative(model.drive, symbol(p.name))) for n, p in enumerate(model.fitted)]
    return kernel([Target(f"by_parameter[{n}]", s) for n, s in slopes if s != 0], scalar_sources(model))
