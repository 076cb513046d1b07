"""The commented model.toml that a new workspace starts with."""

from __future__ import annotations

import textwrap
from collections.abc import Iterable

import tomlkit

from derive import plants
from derive.plant_signature import PlantSignature
from derive.records import Assumption
from wheelpend.kernels.plant_signature import plant_signature

HEADER_TEMPLATE = """\
# The model of this workspace. It is the only source of the code in generated/: edit it, then run `wheelpend generate`.
# {units} Comments survive the tool.

plant = "{plant}"
effects = []                           # `wheelpend effects` lists them, `wheelpend add` adds one
"""


def model_file_text(plant: str) -> str:
    """A first model.toml of a plant; raises KeyError naming the known plants."""
    built = plant_signature(plant, plants.complete_assumptions(plant, {}))
    sections = [
        HEADER_TEMPLATE.format(plant=plant, units=units_sentence(built)),
        section("assumptions", "", assumption_lines(plant)),
        section("constants", "known, never identified; only some effects and the display in N·m need them",
                constant_lines(plant, built)),
        section("parameters", parameters_comment(plant), nominal_value_lines(plant)),
        plants.template_of(plant).sensors or noise_section(built),
        section("controller", "only where known: for closed-loop simulation, prediction and instruments",
                controller_lines(plant)),
        columns_section(plant, built),
        section("simulation", simulation_comment(plant), simulation_lines(plant, built)),
    ]  # fmt: skip
    return "\n".join(s for s in sections if s)


def units_sentence(built: PlantSignature) -> str:
    """Units of what a model file holds: Angles are in rad, times in s, voltages in V."""
    units = {c.unit for c in built.coordinates}
    found = [*(["angles are in rad"] if "rad" in units else []), *(["lengths are in m"] if "m" in units else [])]
    found = [found[0], *(f.replace(" are", "") for f in found[1:]), "times in s"]
    text = ", ".join([*found, *([built.inputs_phrase] if built.driven else [])])
    return f"{text[0].upper()}{text[1:]}."


def section(name: str, comment: str, lines: Iterable[str]) -> str:
    """A section with its lines; nothing where it has none."""
    entries = list(lines)
    header = f"[{name}]".ljust(39 if comment else 0) + (f"# {comment}" if comment else "")
    return "\n".join([header, *entries]) + "\n" if entries else ""


def assumption_lines(plant: str) -> list[str]:
    """Every assumption at its default, under its sentence; those on sensors are among these."""
    return [commented_assumption(a) for a in plants.assumptions_of(plant) if a.section == "assumptions"]


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
    source = plants.template_of(plant).numbers or "those of the plant's file"
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


def columns_section(plant: str, built: PlantSignature) -> str:
    """An example of a mapped column, commented out."""
    last = built.channels[-1]
    unit, column = {"rad": ("deg", "angle_deg"), "m": ("mm", "position_mm")}.get(last.unit, (last.unit, "other_name"))
    example = plants.template_of(plant).column or f'{last.name} = {{ column = "{column}", unit = "{unit}" }}'
    comment = "only where a log names or measures things differently, for instance"
    return section("columns", comment, [f"# {example}"])


def simulation_comment(plant: str) -> str:
    """Comment on the source of the simulated machine's numbers."""
    source = plants.template_of(plant).numbers or "the plant's numbers"
    return f"the machine that `wheelpend simulate` plays: {source}"


def simulation_lines(plant: str, built: PlantSignature) -> list[str]:
    """True parameters, noises, and the initial state of a plant without a drive."""
    lines = [f"{x} = {v!r}" for x, v in plants.reference_of(plant).items()]
    if further := plants.template_of(plant).simulation:
        lines.append(further)
    elif lines and not built.driven:
        lines += [f"{built.coordinates[0].name} = 1.0".ljust(39) + "# where it is let go"]
    return lines
