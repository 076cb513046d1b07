"""Add: the effect becomes part of the model, the error falls, and the ladder tells every change so far."""

from __future__ import annotations

from collections.abc import Hashable, Mapping, Sequence
from typing import Any

import plotly.graph_objects as go
from nicegui import ui

from wheelpend.reports.numbers import number_text
from wheelpend.view.bench import Bench
from wheelpend.view.hints import chain, next_step
from wheelpend.view.panel import Panel, action, chart, folded, paragraph, set_enabled, table
from wheelpend.view.words import NORMAL_QUANTILE, ladder_rows, parameter_rows

LADDER_COLOUR = "#2f86d6"
STEP_COLOURS = ("#8a919c", "#d98a1f", "#2f86d6", "#5b8c5a", "#a05195", "#7a5230")
PARAMETERS_WORDS = "Each parameter after each change, over its last value, with its interval of 95 %"
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


def parameter_figure(entries: Sequence[dict[str, Any]]) -> go.Figure | None:
    """Each parameter after each change over its last value, with intervals of 95 %; None before the second fit."""
    fitted = [(str(e.get("change", "")), found) for e in entries if (found := _estimates(e))]
    last = {name: value for _, found in fitted for name, (value, _) in found.items()}
    shown = [name for name, value in last.items() if value and sum(name in found for _, found in fitted) > 1]
    if not shown:
        return None
    figure = go.Figure()
    for number, (change, found) in enumerate(fitted, 1):
        names = [name for name in shown if name in found]
        relative = [(found[name][0] / last[name], found[name][1] / abs(last[name])) for name in names]
        bars = {"type": "data", "array": [NORMAL_QUANTILE * sigma for _, sigma in relative], "thickness": 1.5}
        marker = {"color": STEP_COLOURS[(number - 1) % len(STEP_COLOURS)], "size": 8, "symbol": number % 20}
        figure.add_scatter(x=[value for value, _ in relative], y=names, mode="markers", error_x=bars, marker=marker,
                           name=f"{number}: {change}")  # fmt: skip
    figure.update_layout(scattermode="group", scattergap=0.6, height=120 + 44 * len(shown))
    figure.update_xaxes(title_text="over the last value")
    figure.update_yaxes(autorange="reversed", automargin=True, type="category")
    return figure


def _estimates(entry: Mapping[str, Any]) -> dict[str, tuple[float, float]]:
    """The parameters of a change with their standard errors, as far as the history states numbers."""
    found = entry.get("parameters")
    stated = found.items() if isinstance(found, dict) else ()
    pairs = {name: (e.get("value"), e.get("sigma")) for name, e in stated if isinstance(e, dict)}
    return {
        name: (float(value), float(sigma or 0.0))
        for name, (value, sigma) in pairs.items()
        if isinstance(value, (int, float)) and isinstance(sigma, (int, float, type(None)))
    }


def _show_ladder(entries: Sequence[dict[str, Any]]) -> None:
    if (figure := ladder_figure(entries)) is not None:
        chart(figure, "The error after each change, and before the first: the shorter a bar, the better the prediction")
    if (figure := parameter_figure(entries)) is not None:
        with folded("How the parameters moved"):
            chart(figure, PARAMETERS_WORDS)
    table(LADDER_HEAD, ladder_rows(entries), "The ladder: every change of this workspace, and what it did to the error")


def _show_equations(bench: Bench, newest: str) -> None:
    found = bench.found.get("equations")
    if found is None:
        return
    with folded(f"Equations{f', with {newest} marked' if newest else ''}"), ui.element("div").classes("code"):
        for line in found.text:
            is_new = bool(newest) and f"{newest}." in line
            ui.label(line or " ").classes("plain new" if is_new else "plain")
