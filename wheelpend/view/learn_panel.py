"""Learn: what is missing, ranked, what each candidate means for the machine, and what it cannot be told from."""

from __future__ import annotations

from collections.abc import Hashable
from typing import Any

from nicegui import ui

from wheelpend.view.panel import Panel, action, folded, paragraph, set_enabled, table
from wheelpend.view.words import candidate_cells, meaning, sentences

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
        self.law.set_visibility(bool(found and found.result.get("verdict") == "unexplained"))
        self.apart.set_visibility(bool(self._pair()))
        for button in (self.law, self.apart):
            set_enabled(button, self.bench.can_judge)

    def state(self) -> Hashable:
        """The diagnosis."""
        return self.bench.numbers("diagnose")

    def show(self) -> None:
        """The verdict in words, the candidates, and each in detail."""
        found = self.bench.current("diagnose")
        if found is None:
            again = "diagnose" in self.bench.found
            paragraph("Not diagnosed yet, since the model or the logs changed." if again else "")
            return
        first, *rest = sentences(found.text) or [""]
        paragraph(first, "lead")
        _show_candidates(found.result.get("candidates") or [], self.bench.model())
        if found.result.get("experiment"):
            paragraph(found.result["experiment"], "note")
        with folded("More about it"):
            for sentence in rest:
                paragraph(sentence)


def _show_candidates(candidates: list[dict[str, Any]], model: Any) -> None:
    if not candidates:
        return
    table(CANDIDATE_HEAD, [candidate_cells(c, model) for c in candidates], "Candidates, the likeliest first")
    for candidate in candidates:
        with ui.element("div").classes("candidate"), ui.element("h3"):
            ui.label(candidate["effect"]).classes("plain")
        for sentence in meaning(candidate["effect"]):
            paragraph(sentence)
