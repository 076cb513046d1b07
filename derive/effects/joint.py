"""Effects in a joint: between two links, or between a cart and its pole. s is the joint's speed.

The laws are those of the drive; only the part on which they act is another one. What a motor and its gearbox bring is
there only where a motor turns the joint.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

from derive.effects import drive
from derive.effects.row import DryForce, Effect, EffectParameter, Force, HysteresisForce, Quantiles, Ripple

DRIVE_ANGLE, JOINT_ANGLE = "θw − θp", "q"  # motion of the port in equations


class JointEffect(NamedTuple):
    """A row of the drive as it acts in a joint."""

    name: str
    model: str  # the row of the drive
    sentence: str
    means: str
    needs_motor: bool = False


JOINT_EFFECTS = (
    JointEffect(
        "viscous_joint",
        "viscous_drive",
        "Viscous friction in the joint.",
        "Oil in the bearing, or air around the link, resists in proportion to speed.",
    ),
    JointEffect(
        "coulomb_joint",
        "coulomb_drive",
        "Dry friction in the joint.",
        "The bearing or its seal rubs with the same torque at any speed: the swing ends at a standstill, not slowly.",
    ),
    JointEffect(
        "quadratic_joint",
        "quadratic_drive",
        "Drag in the joint that grows with the square of its speed.",
        "The swinging part pushes air: fast motion costs more than viscous friction says.",
    ),
    JointEffect(
        "coulomb_asymmetry_joint",
        "coulomb_asymmetry",
        "Dry friction in the joint is larger one way than the other, or a constant torque acts there.",
        "Gear teeth or brushes worn on one side, or a driver of the joint's motor whose zero is off.",
        needs_motor=True,
    ),
    JointEffect(
        "viscous_asymmetry_joint",
        "viscous_asymmetry",
        "Viscous friction in the joint is larger one way than the other.",
        "The faster it turns, the more one direction costs than the other: a bearing or seal that is preloaded.",
        needs_motor=True,
    ),
    JointEffect(
        "load_friction_joint",
        "load_friction",
        "Dry friction in the joint's gearbox that grows with the load it carries.",
        "Teeth rub the harder the more they carry: a share of every torque is lost, whatever the speed.",
        needs_motor=True,
    ),
    JointEffect(
        "stribeck_joint",
        "stribeck_drive",
        "Dry friction in the joint that falls from a static to a sliding value as it starts to move.",
        "It breaks loose with a jerk and then runs more easily: small motions go by stick and slip.",
        needs_motor=True,
    ),
    JointEffect(
        "presliding_joint",
        "presliding_drive",
        "Dry friction in the joint that winds up like a spring before it slides (Dahl).",
        "Teeth, seals and grease give way before they slide: around a reversal the friction builds up with the angle.",
        needs_motor=True,
    ),
    JointEffect(
        "cogging_joint",
        "cogging",
        "Torque ripple of the joint's motor or gear, repeating over a turn of the joint.",
        "The joint is pulled towards preferred positions: magnets, brushes, or a damaged tooth.",
        needs_motor=True,
    ),
)


TURNING_EFFECTS = {
    "coulomb_turn": (
        "coulomb_drive",
        "Dry friction of the tyres where the robot turns on the spot.",
        "Broad tyres scrub: turning costs the same torque at any rate, and small commands do not turn the robot.",
    ),
}


def drive_row_on(name: str, model: str, sentence: str, means: str, port: str = "joint") -> Effect:
    """A row of the drive as it acts on another port; what it says of the drive alone is left out."""
    row = next(r for r in drive.EFFECT_ROWS if r.name == model)
    assert isinstance(row.enters, Force | DryForce | HysteresisForce)
    bare = replace(row, undriven=("", ""), covers=(), law_text="", residual="", resembles="", remarks=())
    enters = row.enters._replace(port=port)
    parameters = tuple(_started_on(p, port) for p in row.parameters)
    return replace(
        bare, name=name, family="joint", sentence=sentence, means=means, enters=enters, parameters=parameters
    )


def _started_on(parameter: EffectParameter, port: str) -> EffectParameter:
    """A parameter whose starting values, where they are those of a port's motion in a log, are another port's."""
    starts = parameter.starts
    return parameter._replace(starts=starts._replace(of=port)) if isinstance(starts, Quantiles | Ripple) else parameter


def joint_row(effect: JointEffect) -> Effect:
    """A row of the drive as it acts in a joint; what it approaches or varies is in the joint too."""
    row = drive_row_on(effect.name, effect.model, effect.sentence, effect.means)
    in_joint = {e.model: e.name for e in JOINT_EFFECTS}
    equation = row.equation.replace(f"({DRIVE_ANGLE})", f" {JOINT_ANGLE}")
    law_text = f"{JOINT_ANGLE} is the joint's angle." if equation != row.equation else ""
    related = replace(row, approaches=in_joint.get(row.approaches, ""), varies=in_joint.get(row.varies, ""))
    return replace(related, equation=equation, law_text=law_text, needs_motor=effect.needs_motor)


def turning_row(name: str, model: str, sentence: str, means: str) -> Effect:
    """A row of the drive as it acts between the tyres and the ground of a robot that turns."""
    law_text = "s is the yaw rate of [a robot that turns](plants.md#turning)."
    return replace(drive_row_on(name, model, sentence, means, port="turn"), family="ground", law_text=law_text)


EFFECT_ROWS = (
    *map(joint_row, JOINT_EFFECTS),
    *(turning_row(name, *rest) for name, rest in TURNING_EFFECTS.items()),
)
