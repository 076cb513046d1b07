"""The whole story on the shipped log: compare, see where it fails, diagnose, add, watch the error fall, report."""

from __future__ import annotations

from pathlib import Path

from wheelpend import wording, workspace
from wheelpend.comparison import compare
from wheelpend.console import progress, say
from wheelpend.explanation import explain
from wheelpend.failures import Failure
from wheelpend.ladder import draw_ladder
from wheelpend.model import Model
from wheelpend.reporting import write_report
from wheelpend.version import version
from wheelpend.warm import compile_all

HERE = Path(__file__).resolve().parent
LOG, HOLDOUT = "demo.csv", "demo_holdout.csv"


def data_folder() -> Path:
    """Where the shipped logs are: in the package, or beside it in a clone."""
    for folder in (HERE / "data", HERE.parent / "data"):
        if (folder / LOG).exists():
            return folder
    raise Failure(f"The shipped logs must lie in {HERE / 'data'}, but they are missing. Install wheelpend again.")


def fresh_workspace(folder: Path) -> Model:
    """A workspace with the paper's model; one that an earlier demo left is made anew, any other is refused."""
    marker = folder / ".demo"
    if marker.exists():
        for name in ("model.toml", workspace.HISTORY):
            (folder / name).unlink(missing_ok=True)
    model = workspace.create(folder)
    marker.write_text("Made by `wheelpend demo`, which makes it anew.\n", encoding="utf-8")
    return model


def run(folder: Path) -> None:
    """Tell the story in a workspace of its own, and leave the report in it."""
    data = data_folder()
    model = fresh_workspace(folder)
    log, holdout = data / LOG, data / HOLDOUT
    with progress("compiling") as update:
        compile_all(model, update)

    say("\n1. A balancing robot was logged. How well does the textbook model predict it?\n")
    with progress("comparing") as update:
        wording.show_comparison(compare(model, [log], progress=update), model)

    say("\n2. Which physical effect is missing? Every effect is tried, and judged on a log no fit sees.\n")
    with progress("diagnosing") as update:
        result = explain(model, [log], [holdout], progress=update)
    wording.show_diagnosis(result.first, model)

    say("\n3. Add it, derive the model again, refit, and watch the error fall.\n")
    wording.show_explanation(result)

    from wheelpend.change import record

    record(result, [log], [holdout])
    page = write_report(result, folder / "report.html", version=version(), command="wheelpend demo")
    draw_ladder(result, folder / "error_ladder.svg")
    say(f"\nThe report is {page}. Open it in a browser.")
