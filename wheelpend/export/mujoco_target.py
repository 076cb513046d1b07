"""The robot as MuJoCo reads it: masses, inertias and joints that move as the identified, lumped parameters do.

The wheel's way is a slide, the pitch a hinge on it; the drive is a fixed tendon along theta_w - theta_p, whose armature
is the rotor's inertia and whose friction loss is dry friction. X1...X5 leave a mass of the body free: the one between
the least and the largest that give positive inertias, in the middle.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from wheelpend.errors import Failure
from wheelpend.export.exported_model import ExportedModel
from wheelpend.export.ledger import Carried
from wheelpend.export.templates import file_template
from wheelpend.version import version

TEMPLATE_FOLDER = Path(__file__).with_name("mujoco")
SCENE_FILE = "robot.xml"
SUPPORTED_PLANT = "wheel_pendulum"
DEFAULT_GRAVITY = 9.81  # m/s²
ENGINE_STEP_S = 1e-4  # s
SMALL_INERTIA = 1e-6  # kg m², that MuJoCo wants of every body

INERTIA_NAMES = ("X1", "X2", "X3", "X4", "X5")  # and moments; without rotors' inertia there is no X2
SENSOR_PLACES = {  # of the scene, by what a sensor reads of wheel and pitch
    (1.0, 0.0): ("tendon", "theta_w"),
    (1.0, -1.0): ("tendon", "drive"),
    (0.0, 1.0): ("joint", "theta_p"),
}

CARRIED_EXACTLY = Carried("exactly")
FRICTION_LOSS = Carried("approximately", "a friction loss of MuJoCo, a constraint that yields a little before it slips")
CARRIED_EFFECTS: dict[str, Carried] = {
    "viscous_drive": CARRIED_EXACTLY,
    "body_damping": CARRIED_EXACTLY,
    "ground_viscous": CARRIED_EXACTLY,
    "tether_spring": CARRIED_EXACTLY,
    "com_offset": CARRIED_EXACTLY,
    "voltage_offset": CARRIED_EXACTLY,
    "voltage_saturation": CARRIED_EXACTLY,
    "winding_inductance": Carried("exactly", "the actuator's filter, in full over each of the engine's steps"),
    "coulomb_drive": FRICTION_LOSS,
    "rolling_resistance": FRICTION_LOSS,
    "actuator_delay": Carried("approximately", "the actuator's delay, in whole steps of the engine"),
}
NOT_CARRIED = Carried("not", "MuJoCo has no such law; apply it where you step the engine, or export c")


def mujoco_files(exported: ExportedModel) -> dict[str, str]:
    """Text of the scene by path; raises Failure for another plant, and where no masses move as the parameters say."""
    return {SCENE_FILE: file_template(TEMPLATE_FOLDER, f"{SCENE_FILE}.j2").render(scene_values(exported))}


def mujoco_carried(exported: ExportedModel) -> Mapping[str, Carried]:
    """How each effect is carried."""
    return {name: CARRIED_EFFECTS.get(name, NOT_CARRIED) for name in exported.model.effects}


def mujoco_notes(exported: ExportedModel) -> list[str]:
    """What of the plant's own motion the scene has only in part."""
    x6, x7 = _dampings(_own(exported))
    if math.isclose(x6, x7, rel_tol=1e-9):
        return []
    return [f"X6 = {x6:.5g} and X7 = {x7:.5g}: MuJoCo damps the drive alike both ways, so half of their difference "
            "couples pitch rate and wheel otherwise than in the model."]  # fmt: skip


