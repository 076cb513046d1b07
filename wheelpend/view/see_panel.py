"""See where: the missing force, over time and over each state."""

from __future__ import annotations

from collections.abc import Hashable

from wheelpend.reports.numbers import number_text, percent_text
from wheelpend.view.panel import Panel, paragraph, table


class SeePanel(Panel):
    """Where the model fails."""

    name, title = "see", "3 See where"
    purpose = "When does the model fail, and on what does that depend?"

    def state(self) -> Hashable:
        """What tells the places."""
        return self.bench.numbers("diagnose", "compare")

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
        table(("row", "state", "from", "to", "share of the missing force"), rows, "Where the missing force is found")
