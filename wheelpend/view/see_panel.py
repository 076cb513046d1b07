"""See where: the missing force over time, each state and pairs of them; what is chosen in one chart shows in all."""

from __future__ import annotations

from collections.abc import Callable, Hashable
from functools import partial
from typing import Any

import numpy as np
import plotly.graph_objects as go
from nicegui import events, ui

from wheelpend.reports.numbers import number_text, percent_text
from wheelpend.view.force_charts import Force, over_pair, over_time, over_variable
from wheelpend.view.panel import Panel, action, figure_of, paragraph, table, text

CHOSEN_RANGES = "(event) => emit(event?.range ?? {})"  # of a selection; its points would carry all data with them


class SeePanel(Panel):
    """Where the model fails."""

    name, title = "see", "3 See where"
    purpose = "When does the model fail, and on what does that depend?"

    def state(self) -> Hashable:
        """What tells the places."""
        return self.bench.numbers("diagnose", "compare", "figures")

    def show(self) -> None:
        """The places of the missing force, from the latest result that tells them, and the force itself."""
        found = self.bench.current("diagnose") or self.bench.current("compare")
        places = found.result.get("where") if found else None
        drawn = self.bench.current("figures")
        if drawn and drawn.result["forces"]:
            MissingForceView(drawn.result, places or [])
        if not places:
            paragraph(
                "No place stands out: the missing force, if any, depends on no state."
                if found
                else "A comparison tells, and so does a diagnosis."
            )
            return
        rows = [
            [w["row"], w["state"], number_text(w["from"]), number_text(w["to"]), percent_text(w["share"])]
            for w in places
        ]
        table(("row", "state", "from", "to", "share of the missing force"), rows, "Where the missing force is found")


class MissingForceView:
    """Linked charts of the missing force of one log on one row."""

    def __init__(self, told: dict[str, Any], places: list[dict[str, Any]]) -> None:
        self.told = told
        self.rows = [row["name"] for row in told["rows"]]
        self.row = self.rows.index(places[0]["row"]) if places and places[0]["row"] in self.rows else 0
        self.log = 0
        self.force = self._force()
        self.chosen = np.zeros(len(self.force.t), dtype=bool)
        names = list(self.force.variables)
        first = places[0]["state"] if places and places[0]["state"] in names else names[0]
        self.pair = (first, next((n for n in names if n != first), first))
        self.plots: list[tuple[ui.plotly, Callable[[], go.Figure]]] = []
        self._show()

    def _force(self) -> Force:
        return Force.of(self.told["forces"][self.log], self.row, self.told["rows"][self.row]["unit"])

    def _show(self) -> None:
        """The choices, then the charts."""
        logs = [log["log"] for log in self.told["forces"]]
        with ui.element("div").classes("buttons"):
            if len(self.rows) > 1:
                self._choice("Row", self.rows, self.rows[self.row], self._take_row)
            if len(logs) > 1:
                self._choice("Log", logs, logs[self.log], self._take_log)
            action("Choose nothing", lambda: self._choose(np.zeros(len(self.force.t), dtype=bool)))
        self._chart(lambda: over_time(self.force, self.chosen), "The missing force over time", "t", "force-time")
        with ui.element("figcaption"):
            text("Drag over a stretch of time or a range of a state: the same samples stand out in every chart.")
        with ui.element("div").classes("multiples"):
            for name in self.force.variables:
                self._chart(
                    partial(self._over_variable, name),
                    f"The missing force over {name}", name, "force-state",
                )  # fmt: skip
        names = list(self.force.variables)
        if len(names) < 2:
            return
        with ui.element("div").classes("buttons"):
            for place, label in enumerate(("Map over", "and over")):
                self._choice(label, names, self.pair[place], partial(self._take_pair, place))
        self._chart(
            lambda: over_pair(self.force, self.pair, self.chosen),
            "A map of the mean missing force over two states", "pair", "force-map",
        )  # fmt: skip

    def _choice(self, label: str, options: list[str], value: str, take: Callable[[str], None]) -> None:
        chosen = ui.select(options, value=value, label=label, on_change=lambda event: take(str(event.value)))
        chosen.props("outlined dense").classes("choice")

    def _chart(self, draw: Callable[[], go.Figure], describes: str, along: str, classes: str) -> None:
        """A chart that is drawn anew with every choice, and along which samples can be chosen."""
        with ui.element("figure"):
            plot = ui.plotly(figure_of(draw())).classes(f"force {classes}")
        plot.props["role"], plot.props["aria-label"] = "img", describes
        plot.on("plotly_selected", lambda event: self._take_ranges(event, along), js_handler=CHOSEN_RANGES)
        self.plots.append((plot, draw))

    def _over_variable(self, name: str) -> go.Figure:
        return over_variable(self.force, name, self.chosen)

    def _take_ranges(self, event: events.GenericEventArguments, along: str) -> None:
        """Choose the samples within what was dragged over."""
        ranges = event.args if isinstance(event.args, dict) else {}
        if "x" not in ranges:
            return
        names = self.pair if along == "pair" else (along,)
        inside = np.ones(len(self.force.t), dtype=bool)
        for name, key in zip(names, ("x", "y"), strict=False):
            low, high = sorted(map(float, ranges[key][:2]))
            inside &= self.force.within(name, low, high)
        self._choose(inside)

    def _choose(self, chosen: np.ndarray) -> None:
        self.chosen = chosen
        for plot, draw in self.plots:
            plot.update_figure(figure_of(draw()))

    def _take_row(self, name: str) -> None:
        self.row = self.rows.index(name)
        self.force = self._force()
        self._choose(self.chosen)

    def _take_log(self, name: str) -> None:
        self.log = [log["log"] for log in self.told["forces"]].index(name)
        self.force = self._force()
        self._choose(np.zeros(len(self.force.t), dtype=bool))

    def _take_pair(self, place: int, name: str) -> None:
        self.pair = (name, self.pair[1]) if place == 0 else (self.pair[0], name)
        self._choose(self.chosen)
