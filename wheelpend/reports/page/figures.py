"""Figures of the ladder, of the predictions and of the parameters, or None where there is nothing to draw.

Colours mean the same everywhere: dark grey is measured, red the model before, blue the model after.
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots

from wheelpend.diagnosis.explain import Ladder
from wheelpend.estimation.fit import Fit
from wheelpend.estimation.prediction import prediction_error
from wheelpend.estimation.problem import EstimationProblem
from wheelpend.estimation.segments import Segments
from wheelpend.estimation.validation import validation_residuals
from wheelpend.model.units import PlantUnits
from wheelpend.reports.ladder import Rung, ladder_rungs
from wheelpend.reports.names import display_text
from wheelpend.reports.numbers import digits_text
from wheelpend.reports.page.style import (
    AFTER_COLOUR,
    BEFORE_COLOUR,
    MAX_MARKED_STANDSTILLS,
    MEASURED_COLOUR,
    MUTED_COLOUR,
    NOISE_FLOOR_COLOUR,
    STEP_COLOURS,
    with_page_style,
)
from wheelpend.reports.page.thinning import segment_samples

RUNG_COLOURS = {"earlier": MUTED_COLOUR, "nominal": MUTED_COLOUR, "refitted": BEFORE_COLOUR, "step": AFTER_COLOUR}
MIN_LOGARITHMIC_RATIO = 5  # of the largest to the smallest error: from it on the ladder's axis is logarithmic
MIN_DECADE_TICKS_RATIO = 50  # of the same: from it on only decades are ticked


def labelled_rungs(explanation: Ladder) -> list[Rung]:
    """Rungs of the error ladder as the page names them."""
    return ladder_rungs(explanation, "nominal values")


def ladder_figure(explanation: Ladder, earlier: Sequence[Rung] = ()) -> go.Figure:
    """Held-out error from the first model that is known to the last step, with the noise floor."""
    rungs = [r for r in (*earlier, *labelled_rungs(explanation)) if np.isfinite(r.error)]
    errors = tuple(r.error for r in rungs)
    figure = go.Figure(go.Bar(
        x=errors, y=tuple(r.label for r in rungs), orientation="h",
        marker_color=tuple(RUNG_COLOURS[r.kind] for r in rungs), text=[digits_text(e) for e in errors],
        textposition="outside", cliponaxis=False, hovertemplate="%{y}: %{x:.4g}<extra></extra>", width=0.62,
    ))  # fmt: skip
    wide = _scale_error_axis(figure, [*errors, explanation.noise_floor])
    figure.update_yaxes(autorange="reversed")
    floor = explanation.noise_floor
    figure.add_vline(x=floor, line={"color": NOISE_FLOOR_COLOUR, "dash": "dash", "width": 2})
    figure.add_annotation(x=np.log10(floor) if wide else floor, y=1.0, yref="paper", yanchor="bottom", showarrow=False,
                          text=f"noise floor {floor:.3g}", font={"color": NOISE_FLOOR_COLOUR})  # fmt: skip
    return with_page_style(figure, 110 + 46 * len(rungs)).update_layout(margin={"l": 20, "r": 48})


def _scale_error_axis(figure: go.Figure, errors: Sequence[float]) -> bool:
    """Scale the axis of errors; True where it is logarithmic."""
    low, high = min(errors), max(errors)
    wide = high > MIN_LOGARITHMIC_RATIO * low > 0
    span = [np.log10(low * 0.6), np.log10(high * 1.5)] if wide else [0, high * 1.15]
    decades = 1 if wide and high > MIN_DECADE_TICKS_RATIO * low else None
    figure.update_xaxes(type="log" if wide else "linear", range=span, dtick=decades,
                        title=f"error [σ], {'logarithmic' if wide else 'linear'}")  # fmt: skip
    return wide


class ResidualComparison(NamedTuple):
    """Segments of a log on which two models are validated, with their residuals."""

    segments: Segments
    before: np.ndarray  # (N, channels) σ
    after: np.ndarray  # (N, channels) σ


def residual_comparisons(explanation: Ladder) -> list[ResidualComparison]:
    """Residuals before and after on the held-out segments, or on the training ones where nothing was held out."""
    problem = explanation.problem
    segments = problem.data.held_out or problem.data.estimation
    before, after = (_residuals(problem, fit) for fit in (explanation.first.fit, explanation.fit))
    return [ResidualComparison(*row) for row in zip(segments, before, after, strict=True)]


def _residuals(problem: EstimationProblem, fitted: Fit) -> list[np.ndarray]:
    if problem.data.validation:
        return validation_residuals(problem, fitted)[1]
    return [
        prediction_error(problem.simulator, segments, fitted.of_log(k))[1]
        for k, segments in enumerate(problem.data.estimation)
    ]


def prediction_figure(
    comparison: ResidualComparison,
    changed: bool,
    units: PlantUnits,
    standstills: Mapping[str, list[tuple[float, float]]],
    points: int,
) -> go.Figure:
    """Per channel: measured and predicted values above, residuals in σ below; ``changed`` where the models differ.

    Where a place stands still is marked. A line has some ``points`` at most.
    """
    segments = comparison.segments
    channels = segments.log.channels
    figure = make_subplots(rows=2 * len(channels), cols=1, shared_xaxes=True, vertical_spacing=0.022,
                           row_heights=[2.0, 1.0] * len(channels))  # fmt: skip
    before = [("before", BEFORE_COLOUR, comparison.before)] if changed else []
    models = [*before, ("after" if changed else "predicted", AFTER_COLOUR, comparison.after)]
    for c, channel in enumerate(channels):
        shown = [segments.log.measured[:, c], *(residual[:, c] for _, _, residual in models)]
        chosen = segment_samples(segments.bounds, shown, points)
        _add_channel(figure, segments, chosen, c, [(n, k, r[:, c]) for n, k, r in models])
        for begin, end in standstills.get(channel, [])[:MAX_MARKED_STANDSTILLS]:
            figure.add_vrect(begin, end, row=2 * c + 1, col=1, fillcolor=MUTED_COLOUR, opacity=0.18, line_width=0)
        figure.update_yaxes(title=f"{display_text(channel)} [{units.unit(channel)}]", row=2 * c + 1, col=1)
        figure.update_yaxes(title="resid. [σ]", row=2 * c + 2, col=1)
    figure.update_xaxes(title="time [s]", row=2 * len(channels), col=1)
    return with_page_style(figure, 80 + 270 * len(channels))


def _add_channel(figure: go.Figure, segments: Segments, chosen: np.ndarray, c: int, models: Sequence) -> None:
    t, values = _with_gaps(segments.log.t, chosen), segments.log.measured[:, c]
    measured = _line(t, _with_gaps(values, chosen), "measured", MEASURED_COLOUR, width=2.2)
    figure.add_trace(measured.update(showlegend=c == 0), row=2 * c + 1, col=1)
    for name, colour, residual in models:
        predicted = values - residual * segments.sigma[c]
        line = _line(t, _with_gaps(predicted, chosen), name, colour, width=1.4)
        figure.add_trace(line.update(showlegend=c == 0), row=2 * c + 1, col=1)
        rest = _line(t, _with_gaps(residual, chosen), name, colour, width=1.0)
        figure.add_trace(rest.update(showlegend=False), row=2 * c + 2, col=1)


def _line(t: np.ndarray, y: np.ndarray, name: str, colour: str, *, width: float) -> go.Scatter:
    return go.Scatter(
        x=t, y=y, name=name, legendgroup=name, showlegend=False, mode="lines", line={"color": colour, "width": width},
        connectgaps=False,
    )  # fmt: skip


def _with_gaps(values: np.ndarray, chosen: np.ndarray) -> np.ndarray:
    return np.where(chosen < 0, np.nan, values[chosen]).astype(np.float32)


def parameter_figure(explanation: Ladder) -> go.Figure | None:
    """Change of each base parameter with each step, in % of its first value."""
    first = {n: explanation.first.fit.values[n] for n in explanation.problem.base}
    if not explanation.steps:
        return None
    figure = go.Figure()
    for step, colour in zip(explanation.steps, itertools.cycle(STEP_COLOURS)):
        moved = [100.0 * (step.parameters.get(n, v) / v - 1.0) if v else None for n, v in first.items()]
        figure.add_trace(go.Bar(x=list(first), y=moved, name=f"+ {step.effect}", marker_color=colour,
                                hovertemplate="%{x}: %{y:+.3g} %<extra></extra>"))  # fmt: skip
    figure.update_yaxes(title="change from the first fit [%]")
    figure.update_xaxes(title="parameter")
    figure.update_layout(barmode="group", showlegend=True)
    return with_page_style(figure, 300)
