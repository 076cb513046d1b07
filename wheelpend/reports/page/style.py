"""Colours, fonts and frames of the report's figures."""

from __future__ import annotations

import plotly.graph_objects as go

MEASURED_COLOUR = "#3d4450"
BEFORE_COLOUR, BEFORE_RGB = "#d1592a", "209,89,42"  # of the model before anything was added
AFTER_COLOUR = "#1f6fb4"
NOISE_FLOOR_COLOUR = "#5b8c5a"
MUTED_COLOUR = "#b8bfc9"
STEP_COLOURS = ("#1f6fb4", "#7a4fa3", "#1b8a7a", "#a67c1e")  # of steps and candidates, the first is "after"
MAX_PREDICTION_POINTS = 5400  # points of a model's predictions, over all channels and logs
MAX_FORCE_POINTS = 1800  # points of the missing force over time, over all rows and logs
MAX_CLOUD_POINTS = 1500  # points of a cloud of samples
FIGURE_TEMPLATE = {"layout": {
    "autotypenumbers": "strict", "hovermode": "closest", "hoverlabel": {"align": "left"},
    "xaxis": {"automargin": True, "title": {"standoff": 15}}, "yaxis": {"title": {"standoff": 15}},
}}  # fmt: skip
MAX_DRAWN_LOGS = 3  # logs whose predictions are drawn
MAX_MARKED_STANDSTILLS = 60  # standstills of a channel that are marked


def with_page_style(figure: go.Figure, height: int) -> go.Figure:
    """Give a figure the page's type and colours."""
    figure.layout.template = FIGURE_TEMPLATE  # to update the usual one would keep its 7 kB
    figure.update_layout(
        height=height, paper_bgcolor="rgba(0,0,0,0)", plot_bgcolor="rgba(0,0,0,0)",
        font={"family": "system-ui, sans-serif", "size": 13, "color": MEASURED_COLOUR},
        margin={"l": 70, "r": 20, "t": 30, "b": 50}, hoverlabel={"namelength": -1},
        legend={"orientation": "h", "yanchor": "bottom", "y": 1.0, "x": 0},
    )  # fmt: skip
    figure.update_xaxes(showline=True, linecolor=MUTED_COLOUR, gridcolor="#eceff3", zerolinecolor=MUTED_COLOUR)
    figure.update_yaxes(
        showline=True, linecolor=MUTED_COLOUR, gridcolor="#eceff3", zerolinecolor=MUTED_COLOUR, automargin=True
    )
    return figure
