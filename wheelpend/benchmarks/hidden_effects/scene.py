"""The robot as MuJoCo reads it: bodies, joints, tendons and limits, and no equation of motion.

A body on a slide and a hinge, the wheels as its child, the rotors' inertia as armature of the joint between them,
rolling as a stiff equality. Effects that are mechanical are parts of the scene: free play is a limit on the angle
between wheels and a rotor of its own, an elastic shaft a spring there, slosh a pendulum. The motor, its back-EMF and
the plant's viscous friction then act on the rotor. Angles in rad, lengths in m, masses in kg, torques in N m.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

ALPHA, WHEEL_RADIUS_M, GRAVITY_M_S2 = 165.42, 0.2413, 9.81  # N m/V, m, m/s²
WHEELS_MASS_KG, BODY_MASS_KG, COM_HEIGHT_M = 9.2, 110.0, 0.716  # kg, kg, m from the axle to the centre of mass
WHEEL_INERTIA_KG_M2, BODY_INERTIA_KG_M2 = 0.1339, 87.89  # of one wheel, of the body
ROTORS_INERTIA_KG_M2 = 0.0178 * ALPHA  # of both rotors, geared up
ROTOR_DAMPING_NMS_RAD = 0.7256 * ALPHA  # N m s/rad between rotors and body: back-EMF and gearbox
MAX_ENGINE_STEP_S = 1e-4  # s, longest step of the engine
STEEP_TRACTION_SLOPE_S_RAD = 100.0  # s/rad: slope over limit of a traction of which only the limit is given
NEGLIGIBLE_MASS_KG = 1e-6  # kg and kg m²: MuJoCo wants a mass in every body; a rotor's inertia is in its joint
RIGID_SOLIMP = "0.9999 0.9999 0.001"  # solimp: a constraint that yields by no more than its time constant makes it
TRUE_PARAMETERS = {
    "X1": ((WHEELS_MASS_KG + BODY_MASS_KG) * WHEEL_RADIUS_M**2 + 2 * WHEEL_INERTIA_KG_M2) / ALPHA,
    "X2": ROTORS_INERTIA_KG_M2 / ALPHA,
    "X3": BODY_MASS_KG * COM_HEIGHT_M * WHEEL_RADIUS_M / ALPHA,
    "X4": (BODY_MASS_KG * COM_HEIGHT_M**2 + BODY_INERTIA_KG_M2) / ALPHA,
    "X5": BODY_MASS_KG * GRAVITY_M_S2 * COM_HEIGHT_M / ALPHA,
    "X6": ROTOR_DAMPING_NMS_RAD / ALPHA,
    "X7": ROTOR_DAMPING_NMS_RAD / ALPHA,
}

SCENE_TEMPLATE = """
<mujoco>
 <option timestep="{step}" gravity="{downhill} 0 {down}" integrator="RK4" tolerance="1e-12" iterations="200">
  <flag contact="disable"/>
 </option>
 <worldbody>
  <body name="body" pos="0 0 {radius}">
   <joint name="x" type="slide" axis="1 0 0"/>
   <joint name="pitch" type="hinge" axis="0 1 0" damping="{body_damping}"/>
   <inertial pos="{ahead} 0 {above}" mass="{body}" diaginertia="{inertia} {inertia} {inertia}"/>
   <body name="wheels">
    <joint name="drive" type="hinge" axis="0 1 0" {motor}
           frictionloss="{drive_friction}" solreffriction="{engage} 1" solimpfriction="{rigid}"/>
    <inertial pos="0 0 0" mass="{wheels}" diaginertia="{wheel_inertia} {wheel_inertia} {wheel_inertia}"/>
   </body>
   {parts}
  </body>
 </worldbody>
 <tendon>
  <fixed name="roll">
   <joint joint="x" coef="1"/><joint joint="pitch" coef="-{radius}"/><joint joint="drive" coef="-{radius}"/>
  </fixed>
  <fixed name="wheel" damping="{ground_viscous}" stiffness="{tether}" springlength="{slope}"
         frictionloss="{ground_friction}" solreffriction="{engage} 1" solimpfriction="{rigid}">
   <joint joint="pitch" coef="1"/><joint joint="drive" coef="1"/>
  </fixed>
  {shaft}
 </tendon>
 <equality>
  <tendon tendon1="roll" active="{rolls}" polycoef="0 0 0 0 0" solref="{stiff} 1" solimp="{rigid}"/>
 </equality>
 <actuator><motor joint="{driven}" gear="{alpha}"/></actuator>
