"""A model as a C library: one header, one source, what builds them, and an example that balances."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Sequence
from hashlib import sha256
from pathlib import Path
from typing import Any

import jinja2
import numpy as np

from wheelpend.export.c_channels import channels_text, input_word, macro
from wheelpend.export.compensation import INTERVAL_SIGMAS
from wheelpend.export.context import translated_model
from wheelpend.export.exported_model import LIBRARY_PARTS, ExportedModel
from wheelpend.export.templates import file_template
from wheelpend.export.translate.c_code import CPrinter, real

TEMPLATE_FOLDER = Path(__file__).with_name("c")
HEADER_FILE, SOURCE_FILE = "wheelpend_model.h", "wheelpend_model.c"
PLAIN_LETTERS = {
    "²": "^2", "³": "^3", "·": " ", "−": "-", "±": "+-", "’": "'", "…": "...", "≤": "<=", "≥": ">=", "–": "-",
    "½": "1/2", "ø": "o",
}  # fmt: skip
C_LANES = 1  # of sensitivities: a small processor has none side by side, and less stack
USUAL_SUPPLY = 24.0  # of a driver of which nothing is known, in the unit of the input
SMALL_WEIGHT = 1e-9  # that counts as none
FILTER_PARTS = (
    (
        "observer",
        "The state from the sensors, with the random force: the filter of `wheelpend identify`, an extended Kalman\n"
        "   filter. Update it with every sample's readings, then predict under the command that you give.",
        False,
    ),
    (
        "identifier",
        "The same, which learns parameters as it runs, near what any method could: by recursive prediction errors.",
        True,
    ),
)


def c_files(exported: ExportedModel) -> dict[str, str]:
    """Texts of the library by path."""
    context = _context(exported, LIBRARY_PARTS)
    return {
        **_library(context, "src/"),
        "CMakeLists.txt": _template("CMakeLists.txt.j2").render(context),
        "library.properties": _template("library.properties.j2").render(context),
        "examples/balance/balance.ino": _template("balance.ino.j2").render(context),
        "examples/desktop/balance.c": _template("balance.c.j2").render(context),
    }


def c_library(exported: ExportedModel, parts: Sequence[str]) -> dict[str, str]:
    """Header and source of some parts alone, by their names."""
    return _library(_context(exported, parts), "")


def _library(context: dict[str, Any], folder: str) -> dict[str, str]:
    return {
        f"{folder}{HEADER_FILE}": _template("model.h.j2").render(context),
        f"{folder}{SOURCE_FILE}": _template("model.c.j2").render(context),
    }


def c_replay_text(exported: ExportedModel) -> str:
    """A program that replays logs with the library."""
    return _template("replay.c.j2").render(e=exported, m=exported.module, header=HEADER_FILE, real=real)


def _context(exported: ExportedModel, parts: Sequence[str]) -> dict[str, Any]:
    translated = translated_model(exported, parts, C_LANES)
    functions = translated.functions

    def call(name: str, owner: str) -> str:
        return f"wp_{name}({', '.join(_argument(p.name, owner) for p in functions[name].parameters)})"

    return (
        translated.values
        | {
            "equations": comment_safe(translated.values["equations"]),
            "header": HEADER_FILE,
            "source": SOURCE_FILE,
            "precision": (TEMPLATE_FOLDER / "precision.h").read_text(encoding="utf-8").strip(),
            "limits": (TEMPLATE_FOLDER / "limits.h").read_text(encoding="utf-8").strip(),
            "code": ascii_only(CPrinter().text(translated.program)),
            "call": call,
            "real": real,
            "reals": lambda values: ", ".join(real(float(v)) for v in np.atleast_1d(values)) or real(0.0),
            "rows": lambda matrix: ", ".join(
                "{" + ", ".join(real(float(v)) for v in row) + "}" for row in np.atleast_2d(matrix)
            ),
            "names": lambda names: ", ".join(f'"{comment_safe(n)}"' for n in names),
            "parameters": [_parameter(exported, i) for i in range(exported.module.NP)],
            "volts": "wp_real voltage" if exported.inputs <= 1 else f"const wp_real voltage[{exported.inputs}]",
            "commanded": "wp_real commanded" if exported.inputs <= 1 else f"const wp_real commanded[{exported.inputs}]",
            "finite_command": _finite_command(exported.inputs),
            "public_names": _public_names(parts, translated.compensation is not None),
            "model_id": sha256(f"{exported.text}{exported.parameters.tolist()}".encode()).hexdigest()[:16],
            "states": [f"WP_STATE_{macro(n)}" for n in exported.module.STATES],
            "readings": [f"WP_READ_{macro(n)}" for n in exported.module.OUTPUTS],
            "channels": ascii_only(channels_text(exported)),
            "word": input_word(exported),
            "inputs_suffix": "" if exported.inputs <= 1 else "[WP_INPUTS]",
            "interval": f"{INTERVAL_SIGMAS:g}",
            "filters": [f for f in FILTER_PARTS if f[0] in parts],
            "with_modes": "modes" in parts,
        }
        | _example(exported)
    )


def _example(exported: ExportedModel) -> dict[str, Any]:
    """What the examples' loop knows of the machine: its controller, what it starts from, and when it must stop."""
    module, plant, controller = exported.module, exported.model.plant_signature, exported.model.controller
    value, rate = module.CONTROLLED
    watched = module.OUTPUTS[max(value, 0)]
    output = np.asarray(module.OUTPUT_MATRIX, dtype=float)
    place = output[max(value, 0), : module.NQ]
    of_rate = output[rate] if rate >= 0 else np.concatenate([np.zeros(module.NQ), place])
    states = [f"observer.now[WP_STATE_{macro(n)}]" for n in module.STATES]
    return {
        "gains": controller.gains if controller and exported.inputs == 1 else None,
        "angle": _weighted_sum(output[max(value, 0)], states),
        "rate": _weighted_sum(of_rate, states),
        "watched": watched,
        "pitch": f"WP_READ_{macro(watched)}",
        "falls": plant.usual_limits is not None,
        "upright": plant.usual_limits[0] / 2 if plant.usual_limits else 0.0,
        "supply": float(plant.usual_limits[1]) if plant.usual_limits else USUAL_SUPPLY,
        "unit": plant.input_unit,
        "drives": max(exported.inputs, 1),
        "given": "applied" if exported.inputs > 1 else "applied[0]",
        "first_state": f"WP_STATE_{macro(module.STATES[0])}",
        "from_readings": _state_from_readings(exported),
    }


