"""The page's charts as markup: a place for each figure and its data, and the script that draws them all."""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Sequence
from hashlib import sha256
from pathlib import Path
from typing import NamedTuple

import plotly.graph_objects as go
from markupsafe import Markup

from wheelpend.diagnosis.explain import Ladder
from wheelpend.estimation.data import noise_of
from wheelpend.inspection.standstill import standstills
from wheelpend.model.units import PlantUnits
from wheelpend.reports.ladder import Rung
from wheelpend.reports.page.effect_figures import EffectDrawing, effect_drawings
from wheelpend.reports.page.figures import (
    ladder_figure,
    parameter_figure,
    prediction_figure,
    residual_comparisons,
)
from wheelpend.reports.page.force_figures import force_figure, most_repeatable_figure, state_figure
from wheelpend.reports.page.packing import UNPACKING_SCRIPT, figure_text
from wheelpend.reports.page.style import MAX_DRAWN_LOGS, MAX_FORCE_POINTS, MAX_PREDICTION_POINTS

PLOTTING_SCRIPT = Path(__file__).parent / "plotly_basic" / "plotly-basic.min.js"  # bars and scatter traces
DRAWING_SCRIPT = f"""{UNPACKING_SCRIPT}
for (const data of document.querySelectorAll("script[data-chart]")) {{
  const figure = unpacked(data.textContent);
  Plotly.newPlot(data.dataset.chart, figure.data, figure.layout,
                 {{responsive: true, displaylogo: false, displayModeBar: false}});
}}
"""


class PageCharts(NamedTuple):
    """Every chart of the page; nothing where there is nothing to draw."""

    ladder: Markup
    logs: list[tuple[str, Markup]]  # with the log's name
    left_out: int  # logs that are not drawn; negative where there are fewer than may be
    force: list[tuple[str, Markup]]  # over time, with the log's name
    state: Markup
    repeats: Markup
    dotted: bool  # the chart over a state shows laws alone
    parameters: Markup
    effects: list[tuple[EffectDrawing, Markup]]


def page_charts(explanation: Ladder, quantities: PlantUnits, earlier: Sequence[Rung] = ()) -> PageCharts:
    """Draw every chart; the ladder begins with the ``earlier`` rungs."""
    first = explanation.first
    logs, left_out = _prediction_charts(explanation, quantities)
    state = state_figure(first, quantities)
    rows = first.problem.module.ROWS
    drawn = first.missing[:MAX_DRAWN_LOGS]
    forces = [(m.log, force_figure(m, rows, quantities, MAX_FORCE_POINTS // (len(drawn) * len(rows)))) for m in drawn]
    drawings = effect_drawings(explanation)
    return PageCharts(
        ladder=chart_markup("ladder", ladder_figure(explanation, earlier)),
        logs=logs,
        left_out=left_out,
        force=[(name, chart_markup(f"force{k}", figure)) for k, (name, figure) in enumerate(forces)],
        state=chart_markup("state", state),
        repeats=chart_markup("repeats", most_repeatable_figure(explanation.repeats, quantities)),
        dotted=state is not None and any(t.line.dash == "dot" for t in state.data),
        parameters=chart_markup("parameters", parameter_figure(explanation)),
        effects=[(drawing, chart_markup(f"effect{k}", drawing.figure)) for k, drawing in enumerate(drawings)],
    )


def _prediction_charts(explanation: Ladder, quantities: PlantUnits) -> tuple[list[tuple[str, Markup]], int]:
    """Charts of the first logs with their names, and the number of the others."""
    comparisons, charts = residual_comparisons(explanation), []
    drawn = comparisons[:MAX_DRAWN_LOGS]
    for k, comparison in enumerate(drawn):
        log = comparison.segments.log
        points = MAX_PREDICTION_POINTS // (len(drawn) * len(log.channels))
        still = standstills(log, noise_of(log, explanation.model), explanation.model.table)
        figure = prediction_figure(comparison, bool(explanation.steps), quantities, still, points)
        charts.append((log.name, chart_markup(f"log{k}", figure)))
    return charts, len(comparisons) - MAX_DRAWN_LOGS


def chart_markup(name: str, figure: go.Figure | None) -> Markup:
    """A figure's place in the page and its data, which no browser executes; DRAWING_SCRIPT draws it."""
    if figure is None:
        return Markup("")
    # only our own identifier and escaped JSON go into the page as they are
    return Markup(
        f'<div class="chart" id="{name}" style="min-height:{int(figure.layout.height)}px"></div>\n'
        f'<script type="application/json" data-chart="{name}">{figure_text(figure)}</script>'
    )


def script_hash(script: str) -> str:
    """How a content security policy names a script that may run."""
    return f"'sha256-{b64encode(sha256(script.encode()).digest()).decode()}'"
