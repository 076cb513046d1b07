"""What a firmware's author must know of each sensor's reading and of the input, as lines of a comment."""

from __future__ import annotations

import math
import re

from derive.plant_signature import ChannelSpec
from wheelpend.export.exported_model import ExportedModel

CHANNEL_DIRECTIONS = {  # of the plants that we know: how a reading grows, and where it is 0
    ("wheel_pendulum", "theta_w"): "grows when the wheels roll forward; zero anywhere",
    ("wheel_pendulum", "dtheta_w"): "positive when the wheels roll forward",
    ("wheel_pendulum", "theta_p"): "grows when the body leans forward; 0 upright, where it would stand by itself",
    ("wheel_pendulum", "dtheta_p"): "positive when the body tips forward",
    ("cart_pole", "x"): "grows the way in which a positive input pushes; zero anywhere",
    ("cart_pole", "theta_p"): "grows when the pole leans the way in which x grows; 0 upright",
    ("slide", "x"): "grows the way in which a positive input pushes; zero anywhere",
    ("shaft", "theta_m"): "grows the way in which a positive input turns; zero anywhere",
    ("pendulum", "theta_1"): "against the vertical, 0 hanging down",
    ("pendulum", "theta_2"): "0 where the second link hangs straight down, or is in line with the first",
}
INPUT_DIRECTIONS = {
    "wheel_pendulum": "positive turns the wheels forward against the body",
    "cart_pole": "positive pushes the way in which x grows",
    "slide": "positive pushes the way in which x grows",
    "shaft": "positive turns the way in which theta_m grows",
}
FULL_TURN_COUNTS = 4096  # of an encoder as an example, where model.toml states none


def macro(name: str) -> str:
    """A name as part of a macro's."""
    return re.sub(r"\W", "_", name).upper()


def input_word(exported: ExportedModel) -> str:
    """What the input is, in a word: voltage."""
    return exported.model.plant_signature.input_word


def channels_text(exported: ExportedModel) -> str:
    """Lines on every reading and on the input: unit, direction, zero, expected noise, a line of code."""
    model, module = exported.model, exported.module
    lines = [
        "Readings, in the order of measured and output, in the units, signs and zeros of the logs that identified:"
    ]
    for y, name in enumerate(module.OUTPUTS):
        channel = model.plant_signature.channel(name)
        direction = CHANNEL_DIRECTIONS.get((model.plant, name), "as in the log, after [columns] of model.toml")
        lines.append(f"  WP_READ_{macro(name)} [{channel.unit}]: {direction}; sigma {exported.readings_sigma[y]:.3g}.")
        if model.plant == "wheel_pendulum" and name in ("theta_w", "dtheta_w"):
            lines += _reference_lines(model.assumptions.get("encoder", "absolute"), name)
        lines += [f"    {line}" for line in _sample_lines(exported, channel)]
    for name in module.INPUTS if exported.inputs else ():
        unit = model.plant_signature.input_unit
        direction = INPUT_DIRECTIONS.get(model.plant, "its sign as in the log")
        lines += [
            f"  {name} [{unit}]: {direction}. It is the {input_word(exported)} that reached the motor, held from one",
            "    sample to the next: after every limit, 0 while the driver is off.",
        ]
        if unit == "V":
            lines.append(
                "    With a duty cycle in -1..1: duty = volts / supply, and applied = duty * supply after the cut."
            )
    return "\n".join(f"   {line}" for line in lines)


def _reference_lines(encoder: str, name: str) -> list[str]:
    """Against what a wheel's angle or rate is measured, and how it is had from an encoder in the body."""
    other = "theta_p" if name == "theta_w" else "dtheta_p"
    if encoder == "relative":
        return ["    It is the wheel against the body, as an encoder in the body reads it: add no pitch."]
    return [f"    It is the wheel against the vertical. An encoder in the body reads {name} - {other}: add {other}."]


def _sample_lines(exported: ExportedModel, channel: ChannelSpec) -> list[str]:
    """A line of code from counts or degrees."""
    place = f"measured[WP_READ_{macro(channel.name)}]"
    if channel.unit == "rad" and channel.sensor.counts_key:
        step = exported.model.sensors.step_of(channel) or 2 * math.pi / FULL_TURN_COUNTS
        sum_of = " + theta_p" if exported.model.assumptions.get("encoder", "absolute") == "absolute" else ""
        scale = f"WP_R({2 * math.pi:.7g}) / WP_R({2 * math.pi / step:.6g})"
        return [f"{place} = {scale} * (wp_real)counts{sum_of}; (counts per turn of the wheel)"]
    if channel.unit in ("rad", "rad/s"):
        return [f"{place} = WP_R(0.01745329) * degrees{'_per_second' if channel.unit == 'rad/s' else ''};"]
    return []
