"""The wheel-driven inverted pendulum of Peng, Cheng and Tsai (Electronics 2023, 12, 4569).

Sign convention: θw grows when the wheels roll forward, θp grows when the body leans forward, both measured against the
vertical. Positions are in the frame of the track (x forward along it, z away from it), tilted uphill by γ.
"""

from __future__ import annotations

from derive.late import sp
from derive.records import Assumption, Body, Channel, Coordinate, Heading, Load, Parameter, Plant, Port, coordinate

NAME = "wheel_pendulum"

ASSUMPTIONS = (
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
        brings=(("dynamic", "winding_inductance"),),
    ),
    Assumption(
        "encoder",
        "absolute",
        ("absolute", "relative"),
        "Whether theta_w is the wheel's angle against the vertical or against the body; set in [sensors].",
    ),
)

REFERENCE = {
    "X1": 0.0436,
    "X2": 0.0178,
    "X3": 0.1149,
    "X4": 0.8719,
    "X5": 4.6701,
    "X6": 0.7268,
    "X7": 0.7256,
}  # Table 1
CONSTANTS = {"R": 0.2413, "g": 9.81, "alpha": 165.42, "J_w": 0.1339, "L": 0.716}  # paper, section 4; alpha from (12)

GAINS = (-168.0, -800.0, -8.8)  # of the paper's PID on the pitch [V/rad, V/(rad s), V s/rad]


def inside() -> dict[str, Coordinate]:
    """Give inside the machine that effects may free."""
    return {
        "twist": coordinate("twist", "shaft"),  # of the motor's side of the drive against the wheel
        "creep": coordinate("creep", "contact"),  # of the wheel against the ground: it rolls, less this
        "sway": coordinate("sway", "pendulum"),  # of what hangs in the body, against the vertical
    }


