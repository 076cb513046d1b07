"""A model as an ES module without dependencies."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import jinja2
import numpy as np

import derive
from wheelpend.export.compensation import compensation_of
from wheelpend.export.exported_model import EXPORT_PARTS, START_ERROR_SHARE, ExportedModel
from wheelpend.export.templates import file_template
from wheelpend.export.translate.javascript_code import JavaScriptPrinter
from wheelpend.model.equations import derived_model
from wheelpend.version import version

TEMPLATE_FOLDER = Path(__file__).with_name("javascript")
MODULE_FILE, REPLAY_FILE = "wheelpend_model.mjs", "replay.mjs"
FILTER_PARTS = (
    ("observer", "The state from the sensors, with the random force: the filter of `wheelpend identify`.", False),
    ("identifier", "The same, which learns parameters as it runs.", True),
)
PASSED_NAMES = ("state", "voltage", "measured", "wanted", "now_given")
SPECIAL_NAMES = {
    "h": "this.period", "t": "this.time", "forces": "compensated_forces", "absent": "compensated_none",
    "maps": "compensated_maps", "shares": "compensated_shares", "step": "step", "by_state": "a", "by_input": "b",
    "reading_by_state": "c",
}  # fmt: skip


def javascript_files(exported: ExportedModel, parts: Sequence[str] = tuple(EXPORT_PARTS)) -> dict[str, str]:
    """Text of the module by path."""
    return {MODULE_FILE: template("model.mjs.j2").render(javascript_context(exported, parts))}


def javascript_context(exported: ExportedModel, parts: Sequence[str] = tuple(EXPORT_PARTS)) -> dict[str, Any]:
    """What the templates need."""
    compensation = compensation_of(exported) if "compensator" in parts else None
    program = exported.program(tuple(p for p in parts if compensation or p != "compensator"))
    functions = {f.name: f for f in program.functions if f.public}

    def call(name: str, owner: str) -> str:
        return (
            f"{name}({', '.join(argument(p.name) for p in functions[name].parameters)})" if owner else free_call(name)
        )

    def argument(name: str) -> str:
        return name if name in PASSED_NAMES else SPECIAL_NAMES.get(name, f"this.{name}")

    def free_call(name: str) -> str:
        limits = {"least_slip": f"{compensation.least_slip!r}", "least_input": f"{float(compensation.least_input)!r}",
                  "t": "0"} if compensation else {}  # fmt: skip
        names = [p.name for p in functions[name].parameters]
        return f"{name}({', '.join(limits.get(n, SPECIAL_NAMES.get(n, n)) for n in names)})"

    module = exported.module
    doubt = (START_ERROR_SHARE * exported.parameters[exported.learnt]) ** 2
    return {
        "e": exported,
        "m": module,
        "title": f"Model of {exported.model.plant}",
        "version": version(),
        "equations": derive.equations_text(derived_model(exported.model)),
        "effects": ", ".join(exported.model.effects),
        "inputs_phrase": exported.model.plant_signature.inputs_phrase,
        "module_name": MODULE_FILE,
        "code": JavaScriptPrinter().text(program),
        "call": call,
        "flat": lambda matrix: ", ".join(number(v) for v in np.asarray(matrix).ravel()),
        "values": [number(v) for v in exported.parameters],
        "sigmas": [number(exported.sigma[n]) if n in exported.sigma else "null" for n in module.PARAMETERS],
        "absent": [number(v) for v in module.ABSENT],
        "weight": 1.0 / exported.readings_sigma,
        "doubt": np.where(doubt > 0.0, doubt, 1e-4),
        "least": [number(v) for v in exported.least],
        "zero": "0" if exported.inputs <= 1 else f"new Float64Array({exported.inputs})",
        "compensates": compensation is not None,
        "compensation": compensation,
        "compensated": compensation.effects if compensation else (),
        "filters": [f for f in FILTER_PARTS if f[0] in parts],
    }


def number(value: float) -> str:
    """A number in JavaScript."""
    if math.isinf(value):
        return "Infinity" if value > 0 else "-Infinity"
    return repr(float(value))


def template(name: str) -> jinja2.Template:
    """A template of this language."""
    return file_template(TEMPLATE_FOLDER, name)
