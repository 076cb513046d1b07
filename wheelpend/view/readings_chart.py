"""The signals of a log as they are read, all zoomed together, reduced to the window."""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import Any

import numpy as np
import plotly.graph_objects as go
from nicegui import events, ui
from plotly.subplots import make_subplots

from wheelpend.view.panel import CHART_CONFIG, CHART_LAYOUT, text
from wheelpend.view.prediction_chart import MARGIN_PX, ROW_HEIGHT_PX, WINDOW_PIXELS
from wheelpend.view.reduction import reduced, window_of

SIGNAL_COLOUR = "#2f86d6"


class ReadingsChart:
    """A log's series (N, 1 + signals), time first, and how it is zoomed into."""

    def __init__(self, series: np.ndarray, titles: Sequence[str]) -> None:
        self.series, self.titles, self.t = series, titles, series[:, 0]
        with ui.element("figure"):
            self.plot = ui.plotly(self._figure(float(self.t[0]), float(self.t[-1]))).classes("tall")
            self.plot.props["role"], self.plot.props["aria-label"] = "img", f"{', '.join(titles)} over time"
            self.plot.style(f"height: {self._height_px}px")
            self.plot.on("plotly_relayout", self._zoom)
            with ui.element("figcaption"):
                text("The signals as they are read. Drag to zoom all, double-click to go back.")

    @property
    def _height_px(self) -> int:
        return ROW_HEIGHT_PX * len(self.titles) + MARGIN_PX

    def _zoom(self, event: events.GenericEventArguments) -> None:
        """Draw the stretch that the browser shows, from all of its samples."""
        said = event.args if isinstance(event.args, dict) else {}
        limits = sorted(float(v) for key, v in said.items() if ".range[" in key)
        if limits:
            self.plot.update_figure(self._figure(limits[0], limits[-1]))
        elif any(key.endswith("autorange") for key in said):
            self.plot.update_figure(self._figure(float(self.t[0]), float(self.t[-1])))

    def _figure(self, begin: float, end: float) -> dict[str, Any]:
        """The figure of a stretch of time."""
        rows = len(self.titles)
        figure = make_subplots(rows, 1, shared_xaxes=True, vertical_spacing=0.02)
        window = window_of(self.t, begin, end)
        style = {"color": SIGNAL_COLOUR, "width": 1.3}
        for row, title in enumerate(self.titles, 1):
            t, line = reduced(self.t[window], self.series[window, row], WINDOW_PIXELS)
            y = [None if np.isnan(v) else v for v in line.tolist()]
            figure.add_trace(go.Scatter(x=t.tolist(), y=y, mode="lines", line=style, hoverinfo="x+y"), row=row, col=1)
            figure.update_yaxes(title_text=title.replace("<", "&lt;"), row=row)
        figure.update_layout({**CHART_LAYOUT, "height": self._height_px, "showlegend": False})
        figure.update_xaxes(range=[begin, end])
        figure.update_xaxes(title_text="t [s]", row=rows)
        return {**json.loads(figure.to_json()), "config": CHART_CONFIG}
