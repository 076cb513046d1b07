"""A carriage that a motor drives along a level rail, as an axis of a machine tool (Janot, Gautier, Brunot 2019).

Sign convention: x grows the way in which a positive input pushes.
"""

from __future__ import annotations

from derive.lazy import sp
from derive.plant_signature import PlantWords, Sensor
from derive.records import Assumption, Body, Channel, Load, Parameter, Plant, Port, coordinate

PLANT_NAME = "slide"
PLANT_ASSUMPTIONS = (
    Assumption("rate_sensor", False, (True, False), "Whether a sensor of its own reads the carriage's speed, dx."),
)
REFERENCE_PARAMETERS = {"X1": 2.7058}  # V s²/m: 95.11 kg at 35.15 N/V
KNOWN_CONSTANTS = {"gain": 35.1507}
CONTROLLER_GAINS = (38996.0, 0.0, 243.45)  # of the published loop: kp kv [V/m], none, kv [V s/m]


def build(assumptions: dict, free: tuple[str, ...] = ()) -> Plant:
    """State geometry, actuator and sensor of the carriage."""
    fast = assumptions["rate_sensor"]
    carriage = coordinate("x", "carriage", "m")
    M, gain = sp.symbols("M gain", positive=True)
    V = sp.Symbol("v_in", real=True)
    return Plant(
        name=PLANT_NAME,
        sentence="A carriage that a motor drives along a rail.",
        coordinates=(carriage,),
        bodies=(Body("carriage", M, sp.Matrix([carriage.q, 0, 0]), sp.Integer(0), sp.Integer(0)),),
        gravity=sp.Matrix([0, 0, 0]),
        loads=(Load("motor", "drive", gain * V),),
        ports=(
            Port("drive", carriage.q, "between rail and carriage, through motor and screw", length_per_radian=0.01),
            Port(
                "outside",
                carriage.q,
                "between the carriage and what pushes or pulls it from outside",
                length_per_radian=0.01,
            ),
        ),
        channels=(
            Channel("x", carriage.q, "m", Sensor(aliases=("pos", "position", "cart", "slide", "axis", "qm"))),
            *([Channel("dx", carriage.dq, "m/s", Sensor(aliases=("speed", "velocity", "vel")))] if fast else []),
        ),
        input=V,
        input_unit="V",
        scale=gain,
        substitutions={},
        constants=(Parameter("gain", "N/V", "force on the carriage per volt"),),
        controlled=("x", "dx" if fast else ""),
        reference="x_ref",
        words=PlantWords(machine="carriage", controlled="position"),
    )