def scene_values(exported: ExportedModel) -> dict[str, Any]:
    """Masses, lengths and forces of the scene [kg, m, N m]."""
    if exported.model.plant != SUPPORTED_PLANT:
        raise Failure(f"An MJCF is made of {SUPPORTED_PLANT} alone, but the model is a {exported.model.plant}. Export "
                      "c, js or json.")  # fmt: skip
    if not exported.model.assumptions["planar"]:
        raise Failure("An MJCF is made of a robot that keeps its heading (planar = true), but in this model it turns. "
                      "Export c, js or json.")  # fmt: skip
    own, constants = _own(exported), exported.model.constants
    scale, gravity = constants.get("alpha", 1.0), constants.get("g", DEFAULT_GRAVITY)
    if min(own[n] for n in INERTIA_NAMES if n in own) <= 0.0 or own["X1"] * own["X4"] <= own["X3"] ** 2:
        raise Failure("A scene needs masses and inertias that are positive, but X1 X4 must then be above X3², and "
                      "X1...X5 above 0. Identify the model first.")  # fmt: skip
    radius = gravity * own["X3"] / own["X5"]
    moment = scale * own["X5"] / gravity  # kg m, of the body about the axle
    least, largest = moment**2 / (scale * own["X4"]), scale * own["X1"] / radius**2
    mass = math.sqrt(least * largest)
    effect = {n: float(exported.parameters[i]) for i, n in enumerate(exported.module.PARAMETERS)}
    value = effect.get
    length, offset = moment / mass, value("com_offset.angle", 0.0)
    x6, x7 = _dampings(own)
    damping = 0.5 * (x6 + x7)
    return {
        "title": f"Model of {exported.model.plant}",
        "sensors": _sensors(exported),
        "version": version(),
        "torque_unit": "N m" if "alpha" in constants else "V, as the constant alpha is not known",
        "step": ENGINE_STEP_S,
        "gravity": gravity,
        "radius": radius,
        "small": SMALL_INERTIA,
        "wheel_mass": largest - mass,
        "body_mass": mass,
        "body_inertia": scale * own["X4"] - mass * length**2,
        "above": length * math.cos(offset),
        "ahead": length * math.sin(offset),
        "armature": scale * own.get("X2", 0.0),
        "drive_damping": scale * (damping + value("viscous_drive.coefficient", 0.0)),
        "x_damping": scale * (x6 - damping + value("ground_viscous.coefficient", 0.0)) / radius**2,
        "pitch_damping": scale * (x7 - damping + value("body_damping.coefficient", 0.0)),
        "x_stiffness": scale * value("tether_spring.stiffness", 0.0) / radius**2,
        "x_origin": radius * (exported.parameters[exported.module.ORIGIN] if exported.module.ORIGIN >= 0 else 0.0),
        "drive_friction": scale * value("coulomb_drive.torque", 0.0),
        "x_friction": scale * value("rolling_resistance.torque", 0.0) / radius,
        "scale": scale,
        "bias": scale * value("voltage_offset.offset", 0.0),
        "dynamics": _dynamics(effect),
    }


def _own(exported: ExportedModel) -> dict[str, float]:
    module = exported.module
    return {n: float(exported.parameters[i]) for i, n in enumerate(module.PARAMETERS[: module.OWN_PARAMETERS])}


def _dampings(own: Mapping[str, float]) -> tuple[float, float]:
    """X6 and X7, which without friction on the ground are one parameter."""
    return (own["X6"], own["X7"]) if "X6" in own else (own["X8"], own["X8"])


def _sensors(exported: ExportedModel) -> list[dict[str, str]]:
    """Element, name and place of the scene's sensors, one per channel."""
    count, sensors = exported.module.NQ, []
    for name, weights in zip(exported.model.table.channels, exported.module.OUTPUT_MATRIX, strict=True):
        is_rate = not weights[:count].any()
        kind, place = SENSOR_PLACES[tuple(weights[count:] if is_rate else weights[:count])]
        sensors.append({"element": f"{kind}{'vel' if is_rate else 'pos'}", "name": name, "kind": kind, "place": place})
    return sensors


def _dynamics(effect: Mapping[str, float]) -> str:
    """Attributes of the actuator: its lag, its delay, its limit."""
    words = []
    if (time := effect.get("winding_inductance.time_constant", 0.0)) > 0.0:
        words.append(f'dyntype="filterexact" dynprm="{time}"')
    if (delay := effect.get("actuator_delay.delay", 0.0)) >= ENGINE_STEP_S:
        words.append(f'delay="{delay}" nsample="{math.ceil(delay / ENGINE_STEP_S) + 1}"')
    if math.isfinite(limit := effect.get("voltage_saturation.limit", math.inf)):
        words.append(f'ctrllimited="true" ctrlrange="-{limit} {limit}"')
    return " ".join(words)
