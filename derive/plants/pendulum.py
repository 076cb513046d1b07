"""A pendulum of one or two links, swinging freely or driven at its suspension, between its links, or at both.

Sign convention: every angle is measured against the vertical, 0 hanging down, and grows the way in which a positive
input turns. Where nothing drives it, forces are counted in units of what gravity holds the first link with when it is
level: no log of free swinging tells more.
"""

from __future__ import annotations

from derive.lazy import sp
from derive.plant_signature import GYRO, PlantWords, Sensor
from derive.records import Assumption, Body, Channel, Coordinate, Load, Parameter, Plant, Port, coordinate

PLANT_NAME = "pendulum"
SECOND_LINK = (("second", "links", 2), ("both", "links", 2))  # choices that need one
PLANT_ASSUMPTIONS = (
    Assumption("links", 1, (1, 2), "How many links swing, the second hung on the end of the first."),
    Assumption(
        "driven",
        False,
        (True, False, "second", "both"),
        "Whether a motor turns the first link against its suspension (input v_in), the second against the first "
        "(v_in_2), or one each does.",
        needs=SECOND_LINK,
    ),
    Assumption(
        "second_encoder",
        "relative",
        ("absolute", "relative"),
        "Whether theta_2 is the second link's angle against the vertical or against the first link.",
    ),
    Assumption(
        "rate_sensor",
        False,
        (True, False, "second", "both"),
        "Whether a gyro on the first link reads its rate, dtheta_1, on the second dtheta_2, or one on each; both "
        "against the vertical.",
        needs=SECOND_LINK,
    ),
)
FIRST_ENCODER = Sensor(aliases=("theta", "angle", "position", "encoder", "q1", "qm", "pos"))
SECOND_ENCODER = Sensor(aliases=("theta2", "angle2", "encoder2", "elbow", "q2", "pos2"))
FIRST_GYRO = Sensor(kind=GYRO, aliases=("gyro", "gyro1", "angular_velocity", "rate"))
SECOND_GYRO = Sensor(aliases=("gyro2", "angular_velocity2", "rate2"))
REFERENCE_PARAMETERS = {"X1": 0.068}  # s², of a rod a metre long that swings freely
INPUT, SECOND_INPUT = "v_in", "v_in_2"  # columns


def build(assumptions: dict, free: tuple[str, ...] = ()) -> Plant:
    """State geometry, actuators and sensors of the pendulum."""
    two, motors = assumptions["links"] == 2, motors_of(assumptions)
    first, second = coordinate("theta_1", "first"), coordinate("theta_2", "second")
    alpha, G = sp.symbols("alpha G", positive=True)  # G: what gravity holds the level first link with
    names = [INPUT if port == "drive" else SECOND_INPUT for port in motors] or [INPUT]
    inputs = tuple(sp.Symbol(name, real=True) for name in names)
    controlled = controlled_of(assumptions)
    return Plant(
        name=PLANT_NAME,
        sentence=sentence_of(assumptions),
        coordinates=(first, second) if two else (first,),
        bodies=links(first, second, two),
        gravity=sp.Matrix([0, 0, -sp.Symbol("g", positive=True)]),
        loads=tuple(motor(port, u, first, second) for port, u in zip(motors, inputs, strict=False)),
        ports=ports(first, second, two),
        channels=channels(assumptions, first, second),
        input=inputs[0],
        further=inputs[1:],
        input_unit="V" if motors else "1",
        scale=alpha if motors else G,
        substitutions={} if motors else held_by_gravity(two),
        constants=(Parameter("alpha", "N m/V", "torque per volt"),) if motors else (),
        controlled=controlled,
        reference=f"{controlled[0]}_ref" if motors else "",
        words=PlantWords(
            machine="pendulum",
            works={0: "it swings", 1: "the motor works", 2: "the motors work"}[len(motors)],
        ),
    )


def motors_of(assumptions: dict) -> tuple[str, ...]:
    """Ports that a motor turns."""
    return {False: (), True: ("drive",), "second": ("joint",), "both": ("drive", "joint")}[assumptions["driven"]]


def sentence_of(assumptions: dict) -> str:
    """The pendulum in a sentence."""
    how = {False: "swinging freely", True: "driven", "second": "driven at the second joint",
           "both": "driven at both joints"}[assumptions["driven"]]  # fmt: skip
    return f"A pendulum of {'two links' if assumptions['links'] == 2 else 'one link'}, {how}."


def links(first: Coordinate, second: Coordinate, two: bool) -> tuple[Body, ...]:
    """One link, or two: mass, centre of mass at a distance from the joint, inertia about it."""
    m_1, m_2, a_1, a_2, l_1, J_1, J_2 = sp.symbols("m_1 m_2 a_1 a_2 l_1 J_1 J_2", positive=True)
    along_first, along_second = (sp.Matrix([sp.sin(c.q), 0, -sp.cos(c.q)]) for c in (first, second))
    upper = Body("first link", m_1, a_1 * along_first, J_1, first.dq)
    return (
        (upper, Body("second link", m_2, l_1 * along_first + a_2 * along_second, J_2, second.dq)) if two else (upper,)
    )


def held_by_gravity(two: bool) -> dict:
    """The first link's mass by what gravity holds it with when it is level, with the second link on its end."""
    m_2, a_1, l_1, g, G, m_1 = sp.symbols("m_2 a_1 l_1 g G m_1", positive=True)
    return {m_1: (G / g - (m_2 if two else 0) * l_1) / a_1}


def motor(port: str, voltage: sp.Symbol, first: Coordinate, second: Coordinate) -> Load:
    """A motor with its back-EMF; both motors give the same torque per volt."""
    alpha, K_1, K_2 = sp.symbols("alpha K_b K_2", positive=True)
    back_emf = K_1 * first.dq if port == "drive" else K_2 * (second.dq - first.dq)
    return Load("motor" if port == "drive" else "second motor", port, alpha * (voltage - back_emf))


def ports(first: Coordinate, second: Coordinate, two: bool) -> tuple[Port, ...]:
    """The suspension, the first link from outside, and the joint of two links."""
    return (
        Port("drive", first.q, "between the suspension and the first link"),
        Port("outside", first.q, "between the first link and what pushes or pulls it from outside"),
        *([Port("joint", second.q - first.q, "between the first link and the second")] if two else []),
    )


def channels(assumptions: dict, first: Coordinate, second: Coordinate) -> tuple[Channel, ...]:
    """Readings of the encoders and of the gyros."""
    two, gyro = assumptions["links"] == 2, assumptions["rate_sensor"]
    bent = second.q - first.q if assumptions["second_encoder"] == "relative" else second.q
    found = [Channel("theta_1", first.q, "rad", FIRST_ENCODER)]
    found += [Channel("theta_2", bent, "rad", SECOND_ENCODER)] if two else []
    found += [Channel("dtheta_1", first.dq, "rad/s", FIRST_GYRO)] if gyro in (True, "both") else []
    found += [Channel("dtheta_2", second.dq, "rad/s", SECOND_GYRO)] if gyro in ("second", "both") else []
    return tuple(found)


def controlled_of(assumptions: dict) -> tuple[str, str]:
    """Channels of the angle that a controller holds, that of a link with a motor, and of its rate."""
    driven, gyro = assumptions["driven"], assumptions["rate_sensor"]
    if not driven:
        return "", ""
    if driven == "second":
        reads_rate = gyro in ("second", "both") and assumptions["second_encoder"] == "absolute"
        return "theta_2", "dtheta_2" if reads_rate else ""
    return "theta_1", "dtheta_1" if gyro in (True, "both") else ""
