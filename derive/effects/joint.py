"""Effects in a joint that no motor turns: between two links, or between a cart and its pole. s is the joint's speed.

The laws are those of the drive; only the part on which they act is another one.
"""

from __future__ import annotations

from dataclasses import replace

from derive.effects import drive
from derive.effects.row import DryForce, Effect, Force

JOINT_EFFECTS = {  # name, of which row of the drive, sentence, what it means
    "viscous_joint": (
        "viscous_drive",
        "Viscous friction in the joint.",
        "Oil in the bearing, or air around the link, resists in proportion to speed.",
    ),
    "coulomb_joint": (
        "coulomb_drive",
        "Dry friction in the joint.",
        "The bearing or its seal rubs with the same torque at any speed: the swing ends at a standstill, not slowly.",
    ),
    "quadratic_joint": (
        "quadratic_drive",
        "Drag in the joint that grows with the square of its speed.",
        "The swinging part pushes air: fast motion costs more than viscous friction says.",
    ),
}


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
    assert isinstance(row.enters, Force | DryForce)
    bare = replace(row, law_text="", residual="", resembles="", remarks=())
    enters = row.enters._replace(port=port)
    return replace(bare, name=name, family="joint", sentence=sentence, means=means, enters=enters)


def turning_row(name: str, model: str, sentence: str, means: str) -> Effect:
    """A row of the drive as it acts between the tyres and the ground of a robot that turns."""
    law_text = "s is the yaw rate of [a robot that turns](plants.md#turning)."
    return replace(drive_row_on(name, model, sentence, means, port="turn"), family="ground", law_text=law_text)


EFFECT_ROWS = (
    *(drive_row_on(name, *rest) for name, rest in JOINT_EFFECTS.items()),
    *(turning_row(name, *rest) for name, rest in TURNING_EFFECTS.items()),
)
