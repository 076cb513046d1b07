"""Pictures of a fleet: its units beside each other, a map of units by parameters or effects, and what drifts."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import plotly.graph_objects as go

from wheelpend.campaigns.drift import Drift
from wheelpend.campaigns.fleet import WIDTH_95, Fleet, UnitEstimate
from wheelpend.campaigns.units import EffectSpread, UnitsAnswer
from wheelpend.reports.page.style import AFTER_COLOUR, BEFORE_COLOUR, MUTED_COLOUR, with_page_style

MAX_FOREST_UNITS, MAX_MAP_UNITS, MAX_FORESTS = 40, 200, 4
ROW_HEIGHT_PX, MAP_ROW_HEIGHT_PX, FRAME_HEIGHT_PX = 18, 16, 110
MAP_LIMIT = 6.0  # standard deviations, beyond which a colour does not change
DEVIATION_COLOURS = ((0.0, "#1f6fb4"), (0.5, "#f4f6f8"), (1.0, "#d1592a"))


def telling_parameters(answer: UnitsAnswer) -> list[str]:
    """Parameters that are worth a picture: those by which units stand out, then those that scatter."""
    fleet = answer.fleet
    if fleet is None:
        return []
    by = [e.parameter for o in fleet.odd for e in o.difference.parameters[:1]]
    scattering = [n for n, p in fleet.parameters.items() if p.scatters]
    return list(dict.fromkeys([*sorted(by, key=by.count, reverse=True), *scattering]))[:MAX_FORESTS]


def forest_figure(fleet: Fleet, parameter: str, unit: str = "") -> go.Figure:
    """The units' estimates of a parameter with intervals of 95 %, in order, on the fleet's mean and scatter.

    Of many units those farthest from the mean are drawn.
    """
    found, told = fleet.parameters[parameter], [u for u in fleet.units if parameter in u.names]
    values, sigmas = (np.array(v) for v in zip(*(_estimate(u, parameter) for u in told), strict=True))
    far = np.argsort(-np.abs(values - found.mean))[:MAX_FOREST_UNITS]
    order = far[np.argsort(values[far])]
    odd = {o.unit for o in fleet.odd}
    colours = [BEFORE_COLOUR if told[k].unit in odd else AFTER_COLOUR for k in order]
    figure = go.Figure()
    figure.add_vrect(x0=found.mean - WIDTH_95 * found.scatter, x1=found.mean + WIDTH_95 * found.scatter,
                     fillcolor=MUTED_COLOUR, opacity=0.25, line_width=0)  # fmt: skip
    figure.add_vline(x=found.mean, line={"color": MUTED_COLOUR, "width": 2})
    figure.add_scatter(
        x=values[order], y=[told[k].unit for k in order], mode="markers", marker={"color": colours, "size": 8},
        error_x={"type": "data", "array": WIDTH_95 * sigmas[order], "thickness": 1.4, "width": 3},
        hovertemplate="%{y}: %{x:.5g}<extra></extra>", showlegend=False,
    )  # fmt: skip
    figure.update_xaxes(title=f"{parameter} [{unit}]" if unit else parameter)
    figure.update_yaxes(type="category")
    return with_page_style(figure, FRAME_HEIGHT_PX + ROW_HEIGHT_PX * len(order))


def deviation_map(fleet: Fleet) -> go.Figure:
    """Units by parameters: how far each is from the fleet, in standard deviations of scatter and errors together."""
    names = list(fleet.parameters)
    rows = {u.unit: [_deviation(fleet, u, name) for name in names] for u in fleet.units}
    odd = [o.unit for o in fleet.odd]
    ordered = [*odd, *(u for u in rows if u not in odd)][:MAX_MAP_UNITS]
    return _map(names, ordered, [rows[u] for u in ordered], "standard deviations from the fleet")


def effect_map(effects: Sequence[EffectSpread]) -> go.Figure:
    """Units by effects: which unit lacks what."""
    units = list(dict.fromkeys(u for e in effects for u in e.units))[:MAX_MAP_UNITS]
    rows = [[MAP_LIMIT if u in e.units else 0.0 for e in effects] for u in units]
    return _map([e.effect for e in effects], units, rows, "")


def _map(columns: Sequence[str], units: Sequence[str], rows: Sequence[Sequence[float]], title: str) -> go.Figure:
    """Squares in rows and columns, by colour; a hover says the number."""
    x = [c for _ in units for c in columns]
    y = [u for u in units for _ in columns]
    values = [v for row in rows for v in row]
    bar = {"title": title, "thickness": 12} if title else None
    marker = {"symbol": "square", "size": 12, "color": values, "cmin": -MAP_LIMIT, "cmax": MAP_LIMIT,
              "colorscale": DEVIATION_COLOURS, "showscale": bool(title), "colorbar": bar,
              "line": {"color": MUTED_COLOUR, "width": 0.5}}  # fmt: skip
    hover = "%{y}, %{x}: %{marker.color:.2f}<extra></extra>" if title else "%{y}, %{x}<extra></extra>"
    figure = go.Figure(go.Scatter(x=x, y=y, mode="markers", marker=marker, hovertemplate=hover))
    figure.update_xaxes(type="category", side="top")
    figure.update_yaxes(type="category", autorange="reversed", dtick=1)
    return with_page_style(figure, FRAME_HEIGHT_PX + MAP_ROW_HEIGHT_PX * len(units))


def drift_figure(
    drift: Drift, estimates: Sequence[UnitEstimate], days: Sequence[float], unit: str = ""
) -> go.Figure | None:
    """A parameter over the date, of the unit that drifts or of all, each on its own level; None without a log of it."""
    figure = go.Figure()
    whose = dict.fromkeys(e.unit for e in estimates if drift.unit in (None, e.unit) and drift.parameter in e.names)
    for name in list(whose)[:MAX_FOREST_UNITS]:
        own = [(day, *_estimate(e, drift.parameter))
               for e, day in zip(estimates, days, strict=True)
               if e.unit == name and drift.parameter in e.names]  # fmt: skip
        day, value, sigma = (np.array(column) for column in zip(*sorted(own), strict=True))
        dates = (day * 86400.0e9).astype("datetime64[ns]").astype(str)
        figure.add_scatter(x=dates, y=value, mode="lines+markers", name=name,
                           error_y={"type": "data", "array": WIDTH_95 * sigma, "thickness": 1.2})  # fmt: skip
    figure.update_yaxes(title=f"{drift.parameter} [{unit}]" if unit else drift.parameter)
    return with_page_style(figure, 320) if whose else None


def _estimate(unit: UnitEstimate, parameter: str) -> tuple[float, float]:
    """A unit's value and standard error."""
    k = unit.names.index(parameter)
    return float(unit.values[k]), float(np.sqrt(unit.covariance[k, k]))


def _deviation(fleet: Fleet, unit: UnitEstimate, parameter: str) -> float:
    if parameter not in unit.names:
        return 0.0
    (value, sigma), found = _estimate(unit, parameter), fleet.parameters[parameter]
    return (value - found.mean) / float(np.hypot(sigma, found.scatter))
