"""Add: the effect becomes part of the model, the error falls, and the ladder tells every change so far."""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from typing import Any

import plotly.graph_objects as go
from nicegui import ui

from wheelpend.reports.numbers import number_text
from wheelpend.view.bench import Bench
from wheelpend.view.hints import chain, next_step
from wheelpend.view.panel import Panel, action, chart, folded, paragraph, set_enabled, table
from wheelpend.view.words import ladder_rows, parameter_rows

LADDER_COLOUR = "#2f86d6"
LADDER_HEAD = ("change", "error before", "error after", "on", "when")


class AddPanel(Panel):
    """What is added, undone, and what the model has become."""

    name, title = "add", "5 Add"
    purpose = "Add it, derive the model again, refit, and watch the error fall."

    def show_buttons(self) -> None:
        """Add, undo, redo, and a choice of any effect."""
        self.add = action("Add", self._add, main=True)
        self.undo = action("Undo", lambda: self._change("remove", undoable(self.bench)))
        self.redo = action("Redo", lambda: self._change("add", redoable(self.bench)))

    def update_buttons(self) -> None:
        """Each says which effect it is about."""
        effect, last, again = next_step(self.bench).effect, undoable(self.bench), redoable(self.bench)
        for button, word, name in ((self.add, "Add", effect), (self.undo, "Undo", last), (self.redo, "Redo", again)):
            button.set_text(f"{word} {name}" if name else word)
            set_enabled(button, bool(name) and self.bench.can_judge)

    def _add(self) -> None:
        self._change("add", next_step(self.bench).effect)

    def _change(self, command: str, effect: str) -> None:
        if effect:
            self.bench.run(*chain(self.bench, (command, effect, *self.bench.files)))

    def state(self) -> Hashable:
        """The workspace, and its equations."""
        return self.bench.watch.digest(), *self.bench.numbers("equations")

    def show(self) -> None:
        """The ladder, the parameters and the equations."""
        entries = self.bench.history()
        if entries:
            _show_ladder(entries)
        model = self.bench.model()
        if model is None:
            paragraph("There is no model yet.")
            return
        named = ", ".join(model.effects) or "no effect yet"
        paragraph(f"The model of the {model.plant} has {named}.")
        with folded("Parameters, with intervals of 95 %"):
            table(("parameter", "value", "interval", "from"), parameter_rows(model), "Parameters of the model")
        _show_equations(self.bench, undoable(self.bench))


def undoable(bench: Bench) -> str:
    """The effect that the last change added, if the model has it still; else nothing."""
    return _last(bench, "add", present=True)


def redoable(bench: Bench) -> str:
    """The effect that the last change removed, if the model lacks it still; else nothing."""
    return _last(bench, "remove", present=False)


def _last(bench: Bench, change: str, present: bool) -> str:
    model = bench.model()
    added = [words for entry in bench.history() if (words := str(entry.get("change", "")).split())]
    if model is None or not added:
        return ""
    if change == "remove":
        word, effect = added[-1][0], added[-1][-1]
        return effect if word == change and effect not in model.effects else ""
    names = [words[-1] for words in added if words[0] == change and words[-1] in model.effects]
    return names[-1] if names else ""


def ladder_figure(entries: Sequence[dict[str, Any]]) -> go.Figure | None:
    """The error after each change and before the first, as bars; None where no change was judged."""
    judged = [e for e in entries if e.get("error_after") is not None]
    if not judged:
        return None
    first = judged[0].get("error_before")
    bars = [("before", first)] if first is not None else []
    bars += [(f"{number}: {e['change']}", e["error_after"]) for number, e in enumerate(judged, 1)]
    labels, errors = zip(*bars, strict=True)
    figure = go.Figure(go.Bar(x=errors, y=labels, orientation="h", marker_color=LADDER_COLOUR,
                              text=[number_text(e) for e in errors]))  # fmt: skip
    figure.update_xaxes(type="log", title_text="error [σ]")
    figure.update_yaxes(autorange="reversed", automargin=True)
    return figure


def _show_ladder(entries: Sequence[dict[str, Any]]) -> None:
    if (figure := ladder_figure(entries)) is not None:
        chart(figure, "The error after each change, and before the first: the shorter a bar, the better the prediction")
    table(LADDER_HEAD, ladder_rows(entries), "The ladder: every change of this workspace, and what it did to the error")


def _show_equations(bench: Bench, newest: str) -> None:
    found = bench.found.get("equations")
    if found is None:
        return
    with folded(f"Equations{f', with {newest} marked' if newest else ''}"), ui.element("div").classes("code"):
        for line in found.text:
            is_new = bool(newest) and f"{newest}." in line
            ui.label(line or " ").classes("plain new" if is_new else "plain")
