"""A shaft that a motor turns and that gravity leaves alone, as a motor on the bench with its encoder.

Sign convention: theta_m grows the way in which a positive input turns.
"""

from __future__ import annotations

from derive.lazy import sp
from derive.plant_signature import PlantWords, Sensor
from derive.records import Assumption, Body, Channel, Load, Parameter, Plant, Port, coordinate

PLANT_NAME = "shaft"
PLANT_ASSUMPTIONS = (
    Assumption("rate_sensor", False, (True, False), "Whether a sensor of its own reads the shaft's speed, dtheta_m."),
)
ENCODER = Sensor(aliases=("theta", "angle", "encoder", "shaft", "motor_pos"))
TACHOMETER = Sensor(aliases=("speed", "velocity", "vel", "omega", "rpm", "tacho"))
REFERENCE_PARAMETERS = {"X1": 0.005, "X2": 0.05}  # V s²/rad, V s/rad: 240 rad/s at 12 V, within 0.1 s
CONTROLLER_GAINS = (5.0, 0.0, 0.2)  # V/rad, none, V s/rad: 5 Hz, damping ratio 0.8


def build(assumptions: dict, free: tuple[str, ...] = ()) -> Plant:
    """State inertia, motor and sensors of the shaft."""
    fast = assumptions["rate_sensor"]
    shaft = coordinate("theta_m", "shaft")
    J, alpha, K_b = sp.symbols("J alpha K_b", positive=True)
    V = sp.Symbol("v_in", real=True)
    return Plant(
        name=PLANT_NAME,
        sentence="A shaft that a motor turns.",
        coordinates=(shaft,),
        bodies=(Body("shaft", sp.Integer(0), sp.zeros(3, 1), J, shaft.dq),),
        gravity=sp.zeros(3, 1),
        loads=(Load("motor", "drive", alpha * (V - K_b * shaft.dq)),),
        ports=(
            Port("drive", shaft.q, "between the housing and the shaft, through the motor"),
            Port("load", shaft.q, "between the shaft and the weight that hangs on it"),
            Port("outside", shaft.q, "between the shaft and what turns it from outside"),
        ),
        channels=(
            Channel("theta_m", shaft.q, "rad", ENCODER),
            *([Channel("dtheta_m", shaft.dq, "rad/s", TACHOMETER)] if fast else []),
        ),
        input=V,
        input_unit="V",
        scale=alpha,
        substitutions={},
        constants=(Parameter("alpha", "N m/V", "torque per volt"),),
        controlled=("theta_m", "dtheta_m" if fast else ""),
        reference="theta_m_ref",
        words=PlantWords(machine="shaft", controlled="angle"),
    )
