"""A model as an ES module without dependencies."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import jinja2
import numpy as np

from wheelpend.export.context import translated_model
from wheelpend.export.exported_model import LIBRARY_PARTS, ExportedModel
from wheelpend.export.templates import file_template
from wheelpend.export.translate.javascript_code import JavaScriptPrinter

TEMPLATE_FOLDER = Path(__file__).with_name("javascript")
MODULE_FILE, REPLAY_FILE, SEGMENTS_FILE = "wheelpend_model.mjs", "replay.mjs", "segments.mjs.j2"
FILTER_PARTS = (
    ("observer", "The state from the sensors, with the random force: the filter of `wheelpend identify`.", False),
    ("identifier", "The same, which learns parameters as it runs.", True),
)
PASSED_NAMES = ("state", "voltage", "measured", "wanted", "now_given", "gate")
SPECIAL_NAMES = {
    "h": "this.period", "t": "this.time", "forces": "compensated_forces", "absent": "compensated_none",
    "maps": "compensated_maps", "shares": "compensated_shares", "step": "step", "by_state": "a", "by_input": "b",
    "reading_by_state": "c",
}  # fmt: skip


def javascript_files(exported: ExportedModel, parts: Sequence[str] = LIBRARY_PARTS) -> dict[str, str]:
    """Text of the module by path."""
    return {MODULE_FILE: _template("model.mjs.j2").render(_context(exported, parts))}


def javascript_replay_text(exported: ExportedModel) -> str:
    """A program that replays logs with the module."""
    return _template(f"{REPLAY_FILE}.j2").render(_replay_context(exported))


def javascript_page_module(exported: ExportedModel) -> str:
    """Text of a module that simulates the machine along segments of a log, for a page that carries it."""
    model = javascript_files(exported, ("machine",))[MODULE_FILE]
    plain = "\n".join(line for line in model.splitlines() if not line.lstrip().startswith(("//", "/**")))
    return plain + _template(SEGMENTS_FILE).render(_replay_context(exported))


def _replay_context(exported: ExportedModel) -> dict[str, Any]:
    return {"e": exported, "m": exported.module, "zero": _zero(exported), "module_name": MODULE_FILE}


def _context(exported: ExportedModel, parts: Sequence[str]) -> dict[str, Any]:
    translated = translated_model(exported, parts)
    compensation = translated.compensation
    limits = {"t": "0"}
    if compensation:
        limits |= {"least_slip": number(compensation.least_slip), "least_input": number(compensation.least_input)}

    def call(name: str, owner: str) -> str:
        return f"{name}({', '.join(argument(p.name, owner) for p in translated.functions[name].parameters)})"

    def argument(name: str, owner: str) -> str:
        if not owner:
            return limits.get(name, SPECIAL_NAMES.get(name, name))
        return name if name in PASSED_NAMES else SPECIAL_NAMES.get(name, f"this.{name}")

    return translated.values | {
        "code": JavaScriptPrinter().text(translated.program),
        "call": call,
        "flat": lambda matrix: ", ".join(number(v) for v in np.asarray(matrix).ravel()),
        "values": [number(v) for v in exported.parameters],
        "sigmas": [number(exported.sigma[n]) if n in exported.sigma else "null" for n in exported.module.PARAMETERS],
        "absent": [number(v) for v in exported.module.ABSENT],
        "least": [number(v) for v in exported.least],
        "zero": _zero(exported),
        "filters": [f for f in FILTER_PARTS if f[0] in parts],
    }


def _zero(exported: ExportedModel) -> str:
    """No command."""
    return "0" if exported.inputs <= 1 else f"new Float64Array({exported.inputs})"


def number(value: float) -> str:
    """A number in JavaScript."""
    if math.isinf(value):
        return "Infinity" if value > 0 else "-Infinity"
    return repr(float(value))


def _template(name: str) -> jinja2.Template:
    """A template of this language."""
    return file_template(TEMPLATE_FOLDER, name)