</mujoco>
"""
MOTOR_ATTRIBUTES = f'armature="{ROTORS_INERTIA_KG_M2}" damping="{ROTOR_DAMPING_NMS_RAD}"'  # of the joint it turns
ROTOR_ELEMENT = f"""<body name="rotor">
    <joint name="rotor" type="hinge" axis="0 1 0" {MOTOR_ATTRIBUTES}/>
    <inertial pos="0 0 0" mass="{NEGLIGIBLE_MASS_KG}" diaginertia="{" ".join([str(NEGLIGIBLE_MASS_KG)] * 3)}"/>
   </body>"""
SHAFT_TEMPLATE = """<fixed name="shaft" {holds}>
   <joint joint="rotor" coef="1"/><joint joint="drive" coef="-1"/>
  </fixed>"""
PENDULUM_TEMPLATE = """<body name="liquid" pos="0 0 {height}">
    <joint name="hang" type="hinge" axis="0 1 0" damping="{damping}"/>
    <inertial pos="0 0 -{length}" mass="{mass}" diaginertia="{speck} {speck} {speck}"/>
   </body>"""

MECHANICAL_EFFECTS = {  # effect.parameter: what it is in the scene, per volt-equivalent
    "coulomb_drive.torque": "drive_friction",
    "rolling_resistance.torque": "ground_friction",
    "ground_viscous.coefficient": "ground_viscous",
    "tether_spring.stiffness": "tether",
    "body_damping.coefficient": "body_damping",
}
SCENE_PARAMETERS = (
    *MECHANICAL_EFFECTS, "slope.angle", "com_offset.angle", "backlash.gap", "drive_compliance.stiffness",
    "drive_compliance.damping", "slosh.mass_ratio", "slosh.height", "slosh.frequency", "slosh.damping",
)  # fmt: skip


def scene(hide: Mapping[str, float], engage: float) -> str:
    """MuJoCo's XML of the robot with its hidden effects; dry friction engages within about ``engage`` seconds."""
    slope, offset = hide.get("slope.angle", 0.0), hide.get("com_offset.angle", 0.0)
    place = {where: hide.get(name, 0.0) * ALPHA for name, where in MECHANICAL_EFFECTS.items()}
    geared = has_rotor(hide)
    return SCENE_TEMPLATE.format(
        step=step_of(hide),
        stiff=2 * MAX_ENGINE_STEP_S,
        rigid=RIGID_SOLIMP,
        engage=engage,
        radius=WHEEL_RADIUS_M,
        alpha=ALPHA,
        slope=slope,
        downhill=-GRAVITY_M_S2 * np.sin(slope),
        down=-GRAVITY_M_S2 * np.cos(slope),
        ahead=COM_HEIGHT_M * np.sin(offset),
        above=COM_HEIGHT_M * np.cos(offset),
        body=BODY_MASS_KG,
        inertia=BODY_INERTIA_KG_M2,
        wheels=WHEELS_MASS_KG,
        wheel_inertia=2 * WHEEL_INERTIA_KG_M2,
        rolls="false" if creep_stiffness(hide) else "true",
        motor="" if geared else MOTOR_ATTRIBUTES,
        driven="rotor" if geared else "drive",
        parts=(ROTOR_ELEMENT if geared else "") + pendulum(hide),
        shaft=shaft(hide) if geared else "",
        **place,
    )


def has_rotor(hide: Mapping[str, float]) -> bool:
    """True if the rotors can turn against the wheels: there is a gap, or a shaft that is not infinitely stiff."""
    return hide.get("backlash.gap", 0.0) > 0.0 or np.isfinite(hide.get("drive_compliance.stiffness", np.inf))


def shaft(hide: Mapping[str, float]) -> str:
    """XML of the tendon between rotors and wheels: stops at either end of the gap, or a spring that begins there.

    The stops are stiff and do not bounce. With play and spring together the shaft's damping acts in the gap too.
    """
    half = hide.get("backlash.gap", 0.0) / 2
    stiffness = hide.get("drive_compliance.stiffness", np.inf)
    if not np.isfinite(stiffness):
        stops = f'solreflimit="{2 * MAX_ENGINE_STEP_S} 1" solimplimit="{RIGID_SOLIMP}"'
        return SHAFT_TEMPLATE.format(holds=f'limited="true" range="{-half} {half}" {stops}')
    damping = hide.get("drive_compliance.damping", 0.0) * ALPHA
    spring = f'stiffness="{stiffness * ALPHA}" damping="{damping}" springlength="{-half} {half}"'
    return SHAFT_TEMPLATE.format(holds=spring)


def pendulum(hide: Mapping[str, float]) -> str:
    """XML of liquid in a tank: a point mass hung on the body's axis, of length g/ω²; its damper is 2 ζ ω m l².

    ω is its natural frequency with the axis held still, ζ its damping ratio: φ̈ + 2 ζ ω φ̇ + ω² φ = 0.
    """
    mass = hide.get("slosh.mass_ratio", 0.0) * BODY_MASS_KG
    if mass <= 0.0:
        return ""
    frequency = hide["slosh.frequency"]
    length = GRAVITY_M_S2 / frequency**2
    damping = 2 * hide.get("slosh.damping", 0.0) * frequency * mass * length**2
    return PENDULUM_TEMPLATE.format(
        height=hide["slosh.height"], damping=damping, length=length, mass=mass, speck=NEGLIGIBLE_MASS_KG
    )


def creep_stiffness(hide: Mapping[str, float]) -> float:
    """Slope of traction against creep speed [V s/rad]: steep where only its limit is given, 0 where nothing slips."""
    stiffness, limit = hide.get("wheel_slip.stiffness", np.inf), hide.get("wheel_slip.limit", np.inf)
    if np.isfinite(stiffness):
        return stiffness
    return STEEP_TRACTION_SLOPE_S_RAD * limit if np.isfinite(limit) else 0.0


def step_of(hide: Mapping[str, float]) -> float:
    """Step of the engine [s]: a whole share of the longest at which traction, held over a step, is well damped."""
    inertia = 2 * WHEEL_INERTIA_KG_M2 + (0.0 if has_rotor(hide) else ROTORS_INERTIA_KG_M2)
    return MAX_ENGINE_STEP_S / max(1, int(np.ceil(creep_stiffness(hide) * ALPHA / inertia * MAX_ENGINE_STEP_S / 0.3)))
