"""Measured and predicted of each channel, with what is left under them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from wheelpend.view.time_chart import Line, Pane, TimeChart

MEASURED_COLOUR, PREDICTED_COLOUR, RESIDUAL_COLOUR = "#8a919c", "#d98a1f", "#2f86d6"
CHART_CAPTION = "Grey: measured. Orange: predicted. Blue: what is left."


def prediction_chart(series: np.ndarray, channels: Sequence[str], *, held_out: bool) -> TimeChart:
    """The chart of a log's series (N, 1 + 2 channels): time, then measured and predicted of each channel."""
    describes = f"Measured and predicted {', '.join(channels)}, and what is left of each"
    return TimeChart(series[:, 0], list(_panes(series, channels)), describes, CHART_CAPTION, is_shaded=held_out)


def _panes(series: np.ndarray, channels: Sequence[str]) -> Iterator[Pane]:
    for k, channel in enumerate(channels):

        def measured(window: slice, k: int = k) -> np.ndarray:
            return series[window, 1 + 2 * k]

        def predicted(window: slice, k: int = k) -> np.ndarray:
            return series[window, 2 + 2 * k]

        def left(window: slice, k: int = k) -> np.ndarray:
            return series[window, 1 + 2 * k] - series[window, 2 + 2 * k]

        yield Pane(channel, (Line(measured, MEASURED_COLOUR), Line(predicted, PREDICTED_COLOUR)))
        yield Pane("left", (Line(left, RESIDUAL_COLOUR),))
