"""The commented model.toml that a new workspace starts with."""

from __future__ import annotations

import textwrap
from collections.abc import Iterable

import tomlkit

from derive import plants
from derive.plant_signature import PlantSignature
from derive.records import Assumption
from wheelpend.kernels.plant_signature import plant_signature

PAPER_PLANT = "wheel_pendulum"
HEADER_TEMPLATE = """\
# The model of this workspace. It is the only source of the code in generated/: edit it, then run `wheelpend generate`.
# Angles are in rad, times in s, voltages in V. Comments survive the tool.

plant = "{plant}"
effects = []                           # `wheelpend effects` lists them, `wheelpend add` adds one
"""
WHEEL_SENSORS = """\
[sensors]
encoder = "absolute"                   # or "relative": theta_w is then wheel minus body
encoder_counts = 60000                 # per revolution; 0 where unknown
pitch_noise = "auto"                   # standard deviation [rad], or "auto": from the data
rate_noise = "auto"                    # [rad/s]
"""


def model_file_text(plant: str) -> str:
    """A first model.toml of a plant; raises KeyError naming the known plants."""
    built = plant_signature(plant, plants.complete_assumptions(plant, {}))
    sections = [
        HEADER_TEMPLATE.format(plant=plant),
        section("assumptions", "", assumption_lines(plant)),
        section("constants", "known, never identified; only some effects and the display in N·m need them",
                constant_lines(plant, built)),
        section("parameters", parameters_comment(plant), nominal_value_lines(plant)),
        WHEEL_SENSORS if plant == PAPER_PLANT else noise_section(built),
        section("controller", "only where known: for closed-loop simulation, prediction and instruments",
                controller_lines(plant)),
        columns_section(built),
        section("simulation", simulation_comment(plant), simulation_lines(plant, built)),
    ]  # fmt: skip
    return "\n".join(s for s in sections if s)


def section(name: str, comment: str, lines: Iterable[str]) -> str:
    """A section with its lines; nothing where it has none."""
    entries = list(lines)
    header = f"[{name}]".ljust(39 if comment else 0) + (f"# {comment}" if comment else "")
    return "\n".join([header, *entries]) + "\n" if entries else ""


def assumption_lines(plant: str) -> list[str]:
    """Every assumption at its default, under its sentence; the encoder is among the sensors."""
    return [commented_assumption(a) for a in plants.assumptions_of(plant) if a.name != "encoder"]


def commented_assumption(assumption: Assumption) -> str:
    """An assumption at its default, under its sentence and its choices."""
    choices = " or ".join(tomlkit.item(c).as_string() for c in assumption.choices)
    sentence = textwrap.wrap(f"{assumption.sentence} {choices}.", 118)
    default = tomlkit.item(assumption.default).as_string()  # type: ignore[call-overload]
    return "\n".join([*(f"# {s}" for s in sentence), f"{assumption.name} = {default}"])


def constant_lines(plant: str, built: PlantSignature) -> list[str]:
    """The plant's constants, each with its unit and what it is."""
    known = {c.name: c for c in built.constants}
    entries = [(f"{n} = {v!r}", known[n]) for n, v in plants.constants_of(plant).items() if n in known]
    return [f"{entry:<39}# {c.sentence} [{c.unit}]" for entry, c in entries]


def parameters_comment(plant: str) -> str:
    """Comment on the source of the nominal values."""
    source = "the paper's Table 1" if plant == PAPER_PLANT else "those of the plant's file"
    return f"nominal: {source}, a tenth too small; identification corrects it"


def nominal_value_lines(plant: str) -> list[str]:
    """Nominal values a tenth below the plant's own."""
    return [f"{x} = {{ nominal = {0.9 * v:.6g} }}" for x, v in plants.reference_of(plant).items()]


def noise_section(built: PlantSignature) -> str:
    """Noise and steps of every channel, to be found from the data."""
    rows = [f'{c.name} = "auto"'.ljust(39) + f"# [{c.unit}]" for c in built.channels]
    return section("sensors.noise", 'standard deviation of every channel, or "auto": from the data', rows)


def controller_lines(plant: str) -> list[str]:
    """The PID gains that stabilise the plant, where its file gives some."""
    gains = plants.gains_of(plant)
    return ['kind = "pid"', f"gains = {list(map(float, gains))}"] if gains else []


def columns_section(built: PlantSignature) -> str:
    """An example of a mapped column, commented out."""
    last = built.channels[-1] if built.name != PAPER_PLANT else next(c for c in built.channels if c.name == "theta_p")
    unit, column = {"rad": ("deg", "pitch_deg"), "m": ("mm", "position_mm")}.get(last.unit, (last.unit, "other_name"))
    comment = "only where a log names or measures things differently, for instance"
    return section("columns", comment, [f'# {last.name} = {{ column = "{column}", unit = "{unit}" }}'])


def simulation_comment(plant: str) -> str:
    """Comment on the source of the simulated machine's numbers."""
    return f"the machine that `wheelpend simulate` plays: the {'paper' if plant == PAPER_PLANT else 'plant'}'s" + (
        " Table 1" if plant == PAPER_PLANT else " numbers"
    )


def simulation_lines(plant: str, built: PlantSignature) -> list[str]:
    """True parameters, noises, and the initial state of a plant without a drive."""
    lines = [f"{x} = {v!r}" for x, v in plants.reference_of(plant).items()]
    if plant == PAPER_PLANT:
        lines += ["pitch_noise = 0.008726646259971648     # 0.5 deg, standard deviation [rad]",
                  "rate_noise = 0.008726646259971648      # 0.5 deg/s [rad/s]"]  # fmt: skip
    elif lines and not built.driven:
        lines += [f"{built.coordinates[0].name} = 1.0".ljust(39) + "# where it is let go"]
    return lines
