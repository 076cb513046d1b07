"""A lever that a motor at its foot holds upright: one coordinate, a current, and names that no shipped plant has."""

import sympy as sp

from derive.plant_signature import Sensor
from derive.records import Body, Channel, Load, Parameter, Plant, Port, coordinate

PLANT_NAME = "lever"
REFERENCE_PARAMETERS = {"X1": 0.05, "X2": 1.2, "X3": 0.4}
KNOWN_CONSTANTS = {"k_m": 0.08}
CONTROLLER_GAINS = (6.0, 4.0, 0.9)


def build(assumptions, free=()):
    lever = coordinate("phi", "lever")
    m, l, J, K, k_m, g = sp.symbols("m l J K k_m g", positive=True)
    current = sp.Symbol("tau", real=True)
    tip = l * sp.Matrix([sp.sin(lever.q), 0, sp.cos(lever.q)])
    return Plant(
        name=PLANT_NAME,
        sentence="A lever that a motor at its foot holds upright.",
        coordinates=(lever,),
        bodies=(Body("lever", m, tip, J, lever.dq),),
        gravity=sp.Matrix([0, 0, -g]),
        loads=(Load("motor", "drive", k_m * (current - K * lever.dq)),),
        ports=(Port("drive", lever.q, "between foot and lever, through the motor"),),
        channels=(
            Channel("phi", lever.q, "rad", Sensor(noise_key="resolver_noise", counts_key="resolver_counts")),
            Channel("spin", lever.dq, "rad/s"),
        ),
        input=current,
        input_unit="A",
        scale=k_m,
        substitutions={},
        constants=(Parameter("k_m", "N m/A", "torque per ampere"),),
        controlled=("phi", "spin"),
        reference="phi_wanted",
        range_channel="phi",
    )