def build(assumptions: dict, free: tuple[str, ...] = ()) -> Plant:
    """State geometry, actuator and sensors of the robot under the given assumptions; what is not free is rigid."""
    turns = not assumptions["planar"]
    wheel, pitch, yaw = coordinate("theta_w", "wheel"), coordinate("theta_p", "body"), coordinate("psi", "yaw")
    theta_w, dtheta_w, theta_p, dtheta_p = wheel.q, wheel.dq, pitch.q, pitch.dq
    m, M, L, R, g, W = sp.symbols("m M L R g W", positive=True)
    J_w, J_b, J_m, epsilon = sp.symbols("J_w J_b J_m epsilon", positive=True)
    J_x, J_z, J_t = sp.symbols("J_x J_z J_t", positive=True)  # of the body about its other axes, of a wheel's turning
    K_t, K_b, R_m, f_m, f_w, alpha = sp.symbols("K_t K_b R_m f_m f_w alpha", positive=True)
    gamma, delta, payload = sp.symbols("track_slope com_angle payload", real=True)
    hung, height, length, decay = sp.symbols("sway_mass sway_height sway_length sway_decay", real=True)
    give = inside()
    (twist, dtwist), (creep, _), (sway, dsway) = (
        (c.q, c.dq) if name in free else (sp.Integer(0), sp.Integer(0)) for name, c in give.items()
    )
    gamma = sp.Integer(0) if turns else gamma  # a slope would turn with the heading
    psi, dpsi = (yaw.q, yaw.dq) if turns else (sp.Integer(0), sp.Integer(0))
    names = ("v_left", "v_right") if turns else ("v_in", "v_in")
    V_left, V_right = (sp.Symbol(name, real=True) for name in names)

    dlead = W / (2 * R) * dpsi  # by which the right wheel is faster than the mean of both, the left one slower
    slip = dtheta_w + dtwist - dtheta_p  # speed of the motors' side of the drive against the body
    tilt = theta_p + delta + gamma  # body's centre of mass against the normal of the track
    axle = sp.Matrix([R * (theta_w - creep), 0, R])
    pivot = axle + height * sp.Matrix([sp.sin(theta_p + gamma), 0, sp.cos(theta_p + gamma)])
    bob = pivot - length * sp.Matrix([sp.sin(sway + gamma), 0, sp.cos(sway + gamma)])
    base_rate = dtheta_p if assumptions["rotor_speed"] == "world" else 0
    left_rotor, right_rotor = (epsilon * (slip + difference) + base_rate for difference in (-dlead, dlead))
    rotor_inertia = J_m if assumptions["rotor_inertia"] else sp.Integer(0)

    # The motors: i R_m + K_b ω = V (paper eq. 7), torque ε K_t i of each on its wheel. Both together drive the robot,
    # the difference turns it, by the virtual work on the mean angle of the wheels and on the yaw.
    gear = epsilon if assumptions["gear_ratio_in_back_emf"] == "twice" else 1
    left, right = (
        epsilon * K_t * (V - K_b * gear * (slip + difference)) / R_m
        for V, difference in ((V_left, -dlead), (V_right, dlead))
    )
    arm = W / (2 * R)
    reaction = "axle" if assumptions["ground_friction_reaction"] == "body" else "ground"

    on_a_track = {  # what is only stated for a robot that keeps its heading
        "track_slope": gamma,
        "sway_mass": hung,
        "sway_height": height,
        "sway_length": length,
        "sway_decay": decay,
    }
    return Plant(
        name=NAME,
        sentence="A body balancing on two coaxial wheels that it drives itself.",
        coordinates=(wheel, pitch, yaw) if turns else (wheel, pitch),
        bodies=(
            Body("left wheel", m, axle + sp.Matrix([0, W / 2, 0]), J_w, dtheta_w - dlead),
            Body("right wheel", m, axle - sp.Matrix([0, W / 2, 0]), J_w, dtheta_w + dlead),
            Body("body", M * (1 + payload), axle + L * sp.Matrix([sp.sin(tilt), 0, sp.cos(tilt)]), J_b, dtheta_p),
            Body("left rotor", sp.Integer(0), axle, rotor_inertia, left_rotor),
            Body("right rotor", sp.Integer(0), axle, rotor_inertia, right_rotor),
            *(turning_bodies(axle, theta_p, dpsi, (2 * J_t, J_x, J_z)) if turns else []),
            *([Body("pendulum", hung * M, bob, sp.Integer(0), dsway)] if "sway" in free else []),
        ),
        gravity=-g * sp.Matrix([sp.sin(gamma), 0, sp.cos(gamma)]),
        loads=(
            Load("motors", "drive", left + right),
            Load("gearbox friction", "drive", -2 * f_m * slip),
            *([Load("ground friction", reaction, -2 * f_w * dtheta_w)] if assumptions["ground_friction"] else []),
            *(
                [
                    Load("motors' difference", "turn", arm * (right - left)),
                    Load("gearbox friction", "turn", -2 * f_m * arm * dlead),
                    *(
                        [Load("ground friction", "turn", -2 * f_w * arm * dlead)]
                        if assumptions["ground_friction"]
                        else []
                    ),
                ]
                if turns
                else []
            ),
            *(
                [Load("pendulum", "pendulum", -decay * hung * M * length**2 * (dsway - dtheta_p))]
                if "sway" in free
                else []
            ),
        ),
        ports=(
            Port("drive", theta_w + twist - theta_p, "between wheel and body, through motor and gearbox"),
            Port("axle", theta_w - theta_p, "between wheel and body, at the axle"),
            Port("ground", theta_w, "between wheel and ground"),
            Port("body", theta_p, "between body and the world"),
            Port("outside", theta_w, "between the robot and what pushes or pulls it from outside"),
            *([Port("turn", psi, "between the robot and the ground, about the vertical")] if turns else []),
            *([Port("pendulum", sway - theta_p, "between the body and what hangs in it")] if "sway" in free else []),
        ),
        channels=(
            Channel("theta_w", theta_w - (theta_p if assumptions["encoder"] == "relative" else 0), "rad"),
            Channel("theta_p", theta_p, "rad"),
            Channel("dtheta_p", dtheta_p, "rad/s"),
            *([Channel("dpsi", dpsi, "rad/s")] if turns else []),
        ),
        input=V_left,
        further=(V_right,) if turns else (),
        heading=Heading(yaw, axle) if turns else None,
        input_unit="V",
        scale=alpha,
        substitutions={K_t: alpha * R_m / (2 * epsilon)},  # alpha = 2 ε K_t / R_m (paper eq. 12)
        constants=(
            Parameter("R", "m", "wheel radius"),
            Parameter("g", "m/s²", "gravity"),
            Parameter("alpha", "N m/V", "torque of both motors per volt (paper eq. 12)"),
            Parameter("J_w", "kg m²", "inertia of one wheel about its axle"),
            Parameter("L", "m", "height of the body's centre of mass above the axle"),
            Parameter("epsilon", "1", "gear ratio"),
            *([Parameter("W", "m", "distance of the wheels")] if turns else []),
        ),
        geometry={"com_angle": delta, "payload": payload} | ({} if turns else on_a_track),
        inner={} if turns else give,
        free=free,
        controlled=("theta_p", "dtheta_p"),
        reference="theta_ref",
        falls="theta_p",
    )


def turning_bodies(axle: sp.Matrix, pitch: sp.Symbol, rate: sp.Symbol, inertias: tuple) -> list[Body]:
    """Rotation about the vertical: of both wheels, and of the body about its own forward and upward axes."""
    of_wheels, forward, upward = inertias
    return [
        Body("wheels turning", sp.Integer(0), axle, of_wheels, rate),
        Body("body turning, about its forward axis", sp.Integer(0), axle, forward, rate * sp.sin(pitch)),
        Body("body turning, about its upward axis", sp.Integer(0), axle, upward, rate * sp.cos(pitch)),
    ]
