"""A process that draws what a diagnosis found, for the workbench: the missing force over time and over a state.

    python -m wheelpend.cli.view_figures LOG... [--holdout LOG] [--model FILE] --json FILE

takes the words of `wheelpend diagnose`, whose answer it takes up where that was just given.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import plotly.graph_objects as go

from wheelpend import interruption
from wheelpend.api import diagnose
from wheelpend.cli.kept_searches import searched
from wheelpend.diagnosis.verdict import Diagnosis
from wheelpend.model.record import Model
from wheelpend.model.units import plant_units_of
from wheelpend.reports.console import emit_json, exit_on_failure, progress
from wheelpend.reports.page.force_figures import force_figure, state_figure
from wheelpend.view.asked import asked_of_files, opened_model

MAX_FORCE_POINTS = 2000  # of a line
DEFAULT_QUESTION: dict[str, Any] = {"without": [], "law": False}  # as `wheelpend diagnose` asks without options
STATE_TITLE = "The missing force over the state on which it depends most, with the law of each candidate"


def main() -> None:
    """Entry point of the process."""
    interruption.watch()
    asked = asked_of_files()
    with exit_on_failure(asked.json), progress("reading") as update:
        model = opened_model(asked)
        files = [Path(p) for p in asked.logs], [Path(p) for p in asked.holdout]
        found = searched("diagnosis", diagnose, model, files, DEFAULT_QUESTION, update)
        drawn = [{"title": title, "figure": json.loads(figure.to_json())} for title, figure in _figures(found, model)]
        emit_json({"schema": 1, "figures": drawn}, asked.json)


def _figures(found: Diagnosis, model: Model) -> Iterator[tuple[str, go.Figure]]:
    """Each figure with its title."""
    quantities = plant_units_of(model)
    if (over_state := state_figure(found, quantities)) is not None:
        yield STATE_TITLE, over_state
    for missing in found.missing:
        title = f"The missing force over time, with a band of two standard deviations: {missing.log}"
        yield title, force_figure(missing, found.problem.module.ROWS, quantities, MAX_FORCE_POINTS)


if __name__ == "__main__":
    main()
