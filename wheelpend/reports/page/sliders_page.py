"""Sliders for a model as it stands, as a page of its own: what other values would do, before anything is changed."""

from __future__ import annotations

import math
from pathlib import Path

from markupsafe import Markup

import derive
from wheelpend.diagnosis.compare import ComparedModel
from wheelpend.errors import Failure
from wheelpend.model.record import Model
from wheelpend.model.units import plant_units_of
from wheelpend.reports.html import rendered_page
from wheelpend.reports.page.charts import PLOTTING_SCRIPT, script_hash
from wheelpend.reports.page.packing import UNPACKING_SCRIPT
from wheelpend.reports.page.page import TEMPLATE_FILTERS
from wheelpend.reports.page.rows import parameter_meanings
from wheelpend.reports.page.sliders import Adjustable, carried_markup, slider_section


def effects_to_try(model: Model) -> dict[str, dict[str, float]]:
    """Effects that a model lacks and may be tried with, each with values at which it does nothing.

    What does nothing at an infinite size only, as a limit or a stiffness, and what happens once in a log are left out.
    """
    rows = derive.effects.applicable_to(model.plant_signature, model.own)
    found = {}
    for effect in (derive.effects.in_plant_units(e, model.plant_signature) for e in rows if not e.event):
        begin = {effect.name_of(p): p.absent if p in effect.sizes else p.typical for p in effect.parameters}
        if effect.name not in model.effects and all(map(math.isfinite, begin.values())):
            found[effect.name] = begin
    return found


def with_absent_effect(model: Model, name: str) -> Model:
    """The model with one effect more, at sizes at which it does nothing; raises Failure where there are none."""
    begin = effects_to_try(model).get(name)
    if begin is None:
        raise Failure(
            f"An effect that is tried must be one that the model lacks and that does nothing at some size, but {name} "
            "is none. Try another, or `wheelpend add` it."
        )
    return model.with_effects([*model.effects, name]).with_fit({n: (v, None) for n, v in begin.items()})


def sliders_page(compared: ComparedModel) -> str:
    """Text of the page; raises Failure where the model cannot be moved, saying why."""
    model = compared.problem.model
    meanings = {n: meaning for n, (_, meaning) in parameter_meanings(model).items()}
    sliders, why = slider_section(Adjustable.of_comparison(compared), plant_units_of(model), meanings)
    if sliders is None:
        raise Failure(why)
    plotly = PLOTTING_SCRIPT.read_text(encoding="utf-8")
    return rendered_page(
        Path(__file__).parent,
        "sliders_page.html.j2",
        "style.css",
        TEMPLATE_FILTERS,
        plotly=Markup(plotly),
        unpacking=Markup(UNPACKING_SCRIPT),
        script_hashes=Markup(" ".join(map(script_hash, (plotly, UNPACKING_SCRIPT, sliders.script)))),
        sliders=sliders,
        slider_data=carried_markup(sliders),
        slider_script=Markup(sliders.script),
        title=f"What if: {sliders.log_name}",
    )
