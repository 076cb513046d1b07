"""An effect of one's own: its table of effects.toml, checked while it is typed, and its law as a picture."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
import plotly.graph_objects as go
import sympy as sp
from nicegui import background_tasks, run, ui

from derive.effects import DryForce, Effect, Force, InputMap, SensorMap
from derive.functions import symbol
from derive.parameter_name import full_name
from derive.plant_signature import PlantSignature
from wheelpend.errors import Failure
from wheelpend.files import write_text
from wheelpend.model.toml_file import USER_EFFECTS_FILE
from wheelpend.model.user_effects import check_name_is_free, effects_from_text
from wheelpend.reports.page.law_expressions import numeric_law, resistance_law
from wheelpend.view.bench import Bench
from wheelpend.view.hints import chain
from wheelpend.view.panel import action, figure_of, paragraph, set_enabled

DRAFT_FILE = "new_effects.toml"  # of the workspace, from which `effects --define` takes them over
FIRST_TEXT = """[my_friction]
family = "drive"
sentence = "A resistance that grows with the speed, up to a limit."
on = "{port}"
law = "torque*tanh(speed/width)"
dissipates = true

[my_friction.parameters]
torque = {{ unit = "{force}", minimum = 0, typical = 0.3 }}
width = {{ unit = "{speed}", minimum = 0.05, typical = 3.0, starts = [1.0, 3.0, 8.0] }}
"""
LAW_POINTS = 241
LAW_RANGE = 10.0  # of the one argument, to either side, over which a law is drawn
LAW_COLOUR = "#2f86d6"
TYPING_PAUSE_MS = 300  # after which what was typed is checked


class Checked(NamedTuple):
    """What is said of a text, whether it states effects, and the law of the first."""

    sentence: str
    is_right: bool = False
    law: go.Figure | None = None


class OwnEffectForm:
    """A text that is checked while it is typed."""

    def __init__(self, bench: Bench) -> None:
        self.bench = bench
        self.is_right, self.taken = False, [""]  # names of what is in effects.toml already
        paragraph(
            "A few lines state an effect: where it acts, its law, its parameters. Nothing in them is executed. "
            "It is then tried, refitted, drawn and added like those of the library."
        )
        self.field = ui.textarea(label="The effect, as a table of effects.toml", on_change=self._check)
        self.field.props(f'outlined autogrow debounce="{TYPING_PAUSE_MS}" spellcheck="false"').classes("own-effect")
        self.said = ui.label().classes("plain").props('role="status"')
        self.place = ui.element("div")
        self.keep = action(
            "Keep it in effects.toml", self._keep, describes="Keep the effect in effects.toml of the workspace"
        )

    def update(self) -> None:
        """It needs a model; a text to begin with is there as soon as there is one."""
        model = self.bench.model()
        if model is not None and not self.field.value:
            self.field.set_value(template(model.plant_signature))
        if model is not None and self.taken != (taken := list(model.own)):
            self.taken = taken
            background_tasks.create(self._check())
        self._update_button()

    def _update_button(self) -> None:
        set_enabled(self.keep, self.is_right and not self.bench.is_busy)

    async def _check(self) -> None:
        model = self.bench.model()
        if model is None:
            return
        typed = str(self.field.value or "")
        found = await run.io_bound(checked, typed, model.plant_signature, list(model.own))
        if found is not None and typed == str(self.field.value or ""):  # else it was typed on meanwhile
            self._show(found)

    def _show(self, found: Checked) -> None:
        self.is_right = found.is_right
        self._update_button()
        self.said.set_text(found.sentence)
        self.place.clear()
        if found.law is not None:
            with self.place:
                plot = ui.plotly(figure_of(found.law)).classes("force force-state")
                plot.props["role"], plot.props["aria-label"] = "img", "The law with its typical values"

    def _keep(self) -> None:
        if self.is_right:
            write_text(self.bench.folder / DRAFT_FILE, str(self.field.value))
            define = ("effects", "--define", DRAFT_FILE, *self.bench.model_words)
            self.bench.run(*chain(self.bench, define) if self.bench.logs else [define])


def template(plant: PlantSignature) -> str:
    """A table to begin with, for a plant, in its units."""
    port = plant.ports[0]
    return FIRST_TEXT.format(port=port.name, force=plant.force_unit(port.unit), speed=f"{port.unit}/s")


def checked(text: str, plant: PlantSignature, taken: Sequence[str]) -> Checked:
    """What is right or wrong with a text that states effects, and a picture of the first one's law."""
    try:
        effects = effects_from_text(text, plant)
        for effect in effects:
            check_name_is_free(effect.name, taken, Path(USER_EFFECTS_FILE))
    except Failure as failure:
        return Checked(str(failure))
    if not effects:
        return Checked("A table in square brackets must name an effect; there is none yet.")
    names = ", ".join(e.name for e in effects)
    return Checked(f"Right: {names} can be tried.", True, law_figure(effects[0], plant))


def law_figure(effect: Effect, plant: PlantSignature) -> go.Figure | None:
    """A law over its only argument, with its typical values; None where it has none or several."""
    law, label = _law_of(effect, plant)
    free = sorted(law.free_symbols - set(effect.symbols.values()), key=str)
    if len(free) != 1:
        return None
    x = np.linspace(-LAW_RANGE, LAW_RANGE, LAW_POINTS)
    typical = {full_name(effect.name, p.name): p.typical for p in effect.parameters}
    with np.errstate(all="ignore"):
        y = numeric_law(effect, law, free)(typical, x)
    drawn = np.where(np.isfinite(y), y, np.nan)
    figure = go.Figure(go.Scatter(x=x, y=drawn, mode="lines", line={"color": LAW_COLOUR, "width": 2}))
    figure.update_xaxes(title_text=str(free[0]))
    figure.update_yaxes(title_text=label)
    return figure


def _law_of(effect: Effect, plant: PlantSignature) -> tuple[sp.Expr, str]:
    """A law with its own argument, and what it is."""
    match effect.enters:
        case Force() | DryForce():
            return resistance_law(effect, symbol("angle"), symbol("speed")), "resistance"
        case InputMap():
            law = effect.enters.law(symbol(plant.input), symbol("t"), **effect.symbols)
            return law, f"{plant.input_word} that acts"
        case SensorMap():
            return effect.enters.law(symbol("reading"), **effect.symbols), "what the sensor reads"
        case _:
            return sp.Integer(0), ""
