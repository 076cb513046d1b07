"""`wheelpend view`: the workbench in the browser."""

from __future__ import annotations

import shlex
from pathlib import Path
from typing import Annotated

import typer

from wheelpend.cli.app import app
from wheelpend.cli.options import DEFAULT_MODEL_PATH, Holdout, ModelFile, PlantFile
from wheelpend.errors import Failure, require
from wheelpend.reports.console import exit_on_failure, print_command_hint, print_line, progress

DEMO_FOLDER = Path("demo")


@app.command()
def view(
    logs: Annotated[list[Path] | None, typer.Argument(help="Logs to open.", show_default=False)] = None,
    holdout: Holdout = None,
    port: Annotated[int, typer.Option(help="The port; 0 for any that is free.", min=0, max=65535)] = 0,
    no_browser: Annotated[bool, typer.Option("--no-browser", help="Say the address alone.")] = False,
    demo: Annotated[bool, typer.Option("--demo", help=f"On the shipped log, in a new ./{DEMO_FOLDER}.")] = False,
    model: ModelFile = DEFAULT_MODEL_PATH,
    plant: PlantFile = None,
) -> None:
    """The workbench in the browser, on this machine alone: the same commands by clicks. Ctrl-C ends it."""
    with exit_on_failure():
        if demo and (logs or holdout or plant or model != DEFAULT_MODEL_PATH):
            raise Failure("--demo brings its own logs and model, but others are named. Leave it or them out.")
        require("nicegui", "view", "The workbench")
        from wheelpend.view.bench import Bench  # imported late, as in every command

        bench = _demo_bench() if demo else Bench(model, logs or [], holdout or [], plant_file=plant)
        _serve(bench, port, no_browser)


def _demo_bench():
    """The shipped logs and the paper's model in a new workspace."""
    from wheelpend.cli.demo import fresh_workspace  # imported late: loads everything
    from wheelpend.logs.shipped import DEMO_HOLDOUT_LOG, DEMO_LOG, data_folder
    from wheelpend.view.bench import Bench

    with progress("deriving the model"):
        fresh_workspace(DEMO_FOLDER)
    data = data_folder()
    return Bench(DEMO_FOLDER, [data / DEMO_LOG], [data / DEMO_HOLDOUT_LOG], first_run=True)


def _serve(bench, port: int, no_browser: bool) -> None:
    from wheelpend.view.server import serve  # imported late: loads NiceGUI

    def say(address: str) -> None:
        print_line(f"The workbench of {bench.folder} is at")
        print_line(f"  {address}")
        print_line("Only this machine reaches it, and only with that address. Ctrl-C ends it.")

    serve(bench, port, opens_browser=not no_browser, say=say)
    print_line("\nThe workbench has ended; model.toml and history.json are as the last command left them.")
    print_command_hint("Open it again:", shlex.join(bench.view_words))
