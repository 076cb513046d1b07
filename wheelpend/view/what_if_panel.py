"""What if: values are moved by sliders, and the browser simulates the log anew, before anything is changed."""

from __future__ import annotations

from collections.abc import Hashable

from nicegui import ui

from wheelpend.reports.page.sliders_page import effects_to_try
from wheelpend.view.panel import Panel, action, paragraph, set_enabled

NO_EFFECT = "the model as it stands"
FRAME_LABEL = "Sliders for the parameters, and what they do to the prediction and to its error"


class WhatIfPanel(Panel):
    """Sliders for every parameter, of the model's effects and of one that it lacks."""

    name, title = "what_if", "What if"
    purpose = (
        "What would another value do, or an effect that the model lacks? Sliders simulate the log anew in this window; "
        "the model stays as it is."
    )

    def show_buttons(self) -> None:
        """The effect to try, and the sliders."""
        self.effect = ui.select([NO_EFFECT], value=NO_EFFECT, label="With").props("outlined dense").classes("choice")
        self.try_it = action("Show sliders", self._show_sliders)

    def update_buttons(self) -> None:
        """Sliders need a log and a model."""
        set_enabled(self.try_it, self.bench.can_judge)

    def state(self) -> Hashable:
        """The model, whose effects cannot be added, and the sliders."""
        return self.bench.watch.model_digest(), *self.bench.numbers("sliders")

    def show(self) -> None:
        """The sliders, in a frame of their own."""
        self._offer_effects()
        found = self.bench.current("sliders")
        if found is None:
            again = "sliders" in self.bench.found
            paragraph("The model or the logs changed: show the sliders again." if again else "")
            return
        effect = found.result["effect"]
        paragraph(f"{effect} is not in the model: it begins where it does nothing. Move it." if effect else "")
        frame = ui.element("iframe").classes("sliders")
        frame.props["srcdoc"], frame.props["title"] = found.result["page"], FRAME_LABEL
        frame.props["sandbox"] = "allow-scripts"

    def _offer_effects(self) -> None:
        """Every effect of the plant that the model lacks."""
        model = self.bench.model()
        options = [NO_EFFECT, *(effects_to_try(model) if model else ())]
        if options != self.effect.options:
            self.effect.set_options(options, value=self.effect.value if self.effect.value in options else NO_EFFECT)

    def _show_sliders(self) -> None:
        chosen = str(self.effect.value)
        words = () if chosen == NO_EFFECT else ("--with", chosen)
        self.bench.run(("sliders", *words, *self.bench.files))
