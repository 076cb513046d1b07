"""The wheel-driven inverted pendulum of Peng, Cheng and Tsai (Electronics 2023, 12, 4569).

Sign convention: θw grows when the wheels roll forward, θp grows when the body leans forward, both measured against the
vertical. Positions are in the frame of the track (x forward along it, z away from it), tilted uphill by γ.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from derive.lazy import sp
from derive.plant_signature import GYRO, LEADS, PlantWords, Reversal, Sensor
from derive.records import (
    Assumption,
    Body,
    Channel,
    Coordinate,
    Heading,
    Load,
    ModelTemplate,
    Parameter,
    Plant,
    Port,
    coordinate,
)

PLANT_NAME = "wheel_pendulum"

PLANT_ASSUMPTIONS = (
    Assumption(
        "planar",
        True,
        (True, False),
        "Whether the robot keeps its heading. If not, left and right motor have a voltage each, v_left and v_right, "
        "and a gyro reads the yaw rate, dpsi.",
    ),
    Assumption(
        "ground_friction_reaction",
        "body",
        ("body", "none"),
        "Whether the friction between wheels and ground, f_w, also pushes the body (the paper's eq. 13); "
        "'none' is what virtual work gives.",
    ),
    Assumption(
        "ground_friction",
        True,
        (True, False),
        "Whether viscous friction acts between wheels and ground, f_w; without it X6 = X7, the drive's damping alone.",
    ),
    Assumption("rotor_inertia", True, (True, False), "Whether the motors' rotors, geared up by ε, carry inertia."),
    Assumption(
        "rotor_speed",
        "body",
        ("body", "world"),
        "Whether a rotor's kinetic energy counts its speed against the body (the paper's eq. 1) or against the world.",
    ),
    Assumption(
        "gear_ratio_in_back_emf",
        "once",
        ("once", "twice"),
        "Whether the back-EMF sees the wheel's speed (the paper's eq. 12) or the rotor's, ε times as fast.",
    ),
    Assumption(
        "motor_circuit",
        "static",
        ("static", "dynamic"),
        "Whether the current follows the voltage at once (the paper's eq. 7) or through the windings' inductance (its "
        "eq. 5 in full); 'dynamic' is the effect winding_inductance.",
        implies=(("dynamic", "winding_inductance"),),
    ),
    Assumption(
        "range",
        "upright",
        ("upright", "any"),
        "Whether the body stays within ±π/2 of upright, beyond which it fell over, or may be at any angle, as in a "
        "swing-up.",
    ),
    Assumption(
        "gyro",
        True,
        (True, False),
        "Whether a gyro reads the body's rate, dtheta_p, or a log has the pitch alone.",
    ),
    Assumption(
        "rate_sensor",
        False,
        (True, False),
        "Whether a sensor of its own reads the wheel's speed, dtheta_w, against what theta_w is measured against.",
    ),
    Assumption(
        "encoder",
        "absolute",
        ("absolute", "relative"),
        "Whether theta_w is the wheel's angle against the vertical or against the body; set in [sensors].",
        section="sensors",
    ),
)

REFERENCE_PARAMETERS = {
    "X1": 0.0436,
    "X2": 0.0178,
    "X3": 0.1149,
    "X4": 0.8719,
    "X5": 4.6701,
    "X6": 0.7268,
    "X7": 0.7256,
}  # Table 1
KNOWN_CONSTANTS = {
    "R": 0.2413,
    "g": 9.81,
    "alpha": 165.42,
    "J_w": 0.1339,
    "L": 0.716,
}  # paper, section 4; alpha from (12)

CONTROLLER_GAINS = (-168.0, -800.0, -8.8)  # of the paper's PID on the pitch [V/rad, V/(rad s), V s/rad]

INPUT, REFERENCE, RANGE_CHANNEL = "v_in", "theta_ref", "theta_p"  # columns
UNITS = {"t": "s", "theta_w": "rad", "theta_p": "rad", "dtheta_p": "rad/s", INPUT: "V", REFERENCE: "rad"}  # of columns
RATES = {"dtheta_p": "theta_p"}  # channels that are rates of others
HALF_A_DEGREE = math.radians(0.5)  # noise of the paper's IMU [rad, rad/s] (section 4)
SENSORS = {
    "theta_w": Sensor(
        step=2 * math.pi / 4096,  # of an encoder of which nothing is known
        counts_key="encoder_counts",
        aliases=("wheel", "encoder", "enc", "position"),
        finer="an encoder with ten times the counts",
        truer="a second encoder that is known to be true",
        still="The wheel stands still",
    ),
    "theta_p": Sensor(
        noise=HALF_A_DEGREE,
        noise_key="pitch_noise",
        aliases=("pitch", "tilt", "lean", "imu", "pole"),
        finer="a pitch sensor with a tenth of the noise",
        truer="an absolute reference of the pitch (an inclinometer, a camera), as noisy as the present one",
    ),
    "dtheta_p": Sensor(
        noise=HALF_A_DEGREE,
        noise_key="rate_noise",
        aliases=("gyro", "pitch_rate", "dpitch", "angular_velocity.y", "angular_velocity", "rate"),
        kind=GYRO,
        finer="a gyro with a tenth of the noise",
        truer="a second gyro whose zero and scale are known",
    ),
}
WORDS_ANYWHERE = PlantWords(
    machine="robot",
    works="the motors work",
    controlled="pitch",
    sensed="angle, pitch or rate",
    travels="wheels turn",
)
WORDS = WORDS_ANYWHERE.upright()
WIRING_CHECK = "wheels_and_body"
USUAL_LIMITS = (0.4, 24.0)  # rad, V: of the paper's commands
REVERSALS = (
    Reversal("robot", "Turn the robot round on the same ground", geometry=("track_slope",)),
    Reversal(
        "sensor",
        "Turn the pitch sensor round in its holder, its readings negated for controller and log,",
        channels=("theta_p", "dtheta_p"),
    ),
    LEADS._replace(
        instruction="Swap the two leads of every motor, the voltage negated behind the controller but not in the log,"
    ),
)
MODEL_TEMPLATE = ModelTemplate(
    numbers="the paper's Table 1",
    sensors="""\
