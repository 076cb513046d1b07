"""Signals over time, in panes that are zoomed together, reduced to the window."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
from nicegui import events, ui
from plotly.subplots import make_subplots

from wheelpend.view.panel import CHART_CONFIG, CHART_LAYOUT, text
from wheelpend.view.reduction import long_intervals, reduced, window_of, within

WINDOW_PIXELS = 600  # of a line, on a window of some 1200
PANE_HEIGHT_PX, MARGIN_PX = 130, 90
DRAWN_DIGITS = 5  # of the range that is drawn
HELD_OUT_SHADE = {"fillcolor": "#5b8c5a", "opacity": 0.12, "line_width": 0}
CHOSEN_SHADE = {"fillcolor": "#5b8c5a", "opacity": 0.25}


class Line(NamedTuple):
    """A line of a pane."""

    values: Callable[[slice], np.ndarray]  # of a range of samples
    colour: str


class Pane(NamedTuple):
    """Lines on one axis."""

    title: str
    lines: tuple[Line, ...]


class TimeDrawing:
    """What a browser draws of panes over the same time."""

    def __init__(self, t: np.ndarray, panes: Sequence[Pane], *, is_shaded: bool = False) -> None:
        self.t, self.panes = t, panes
        self.long, self.layout = long_intervals(t), self._layout(is_shaded)
        self.chosen: tuple[float, float] | None = None  # s, a stretch that stands out

    @property
    def height_px(self) -> int:
        """How high it is."""
        return PANE_HEIGHT_PX * len(self.panes) + MARGIN_PX

    def figure(self, begin: float = -np.inf, end: float = np.inf) -> dict[str, Any]:
        """The figure of a stretch of time [s], reduced to what a window can show."""
        begin, end = max(begin, float(self.t[0])), min(end, float(self.t[-1]))
        window = window_of(self.t, begin, end)
        long = within(self.long, window)
        data = [
            self._drawn(number, window, long, line) for number, pane in enumerate(self.panes, 1) for line in pane.lines
        ]
        shown = {"range": [begin, end]}
        layout = {key: {**value, **shown} if key.startswith("xaxis") else value for key, value in self.layout.items()}
        if self.chosen is not None:
            layout["shapes"] = [*layout.get("shapes", ()), _shade(*self.chosen)]
        return {"data": data, "layout": layout, "config": CHART_CONFIG}

    def _drawn(self, pane: int, window: slice, long: np.ndarray, line: Line) -> dict[str, Any]:
        """A line of a pane, as the browser draws it."""
        t, values = reduced(self.t[window], line.values(window), WINDOW_PIXELS, long)
        return {
            "type": "scatter",
            "mode": "lines",
            "hoverinfo": "x+y",
            "line": {"color": line.colour, "width": 1.3},
            "x": _rounded(t).tolist(),
            "y": [None if v != v else v for v in _rounded(values).tolist()],  # what is no number is a gap
            "xaxis": f"x{pane if pane > 1 else ''}",
            "yaxis": f"y{pane if pane > 1 else ''}",
        }

    def _layout(self, is_shaded: bool) -> dict[str, Any]:
        """Axes and shade, which no zoom changes."""
        figure = make_subplots(len(self.panes), 1, shared_xaxes=True, vertical_spacing=0.02)
        for row, pane in enumerate(self.panes, 1):
            figure.update_yaxes(title_text=pane.title.replace("<", "&lt;"), row=row)
        figure.update_layout({**CHART_LAYOUT, "height": self.height_px, "showlegend": False})
        figure.update_xaxes(title_text="t [s]", row=len(self.panes))
        if is_shaded:
            figure.add_vrect(x0=float(self.t[0]), x1=float(self.t[-1]), **HELD_OUT_SHADE)
        return dict(json.loads(figure.to_json())["layout"])


def _rounded(values: np.ndarray) -> np.ndarray:
    """Numbers (n,) to less than a ten-thousandth of their range, which no window shows: half as many bytes are sent."""
    known = values[np.isfinite(values)]
    span = float(np.ptp(known)) if known.size else 0.0
    return values if span == 0.0 else np.round(values, DRAWN_DIGITS - int(np.ceil(np.log10(span))))


def _shade(begin: float, end: float) -> dict[str, Any]:
    """The shade of a stretch [s] over all panes."""
    line = {"width": 1, "dash": "dot"}
    ends = {"x0": begin, "x1": end, "y0": 0, "y1": 1}
    return {"type": "rect", "xref": "x", "yref": "paper", **ends, **CHOSEN_SHADE, "line": line}


class TimeChart:
    """A drawing on the page, and how it is zoomed into."""

    def __init__(
        self, t: np.ndarray, panes: Sequence[Pane], describes: str, caption: str, *, is_shaded: bool = False
    ) -> None:
        self.drawing = TimeDrawing(t, panes, is_shaded=is_shaded)
        self.shown = -np.inf, np.inf  # s
        with ui.element("figure"):
            self.plot = ui.plotly(self.drawing.figure()).classes("tall")
            self.plot.props["role"], self.plot.props["aria-label"] = "img", describes
            self.plot.style(f"height: {self.drawing.height_px}px")
            self.plot.on("plotly_relayout", self._zoom)
            with ui.element("figcaption"):
                text(f"{caption} Drag to zoom all, double-click to go back.")

    def _zoom(self, event: events.GenericEventArguments) -> None:
        """Draw the stretch that the browser shows, from all of its samples."""
        said = event.args if isinstance(event.args, dict) else {}
        limits = sorted(float(value) for key, value in said.items() if key.partition(".")[2].startswith("range["))
        if limits:
            self._draw(limits[0], limits[-1])
        elif any(key.endswith("autorange") for key in said):
            self._draw()

    def shade(self, begin: float, end: float) -> None:
        """Let a stretch of time [s] stand out, in what is shown."""
        self.drawing.chosen = begin, end
        self._draw(*self.shown)

    def _draw(self, begin: float = -np.inf, end: float = np.inf) -> None:
        self.shown = begin, end
        self.plot.update_figure(self.drawing.figure(begin, end))
