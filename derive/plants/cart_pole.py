"""A pole on a cart that a motor drives along a level rail.

Sign convention: x grows the way in which a positive input pushes, theta_p is the pole's angle from upright and grows
when it leans that way.
"""

from __future__ import annotations

from derive.lazy import sp
from derive.plant_signature import GYRO, PlantWords, Sensor
from derive.records import Assumption, Body, Channel, Coordinate, Load, Parameter, Plant, Port, coordinate

PLANT_NAME = "cart_pole"
PLANT_ASSUMPTIONS = (
    Assumption(
        "range",
        "upright",
        ("upright", "any"),
        "Whether the pole stays within ±π/2 of upright, beyond which it fell, or may be at any angle: a swing-up.",
    ),
    Assumption(
        "rate_sensor",
        False,
        (True, False, "cart", "both"),
        "Whether a gyro on the pole reads its rate, dtheta_p, a sensor on the cart its speed, dx, or both.",
    ),
)
REFERENCE_PARAMETERS = {
    "X1": 1.1,
    "X2": 0.05,
    "X3": 0.0333,
    "X4": 0.49,
    "X5": 4.0,
}  # a cart of 1 kg, a pole of 0.1 kg and 1 m
KNOWN_CONSTANTS = {"gain": 1.0}
CART_SENSOR = Sensor(aliases=("pos", "position", "cart", "slide", "axis", "qm"))
POLE_SENSOR = Sensor(aliases=("pitch", "tilt", "lean", "imu", "pole"))
POLE_GYRO = Sensor(kind=GYRO, aliases=("gyro", "angular_velocity", "pole_rate", "rate"))
CART_SPEED_SENSOR = Sensor(aliases=("speed", "velocity", "vel"))
WORDS_ANYWHERE = PlantWords(machine="pole", controlled="pole's angle", travels="cart moves")
WORDS_UPRIGHT = WORDS_ANYWHERE.upright()


def build(assumptions: dict, free: tuple[str, ...] = ()) -> Plant:
    """State geometry, actuator and sensors of cart and pole."""
    cart, pole = coordinate("x", "cart", "m"), coordinate("theta_p", "pole")
    x, theta = cart.q, pole.q
    M, m, l, J, g, gain, K_b = sp.symbols("M m l J g gain K_b", positive=True)
    V = sp.Symbol("v_in", real=True)
    upright = assumptions["range"] == "upright"
    return Plant(
        name=PLANT_NAME,
        sentence=f"A pole {'balanced' if upright else 'hinged'} on a cart that a motor drives along a rail.",
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
        channels=channels(assumptions, cart, pole),
        input=V,
        input_unit="V",
        scale=gain,
        substitutions={},
        constants=(Parameter("gain", "N/V", "force on the cart per volt"),),
        controlled=("theta_p", "dtheta_p" if assumptions["rate_sensor"] in (True, "both") else ""),
        reference="theta_ref",
        range_channel="theta_p" if upright else "",
        words=WORDS_UPRIGHT if upright else WORDS_ANYWHERE,
    )


def channels(assumptions: dict, cart: Coordinate, pole: Coordinate) -> tuple[Channel, ...]:
    """Readings of the sensors of place and angle, and of their rates where there are such sensors."""
    fast = assumptions["rate_sensor"]
    found = [Channel("x", cart.q, "m", CART_SENSOR), Channel("theta_p", pole.q, "rad", POLE_SENSOR)]
    found += [Channel("dtheta_p", pole.dq, "rad/s", POLE_GYRO)] if fast in (True, "both") else []
    found += [Channel("dx", cart.dq, "m/s", CART_SPEED_SENSOR)] if fast in ("cart", "both") else []
    return tuple(found)
