"""Colours, fonts and frames of the report's figures."""

from __future__ import annotations

import plotly.graph_objects as go

MEASURED, BEFORE, AFTER, FLOOR, QUIET = "#3d4450", "#d1592a", "#1f6fb4", "#5b8c5a", "#b8bfc9"
SHADES = ("#1f6fb4", "#7a4fa3", "#1b8a7a", "#a67c1e")  # of steps and candidates, the first is "after"
MOST_POINTS = 3000  # of one trace
MOST_LOGS = 3  # shown in full
MOST_MARKED = 60  # standstills of a channel that are marked


def pretty(text: str) -> str:
    """An expression of ours with Greek letters and dots: ddtheta_w becomes θ̈w."""
    for plain, shown in (("ddtheta_", "θ̈"), ("dtheta_", "θ̇"), ("theta_", "θ"), ("v_in", "V"), (" - ", " − ")):
        text = text.replace(plain, shown)
    return text


def quantity(name: str) -> str:
    """A state, the input or time, as an axis names it."""
    return {"v_in": "commanded voltage", "t": "time"}.get(name, pretty(name))


def styled(figure: go.Figure, height: int) -> go.Figure:
    """Give a figure the page's type and colours."""
    figure.update_layout(
        height=height, template="plotly_white", paper_bgcolor="rgba(0,0,0,0)", plot_bgcolor="rgba(0,0,0,0)",
        font={"family": "system-ui, sans-serif", "size": 13, "color": MEASURED},
        margin={"l": 70, "r": 20, "t": 30, "b": 50}, hoverlabel={"namelength": -1},
        legend={"orientation": "h", "yanchor": "bottom", "y": 1.0, "x": 0},
    )  # fmt: skip
    figure.update_xaxes(showline=True, linecolor=QUIET, gridcolor="#eceff3", zerolinecolor=QUIET)
    figure.update_yaxes(showline=True, linecolor=QUIET, gridcolor="#eceff3", zerolinecolor=QUIET, automargin=True)
    return figure
