"""A model as the templates need it: strings and numbers in records, kernels as text. Here SymPy ends."""

from __future__ import annotations

from typing import NamedTuple

from derive.kernels.friction import Friction, dry_law, friction_of
from derive.kernels.motion import Actuator, Layout, actuator_of, layout_of, motion_kernels
from derive.kernels.parameters import Parameters, parameters_of
from derive.kernels.regression import FilterPlan, filter_plan, filtered_regression, regression_kernels
from derive.kernels.sensors import Sensors, sensor_kernels, sensors_of
from derive.printing import Kernel
from derive.records import Model


class Code(NamedTuple):
    """Everything the templates need, under the names that it has in them."""

    layout: Layout
    actuator: Actuator
    friction: Friction
    sensors: Sensors
    parameters: Parameters
    filters: FilterPlan
    kernels: dict[str, Kernel]


def generate_code(model: Model) -> Code:
    """Turn a model into the text of its kernels."""
    filtered = filtered_regression(model)
    return Code(
        layout=layout_of(model),
        actuator=actuator_of(model),
        friction=friction_of(model),
        sensors=sensors_of(model),
        parameters=parameters_of(model),
        filters=filter_plan(filtered),
        kernels={
            **motion_kernels(model),
            "dry_law": dry_law(model),
            **sensor_kernels(model),
            **regression_kernels(model, filtered),
        },
    )
