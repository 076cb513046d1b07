"""Measured and predicted of each channel with what is left under them, all zoomed together, reduced to the window."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import plotly.graph_objects as go
from nicegui import events, ui
from plotly.subplots import make_subplots

from wheelpend.view.panel import CHART_CONFIG, CHART_LAYOUT, text
from wheelpend.view.reduction import reduced, window_of

WINDOW_PIXELS = 600  # of a line, on a window of some 1200
ROW_HEIGHT_PX, MARGIN_PX = 130, 90
MEASURED_COLOUR, PREDICTED_COLOUR, RESIDUAL_COLOUR = "#8a919c", "#d98a1f", "#2f86d6"
HELD_OUT_SHADE = {"fillcolor": "#5b8c5a", "opacity": 0.12, "line_width": 0}


class PredictionChart:
    """A log's channels, and how it is zoomed into."""

    def __init__(self, series: np.ndarray, channels: list[str], *, held_out: bool) -> None:
        self.series, self.channels, self.held_out = series, channels, held_out
        self.t = series[:, 0]
        with ui.element("figure"):
            self.plot = ui.plotly(self._figure(float(self.t[0]), float(self.t[-1]))).classes("tall")
            self.plot.props["role"] = "img"
            self.plot.props["aria-label"] = f"Measured and predicted {', '.join(channels)}, and what is left of each"
            self.plot.style(f"height: {ROW_HEIGHT_PX * 2 * len(channels) + MARGIN_PX}px")
            self.plot.on("plotly_relayout", self._zoom)
            with ui.element("figcaption"):
                text(
                    "Grey: measured. Orange: predicted. Blue: what is left. Drag to zoom all, double-click to go back."
                )

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
        rows = 2 * len(self.channels)
        figure = make_subplots(rows, 1, shared_xaxes=True, vertical_spacing=0.02)
        window = window_of(self.t, begin, end)
        for k, channel in enumerate(self.channels):
            measured, predicted = self.series[window, 1 + 2 * k], self.series[window, 2 + 2 * k]
            self._add(figure, 2 * k + 1, window, measured, MEASURED_COLOUR)
            self._add(figure, 2 * k + 1, window, predicted, PREDICTED_COLOUR)
            self._add(figure, 2 * k + 2, window, measured - predicted, RESIDUAL_COLOUR)
            figure.update_yaxes(title_text=channel, row=2 * k + 1)
            figure.update_yaxes(title_text="left", row=2 * k + 2)
        figure.update_layout({**CHART_LAYOUT, "height": ROW_HEIGHT_PX * rows + MARGIN_PX, "showlegend": False})
        figure.update_xaxes(range=[begin, end])
        figure.update_xaxes(title_text="t [s]", row=rows)
        if self.held_out:
            figure.add_vrect(x0=float(self.t[0]), x1=float(self.t[-1]), **HELD_OUT_SHADE)
        return {**json.loads(figure.to_json()), "config": CHART_CONFIG}

    def _add(self, figure: go.Figure, row: int, window: slice, values: np.ndarray, colour: str) -> None:
        t, line = reduced(self.t[window], values, WINDOW_PIXELS)
        shown = [None if np.isnan(v) else v for v in line.tolist()]
        drawn = go.Scatter(x=t.tolist(), y=shown, mode="lines", line={"color": colour, "width": 1.3}, hoverinfo="x+y")
        figure.add_trace(drawn, row=row, col=1)