[sensors]
encoder = "absolute"                   # or "relative": theta_w is then wheel minus body
encoder_counts = 60000                 # per revolution; 0 where unknown
pitch_noise = "auto"                   # standard deviation [rad], or "auto": from the data
rate_noise = "auto"                    # [rad/s]
""",
    column='theta_p = { column = "pitch_deg", unit = "deg" }',
    simulation="""\
pitch_noise = 0.008726646259971648     # 0.5 deg, standard deviation [rad]
rate_noise = 0.008726646259971648      # 0.5 deg/s [rad/s]""",
)


def internal_coordinates() -> dict[str, Coordinate]:
    """Internal coordinates that effects may release, by name."""
    return {
        "twist": coordinate("twist", "shaft"),  # of the motor's side of the drive against the wheel
        "creep": coordinate("creep", "contact"),  # of the wheel against the ground: it rolls, less this
        "slosh_angle": coordinate("slosh_angle", "pendulum"),  # of what hangs in the body, against the vertical
        "filtered_speed": coordinate("followed", "filter"),  # of a sensor's filter: its rate is the speed behind it
    }


class Motion(NamedTuple):
    """Angles and their rates; zero where something is rigid, or where the robot keeps its heading."""

    theta_w: sp.Expr
    dtheta_w: sp.Expr
    theta_p: sp.Expr
    dtheta_p: sp.Expr
    psi: sp.Expr
    dpsi: sp.Expr
    twist: sp.Expr
    dtwist: sp.Expr
    creep: sp.Expr
    slosh: sp.Expr
    dslosh: sp.Expr

    @property
    def slip(self) -> sp.Expr:
        """Speed of the motors' side of the drive against the body."""
        return self.dtheta_w + self.dtwist - self.dtheta_p

    @property
    def dlead(self) -> sp.Expr:
        """Speed of the right wheel above the mean of both [rad/s], of the left one below it."""
        W, R = sp.symbols("W R", positive=True)
        return W / (2 * R) * self.dpsi

    @property
    def axle(self) -> sp.Matrix:
        """Middle of the axle, in the frame of the track."""
        R = sp.Symbol("R", positive=True)
        return sp.Matrix([R * (self.theta_w - self.creep), 0, R])


