"""Colours, fonts and frames of the report's figures."""

from __future__ import annotations

import plotly.graph_objects as go

MEASURED_COLOUR = "#3d4450"
BEFORE_COLOUR, BEFORE_RGB = "#d1592a", "209,89,42"  # of the model before anything was added
AFTER_COLOUR = "#1f6fb4"
NOISE_FLOOR_COLOUR = "#5b8c5a"
MUTED_COLOUR = "#b8bfc9"
STEP_COLOURS = ("#1f6fb4", "#7a4fa3", "#1b8a7a", "#a67c1e")  # of steps and candidates, the first is "after"
MAX_TRACE_POINTS = 3000  # points of one trace
MAX_DRAWN_LOGS = 3  # logs whose predictions are drawn
MAX_MARKED_STANDSTILLS = 60  # standstills of a channel that are marked


def with_page_style(figure: go.Figure, height: int) -> go.Figure:
    """Give a figure the page's type and colours."""
    figure.update_layout(
        height=height, template="plotly_white", paper_bgcolor="rgba(0,0,0,0)", plot_bgcolor="rgba(0,0,0,0)",
        font={"family": "system-ui, sans-serif", "size": 13, "color": MEASURED_COLOUR},
        margin={"l": 70, "r": 20, "t": 30, "b": 50}, hoverlabel={"namelength": -1},
        legend={"orientation": "h", "yanchor": "bottom", "y": 1.0, "x": 0},
    )  # fmt: skip
    figure.update_xaxes(showline=True, linecolor=MUTED_COLOUR, gridcolor="#eceff3", zerolinecolor=MUTED_COLOUR)
    figure.update_yaxes(
        showline=True, linecolor=MUTED_COLOUR, gridcolor="#eceff3", zerolinecolor=MUTED_COLOUR, automargin=True
    )
    return figure
