"""A pole on a cart that a motor drives along a level rail.

Sign convention: x grows the way in which a positive input pushes, theta_p is the pole's angle from upright and grows
when it leans that way.
"""

from __future__ import annotations

from derive.lazy import sp
from derive.plant_signature import PlantWords, Sensor
from derive.records import Body, Channel, Load, Parameter, Plant, Port, coordinate

PLANT_NAME = "cart_pole"
REFERENCE_PARAMETERS = {
    "X1": 1.1,
    "X2": 0.05,
    "X3": 0.0333,
    "X4": 0.49,
    "X5": 4.0,
}  # a cart of 1 kg, a pole of 0.1 kg and 1 m
KNOWN_CONSTANTS = {"gain": 1.0}


def build(assumptions: dict, free: tuple[str, ...] = ()) -> Plant:
    """State geometry, actuator and sensors of cart and pole."""
    cart, pole = coordinate("x", "cart", "m"), coordinate("theta_p", "pole")
    x, theta = cart.q, pole.q
    M, m, l, J, g, gain, K_b = sp.symbols("M m l J g gain K_b", positive=True)
    V = sp.Symbol("v_in", real=True)
    return Plant(
        name=PLANT_NAME,
        sentence="A pole balanced on a cart that a motor drives along a rail.",
        coordinates=(cart, pole),
        bodies=(
            Body("cart", M, sp.Matrix([x, 0, 0]), sp.Integer(0), sp.Integer(0)),
            Body("pole", m, sp.Matrix([x + l * sp.sin(theta), 0, l * sp.cos(theta)]), J, pole.dq),
        ),
        gravity=sp.Matrix([0, 0, -g]),
        loads=(Load("motor", "drive", gain * (V - K_b * cart.dq)),),
        ports=(
            Port("drive", x, "between rail and cart, through the motor", length_per_radian=0.05),
            Port("outside", x, "between the cart and what pushes or pulls it from outside", length_per_radian=0.05),
            Port("joint", theta, "between cart and pole"),
        ),
        channels=(
            Channel("x", x, "m", Sensor(aliases=("pos", "position", "cart", "slide", "axis", "qm"))),
            Channel("theta_p", theta, "rad", Sensor(aliases=("pitch", "tilt", "lean", "imu", "pole"))),
        ),
        input=V,
        input_unit="V",
        scale=gain,
        substitutions={},
        constants=(Parameter("gain", "N/V", "force on the cart per volt"),),
        controlled=("theta_p", ""),
        reference="theta_ref",
        range_channel="theta_p",
        words=PlantWords(
            machine="pole",
            stay="stay up",
            leaves="falls",
            left="fell over",
            failed="fell",
            strays="falls over",
            stands="stands",
            controlled="pole's angle",
            travels="cart moves",
        ),
    )
