"""A log's signals as they are read."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from wheelpend.view.time_chart import Line, Pane, TimeChart

SIGNAL_COLOUR = "#2f86d6"


def signal_chart(series: np.ndarray, names: Sequence[str], units: Sequence[str]) -> TimeChart:
    """The chart of a log's series (N, 1 + names): time, then each signal in its unit."""

    def pane(place: int, title: str) -> Pane:
        return Pane(title, (Line(lambda window: series[window, place], SIGNAL_COLOUR),))

    panes = [pane(k, f"{name} [{unit}]") for k, (name, unit) in enumerate(zip(names, units, strict=True), 1)]
    return TimeChart(series[:, 0], panes, f"{', '.join(names)} over time", "The signals in the plant's units.")
