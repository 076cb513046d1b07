"""Tests of the residuals: a row for each channel in plain words, and the autocorrelation beside its band."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import plotly.graph_objects as go

from wheelpend.reports.numbers import number_text, p_value_text
from wheelpend.reports.text.residuals import BELIEVED_INPUT_P
from wheelpend.view.panel import chart, folded, table

TEST_HEAD = ("channel", "white?", "predicted by past inputs?", "size, found over assumed")
TEST_CAPTION = "What is left of each channel, one sample ahead: white where nothing in it repeats"
CHANNEL_COLOURS = ("#2f86d6", "#d98a1f", "#5b8c5a", "#a05195", "#8a919c", "#7a5230")
BAND_COLOUR = "#8a919c"


def show_residual_tests(residuals: Mapping[str, Mapping[str, Any]]) -> None:
    """The tests of each channel, as `compare` has them under ``residuals``."""
    if not residuals:
        return
    table(TEST_HEAD, [[name, *_cells(found)] for name, found in residuals.items()], TEST_CAPTION)
    if (figure := autocorrelation_figure(residuals)) is not None:
        with folded("Autocorrelation of the residuals"):
            chart(figure, "Autocorrelation over the lag; beyond the dotted band it is more than chance")


def _cells(found: Mapping[str, Any]) -> list[str]:
    p_white, p_input = found.get("whiteness_p"), found.get("independent_of_input_p")
    return [
        f"{'yes' if found.get('white') else 'no'} (p {p_value_text(p_white)})" if p_white is not None else "",
        f"{'yes' if p_input < BELIEVED_INPUT_P else 'no'} (p {p_value_text(p_input)})" if p_input is not None else "",
        number_text(found.get("sigma_ratio")),
    ]


def autocorrelation_figure(residuals: Mapping[str, Mapping[str, Any]]) -> go.Figure | None:
    """The autocorrelation of every channel over the lag, with the widest band of chance; None where none is known."""
    known = {name: found for name, found in residuals.items() if found.get("lags_s") and found.get("autocorrelation")}
    if not known:
        return None
    figure = go.Figure()
    for number, (name, found) in enumerate(known.items()):
        line = {"color": CHANNEL_COLOURS[number % len(CHANNEL_COLOURS)], "width": 1.6}
        figure.add_scatter(x=found["lags_s"], y=found["autocorrelation"], mode="lines+markers", name=name, line=line)
    widest = max(known.values(), key=lambda found: max(found["band"]))
    for side in (-1.0, 1.0):
        line = {"color": BAND_COLOUR, "dash": "dot", "width": 1}
        band = [side * value for value in widest["band"]]
        figure.add_scatter(x=widest["lags_s"], y=band, mode="lines", showlegend=False, line=line)
    figure.update_xaxes(type="log", title_text="lag [s]")
    figure.update_yaxes(title_text="autocorrelation")
    return figure
