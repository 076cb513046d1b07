"""A process that writes the page of sliders for the model as it stands, or with one effect more, for the workbench.

    python -m wheelpend.cli.view_sliders [--with EFFECT] LOG... [--holdout LOG] [--model FILE] --json FILE

takes the words of `wheelpend compare`. An effect that is tried begins where it does nothing.
"""

from __future__ import annotations

from pathlib import Path

from wheelpend import interruption
from wheelpend.diagnosis.compare import model_to_compare
from wheelpend.reports.console import emit_json, exit_on_failure, progress
from wheelpend.reports.page.sliders_page import sliders_page, with_absent_effect
from wheelpend.view.asked import opened_model, question_parser


def main() -> None:
    """Entry point of the process."""
    interruption.watch()
    parser = question_parser()
    parser.add_argument("--with", dest="effect", default="")
    asked = parser.parse_args()
    with exit_on_failure(asked.json), progress("reading") as update:
        model = opened_model(asked)
        tried = with_absent_effect(model, asked.effect) if asked.effect else model
        logs, holdout = [Path(p) for p in asked.logs], [Path(p) for p in asked.holdout]
        compared = model_to_compare(tried, logs, holdout, update)
        update("translating the model into the page's language")
        emit_json({"schema": 1, "effect": asked.effect, "page": sliders_page(compared)}, asked.json)


if __name__ == "__main__":
    main()
