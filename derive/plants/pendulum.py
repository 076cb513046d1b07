"""A pendulum of one or two links, swinging freely or driven at its suspension.

Sign convention: every angle is measured against the vertical, 0 hanging down, and grows the way in which a positive
input turns. Where nothing drives it, forces are counted in units of what gravity holds the first link with when it is
level: no log of free swinging tells more.
"""

from __future__ import annotations

from derive.lazy import sp
from derive.plant_signature import PlantWords, Sensor
from derive.records import Assumption, Body, Channel, Load, Parameter, Plant, Port, coordinate

PLANT_NAME = "pendulum"
PLANT_ASSUMPTIONS = (
    Assumption("links", 1, (1, 2), "How many links swing, the second hung on the end of the first."),
    Assumption("driven", False, (True, False), "Whether a motor turns the first link against its suspension."),
    Assumption(
        "second_encoder",
        "relative",
        ("absolute", "relative"),
        "Whether theta_2 is the second link's angle against the vertical or against the first link.",
    ),
)
FIRST_ENCODER = Sensor(aliases=("theta", "angle", "position", "encoder", "q1", "qm", "pos"))
SECOND_ENCODER = Sensor(aliases=("theta2", "angle2", "encoder2", "elbow", "q2"))
REFERENCE_PARAMETERS = {"X1": 0.068}  # s², of a rod a metre long that swings freely


def build(assumptions: dict, free: tuple[str, ...] = ()) -> Plant:
    """State geometry, actuator and encoders of the pendulum."""
    two, driven = assumptions["links"] == 2, assumptions["driven"]
    first, second = coordinate("theta_1", "first"), coordinate("theta_2", "second")
    m_1, m_2, a_1, a_2, l_1, J_1, J_2, g = sp.symbols("m_1 m_2 a_1 a_2 l_1 J_1 J_2 g", positive=True)
    alpha, K_b, G = sp.symbols("alpha K_b G", positive=True)  # G: what gravity holds the level first link with
    V = sp.Symbol("v_in", real=True)
    q_1, q_2 = first.q, second.q
    hung = m_2 if two else sp.Integer(0)
    tip = l_1 * sp.Matrix([sp.sin(q_1), 0, -sp.cos(q_1)])
    bodies = [Body("first link", m_1, a_1 * sp.Matrix([sp.sin(q_1), 0, -sp.cos(q_1)]), J_1, first.dq)]
    ports = [
        Port("drive", q_1, "between the suspension and the first link"),
        Port("outside", q_1, "between the first link and what pushes or pulls it from outside"),
    ]
    channels = [Channel("theta_1", q_1, "rad", FIRST_ENCODER)]
    if two:
        place = tip + a_2 * sp.Matrix([sp.sin(q_2), 0, -sp.cos(q_2)])
        bodies.append(Body("second link", m_2, place, J_2, second.dq))
        ports.append(Port("joint", q_2 - q_1, "between the first link and the second"))
        relative = assumptions["second_encoder"] == "relative"
        channels.append(Channel("theta_2", q_2 - q_1 if relative else q_2, "rad", SECOND_ENCODER))
    return Plant(
        name=PLANT_NAME,
        sentence=f"A pendulum of {'two links' if two else 'one link'}, {'driven' if driven else 'swinging freely'}.",
        coordinates=(first, second) if two else (first,),
        bodies=tuple(bodies),
        gravity=sp.Matrix([0, 0, -g]),
        loads=(Load("motor", "drive", alpha * (V - K_b * first.dq)),) if driven else (),
        ports=tuple(ports),
        channels=tuple(channels),
        input=V,
        input_unit="V" if driven else "1",
        scale=alpha if driven else G,
        substitutions={} if driven else {m_1: (G / g - hung * l_1) / a_1},
        constants=(Parameter("alpha", "N m/V", "torque per volt"),) if driven else (),
        controlled=("theta_1", "") if driven else ("", ""),
        reference="theta_1_ref" if driven else "",
        words=PlantWords(machine="pendulum", works="the motor works" if driven else "it swings"),
    )
