"""Results as pictures for a notebook, a function for each kind: what `.plot()` of a result calls."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from textwrap import fill
from typing import TYPE_CHECKING, Any

import numpy as np

from wheelpend.diagnosis.compare import Comparison
from wheelpend.diagnosis.explain import Ladder
from wheelpend.diagnosis.predict import Prediction
from wheelpend.diagnosis.verdict import Diagnosis
from wheelpend.errors import Failure, require
from wheelpend.identification.identify import Identification
from wheelpend.identification.residual_tests import ResidualTests
from wheelpend.isolation import import_configured
from wheelpend.reports.drawing import INK_COLOUR, MEASURED_COLOUR, figure_style
from wheelpend.reports.ladder import SVG_COLOURS, ladder_rungs
from wheelpend.reports.names import display_text
from wheelpend.reports.numbers import prediction_error_text, share_text, whole_digits_text
from wheelpend.reports.text.remainder import leaves_a_force
from wheelpend.reports.text.structures import named_probabilities

if TYPE_CHECKING:
    from matplotlib.axes import Axes

PANEL_WIDTH_IN, PANEL_HEIGHT_IN, TIME_PANEL_HEIGHT_IN = 7.0, 4.0, 2.1  # inches
BAR_HEIGHT_IN, BARS_MARGIN_IN = 0.38, 1.1  # inches, of a picture of bars
MODEL_COLOURS = ("#d9622b", "#2166ac", "#3f8f4f", "#8254a2", "#b8860b")  # of several models; the first is this one's
NORMAL_QUANTILE_95 = 1.96  # standard errors on either side of an interval of 95 %
MAX_CELL_NUMBERS = 12  # parameters up to which a correlation is also written into its cell
MAX_DRAWN_CANDIDATES, MAX_LABEL_CHARACTERS = 8, 28  # bars, and letters of a line beside them


def plot(result: Any, ax: Any = None) -> Any:
    """Draw a result, and return the Axes, or an array of Axes (panels,).

    Drawn are results of ``compare`` (error against horizon), ``predict`` (each channel over time), ``residuals``
    (autocorrelation of each channel), ``identify`` (relative standard errors, and correlations), ``explain`` (the
    ladder) and ``diagnose`` (probabilities, or errors of the candidates). ``ax`` are Axes to draw into, or an array of
    as many as there are panels; new ones are made where it is None. Raises Failure where matplotlib is not installed,
    for a result without a picture, and for another number of Axes.
    """
    require("matplotlib", "plots", "A picture of a result")
    kind = next((k for k in RESULT_PICTURES if isinstance(result, k)), None)
    if kind is None:
        drawn = ", ".join(k.__name__ for k in RESULT_PICTURES)
        raise Failure(f"A picture must be of a {drawn}, not of a {type(result).__name__}. Its to_frame() has numbers.")
    with figure_style():
        return RESULT_PICTURES[kind](result, ax)


def panels(ax: Any, size: tuple[float, float], rows: int = 1, columns: int = 1, **shared: Any) -> np.ndarray:
    """Axes (rows · columns,) to draw into: those that are given, or those of a new figure of a size [inches]."""
    count = rows * columns
    if ax is not None:
        given = np.ravel(np.asarray(ax, dtype=object))
        if len(given) != count:
            raise Failure(f"ax must hold {count} Axes, one for each panel of this result, but it holds {len(given)}. "
                          "Leave it out to have them made.")  # fmt: skip
        return given
    import_configured("matplotlib")  # late: a start of the command must not wait for it
    from matplotlib import pyplot

    return pyplot.subplots(rows, columns, figsize=size, layout="constrained", squeeze=False, **shared)[1].ravel()


def plot_comparison(result: Comparison, ax: Axes | None = None) -> Axes:
    """Error against horizon, a line per model; what diverges is a cross near the upper edge."""
    (axes,) = panels(ax, (PANEL_WIDTH_IN, PANEL_HEIGHT_IN))
    for number, (model, colour) in enumerate(zip(result.models, _colours(len(result.models)), strict=True)):
        height = 0.97 - 0.04 * number  # of its crosses, as a share of the panel
        known = [(h.seconds, h.error) for h in model.horizons if h.error is not None]
        axes.loglog(*zip(*known, strict=True), "o-", color=colour, markersize=4, label=model.label) if known else None
        lost = [h.seconds for h in model.horizons if h.diverged]
        axes.plot(lost, np.full(len(lost), height), "x", color=colour, transform=axes.get_xaxis_transform())
    _draw_floor(axes.axhline, result.noise_floor)
    axes.set(xscale="log", yscale="log", xlabel="predicted ahead [s]", ylabel="error [σ]")
    axes.set_title("Prediction error" + (" (× diverged)" if _diverges(result) else ""))
    axes.legend(loc="upper left")  # errors grow from the lower left to the upper right
    return axes


def _diverges(result: Comparison) -> bool:
    return any(h.diverged for model in result.models for h in model.horizons)


def plot_prediction(result: Prediction, ax: Any = None) -> np.ndarray:
    """Each channel over time, measured and predicted; the prediction begins anew with every segment."""
    count = len(result.channels)
    axes = panels(ax, (PANEL_WIDTH_IN + 2.0, TIME_PANEL_HEIGHT_IN * count), count, sharex=True)
    breaks = np.flatnonzero(np.diff(result.segment)) + 1
    t = np.insert(result.t, breaks, np.nan)
    for panel, name, measured, predicted in zip(
        axes, result.channels, result.measured.T, result.predicted.T, strict=True
    ):
        shown = np.where(np.isfinite(predicted), predicted, np.nan)
        panel.plot(result.t, measured, color=MEASURED_COLOUR, linewidth=2.2, label="measured")
        panel.plot(t, np.insert(shown, breaks, np.nan), color=MODEL_COLOURS[0], linewidth=1.0, label="predicted")
        panel.set_ylabel(display_text(name))
    axes[0].set_title(f"Predicted over {result.horizon_s:g} s, error {prediction_error_text(result.error)}")
    axes[0].legend(loc="upper right", ncols=2)
    axes[-1].set_xlabel("time [s]")
    return axes


def plot_residuals(result: ResidualTests, ax: Any = None) -> np.ndarray:
    """Autocorrelation of each channel's residual, and the band that holds 95 % of the values of white noise."""
    count = len(result.channels)
    axes = panels(ax, (PANEL_WIDTH_IN, TIME_PANEL_HEIGHT_IN * count), count, sharex=True)
    for panel, (name, found) in zip(axes, result.channels.items(), strict=True):
        lags, band = np.array(found.lags_s), np.array(found.band)
        panel.fill_between(
            lags, -band, band, color=MEASURED_COLOUR, alpha=0.35, linewidth=0, label="95 % of white noise"
        )
        colour = MODEL_COLOURS[1] if found.white else MODEL_COLOURS[0]
        panel.vlines(lags, 0.0, found.autocorrelation, color=colour, linewidth=1.0)
        panel.plot(lags, found.autocorrelation, "o", color=colour, markersize=3)
        panel.set_title(f"{display_text(name)}: {'white' if found.white else 'not white'}")
    axes[count // 2].set_ylabel("autocorrelation of the residual")
    axes[0].legend(loc="upper right")
    axes[-1].set_xlabel("lag [s]")
    return axes


def plot_identification(result: Identification, ax: Any = None) -> np.ndarray:
    """Standard error of each parameter relative to its value, and the correlations of the estimates."""
    covariance = result.covariance
    if covariance is None or not len(covariance.names):
        raise Failure("A picture of an identification needs the covariance of its estimates, but this one has none.")
    size = max(PANEL_HEIGHT_IN, BAR_HEIGHT_IN * len(covariance.names) + BARS_MARGIN_IN)
    left, right = panels(ax, (2.0 * size + 1.5, size), columns=2)
    estimates = [e for n, e in result.parameters.items() if n not in result.fixed]
    names = [display_text(n) for n in result.parameters if n not in result.fixed]
    percent = [100.0 * e.sigma / abs(e.value) if e.value and e.sigma > 0.0 else np.nan for e in estimates]
    colours = [MODEL_COLOURS[1] if e.identifiable else MODEL_COLOURS[0] for e in estimates]
    texts = [f"{whole_digits_text(p, 2)} %" if np.isfinite(p) else "no value or no error" for p in percent]
    _draw_bars(left, names, percent, colours, texts)
    left.set(xscale="log", xlabel="standard error / value [%]")
    left.set_title(f"Parameters by {result.method}")
    _draw_correlations(right, [display_text(n) for n in covariance.names], covariance.matrix)
    return np.array([left, right], dtype=object)


def _draw_correlations(axes: Axes, names: Sequence[str], covariance: np.ndarray) -> None:
    sigma = np.sqrt(np.maximum(np.diag(covariance), 1e-300))
    correlation = np.clip(covariance / np.outer(sigma, sigma), -1.0, 1.0)
    axes.imshow(correlation, cmap="RdBu_r", vmin=-1.0, vmax=1.0)
    axes.grid(False)
    labels = [name.replace(".", "\n") for name in names]  # of an effect and its parameter
    axes.set_xticks(range(len(names)), labels, rotation=0 if max(map(len, names)) < 4 else 90)
    axes.set_yticks(range(len(names)), labels)
    axes.set_title("Correlations of the estimates")
    for row, column in np.ndindex(correlation.shape if len(names) <= MAX_CELL_NUMBERS else (0, 0)):
        value = correlation[row, column]
        colour = "white" if abs(value) > 0.6 else INK_COLOUR
        axes.text(column, row, f"{value:.2f}", ha="center", va="center", fontsize=8, color=colour)


def plot_ladder(result: Ladder, ax: Axes | None = None) -> Axes:
    """The error of every rung of the ladder, and the noise floor."""
    rungs = ladder_rungs(result)
    (axes,) = panels(ax, _bars_size(len(rungs)))
    errors = [r.error if np.isfinite(r.error) else np.nan for r in rungs]
    texts = [r.text if np.isfinite(r.error) else "diverged" for r in rungs]
    _draw_bars(axes, [r.label for r in rungs], errors, [SVG_COLOURS[r.kind] for r in rungs], texts)
    _draw_errors_scale(axes, errors, result.noise_floor)
    axes.set_title(f"Error ladder: {result.verdict.replace('_', ' ')}")
    return axes


def plot_diagnosis(result: Diagnosis, ax: Axes | None = None) -> Axes:
    """Probabilities of what may be missing; without any, the error that each candidate would leave."""
    likely = named_probabilities(result.structures, beside_force=leaves_a_force(result.remainder))
    if likely:
        (axes,) = panels(ax, _bars_size(len(likely)))
        values = [100.0 * p for _, p in likely]
        colours = [MODEL_COLOURS[1]] * len(values)
        _draw_bars(axes, [n for n, _ in likely], values, colours, [share_text(p) for _, p in likely])
        axes.set(xlim=(0.0, 115.0), xlabel="probability [%]")
    else:
        candidates = result.candidates[:MAX_DRAWN_CANDIDATES]
        (axes,) = panels(ax, _bars_size(1 + len(candidates)))
        errors = [result.error, *(c.error_after for c in candidates)]
        names = ["as it is", *(f"+ {c.effect}" for c in candidates)]
        colours = [SVG_COLOURS["refitted"], *[SVG_COLOURS["step"]] * len(candidates)]
        _draw_bars(axes, names, errors, colours, [prediction_error_text(e) for e in errors])
        _draw_errors_scale(axes, errors, result.noise_floor)
    axes.set_title(f"Diagnosis: {result.verdict.replace('_', ' ')}")
    return axes


def _bars_size(bars: int) -> tuple[float, float]:
    return PANEL_WIDTH_IN, BARS_MARGIN_IN + BAR_HEIGHT_IN * max(bars, 2)


def _draw_bars(
    axes: Axes, names: Sequence[str], values: Sequence[float], colours: Sequence[str], texts: Sequence[str]
) -> None:
    """Horizontal bars from above to below, each with its text at its end."""
    places = range(len(names))
    bars = axes.barh(places, values, color=colours, height=0.62)
    shown = [text if np.isfinite(value) else "" for text, value in zip(texts, values, strict=True)]
    axes.bar_label(bars, shown, padding=4, fontsize=9)
    for place, (text, value) in enumerate(zip(texts, values, strict=True)):
        if not np.isfinite(value):
            axes.text(0.01, place, text, transform=axes.get_yaxis_transform(), va="center", fontsize=9)
    axes.set_yticks(places, [fill(name, MAX_LABEL_CHARACTERS) for name in names])
    axes.set_ylim(len(names) - 0.5, -0.5)
    axes.grid(False, axis="y")
    axes.margins(x=0.25)


def _draw_errors_scale(axes: Axes, errors: Sequence[float], floor: float) -> None:
    """A logarithmic scale of errors that begins below the noise floor, with room for the texts at the bars' ends."""
    largest = max([floor, *(e for e in errors if np.isfinite(e))])
    span = np.log10(largest / (0.8 * floor))
    axes.set(xscale="log", xlim=(0.8 * floor, largest * 10 ** (0.35 * span + 0.05)), xlabel="error [σ]")
    _draw_floor(axes.axvline, floor)


def _draw_floor(line: Callable[..., Any], floor: float) -> None:
    line(floor, color=INK_COLOUR, linestyle="--", linewidth=1.0, label="noise floor")


def _colours(count: int) -> list[str]:
    return [MODEL_COLOURS[k % len(MODEL_COLOURS)] for k in range(count)]


RESULT_PICTURES: dict[type, Callable[..., Any]] = {
    Comparison: plot_comparison,
    Prediction: plot_prediction,
    ResidualTests: plot_residuals,
    Identification: plot_identification,
    Ladder: plot_ladder,
    Diagnosis: plot_diagnosis,
}
