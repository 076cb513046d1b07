"""The filter-error method on measured logs, which lie beside the project: no inertia runs away without friction.

Models are those that `new --from` proposes for the logs.
"""

from typing import NamedTuple

import pytest

from tests.support import DATA
from wheelpend import Model, identify

AXIS_FILE, AXIS_MASS = "emps/DATA_EMPS.mat", 95.1089 / 35.1507  # V s²/m, as published


class Machine(NamedTuple):
    """A log, its model, and between what bounds a sum of parameters lies."""

    log: str
    model: str
    names: tuple[str, ...]
    lowest: float
    highest: float


AXIS = """plant = "slide"
[columns]
v_in = { column = "vir" }
x = { column = "qm" }
x_ref = { column = "qg" }
"""
FREE_PENDULUM = """plant = "pendulum"
[columns]
theta_1 = { column = "angle", offset = -3.141593 }
t = { column = "time" }
"""
SERVO = """plant = "pendulum"
[assumptions]
driven = true
[sensors.step]
theta_1 = 0.001534
"""
ARM = """plant = "pendulum"
[assumptions]
links = 2
driven = "both"
[input]
unit = "N m"
[columns]
v_in = { column = "tau1" }
v_in_2 = { column = "tau2" }
theta_1 = { column = "pos1" }
theta_2 = { column = "pos2" }
t = { column = "time" }
[sensors.step]
theta_1 = 0.0003815
theta_2 = 0.0003815
"""
ROBOT = """plant = "wheel_pendulum"
effects = ["coulomb_drive"]
[sensors]
encoder = "relative"
encoder_counts = 4496
"""
INVERSE_DYNAMICS_SERVO, LEAST_SQUARES_ARM, BACK_EMF = 0.116, 0.12, 0.546  # V s², N m s² (behind 5 Hz), V s/rad
MACHINES = {
    "axis": Machine(AXIS_FILE, AXIS, ("X1",), 0.97 * AXIS_MASS, 1.03 * AXIS_MASS),
    "free pendulum": Machine("free_pendulum/decay.csv", FREE_PENDULUM, ("X1",), 0.99 * 0.0156, 1.01 * 0.0156),
    "servo": Machine(
        "servo_pendulum/sin_sin_400.csv", SERVO, ("X1",), INVERSE_DYNAMICS_SERVO / 1.5, INVERSE_DYNAMICS_SERVO * 1.5
    ),
    "arm": Machine("dfki_arm/measured.csv", ARM, ("X1", "X3"), LEAST_SQUARES_ARM / 1.5, LEAST_SQUARES_ARM * 1.5),
    "robot with dry friction": Machine("mini_segway/balancing.csv", ROBOT, ("X6",), 0.85 * BACK_EMF, 1.15 * BACK_EMF),
}


@pytest.mark.parametrize(
    "machine", ["servo", *(pytest.param(m, marks=pytest.mark.slow) for m in MACHINES if m != "servo")]
)
def test_what_a_measured_machine_is_made_of_is_right_before_any_further_friction_is_in_the_model(machine):
    given = MACHINES[machine]
    if not (DATA / given.log).exists():
        pytest.skip("the measured logs are not here")
    found = identify(Model.parse(given.model), [DATA / given.log])
    assert given.lowest < sum(found.parameters[n].value for n in given.names) < given.highest
    assert found.remainder.force  # every real machine feels more than its model says
    assert all(row.sigma < abs(row.value) for name, row in found.parameters.items() if name in given.names)
