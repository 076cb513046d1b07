"""Signals over time, in panes that are zoomed together, reduced to the window."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
import plotly.graph_objects as go
from nicegui import events, ui
from plotly.subplots import make_subplots

from wheelpend.view.panel import CHART_CONFIG, CHART_LAYOUT, text
from wheelpend.view.reduction import reduced, window_of

WINDOW_PIXELS = 600  # of a line, on a window of some 1200
PANE_HEIGHT_PX, MARGIN_PX = 130, 90
HELD_OUT_SHADE = {"fillcolor": "#5b8c5a", "opacity": 0.12, "line_width": 0}


class Line(NamedTuple):
    """A line of a pane."""

    values: Callable[[slice], np.ndarray]  # of a range of samples
    colour: str


class Pane(NamedTuple):
    """Lines on one axis."""

    title: str
    lines: tuple[Line, ...]


class TimeChart:
    """Panes over the same time, and how they are zoomed into."""

    def __init__(
        self, t: np.ndarray, panes: Sequence[Pane], describes: str, caption: str, *, is_shaded: bool = False
    ) -> None:
        self.t, self.panes, self.is_shaded = t, panes, is_shaded
        with ui.element("figure"):
            self.plot = ui.plotly(self._figure(float(t[0]), float(t[-1]))).classes("tall")
            self.plot.props["role"], self.plot.props["aria-label"] = "img", describes
            self.plot.style(f"height: {self._height}px")
            self.plot.on("plotly_relayout", self._zoom)
            with ui.element("figcaption"):
                text(f"{caption} Drag to zoom all, double-click to go back.")

    @property
    def _height(self) -> int:
        return PANE_HEIGHT_PX * len(self.panes) + MARGIN_PX

    def _zoom(self, event: events.GenericEventArguments) -> None:
        """Draw the stretch that the browser shows, from all of its samples."""
        said = event.args if isinstance(event.args, dict) else {}
        limits = [value for key, value in said.items() if key.partition(".")[2].startswith("range[")]
        if len(limits) >= 2:
            self._draw(float(min(limits[:2])), float(max(limits[:2])))
        elif any(key.endswith("autorange") for key in said):
            self._draw(float(self.t[0]), float(self.t[-1]))

    def _draw(self, begin: float, end: float) -> None:
        self.plot.update_figure(self._figure(begin, end))

    def _figure(self, begin: float, end: float) -> dict[str, Any]:
        """The figure of a stretch of time."""
        figure = make_subplots(len(self.panes), 1, shared_xaxes=True, vertical_spacing=0.02)
        window = window_of(self.t, begin, end)
        for row, pane in enumerate(self.panes, 1):
            for line in pane.lines:
                self._add(figure, row, window, line)
            figure.update_yaxes(title_text=pane.title, row=row)
        figure.update_layout({**CHART_LAYOUT, "height": self._height, "showlegend": False})
        figure.update_xaxes(range=[begin, end])
        figure.update_xaxes(title_text="t [s]", row=len(self.panes))
        if self.is_shaded:
            figure.add_vrect(x0=float(self.t[0]), x1=float(self.t[-1]), **HELD_OUT_SHADE)
        return {**json.loads(figure.to_json()), "config": CHART_CONFIG}

    def _add(self, figure: go.Figure, row: int, window: slice, line: Line) -> None:
        t, values = reduced(self.t[window], line.values(window), WINDOW_PIXELS)
        shown = [None if np.isnan(v) else v for v in values.tolist()]
        style = {"color": line.colour, "width": 1.3}
        figure.add_trace(go.Scatter(x=t.tolist(), y=shown, mode="lines", line=style, hoverinfo="x+y"), row=row, col=1)
