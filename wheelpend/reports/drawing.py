"""Grids of axes as PNG, in one style, and the colours that all pictures share."""

from __future__ import annotations

import io
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np

from wheelpend.isolation import import_configured

INK_COLOUR, MEASURED_COLOUR, PAPER_COLOUR = "#262b33", "#9aa0a6", "#000000"
FIGURE_DPI = 130
FIGURE_STYLE: Any = {
    "font.size": 10,
    "axes.grid": True,
    "grid.color": "#e2e6eb",
    "axes.edgecolor": MEASURED_COLOUR,
    "axes.axisbelow": True,
    "axes.titlesize": 10.5,
    "axes.titlelocation": "left",
    "legend.frameon": False,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "text.color": INK_COLOUR,
    "axes.labelcolor": INK_COLOUR,
}


@contextmanager
def figure_style() -> Iterator[None]:
    """Axes that are made within have the style of all pictures; afterwards the user's own settings hold again.

    Only these settings are put back: a notebook's backend, which may be loaded within, keeps its own.
    """
    settings = import_configured("matplotlib").rcParams
    before = {key: settings[key] for key in FIGURE_STYLE}
    settings.update(FIGURE_STYLE)
    try:
        yield
    finally:
        settings.update(before)


def figure_png(
    size: tuple[float, float], rows: int, columns: int, fill: Callable[[np.ndarray], Any], **shared
) -> bytes:
    """PNG of a grid of axes (rows, columns) of a size in inches, which a function fills."""
    # Late: a start of the command must not wait for matplotlib.
    import_configured("matplotlib")
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=size, layout="constrained")
    FigureCanvasAgg(figure)
    fill(figure.subplots(rows, columns, squeeze=False, **shared))
    data = io.BytesIO()
    figure.savefig(data, format="png", dpi=FIGURE_DPI, metadata={"Software": None})
    return data.getvalue()


def add_legend(ax, columns: int = 4) -> None:
    """Legend of one panel above the whole figure."""
    ax.figure.legend(*ax.get_legend_handles_labels(), loc="outside upper left", ncols=columns, fontsize=9.5)
