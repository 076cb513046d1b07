"""The robot as MuJoCo reads it: bodies, joints, tendons and limits, and no equation of motion.

A body on a slide and a hinge, the wheels as its child, the rotors' inertia as armature of the joint between them,
rolling as a stiff equality. Effects that are mechanical are parts of the scene: free play is a limit on the angle
between wheels and a rotor of its own, an elastic shaft a spring there, slosh a pendulum. The motor, its back-EMF and
the plant's viscous friction then act on the rotor. Angles in rad, lengths in m, masses in kg, torques in N m.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

ALPHA, RADIUS, GRAVITY = 165.42, 0.2413, 9.81  # N m/V, m, m/s²
WHEELS, BODY, HEIGHT = 9.2, 110.0, 0.716  # kg, kg, m from the axle to the centre of mass
WHEEL_INERTIA, BODY_INERTIA, ROTORS = 0.1339, 87.89, 0.0178 * ALPHA  # kg m²; of one wheel, the body, both rotors
DAMPING = 0.7256 * ALPHA  # N m s/rad between rotors and body: back-EMF and gearbox
STEP = 1e-4  # s, longest step of the engine
STEEP = 100.0  # s/rad: slope over limit of a traction of which only the limit is given
SPECK = 1e-6  # kg and kg m²: MuJoCo wants a mass in every body; a rotor's inertia is in its joint
RIGID = "0.9999 0.9999 0.001"  # solimp: a constraint that yields by no more than its time constant makes it
TRUTH = {
    "X1": ((WHEELS + BODY) * RADIUS**2 + 2 * WHEEL_INERTIA) / ALPHA,
    "X2": ROTORS / ALPHA,
    "X3": BODY * HEIGHT * RADIUS / ALPHA,
    "X4": (BODY * HEIGHT**2 + BODY_INERTIA) / ALPHA,
    "X5": BODY * GRAVITY * HEIGHT / ALPHA,
    "X6": DAMPING / ALPHA,
    "X7": DAMPING / ALPHA,
}

SCENE = """
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
MOTOR = f'armature="{ROTORS}" damping="{DAMPING}"'  # of the joint that the motor turns
ROTOR = f"""<body name="rotor">
    <joint name="rotor" type="hinge" axis="0 1 0" {MOTOR}/>
    <inertial pos="0 0 0" mass="{SPECK}" diaginertia="{SPECK} {SPECK} {SPECK}"/>
   </body>"""
SHAFT = """<fixed name="shaft" {holds}>
   <joint joint="rotor" coef="1"/><joint joint="drive" coef="-1"/>
  </fixed>"""
PENDULUM = """<body name="liquid" pos="0 0 {height}">
    <joint name="hang" type="hinge" axis="0 1 0" damping="{damping}"/>
    <inertial pos="0 0 -{length}" mass="{mass}" diaginertia="{speck} {speck} {speck}"/>
   </body>"""

MECHANICAL = {  # effect.parameter: what it is in the scene, per volt-equivalent
    "coulomb_drive.torque": "drive_friction",
    "rolling_resistance.torque": "ground_friction",
    "ground_viscous.coefficient": "ground_viscous",
    "tether_spring.stiffness": "tether",
    "body_damping.coefficient": "body_damping",
}
PARTS = (
    *MECHANICAL, "slope.angle", "com_offset.angle", "backlash.gap", "drive_compliance.stiffness",
    "drive_compliance.damping", "slosh.mass_ratio", "slosh.height", "slosh.frequency", "slosh.damping",
)  # fmt: skip


def scene(hide: Mapping[str, float], engage: float) -> str:
    """The robot with its hidden effects; dry friction engages within about ``engage`` seconds."""
    slope, offset = hide.get("slope.angle", 0.0), hide.get("com_offset.angle", 0.0)
    place = {where: hide.get(name, 0.0) * ALPHA for name, where in MECHANICAL.items()}
    geared = has_rotor(hide)
    return SCENE.format(
        step=step_of(hide), stiff=2 * STEP, rigid=RIGID, engage=engage, radius=RADIUS, alpha=ALPHA, slope=slope,
        downhill=-GRAVITY * np.sin(slope), down=-GRAVITY * np.cos(slope), ahead=HEIGHT * np.sin(offset),
        above=HEIGHT * np.cos(offset), body=BODY, inertia=BODY_INERTIA, wheels=WHEELS, wheel_inertia=2 * WHEEL_INERTIA,
        rolls="false" if creep_stiffness(hide) else "true", motor="" if geared else MOTOR,
        driven="rotor" if geared else "drive", parts=(ROTOR if geared else "") + pendulum(hide),
        shaft=shaft(hide) if geared else "", **place,
    )  # fmt: skip


def has_rotor(hide: Mapping[str, float]) -> bool:
    """Whether the rotors can turn against the wheels: there is a gap, or a shaft that is not infinitely stiff."""
    return hide.get("backlash.gap", 0.0) > 0.0 or np.isfinite(hide.get("drive_compliance.stiffness", np.inf))


def shaft(hide: Mapping[str, float]) -> str:
    """What lies between rotors and wheels: stops at either end of the gap, or a spring that begins there.

    The stops are stiff and do not bounce. With play and spring together the shaft's damping acts in the gap too.
    """
    half = hide.get("backlash.gap", 0.0) / 2
    stiffness = hide.get("drive_compliance.stiffness", np.inf)
    if not np.isfinite(stiffness):
        stops = f'solreflimit="{2 * STEP} 1" solimplimit="{RIGID}"'
        return SHAFT.format(holds=f'limited="true" range="{-half} {half}" {stops}')
    damping = hide.get("drive_compliance.damping", 0.0) * ALPHA
    spring = f'stiffness="{stiffness * ALPHA}" damping="{damping}" springlength="{-half} {half}"'
    return SHAFT.format(holds=spring)


def pendulum(hide: Mapping[str, float]) -> str:
    """Liquid in a tank: a point mass hung on the body's axis, of length g/ω², damped against the body by 2 ζ ω m l².

    ω is its natural frequency with the axis held still, ζ its damping ratio: φ̈ + 2 ζ ω φ̇ + ω² φ = 0.
    """
    mass = hide.get("slosh.mass_ratio", 0.0) * BODY
    if mass <= 0.0:
        return ""
    frequency = hide["slosh.frequency"]
    length = GRAVITY / frequency**2
    damping = 2 * hide.get("slosh.damping", 0.0) * frequency * mass * length**2
    return PENDULUM.format(height=hide["slosh.height"], damping=damping, length=length, mass=mass, speck=SPECK)


def creep_stiffness(hide: Mapping[str, float]) -> float:
    """Slope of traction against creep speed [V s/rad]: steep where only its limit is given, 0 where nothing slips."""
    stiffness, limit = hide.get("wheel_slip.stiffness", np.inf), hide.get("wheel_slip.limit", np.inf)
    if np.isfinite(stiffness):
        return stiffness
    return STEEP * limit if np.isfinite(limit) else 0.0


def step_of(hide: Mapping[str, float]) -> float:
    """Step of the engine [s]: a whole share of STEP at which traction, which is held over a step, is well damped."""
    inertia = 2 * WHEEL_INERTIA + (0.0 if has_rotor(hide) else ROTORS)
    return STEP / max(1, int(np.ceil(creep_stiffness(hide) * ALPHA / inertia * STEP / 0.3)))
