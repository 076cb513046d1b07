"""`wheelpend demo`: every step on the shipped log, from a comparison to the report."""

from __future__ import annotations

from pathlib import Path

from wheelpend.api import explain
from wheelpend.cli.change import save_explanation
from wheelpend.diagnosis.compare import compare
from wheelpend.files import write_text
from wheelpend.logs.shipped import DEMO_HOLDOUT_LOG, DEMO_LOG, data_folder
from wheelpend.model import workspace
from wheelpend.model.precompile import compile_all
from wheelpend.model.record import Model
from wheelpend.model.toml_file import MODEL_FILE
from wheelpend.model.transaction import finish_change
from wheelpend.reports.console import print_line, print_text, progress
from wheelpend.reports.ladder import draw_ladder
from wheelpend.reports.page.page import write_report
from wheelpend.reports.text.comparison import comparison_text
from wheelpend.reports.text.diagnosis import diagnosis_text
from wheelpend.reports.text.explanation import explanation_text
from wheelpend.version import version


def fresh_workspace(folder: Path) -> Model:
    """A workspace with the paper's model; one of an earlier demo is made anew, for any other Failure is raised."""
    marker = folder / ".demo"
    finish_change(folder)
    if marker.exists() or _is_untouched(folder):
        for name in ("model.toml", workspace.HISTORY_FILE):
            (folder / name).unlink(missing_ok=True)
    model = workspace.create(folder)
    write_text(marker, "Made by `wheelpend demo`, which makes it anew.\n")
    return model


def _is_untouched(folder: Path) -> bool:
    """True for a workspace as a demo begins it, which may have been killed before it could say that it is its own."""
    if not (folder / MODEL_FILE).exists() or (folder / workspace.HISTORY_FILE).exists():
        return False
    return Model.open(folder).text == Model.default().text


def run_demo(folder: Path) -> None:
    """Tell the story in a workspace of its own, and leave the report in it."""
    data = data_folder()
    model = fresh_workspace(folder)
    log, holdout = data / DEMO_LOG, data / DEMO_HOLDOUT_LOG
    with progress("compiling") as update:
        compile_all(model, update)

    print_line("\n1. A balancing robot was logged. How well does the textbook model predict it?\n")
    with progress("comparing") as update:
        compared = compare(model, [log], progress=update)
    print_text(comparison_text(compared, model))

    print_line("\n2. Which physical effect is missing? Every effect is tried, and judged on a log no fit sees.\n")
    with progress("diagnosing") as update:
        result = explain(model, [log], [holdout], progress=update)
    print_text(diagnosis_text(result.first, model))

    print_line("\n3. Add it, derive the model again, refit, and watch the error fall.\n")
    print_text(explanation_text(result))
    print_line(save_explanation(result, [log], [holdout], model))
    with progress("writing the report"):
        page = write_report(result, folder / "report.html", version=version(), command="wheelpend demo",
                            files=[log, holdout])  # fmt: skip
    draw_ladder(result, folder / "error_ladder.svg")
    print_line(f"\nThe report is {page}. Open it in a browser.")