def _state_from_readings(exported: ExportedModel) -> list[tuple[str, str]]:
    """Each state that the sensors read, and the sum of readings that it is."""
    module, readings = exported.module, [f"measured[WP_READ_{macro(n)}]" for n in exported.module.OUTPUTS]
    inverse = np.linalg.pinv(np.asarray(module.OUTPUT_MATRIX, dtype=float))
    sums = [
        (f"WP_STATE_{macro(n)}", _weighted_sum(row, readings)) for n, row in zip(module.STATES, inverse, strict=True)
    ]
    return [(state, text) for state, text in sums if text]


def _weighted_sum(weights: np.ndarray, values: Sequence[str]) -> str:
    """Text of the sum of values, each times its weight; '' where none has any."""
    terms = [
        {1.0: value, -1.0: f"-{value}"}.get(weight, f"{real(weight)} * {value}")
        for weight, value in zip((round(float(w), 6) for w in weights), values, strict=True)
        if abs(weight) > SMALL_WEIGHT
    ]
    return " + ".join(terms)


def _argument(name: str, owner: str) -> str:
    """What a kernel is passed for one of its parameters."""
    special = {
        "t": f"{owner}->time" if owner else "WP_R(0.0)",
        "h": f"{owner}->period",
        "max_step": "max_step",  # those of a call: bounded, per reading
        "gate": "gate",
        "taken": "taken",
        "step": "WP_DIFFERENCE_STEP",
        "by_state": "a",
        "by_input": "b",
        "reading_by_state": "c",
        "forces": "compensated_forces",
        "absent": "compensated_none",
        "maps": "compensated_maps",
        "shares": "compensated_shares",
    }
    modes = ("slope", "directions", "reserves")
    passed = ("state", "voltage", "output", "rates", "measured", "wanted", "a", "b", "c", *modes)
    if name in special:
        return special[name]
    if name in passed or not owner:
        return {"least_slip": "WP_LEAST_SLIP", "least_input": "WP_LEAST_INPUT"}.get(name, name)
    return f"{owner}->{name}"


def _finite_command(inputs: int) -> str:
    """Statements that take a command, 0 where it is not finite."""
    if inputs <= 1:
        return "const wp_real voltage = finite_or_zero(commanded);"
    values = ", ".join(f"finite_or_zero(commanded[{i}])" for i in range(inputs))
    return f"const wp_real voltage[{inputs}] = {{{values}}};"


def _public_names(parts: Sequence[str], compensates: bool) -> list[str]:
    """Functions of these parts that a program links to."""
    verbs = ("init", "start", "update", "predict", "healthy")
    filters = [f"{part}_{verb}" for part, *_ in FILTER_PARTS if part in parts for verb in verbs]
    modes = ("slopes", "reserves", "settle") if "modes" in parts else ()
    machine = [f"machine_{verb}" for verb in ("init", "start", "step", "rates", "read", "linearise", *modes)]
    return [*machine, *(["compensate"] if compensates else []), *filters]


def _parameter(exported: ExportedModel, place: int) -> dict[str, str]:
    """A parameter as a macro, with its value, unit and standard error as text."""
    module, name = exported.module, exported.module.PARAMETERS[place]
    value, sigma = float(exported.parameters[place]), exported.sigma.get(name)
    error = f" +- {sigma:.2g}" if sigma else ""
    unit = module.UNITS[place] if place < len(module.UNITS) else ""
    return {
        "macro": macro(name),
        "value": real(value),
        "text": comment_safe(f"{name}: {value:.6g}{error} {unit}".strip()),
    }


def ascii_only(text: str) -> str:
    """Code whose comments are in ASCII."""
    for letter, plain in PLAIN_LETTERS.items():
        text = text.replace(letter, plain)
    return "".join(c if c.isascii() else _plain(c) for c in text)


def _plain(letter: str) -> str:
    """A letter in ASCII: without its accent, or a Greek one's name."""
    if bare := unicodedata.normalize("NFKD", letter).encode("ascii", "ignore").decode():
        return bare
    found = re.fullmatch(r"GREEK (?:SMALL|CAPITAL) LETTER (\w+)", unicodedata.name(letter, ""))
    return found[1].lower() if found else ""


def comment_safe(text: str) -> str:
    """A text in ASCII that ends no comment and no string."""
    return ascii_only(text).replace("*/", "* /").replace("/*", "/ *").replace("\\", "/").replace('"', "'")


def _template(name: str) -> jinja2.Template:
    """A template of this language."""
    return file_template(TEMPLATE_FOLDER, name)
