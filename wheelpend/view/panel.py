"""A step of the work as a part of the page: what it is for, its buttons, and what came of it.

Buttons are made once, so that the keyboard stays where it is; what came of a step is shown anew when it changed.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Hashable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any
from weakref import WeakKeyDictionary

import plotly.graph_objects as go
from nicegui import Client, ui

from wheelpend.view.bench import Bench

CHART_LAYOUT = {
    "paper_bgcolor": "rgba(0,0,0,0)",
    "plot_bgcolor": "rgba(0,0,0,0)",
    "margin": {"l": 60, "r": 16, "t": 16, "b": 48},
    "height": 280,
    "legend": {"orientation": "h", "y": 1.12},
    "template": "none",
}

CHART_CONFIG = {"displayModeBar": False}

window_refreshes: WeakKeyDictionary[Client, Callable[[], object]] = WeakKeyDictionary()  # of every open window


class Panel:
    """A section of the page; a step fills in ``title``, ``purpose``, and what it shows."""

    name, title, purpose = "", "", ""

    def __init__(self, bench: Bench) -> None:
        self.bench = bench
        self._shown: Hashable = None
        self.section = ui.element("section").classes("panel")
        with self.section.props(f'id="{self.name}" aria-labelledby="{self.name}-title"'):
            with ui.element("h2").props(f'id="{self.name}-title"'):
                text(self.title)
            paragraph(self.purpose, "soft")
            self.buttons = ui.element("div").classes("buttons")
            with self.buttons:
                self.show_buttons()
            self.body = ui.element("div").classes("body")

    def show_buttons(self) -> None:
        """Make the buttons of the step."""

    def update_buttons(self) -> None:
        """Say of each button whether it can be pressed now."""

    def state(self) -> Hashable:
        """What the body depends on: it is shown anew where that changed, and stays where it did not."""
        return self.bench.version

    def show(self) -> None:
        """Fill the body."""

    def update(self) -> None:
        """Show what changed since the last time."""
        if (state := self.state()) != self._shown:
            self._shown = state
            self.body.clear()
            with self.body:
                self.show()
        self.update_buttons()  # those that were just shown too


def text(words: str) -> None:
    """Text as it is, whoever wrote it: never markup."""
    ui.label(words).classes("plain")


def paragraph(words: str, classes: str = "") -> None:
    """A paragraph of text."""
    ui.label(words).classes(f"paragraph {classes}")


def action(words: str, press: Callable[[], object], *, main: bool = False, describes: str = "") -> ui.button:
    """A button that says what it does."""
    button = ui.button(words, on_click=lambda: _pressed(press), color=None).props("no-caps unelevated")
    button.classes("action main" if main else "action")
    if describes:
        button.props["aria-label"] = describes
    return button


def _pressed(press: Callable[[], object]) -> object:
    """Do what a button says, and show at once what can be pressed now: a second click would be lost."""
    found = press()
    if (refresh := window_refreshes.get(ui.context.client)) is not None:
        refresh()
    return found  # which may be something to be awaited


def set_enabled(button: ui.button, enabled: bool) -> None:
    """Let a button be pressed, or not, and tell the browser only where that changed."""
    if button.enabled != enabled:
        button.set_enabled(enabled)


def table(head: Sequence[str], rows: Sequence[Sequence[str]], caption: str) -> None:
    """A table of text, its first column the name of the row."""
    with _wide(caption), ui.element("table"):
        with ui.element("caption"):
            text(caption)
        with ui.element("thead"), ui.element("tr"):
            for words in head:
                with ui.element("th").props('scope="col"'):
                    text(words)
        with ui.element("tbody"):
            for row in rows:
                _row(row)


def _wide(describes: str) -> ui.element:
    """A place that scrolls by itself, by the keyboard too, where what it holds is wider than the page."""
    place = ui.element("div").classes("wide").props('tabindex="0" role="region"')
    place.props["aria-label"] = describes
    return place


def _row(cells: Sequence[str]) -> None:
    with ui.element("tr"):
        for number, words in enumerate(cells):
            with ui.element("td" if number else "th").props("" if number else 'scope="row"'):
                text(words)


@contextmanager
def folded(words: str, *, is_open: bool = False) -> Iterator[None]:
    """What is read on demand, behind a line that opens it."""
    with ui.element("details").props("open" if is_open else ""):
        with ui.element("summary"):
            text(words)
        yield


def figure_of(figure: go.Figure) -> dict[str, Any]:
    """A figure as the browser draws it, in the page's colours and as high as its place."""
    drawn = json.loads(figure.to_json())
    layout = {**CHART_LAYOUT, **drawn["layout"], "template": "none"}
    return {"data": drawn["data"], "layout": {**layout, "height": None}, "config": CHART_CONFIG}


def chart(figure: go.Figure, describes: str) -> None:
    """A chart that follows the page's colours, with words for those who do not see it."""
    height = figure.layout.height or CHART_LAYOUT["height"]
    figure.update_layout({**CHART_LAYOUT, "height": height})
    with ui.element("figure"):
        shown = ui.plotly({**json.loads(figure.to_json()), "config": CHART_CONFIG}).classes("chart")
        shown.style(f"height: {height}px")
        shown.props["role"], shown.props["aria-label"] = "img", describes
        with ui.element("figcaption"):
            text(describes)
