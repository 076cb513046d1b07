"""See where: the missing force, over time and over each state."""

from __future__ import annotations

from collections.abc import Hashable
from typing import Any

from nicegui import ui

from wheelpend.reports.numbers import number_text, percent_text
from wheelpend.view.panel import CHART_CONFIG, Panel, folded, paragraph, table

LEGEND_ABOVE = {"orientation": "h", "yanchor": "bottom", "y": 1.0}
MAX_OPEN_FIGURES = 2  # the others are behind a line each


class SeePanel(Panel):
    """Where the model fails."""

    name, title = "see", "3 See where"
    purpose = "When does the model fail, and on what does that depend?"

    def state(self) -> Hashable:
        """What tells the places."""
        return self.bench.numbers("diagnose", "compare", "figures")

    def show(self) -> None:
        """The places of the missing force, from the latest result that tells them."""
        found = self.bench.current("diagnose") or self.bench.current("compare")
        places = found.result.get("where") if found else None
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
        drawn = self.bench.current("figures")
        for number, found in enumerate(drawn.result["figures"] if drawn else []):
            with folded(found["title"], is_open=number < MAX_OPEN_FIGURES):
                _show_figure(found["figure"], found["title"])
        table(("row", "state", "from", "to", "share of the missing force"), rows, "Where the missing force is found")


def _show_figure(figure: dict[str, Any], title: str) -> None:
    layout = {**figure["layout"], "legend": LEGEND_ABOVE}
    shown = ui.plotly({"data": figure["data"], "layout": layout, "config": CHART_CONFIG}).classes("force")
    shown.props["role"], shown.props["aria-label"] = "img", title
