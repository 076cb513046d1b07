"""Figures of the missing force: over time, over a state, over a pair of them; chosen samples stand out."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
import plotly.graph_objects as go

from wheelpend.reports.page.binning import bin_means, quantile_bins

FORCE_COLOUR, CHOSEN_COLOUR, EXPLAINED_COLOUR = "#2f86d6", "#d98a1f", "#7a4fa3"
BAND_COLOUR, CLOUD_COLOUR = "rgba(47,134,214,0.22)", "#8a919c"
BAND_WIDTH = 2.0  # standard deviations on either side
MAP_BINS = 14
MAX_CLOUD = 1200  # points
MIN_BIN_SAMPLES = 3
MAP_COLOURS = "RdBu"  # told apart by everybody


class Force(NamedTuple):
    """The missing force of a log on one row, and the states where it acts."""

    t: np.ndarray  # (n,) s
    force: np.ndarray  # (n,)
    sigma: np.ndarray  # (n,)
    variables: dict[str, np.ndarray]
    units: Mapping[str, str]
    unit: str  # of the force

    @classmethod
    def of(cls, told: Mapping[str, Any], row: int, unit: str) -> Force:
        """The force of a log as a process told it, in the order of time."""
        t = np.array(told["t"], dtype=float)
        order = np.argsort(t, kind="stable")
        columns = {n: np.array(v, dtype=float)[order] for n, v in told["variables"].items()}
        force, sigma = (np.array(told[key][row], dtype=float)[order] for key in ("force", "sigma"))
        return cls(t[order], force, sigma, columns, told["units"], unit)

    def within(self, name: str, low: float, high: float) -> np.ndarray:
        """Which samples (n,) lie in a range of a variable, or of the time."""
        values = self.t if name == "t" else self.variables[name]
        return (values >= low) & (values <= high)


def over_time(f: Force, chosen: np.ndarray, explained: np.ndarray | None = None, name: str = "") -> go.Figure:
    """The force with its band, the chosen samples, and what a candidate would explain."""
    figure = go.Figure()
    edge = np.concatenate([f.force + BAND_WIDTH * f.sigma, (f.force - BAND_WIDTH * f.sigma)[::-1]])
    _add(figure, np.concatenate([f.t, f.t[::-1]]), edge, "± 2 standard deviations", fill=BAND_COLOUR)
    _add(figure, f.t, f.force, "missing force", colour=FORCE_COLOUR)
    if explained is not None:
        _add(figure, f.t, explained, f"{name} would explain", colour=EXPLAINED_COLOUR)
    if chosen.any():
        _add(figure, f.t, np.where(chosen, f.force, np.nan), "chosen", colour=CHOSEN_COLOUR, width=2.6)
    figure.update_xaxes(title_text="t [s]")
    figure.update_yaxes(title_text=f"missing force [{f.unit}]")
    return figure.update_layout(dragmode="select", selectdirection="h")


def over_variable(f: Force, name: str, chosen: np.ndarray) -> go.Figure:
    """The force at samples over a state or an input, its mean in ranges with the band of that, and what is chosen."""
    figure, x = go.Figure(), f.variables[name]
    thin = slice(None, None, max(1, -(-len(x) // MAX_CLOUD)))
    _add(figure, x[thin], f.force[thin], "samples", points=CLOUD_COLOUR)
    centres, means, errors = bin_means(x, f.force, quantile_bins(x)).T
    edge = np.concatenate([means + BAND_WIDTH * errors, (means - BAND_WIDTH * errors)[::-1]])
    _add(figure, np.concatenate([centres, centres[::-1]]), edge, "± 2 standard errors", fill=BAND_COLOUR)
    _add(figure, centres, means, "mean", colour=FORCE_COLOUR)
    if chosen.any():
        _add(figure, x[chosen], f.force[chosen], "chosen", points=CHOSEN_COLOUR)
    figure.update_xaxes(title_text=f"{name} [{f.units.get(name, '')}]")
    figure.update_yaxes(title_text=f"[{f.unit}]")
    return figure.update_layout(dragmode="select", selectdirection="h", showlegend=False)


def over_pair(f: Force, names: tuple[str, str], chosen: np.ndarray) -> go.Figure:
    """A map of the mean force over two variables; where hardly a sample is it stays blank."""
    x, y = (f.variables[name] for name in names)
    edges = [np.linspace(v.min(), v.max() if np.ptp(v) else v.min() + 1.0, MAP_BINS + 1) for v in (x, y)]
    count, _, _ = np.histogram2d(x, y, bins=edges)
    total, _, _ = np.histogram2d(x, y, bins=edges, weights=f.force)
    mean = np.where(count >= MIN_BIN_SAMPLES, total / np.maximum(count, 1.0), np.nan)
    limit = float(np.nanmax(np.abs(mean), initial=0.0)) or 1.0
    shown = [[None if np.isnan(v) else round(float(v), 6) for v in row] for row in mean.T]
    centres = [(0.5 * (e[1:] + e[:-1])).tolist() for e in edges]
    figure = go.Figure(go.Heatmap(x=centres[0], y=centres[1], z=shown, zmin=-limit, zmax=limit, colorscale=MAP_COLOURS,
                                  colorbar={"title": f"[{f.unit}]"}, hoverongaps=False))  # fmt: skip
    if chosen.any():
        _add(figure, x[chosen], y[chosen], "chosen", points="#1f2430")
    for axis, name in zip((figure.update_xaxes, figure.update_yaxes), names, strict=True):
        axis(title_text=f"{name} [{f.units.get(name, '')}]")
    return figure.update_layout(dragmode="select", showlegend=False)


def _add(
    figure: go.Figure,
    x: np.ndarray,
    y: np.ndarray,
    name: str,
    *,
    colour: str = "",
    points: str = "",
    fill: str = "",
    width: float = 1.6,
) -> None:
    """Add a line, points or a filled band; what is no number is a gap."""
    style: dict[str, Any] = {"mode": "none", "fill": "toself", "fillcolor": fill, "hoverinfo": "skip"}
    if colour:
        style = {"mode": "lines", "line": {"color": colour, "width": width}, "connectgaps": False}
    if points:
        style = {"mode": "markers", "marker": {"color": points, "size": 4}}
    shown = [None if np.isnan(v) else v for v in y.tolist()]
    figure.add_trace(go.Scatter(x=x.tolist(), y=shown, name=name, **style))
