"""The command `export`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from wheelpend.cli.app import app
from wheelpend.cli.options import DEFAULT_MODEL_PATH, Holdout, Json, ModelFile, OptionalLogs, PlantFile, open_model
from wheelpend.reports.console import exit_on_failure, print_result, print_text, progress

Target = Annotated[str, typer.Argument(help="c, js, fmu, mujoco or json.", show_default=False)]


@app.command()
def export(
    target: Target,
    logs: OptionalLogs = None,
    holdout: Holdout = None,
    output: Annotated[
        Path | None,
        typer.Option("-o", "--out", metavar="DIR", help="Where to write it; export-TARGET.", show_default=False),
    ] = None,
    period: Annotated[
        float | None,
        typer.Option(help="Seconds between samples; of the log, else 0.001.", show_default=False),
    ] = None,
    model: ModelFile = DEFAULT_MODEL_PATH,
    plant: PlantFile = None,
    json: Json = None,
) -> None:
    """Export the model as it stands to another language, with a ledger of what it carries and its error there."""
    # imported late, as in every command: the list of commands needs none of it
    from wheelpend.export.export import checked_request, export_model, write_export
    from wheelpend.reports.text.export import export_text

    with exit_on_failure(json):
        folder = output or Path(f"export-{target}")
        checked_request(target, period, folder)
        opened = open_model(model, plant)
        with progress("deriving") as update:
            made = export_model(opened, target, logs or [], holdout or [], period=period, progress=update)
            write_export(made, folder)
        print_result(made, json, lambda: print_text(export_text(made.ledger, folder)))
