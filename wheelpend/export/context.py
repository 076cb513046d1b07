"""What the templates of every language are given."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import derive
from wheelpend.export.compensation import Compensation, compensation_of
from wheelpend.export.exported_model import ExportedModel
from wheelpend.export.translate.program import Function, Program
from wheelpend.model.equations import derived_model
from wheelpend.version import version


class TranslatedModel(NamedTuple):
    """A model's kernels as a program, and what is said of it in any language."""

    program: Program
    functions: dict[str, Function]  # those that the files around them call, by name
    compensation: Compensation | None
    values: dict[str, Any]


def translated_model(exported: ExportedModel, parts: Sequence[str], lanes: int = 0) -> TranslatedModel:
    """The kernels of some parts; without a compensator where no effect can be compensated."""
    compensation = compensation_of(exported) if "compensator" in parts else None
    program = exported.program([p for p in parts if compensation or p != "compensator"], lanes)
    model = exported.model
    values = {
        "e": exported,
        "m": exported.module,
        "title": f"Model of {model.plant}",
        "version": version(),
        "equations": derive.equations_text(derived_model(model)),
        "effects": ", ".join(model.effects),
        "inputs_phrase": model.plant_signature.inputs_phrase,
        "weight": 1.0 / exported.readings_sigma,
        "compensates": compensation is not None,
        "compensation": compensation,
        "compensated": compensation.effects if compensation else (),
    }
    return TranslatedModel(program, {f.name: f for f in program.functions if f.public}, compensation, values)
