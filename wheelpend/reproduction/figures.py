"""Every picture (PNG) that belongs to a reproduction."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from wheelpend.isolation import import_configured
from wheelpend.reports.drawing import FIGURE_STYLE
from wheelpend.reproduction.charts import deviations_chart, errors_chart
from wheelpend.reproduction.experiment import COMMAND_NAMES
from wheelpend.reproduction.paper_figures import SHOWN_SEED, paper_figures

if TYPE_CHECKING:
    from wheelpend.reproduction.record import Reproduction

__all__ = ["SHOWN_SEED", "draw"]


def draw(result: Reproduction) -> dict[str, bytes]:
    """All pictures that belong to a result, as PNG by name."""
    matplotlib = import_configured("matplotlib")  # late: a start of the command must not wait for it

    with matplotlib.rc_context(FIGURE_STYLE):
        return dict(_pictures(result))


def _pictures(result: Reproduction) -> Iterator[tuple[str, bytes]]:
    if result.table1:
        yield "table1", errors_chart(result.table1, ("simple",))
    if result.table2:
        yield "table2", errors_chart(result.table2, COMMAND_NAMES)
    if result.table3:
        yield "table3", deviations_chart(result.table3)
    if result.predictions and result.robot:
        yield from paper_figures(result.robot)
