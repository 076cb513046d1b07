"""The signals of a log as they are read."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from wheelpend.view.time_chart import Line, Pane, TimeChart

SIGNAL_COLOUR = "#2f86d6"


def readings_chart(series: np.ndarray, titles: Sequence[str]) -> TimeChart:
    """The chart of a log's series (N, 1 + signals), time first."""

    def pane(place: int, title: str) -> Pane:
        return Pane(title, (Line(lambda window: series[window, place], SIGNAL_COLOUR),))

    panes = [pane(k, title) for k, title in enumerate(titles, 1)]
    return TimeChart(series[:, 0], panes, f"{', '.join(titles)} over time", "The signals as they are read.")
