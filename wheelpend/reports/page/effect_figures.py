"""Drawings of the effects of a report: each law with its fitted coefficients and a 95 % band over the logs' range."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
import plotly.graph_objects as go

import derive
from derive.effects import Effect
from derive.plant_signature import PlantSignature
from wheelpend.diagnosis.explain import Ladder
from wheelpend.estimation.fit import Fit
from wheelpend.estimation.free_parameters import limits_of, per_log_names
from wheelpend.estimation.problem import EstimationProblem
from wheelpend.model.units import PlantUnits, plant_units_of
from wheelpend.reports.names import display_text
from wheelpend.reports.page.effect_laws import EffectPlot, LineFunction, effect_plot
from wheelpend.reports.page.force_figures import force_hover
from wheelpend.reports.page.style import AFTER_COLOUR, MUTED_COLOUR, with_page_style

LINE_COLOURS = (AFTER_COLOUR, "#d1592a", "#1b8a7a")  # of lines, or of logs
MAX_DRAWN_CANDIDATES = 3  # candidates, not added, that are drawn
MAX_LOGS_PER_FIGURE = 3  # logs
COEFFICIENT_DRAWS = 200  # draws of the coefficients for a band
BAND_QUANTILES = (0.025, 0.975)  # of the drawn lines, edges of a band
FIGURE_HEIGHT_PX = 250  # px


class EffectDrawing(NamedTuple):
    """An effect's drawing and what stands beside it."""

    name: str
    role: str  # in the model, added, or a candidate
    law: str
    sentence: str
    figure: go.Figure


def effect_drawings(explanation: Ladder) -> list[EffectDrawing]:
    """Drawings of the effects of the model, of those that were added, and of the first candidates that were not."""
    return [
        EffectDrawing(effect.name, role, said.equation, said.sentence, effect_figure(effect, problem, fitted))
        for effect, role, problem, fitted in _effects_to_draw(explanation)
        for said in [derive.effects.in_plant_units(effect, problem.plant)]
    ]


def _effects_to_draw(explanation: Ladder) -> Iterator[tuple[Effect, str, EstimationProblem, Fit]]:
    added = {s.effect for s in explanation.steps}
    for name in explanation.effects:
        role = "added" if name in added else "in the model"
        yield derive.effects.find(name), role, explanation.problem, explanation.fit
    others = [t for t in explanation.first.candidates if t.effect not in explanation.effects]
    for candidate in others[:MAX_DRAWN_CANDIDATES]:
        role = "candidate, not added" if candidate.physical else "impossible as fitted"
        yield derive.effects.find(candidate.effect), role, explanation.first.problem, candidate.fit


def effect_figure(effect: Effect, problem: EstimationProblem, fitted: Fit) -> go.Figure:
    """An effect's drawing; where each log has its own size, a line for each of the first three."""
    several = len(problem.logs) > 1 and bool(per_log_names(effect.full_names))
    figure, shown = go.Figure(), range(min(len(problem.logs), MAX_LOGS_PER_FIGURE) if several else 1)
    pictures, q = [effect_plot(effect, problem, fitted, k) for k in shown], plant_units_of(problem.model)
    if pictures[0].reference is not None:
        _add_line(figure, _DrawnLine(pictures[0].x, pictures[0].reference, "without", MUTED_COLOUR, dash="dash"))
    colours = iter(LINE_COLOURS * 4)
    for k, picture in zip(shown, pictures, strict=True):
        values = {n: fitted.of_log(k)[n] for n in effect.full_names}
        for name, y in picture.lines(values).items():
            label = ", ".join(filter(None, (display_text(name), problem.logs[k].name if several else "")))
            edges = confidence_band(picture.lines, name, values, fitted, k, problem.plant)
            known = q if f"[{q.force}]" in picture.y_label and "that acts" not in picture.y_label else None
            _add_line(figure, _DrawnLine(picture.x, y, label, next(colours), q=known), edges)
    return _with_axis_titles(figure, pictures[0])


def confidence_band(
    lines: LineFunction, name: str, values: dict[str, float], fitted: Fit, log: int, plant: PlantSignature | None = None
) -> tuple[np.ndarray, np.ndarray] | None:
    """Edges (points,) of a line whose coefficients are drawn from their errors; None where all are known.

    The wider of what the information matrix and the scatter of blocks give. Limits that a simulation needs are kept.
    """
    known = [n for n in values if n in fitted.names]
    places, limits = [fitted.place(n, log) for n in known], limits_of(known, plant)
    if not known:
        return None
    normal, edges = np.random.default_rng(0).normal(size=(COEFFICIENT_DRAWS, len(known))), []
    for matrix in (fitted.covariance, fitted.robust):
        eigenvalues, vectors = np.linalg.eigh(np.nan_to_num(matrix[np.ix_(places, places)], posinf=0.0))
        draws = normal @ (vectors * np.sqrt(np.maximum(eigenvalues, 0.0))).T
        moved = [{n: float(np.clip(values[n] + d, *limits[n]))
                  for n, d in zip(known, row, strict=True)} for row in draws]  # fmt: skip
        edges.append(np.quantile([lines({**values, **m})[name] for m in moved], BAND_QUANTILES, axis=0))
    return np.minimum(edges[0][0], edges[1][0]), np.maximum(edges[0][1], edges[1][1])


class _DrawnLine(NamedTuple):
    """A line of a figure and how it looks."""

    x: np.ndarray  # (points,)
    y: np.ndarray  # (points,)
    name: str  # in the legend; none for an empty one
    colour: str
    dash: str = "solid"
    q: PlantUnits | None = None  # where y is a force, which is shown in physical units too


def _add_line(figure: go.Figure, line: _DrawnLine, edges: tuple[np.ndarray, np.ndarray] | None = None) -> None:
    x, y, name, colour, dash, q = line
    if edges is not None and np.any(edges[1] > edges[0]):
        edge = np.concatenate([edges[1], edges[0][::-1]])
        figure.add_trace(go.Scatter(
            x=np.concatenate([x, x[::-1]]).astype(np.float32), y=edge.astype(np.float32), fill="toself", mode="none",
            fillcolor=_translucent(colour), hoverinfo="skip", showlegend=False,
        ))  # fmt: skip
    figure.add_trace(go.Scatter(
        x=x.astype(np.float32), y=np.asarray(y, dtype=np.float32), mode="lines", name=name, showlegend=bool(name),
        line={"color": colour, "width": 2, "dash": dash},
        **(force_hover(y, q, "") if q else {"hovertemplate": "%{x:.4g}: %{y:.4g}<extra></extra>"}),
    ))  # fmt: skip


def _translucent(colour: str) -> str:
    red, green, blue = (int(colour[k : k + 2], 16) for k in (1, 3, 5))
    return f"rgba({red},{green},{blue},0.22)"


def _with_axis_titles(figure: go.Figure, picture: EffectPlot) -> go.Figure:
    figure.update_xaxes(title={"text": display_text(picture.x_label), "standoff": 6})
    figure.update_yaxes(title={"text": display_text(picture.y_label), "standoff": 6})
    figure = with_page_style(figure, FIGURE_HEIGHT_PX).update_yaxes(rangemode="tozero")
    return figure.update_layout(margin={"l": 55, "r": 12, "t": 26, "b": 42}, font={"size": 12})