def build(assumptions: dict, free: tuple[str, ...] = ()) -> Plant:
    """State geometry, actuator and sensors of the robot; internal coordinates that are not in ``free`` are rigid."""
    yaws, upright = not assumptions["planar"], assumptions["range"] == "upright"
    wheel, pitch, yaw = coordinate("theta_w", "wheel"), coordinate("theta_p", "body"), coordinate("psi", "yaw")
    internal = internal_coordinates()
    moving = [(c.q, c.dq) if name in free else (sp.Integer(0), sp.Integer(0)) for name, c in internal.items()]
    (twist, dtwist), (creep, _), (slosh, dslosh), _ = moving
    psi, dpsi = (yaw.q, yaw.dq) if yaws else (sp.Integer(0), sp.Integer(0))
    motion = Motion(wheel.q, wheel.dq, pitch.q, pitch.dq, psi, dpsi, twist, dtwist, creep, slosh, dslosh)
    names = ("v_left", "v_right") if yaws else (INPUT, INPUT)
    V_left, V_right = (sp.Symbol(name, real=True) for name in names)
    g, alpha, epsilon, K_t, R_m = sp.symbols("g alpha epsilon K_t R_m", positive=True)
    gamma = slope_of(assumptions)
    return Plant(
        name=PLANT_NAME,
        sentence="A body balancing on two coaxial wheels that it drives itself.",
        coordinates=(wheel, pitch, yaw) if yaws else (wheel, pitch),
        bodies=(*bodies(assumptions, motion), *(sloshing_body(assumptions, motion) if "slosh_angle" in free else [])),
        gravity=-g * sp.Matrix([sp.sin(gamma), 0, sp.cos(gamma)]),
        loads=(*loads(assumptions, motion, V_left, V_right), *(slosh_damping(motion) if "slosh_angle" in free else [])),
        ports=ports(motion, yaws, "slosh_angle" in free),
        channels=channels(assumptions, motion),
        input=V_left,
        further=(V_right,) if yaws else (),
        heading=Heading(yaw, motion.axle) if yaws else None,
        input_unit="V",
        scale=alpha,
        substitutions={K_t: alpha * R_m / (2 * epsilon)},  # alpha = 2 ε K_t / R_m (paper eq. 12)
        constants=constants(yaws),
        geometry=geometry_symbols(yaws),
        internal={} if yaws else internal,
        free=free,
        controlled=("theta_p", "dtheta_p" if assumptions["gyro"] else ""),
        reference=REFERENCE,
        range_channel=RANGE_CHANNEL if upright else "",
        words=WORDS if upright else WORDS_ANYWHERE,
        usual_limits=USUAL_LIMITS if upright else None,
        reversals=REVERSALS,
        wiring_check=WIRING_CHECK if assumptions["gyro"] and not yaws else "",
    )


def slope_of(assumptions: dict) -> sp.Expr:
    """Tilt of the track, which is level for a robot that turns: a slope would turn with the heading."""
    return sp.Symbol("track_slope", real=True) if assumptions["planar"] else sp.Integer(0)


