"""Compare: measured and predicted, the error against the horizon, and what the residuals say."""

from __future__ import annotations

from collections.abc import Hashable, Mapping
from pathlib import Path
from typing import Any

import plotly.graph_objects as go

from wheelpend.reports.numbers import fit_text, number_text
from wheelpend.view.panel import Panel, action, chart, folded, paragraph, set_enabled, table
from wheelpend.view.prediction_chart import prediction_chart
from wheelpend.view.residual_tests import show_residual_tests
from wheelpend.view.stretch_control import StretchControl
from wheelpend.view.words import sentences

ERROR_COLOUR, FLOOR_COLOUR = "#2f86d6", "#d98a1f"  # told apart by everybody, on light and on dark


class ComparePanel(Panel):
    """How well the model predicts."""

    name, title = "compare", "2 Compare"
    purpose = "How well does the model predict what was measured?"

    def show_buttons(self) -> None:
        """The comparison."""
        self.compare = action("Compare", self._compare, main=True)

    def _compare(self) -> None:
        self.bench.run(("compare", *self.bench.files), ("predictions", *self.bench.files))

    def update_buttons(self) -> None:
        """It needs a log and a model."""
        set_enabled(self.compare, self.bench.can_judge)

    def state(self) -> Hashable:
        """The comparison."""
        return self.bench.numbers("compare", "predictions")

    def show(self) -> None:
        """The fit of each channel, and the error against the horizon; first what it amounts to, in words."""
        found = self.bench.current("compare")
        if found is None:
            paragraph("Not compared yet, since the model or the logs changed." if "compare" in self.bench.found else "")
            return
        said = sentences(found.text) or [""]
        judged = number_text(found.result.get("error"))
        lead = next((words for words in said if judged in words.split()), said[0])
        rest = [words for words in said if words != lead]
        paragraph(lead, "lead")
        fit, off = found.result.get("fit_percent") or {}, found.result.get("rmse") or {}
        rows = [[name, fit_text(fit[name]), number_text(off.get(name))] for name in fit]
        table(("channel", "fit [%]", "rms error"), rows, f"Fit over {number_text(found.result.get('horizon_s'))} s")
        self._show_predictions()
        show_residual_tests(found.result.get("residuals") or {})
        with folded("Closed loop, what is left to chance, what the residuals mean"):
            for sentence in rest:
                paragraph(sentence)
        chart(_horizon_figure(found.result), "Error against horizon, in standard deviations of the sensors")

    def _show_predictions(self) -> None:
        """Measured and predicted of the log that judges, others behind a line."""
        found = self.bench.current("predictions")
        pairs = list(zip(found.result["logs"], found.series, strict=True)) if found else []
        for number, (log, series) in enumerate(pairs):
            is_open = number == 0 or Path(log["path"]) in self.bench.splits
            with folded(f"{log['name']}{', held out' if log['held_out'] else ''}", is_open=is_open):
                drawn = prediction_chart(series, log["channels"], held_out=log["held_out"])
                if not log["held_out"]:
                    StretchControl(self.bench, Path(log["path"]), log["duration_s"], drawn)


def _horizon_figure(result: Mapping[str, Any]) -> go.Figure:
    known = [h for h in result.get("horizons") or [] if h.get("error") is not None]
    seconds, errors = [h["seconds"] for h in known], [h["error"] for h in known]
    line = {"color": ERROR_COLOUR, "width": 2}
    figure = go.Figure(go.Scatter(x=seconds, y=errors, mode="lines+markers", name="error", line=line))
    floor = [result.get("noise_floor") or 1.0] * len(seconds)
    figure.add_scatter(
        x=seconds, y=floor, mode="lines", line={"dash": "dash", "color": FLOOR_COLOUR}, name="noise floor"
    )
    figure.update_xaxes(type="log", title_text="horizon [s]")
    figure.update_yaxes(type="log", title_text="error [σ]")
    return figure
