"""Learn: what is missing, ranked, what each candidate means for the machine, and what it cannot be told from."""

from __future__ import annotations

from collections.abc import Hashable
from typing import Any

import numpy as np
import plotly.graph_objects as go
from nicegui import ui

from wheelpend.view.force_charts import Force, over_time
from wheelpend.view.hints import chain
from wheelpend.view.panel import Panel, action, figure_of, folded, paragraph, set_enabled, table, text
from wheelpend.view.words import candidate_cells, meaning, sentences

OVER_STATE_TITLE = "The missing force over the state on which it depends most, with the law of each candidate"
CANDIDATE_HEAD = ("effect", "probability", "size", "error after", "p", "cannot be told from")


class LearnPanel(Panel):
    """Which effect is missing."""

    name, title = "learn", "4 Learn"
    purpose = (
        "Which physical effect is missing? Every one of the library is tried, and judged on data that no fit sees."
    )

    def show_buttons(self) -> None:
        """The diagnosis, and a law for what no effect explains."""
        self.learn = action("Learn what is missing", lambda: self._diagnose(), main=True)
        self.law = action("Seek a law for the rest", lambda: self._diagnose("--law"))

        self.apart = action("Design what tells them apart", self._design)
        self.steps = action("Add them all in turn", self._explain)

    def _explain(self) -> None:
        self.bench.run(*chain(self.bench, ("explain", *self.bench.files, "--save")))

    def _design(self) -> None:
        self.bench.run(("design", "--between", ",".join(self._pair()), *self.bench.fitted_files))

    def _pair(self) -> list[str]:
        """The first candidate and one that it cannot be told from, where there is one."""
        found = self.bench.current("diagnose")
        first: dict[str, Any] = next(iter(found.result.get("candidates") or []), {}) if found else {}
        others = first.get("equivalent_to") or []
        return [first["effect"], others[0]] if others else []

    def _diagnose(self, *options: str) -> None:
        drawn = [] if options else [("figures", *self.bench.files)]
        self.bench.run(("diagnose", *options, *self.bench.files), *drawn)

    def update_buttons(self) -> None:
        """It needs a log and a model; a law is for what no effect explains."""
        set_enabled(self.learn, self.bench.can_judge)
        found = self.bench.current("diagnose")
        is_unexplained = bool(found and found.result.get("verdict") == "unexplained")
        self.law.set_visibility(is_unexplained)
        self.steps.set_visibility(bool(is_unexplained and found and len(found.result.get("steps") or ()) > 1))
        model = self.bench.model()
        self.apart.set_visibility(bool(self._pair()) and model is not None and model.plant_signature.is_balanced)
        for button in (self.law, self.apart, self.steps):
            set_enabled(button, self.bench.can_judge)

    def state(self) -> Hashable:
        """The diagnosis, and its drawings."""
        return self.bench.numbers("diagnose", "figures")

    def show(self) -> None:
        """The verdict in words, the candidates, and each in detail."""
        found = self.bench.current("diagnose")
        if found is None:
            again = "diagnose" in self.bench.found
            paragraph("Not diagnosed yet, since the model or the logs changed." if again else "")
            return
        first, *rest = sentences(found.text) or [""]
        paragraph(first, "lead")
        drawn = self.bench.current("figures")
        CandidateList(found.result.get("candidates") or [], self.bench.model(), drawn.result if drawn else {})
        if found.result.get("experiment"):
            paragraph(found.result["experiment"], "note")
        with folded("More about it"):
            for sentence in rest:
                paragraph(sentence)


class CandidateList:
    """Candidates, each with what it means and its law over the data; what one would explain is drawn on demand."""

    def __init__(self, candidates: list[dict[str, Any]], model: Any, drawn: dict[str, Any]) -> None:
        if not candidates:
            return
        table(CANDIDATE_HEAD, [candidate_cells(c, model) for c in candidates], "Candidates, the likeliest first")
        self.drawn = drawn
        self.plot: ui.plotly | None = None
        if drawn.get("explained") and drawn["forces"]:
            self._show_explained(next(iter(drawn["explained"])))
        if drawn.get("over_state"):
            with folded(OVER_STATE_TITLE, is_open=True):
                plot = ui.plotly(figure_of(go.Figure(drawn["over_state"]))).classes("force force-map")
                plot.props["role"], plot.props["aria-label"] = "img", OVER_STATE_TITLE
        for candidate in candidates:
            self._show(candidate["effect"])

    def _show_explained(self, effect: str) -> None:
        with ui.element("figure"):
            plot = self.plot = ui.plotly(figure_of(self._explained(effect))).classes("force force-time")
            plot.props["role"] = "img"
            plot.props["aria-label"] = "The missing force over time, and what a candidate would explain of it"
            with ui.element("figcaption"):
                log = f" of {self.drawn['forces'][0]['log']}" if len(self.drawn["forces"]) > 1 else ""
                text(
                    f"What a candidate would explain{log}, smoothed over 0.05 s: point at one below, or move to it by "
                    "the keyboard."
                )

    def _explained(self, effect: str) -> go.Figure:
        """The missing force on the row of which the effect would explain most, and that."""
        parts = np.array(self.drawn["explained"][effect], dtype=float)
        row = int(np.argmax(np.nanmean(parts**2, axis=1)))
        told = self.drawn["forces"][0]
        force = Force.of(told, row, self.drawn["rows"][row]["unit"])
        order = np.argsort(np.array(told["t"], dtype=float), kind="stable")
        return over_time(force, np.zeros(len(order), dtype=bool), parts[row][order], effect)

    def _show(self, effect: str) -> None:
        """A candidate in words, and its law."""
        box = ui.element("div").classes("candidate")
        if effect in self.drawn.get("explained", {}):
            box.props('tabindex="0"')
            box.props["aria-label"] = f"{effect}: draws what it would explain"
            for event in ("mouseenter", "focusin"):
                box.on(event, lambda: self._point_at(effect))
        with box:
            with ui.element("h3"):
                ui.label(effect).classes("plain")
            for sentence in meaning(effect):
                paragraph(sentence)
            if effect in self.drawn.get("laws", {}):
                with folded("Its law over the data, with a band of 95 %"):
                    law = ui.plotly(figure_of(go.Figure(self.drawn["laws"][effect]))).classes("force force-state")
                    law.props["role"], law.props["aria-label"] = "img", f"The law of {effect} over the data"

    def _point_at(self, effect: str) -> None:
        if self.plot is not None:
            self.plot.update_figure(figure_of(self._explained(effect)))