def bodies(assumptions: dict, motion: Motion) -> list[Body]:
    """Wheels, body and the motors' rotors."""
    m, M, L, W = sp.symbols("m M L W", positive=True)
    J_w, J_b, J_m, epsilon = sp.symbols("J_w J_b J_m epsilon", positive=True)
    J_x, J_z, J_t = sp.symbols("J_x J_z J_t", positive=True)  # of the body about its other axes, of a wheel's turning
    delta, payload = sp.symbols("com_angle payload", real=True)
    axle, dlead = motion.axle, motion.dlead
    tilt = motion.theta_p + delta + slope_of(assumptions)  # body's centre of mass against the normal of the track
    base_rate = motion.dtheta_p if assumptions["rotor_speed"] == "world" else 0
    left_rotor, right_rotor = (epsilon * (motion.slip + difference) + base_rate for difference in (-dlead, dlead))
    rotor_inertia = J_m if assumptions["rotor_inertia"] else sp.Integer(0)
    turning = [] if assumptions["planar"] else yawing_bodies(axle, motion.theta_p, motion.dpsi, (2 * J_t, J_x, J_z))
    centre = axle + L * sp.Matrix([sp.sin(tilt), 0, sp.cos(tilt)])
    return [
        Body("left wheel", m, axle + sp.Matrix([0, W / 2, 0]), J_w, motion.dtheta_w - dlead),
        Body("right wheel", m, axle - sp.Matrix([0, W / 2, 0]), J_w, motion.dtheta_w + dlead),
        Body("body", M * (1 + payload), centre, J_b, motion.dtheta_p),
        Body("left rotor", sp.Integer(0), axle, rotor_inertia, left_rotor),
        Body("right rotor", sp.Integer(0), axle, rotor_inertia, right_rotor),
        *turning,
    ]


def yawing_bodies(axle: sp.Matrix, pitch: sp.Symbol, rate: sp.Symbol, inertias: tuple) -> list[Body]:
    """Rotation about the vertical: of both wheels, and of the body about its own forward and upward axes."""
    of_wheels, forward, upward = inertias
    return [
        Body("wheels turning", sp.Integer(0), axle, of_wheels, rate),
        Body("body turning, about its forward axis", sp.Integer(0), axle, forward, rate * sp.sin(pitch)),
        Body("body turning, about its upward axis", sp.Integer(0), axle, upward, rate * sp.cos(pitch)),
    ]


def sloshing_body(assumptions: dict, motion: Motion) -> list[Body]:
    """Equivalent pendulum of the slosh: a share of the body's mass on a rod, from a pivot above the axle."""
    M = sp.Symbol("M", positive=True)
    hung, height, length = sp.symbols("slosh_mass slosh_height slosh_length", real=True)
    gamma = slope_of(assumptions)
    body, rod = motion.theta_p + gamma, motion.slosh + gamma
    pivot = motion.axle + height * sp.Matrix([sp.sin(body), 0, sp.cos(body)])
    bob = pivot - length * sp.Matrix([sp.sin(rod), 0, sp.cos(rod)])
    return [Body("pendulum", hung * M, bob, sp.Integer(0), motion.dslosh)]


def loads(assumptions: dict, motion: Motion, V_left: sp.Symbol, V_right: sp.Symbol) -> list[Load]:
    """Motors and friction: both wheels together drive the robot, their difference turns it.

    The work of the one is done on the mean angle of the wheels, of the other on the yaw.
    """
    W, R, f_m, f_w = sp.symbols("W R f_m f_w", positive=True)
    arm = W / (2 * R)
    left, right = (
        torque(assumptions, V_left, motion.slip - motion.dlead),
        torque(assumptions, V_right, motion.slip + motion.dlead),
    )
    reaction = "axle" if assumptions["ground_friction_reaction"] == "body" else "ground"
    driving = [Load("motors", "drive", left + right), Load("gearbox friction", "drive", -2 * f_m * motion.slip)]
    turning = [
        Load("motors' difference", "turn", arm * (right - left)),
        Load("gearbox friction", "turn", -2 * f_m * arm * motion.dlead),
    ]
    if assumptions["ground_friction"]:
        driving.append(Load("ground friction", reaction, -2 * f_w * motion.dtheta_w))
        turning.append(Load("ground friction", "turn", -2 * f_w * arm * motion.dlead))
    return driving if assumptions["planar"] else driving + turning


def torque(assumptions: dict, V: sp.Symbol, slip: sp.Expr) -> sp.Expr:
    """Torque ε K_t i of a motor on its wheel: i R_m + K_b ω = V (paper eq. 7)."""
    epsilon, K_t, K_b, R_m = sp.symbols("epsilon K_t K_b R_m", positive=True)
    gear = epsilon if assumptions["gear_ratio_in_back_emf"] == "twice" else 1
    return epsilon * K_t * (V - K_b * gear * slip) / R_m


def slosh_damping(motion: Motion) -> list[Load]:
    """Viscous damping of the slosh against the body."""
    M = sp.Symbol("M", positive=True)
    hung, length, decay = sp.symbols("slosh_mass slosh_length slosh_decay", real=True)
    return [Load("pendulum", "pendulum", -decay * hung * M * length**2 * (motion.dslosh - motion.dtheta_p))]


def ports(motion: Motion, yaws: bool, sloshes: bool) -> tuple[Port, ...]:
    """Ports on which forces do work."""
    theta_w, theta_p = motion.theta_w, motion.theta_p
    return (
        Port("drive", theta_w + motion.twist - theta_p, "between wheel and body, through motor and gearbox"),
        Port("axle", theta_w - theta_p, "between wheel and body, at the axle"),
        Port("ground", theta_w, "between wheel and ground"),
        Port("body", theta_p, "between body and the world"),
        Port("outside", theta_w, "between the robot and what pushes or pulls it from outside"),
        *([Port("turn", motion.psi, "between the robot and the ground, about the vertical")] if yaws else []),
        *([Port("pendulum", motion.slosh - theta_p, "between the body and what hangs in it")] if sloshes else []),
    )


def channels(assumptions: dict, motion: Motion) -> tuple[Channel, ...]:
    """Ideal readings of encoder and gyros."""
    relative = assumptions["encoder"] == "relative"
    base, base_rate = (motion.theta_p, motion.dtheta_p) if relative else (0, 0)
    speed = Channel("dtheta_w", motion.dtheta_w - base_rate, "rad/s", Sensor(aliases=("wheel_speed", "wheel_vel")))
    return (
        Channel("theta_w", motion.theta_w - base, "rad", SENSORS["theta_w"]),
        Channel("theta_p", motion.theta_p, "rad", SENSORS["theta_p"]),
        *([Channel("dtheta_p", motion.dtheta_p, "rad/s", SENSORS["dtheta_p"])] if assumptions["gyro"] else []),
        *([speed] if assumptions["rate_sensor"] else []),
        *([] if assumptions["planar"] else [Channel("dpsi", motion.dpsi, "rad/s")]),
    )


def constants(yaws: bool) -> tuple[Parameter, ...]:
    """Numbers that are measured by themselves, never identified."""
    return (
        Parameter("R", "m", "wheel radius"),
        Parameter("g", "m/s²", "gravity"),
        Parameter("alpha", "N m/V", "torque of both motors per volt (paper eq. 12)"),
        Parameter("J_w", "kg m²", "inertia of one wheel about its axle"),
        Parameter("L", "m", "height of the body's centre of mass above the axle"),
        Parameter("epsilon", "1", "gear ratio"),
        *([Parameter("W", "m", "distance of the wheels")] if yaws else []),
    )


def geometry_symbols(yaws: bool) -> dict[str, sp.Symbol]:
    """Symbols of the geometry's deviations, each zero unless an effect states it."""
    anywhere = ("com_angle", "payload")
    on_a_track = (
        "track_slope",
        "slosh_mass",
        "slosh_height",
        "slosh_length",
        "slosh_decay",
    )  # of a robot that keeps its heading
    return {name: sp.Symbol(name, real=True) for name in (*anywhere, *(() if yaws else on_a_track))}
